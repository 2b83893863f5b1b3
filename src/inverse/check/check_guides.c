/* SPDX-License-Identifier: Apache-2.0
 *
 * What a guide (scene/guide.h) draws, at vertices of the scene's walks that it covers:
 *
 *     directions  of each field, with the density that it claims, against lobes about some
 *     lights      with the probability that it claims, against all lights alike
 *     starts      of light walks: the numbers of a direction with the density that is claimed
 *                 for them, against even ones; those of a point by E[1_S/p] = |S|
 *
 * Sums as in check_directions.c. Mixtures that a guide takes part in are looked at there. */
#include "check_lobes.h"
#include "check_sources.h"
#include "math/rng.h"
#include "math/vec.h"
#include <math.h>

#define PILOTS 8
enum { WHOLE, RATIOS, QUARTERS = RATIOS + 6, POINTS = QUARTERS + 4, AGREE = POINTS + 4 };
enum { GROUPS = RATIOS + 6 }; /* 8 of lights */

struct spot {
    struct imp_guide_place at;
    struct imp__lobes lobes;
};
struct guided {
    const struct imp_guide *guide;
    const struct imp_scene *scene;
    enum imp_guide_field field;
    int n;
    struct spot *spot; /* [n] */
};

static double ratio_add(struct imp__pair *p, double pdf, double q, bool drawn)
{
    const double part = (drawn ? q : pdf) / (q + pdf), d = drawn ? part : 0,
                 g = drawn ? 0 : part;
    imp__pair_add(p, WHOLE, d, g);
    imp__pair_add(p, RATIOS + imp_min((int)(6 * pdf / (pdf + q)), 5), d, g);
    return part;
}

/* ---- Directions -------------------------------------------------------------------------- */

static void direction_add(const struct guided *g, const struct spot *x, imp_v3 w,
                          struct imp__pair *p, bool drawn)
{
    const double pdf = g->guide->pdf(g->guide, &x->at, w);
    if (!(pdf > 0)) return;
    const double part = ratio_add(p, pdf, imp__lobes_pdf(&x->lobes, w), drawn);
    imp__pair_add(p, QUARTERS + (w[0] > 0) + 2 * (w[1] > 0), drawn ? part : 0,
                  drawn ? 0 : part);
}

static void direction_pair(const void *payload, uint64_t seed, int64_t i,
                           struct imp__pair *p)
{
    const struct guided *g = payload;
    const struct spot *x = &g->spot[i % g->n];
    const struct imp_key key = imp__key(seed, 0x901d, (uint64_t)i);
    double u[5];
    for (int k = 0; k < 5; k++) u[k] = imp__u01(key, (uint32_t)k);
    direction_add(g, x, g->guide->draw(g->guide, &x->at, u), p, true);
    direction_add(g, x, imp__lobes_sample(&x->lobes, u + 2), p, false);
}

/* ---- Lights ------------------------------------------------------------------------------ */

static void light_add(const struct guided *g, const struct spot *x, int light,
                      struct imp__pair *p, bool drawn)
{
    const double chance = g->guide->light_pmf(g->guide, &x->at, light);
    if (!(chance > 0)) return;
    const double part = ratio_add(p, chance, 1.0 / g->scene->n_emitters, drawn);
    imp__pair_add(p, GROUPS + light % 8, drawn ? part : 0, drawn ? 0 : part);
}

static void light_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct guided *g = payload;
    const struct spot *x = &g->spot[i % g->n];
    const struct imp_key key = imp__key(seed, 0x901e, (uint64_t)i);
    const int n = g->scene->n_emitters;
    light_add(g, x, g->guide->light(g->guide, &x->at, imp__u01(key, 0)), p, true);
    light_add(g, x, imp_min((int)(imp__u01(key, 1) * n), n - 1), p, false);
}

/* ---- Starts of light walks ----------------------------------------------------------------- */

static void start_add(struct imp__pair *p, double pdf, const double v[2], bool drawn)
{
    if (!(pdf > 0)) return;
    const double part = ratio_add(p, pdf, 1, drawn);
    imp__pair_add(p, QUARTERS + (v[0] > 0.5) + 2 * (v[1] > 0.5), drawn ? part : 0,
                  drawn ? 0 : part);
}

static void start_pair(const void *payload, uint64_t seed, int64_t i, struct imp__pair *p)
{
    const struct guided *g = payload;
    const struct imp_key key = imp__key(seed, 0x901f, (uint64_t)i);
    const int light = (int)(i % g->scene->n_emitters);
    double u[6], point = 1;
    for (int k = 0; k < 6; k++) u[k] = imp__u01(key, (uint32_t)k);
    const double pdf = g->guide->emit(g->guide, g->field, light, u, &point),
                 other = g->guide->emit_pdf(g->guide, g->field, light, u);
    const double even[4] = {u[0], u[1], u[4], u[5]};
    start_add(p, pdf, u + 2, true);
    start_add(p, g->guide->emit_pdf(g->guide, g->field, light, even), u + 4, false);
    imp__pair_add(p, AGREE, other > 0 ? fmin(pdf / other, 2) : 2, 1);
    for (int k = 0; k < 4; k++) imp__pair_add(p, POINTS + k, 0, 0.25);
    imp__pair_add(p, POINTS + (u[0] > 0.5) + 2 * (u[1] > 0.5), 1 / point, 0);
}

/* ---- Rows ----------------------------------------------------------------------------------- */

static enum imp_status guided_make(struct imp__draw_list *l,
                                   const struct imp__places *places,
                                   const struct imp_guide *guide,
                                   enum imp_guide_field field, struct guided **out)
{
    struct guided *g = imp__arena_array(&l->arena, 1, sizeof *g);
    struct spot *spot =
        imp__arena_array(&l->arena, (size_t)places->n_all + 1, sizeof *spot);
    if (!g || !spot)
        return imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check");
    *g = (struct guided){
        .guide = guide, .scene = places->tracer.scene, .field = field, .spot = spot};
    for (int i = 0; i < places->n_all; i++) {
        const struct imp__place *x = places->all[i];
        const struct imp_vertex *v = x->v;
        struct spot *s = &spot[g->n];
        if (!x->located || v->d.scatterer != IMP_AT_SURFACE) continue;
        const struct imp_hit hit = {.shape = v->d.shape, .prim = v->d.located.prim};
        const imp_v3 wo = imp__to_world(&x->frame, imp__decided_v3(v->d.wo));
        g->n += guide->find(guide, field, &hit, &x->at, -wo, &s->at);
    }
    *out = g;
    return IMP_OK;
}

static enum imp_status directions_add(struct imp__draw_list *l, struct guided *g)
{
    int n = 0;
    for (int i = 0; i < g->n; i++) {
        if (!(g->spot[i].at.share > 0)) continue;
        struct spot *x = &g->spot[n++];
        *x = g->spot[i];
        for (uint32_t k = 0; k < PILOTS; k++) {
            const struct imp_key key = imp__key(0x9107, (uint64_t)i, k);
            const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
            imp__lobes_add(&x->lobes, g->guide->draw(g->guide, &x->at, u));
        }
    }
    g->n = n;
    if (n == 0) return IMP_OK;
    static const char *const name[IMP_GUIDE_FIELDS] = {
        "directions of light", "directions to the sensor", "directions to the meter"};
    return imp__draw_add(l, &(struct imp__draw_row){.method = "guides",
                                                    .name = name[g->field],
                                                    .pair = direction_pair,
                                                    .payload = g});
}

static enum imp_status field_add(struct imp__draw_list *l,
                                 const struct imp__places *places,
                                 const struct imp_guide *guide,
                                 enum imp_guide_field field)
{
    enum imp_status st = IMP_OK;
    struct guided *g;
    IMP_TRY(guided_make(l, places, guide, field, &g));
    if (field == IMP_GUIDE_LIGHT && g->n > 0 && g->scene->n_emitters > 1)
        IMP_TRY(imp__draw_add(l, &(struct imp__draw_row){.method = "guides",
                                                         .name = "lights",
                                                         .pair = light_pair,
                                                         .payload = g}));
    if (field != IMP_GUIDE_LIGHT && guide->emit)
        IMP_TRY(imp__draw_add(l, &(struct imp__draw_row){.method = "guides",
                                                         .name = "starts of light walks",
                                                         .pair = start_pair,
                                                         .payload = g}));
    struct guided *own;
    IMP_TRY(guided_make(l, places, guide, field, &own));
    st = directions_add(l, own);
out:
    return st;
}

/* Light walks are asked for where the check's own walks are these. */
enum imp_status imp__check_guides(struct imp__draw_list *l,
                                  const struct imp__places *places)
{
    enum imp_status st = IMP_OK;
    const struct imp_tracer *own = &l->check->tracer;
    const struct imp_guide *guide = places->tracer.guide;
    if (!imp__check_wants(l->check, "guides")) return IMP_OK;
    if (guide) IMP_TRY(field_add(l, places, guide, IMP_GUIDE_LIGHT));
    if (own->guide && own->guide->importance && own->integrator->from_lights)
        IMP_TRY(field_add(l, places, own->guide,
                          own->integrator->lights ? IMP_GUIDE_CONNECTED : IMP_GUIDE_MET));
out:
    return st;
}
