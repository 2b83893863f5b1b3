/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from lights that are made some at a time (walk/lights/light_supply.h) beside the same walks
 * alone: what reaches the film, the cause of a drop, and records, to the bit. */
#ifndef IMP_TESTS_LIGHT_KIT_H
#define IMP_TESTS_LIGHT_KIT_H

#include "imp_scene.h"
#include "imp_tap.h"
#include "walk/lights/light_bundle.h"
#include "walk/lights/light_supply.h"
#include <string.h>

enum { WALKS = 700 }; /* no multiple of how many go together */

static imp_context *ctx;

static bool same(const void *a, const void *b, size_t n) { return memcmp(a, b, n) == 0; }

/* Vertices of recorded walks that differ. */
static int differing(const struct imp_light_walk *a, const struct imp_light_walk *b)
{
    const struct imp_vertex *v = a->walk.first, *w = b->walk.first;
    int wrong = a->walk.n != b->walk.n;
    for (; v && w; v = v->next, w = w->next) {
        wrong += !same(&v->e, &w->e, sizeof v->e) || !same(&v->b, &w->b, sizeof v->b) ||
                 !same(&v->w, &w->w, sizeof v->w);
        const struct imp_decision *x = &v->d, *y = &w->d;
        wrong += v->t != w->t || x->shape != y->shape || x->connection != y->connection ||
                 x->goes_on != y->goes_on || !same(x->p, y->p, sizeof x->p) ||
                 !same(x->uv, y->uv, sizeof x->uv) ||
                 !same(x->located.at, y->located.at, sizeof x->located.at);
        if (x->goes_on)
            wrong += x->pdf != y->pdf || x->survive != y->survive || x->lobe != y->lobe ||
                     !same(x->wo, y->wo, sizeof x->wo) ||
                     !same(x->wi, y->wi, sizeof x->wi);
    }
    return wrong + (v != w);
}

/* What walks bring to the film's channels. */
static int differing_reaches(const struct imp_light_walk *a,
                             const struct imp_light_walk *b, int channels)
{
    const struct imp_reach *r = a->reach, *q = b->reach;
    int wrong = a->n_reach != b->n_reach || a->walk.dropped != b->walk.dropped;
    for (; r && q; r = r->next, q = q->next)
        wrong += r->px != q->px || r->py != q->py || r->met != q->met ||
                 r->number != q->number ||
                 !same(&r->L, &q->L, (size_t)channels * sizeof(double));
    return wrong + (r != q);
}

#if defined(__AVX2__)
enum { IN_LANES = true };
#else
enum { IN_LANES = false };
#endif

/* lanes: are values made in lanes? */
static void compare(const char *name, enum imp_color_mode mode, bool lanes,
                    const char *integrator, const char *body)
{
    static char text[65536];
    snprintf(
        text, sizeof text,
        "<scene version='3.0.0'><integrator type='ptracer'>%s</integrator>%s</scene>",
        integrator, body);
    imp_scene *scene = test_scene_text(ctx, text, mode);
    struct imp_tracer tracer = {.scene = scene,
                                .integrator = imp__walk_integrator(scene),
                                .sensor = scene->sensors[0],
                                .seed = 11,
                                .wavelengths = scene->wavelengths};
    for (int recorded = 0; recorded < 2; recorded++) {
        struct imp_arena arena, alone;
        int wrong = 0, reached = 0;
        tracer.value_only = !recorded;
        imp__arena_init(&arena, ctx);
        imp__arena_init(&alone, ctx);
        struct imp_light_supply s = imp__light_supply(&tracer, &arena, 5, 5 + WALKS);
        for (int k = 0; k < WALKS; k++) {
            struct imp_light_walk one;
            const struct imp_light_walk *other = imp__light_supply_take(&s);
            imp__light_walk_trace(&tracer, &alone, 5 + k, &one);
            wrong += !other || differing_reaches(&one, other, scene->channels) ||
                     (recorded && differing(&one, other));
            reached += one.n_reach;
            imp__arena_rewind(&alone, (struct imp_arena_mark){0});
        }
        tap_ok(wrong == 0 && reached > WALKS / 16 &&
                   imp__light_walks_go_together(&tracer) &&
                   s.lanes == (lanes && !recorded && IN_LANES),
               "%s, %s: of %d walks %d differ, %d connections", name,
               recorded ? "recorded" : "values", WALKS, wrong, reached);
        imp__arena_free(&arena);
        imp__arena_free(&alone);
    }
    imp_scene_destroy(scene);
}

#endif
