/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks in bundles (walk/bundle/) beside the same walks alone: radiance, film position, alpha, the
 * cause of a drop, every number of a record, and what sweeps give, to the bit. */
#ifndef IMP_TESTS_BUNDLE_KIT_H
#define IMP_TESTS_BUNDLE_KIT_H

#include "bundle_scenes.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/lamp_levels.h"
#include "walk/bundle/swept.h"

enum { SIDE = 6, SAMPLES = 21 }; /* neither is a multiple of lanes */

static imp_context *ctx;
static const double *level; /* of emitters; NULL: as they are */

static bool same(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}
static bool same_color(imp_spec a, imp_spec b, const struct imp_carried *carried)
{
    bool all = true;
    for (int c = 0; c < (carried ? 4 : 3); c++) all &= same(a[c], b[c]);
    return all;
}
static bool same_decided(const imp_decided *a, const imp_decided *b, int n)
{
    bool all = true;
    for (int k = 0; k < n; k++) all &= same(a[k], b[k]);
    return all;
}

/* ---- Records ----------------------------------------------------------------------------- */

static bool same_located(const struct imp_located *a, const struct imp_located *b)
{
    return a->prim == b->prim && same(a->at[0], b->at[0]) && same(a->at[1], b->at[1]);
}

static bool same_step(const struct imp_vertex *a, const struct imp_vertex *b)
{
    const struct imp_decision *x = &a->d, *y = &b->d;
    if (x->goes_on != y->goes_on) return false;
    return !x->goes_on ||
           (same_decided(x->wi, y->wi, 3) && same(x->pdf, y->pdf) && x->lobe == y->lobe &&
            same(x->survive, y->survive) && same(x->share, y->share) &&
            same(x->rest, y->rest) && x->drawn == y->drawn && x->alone == y->alone);
}

static bool same_light(const struct imp_vertex *a, const struct imp_vertex *b)
{
    const struct imp_light *x = &a->d.light, *y = &b->d.light;
    if (a->d.connection != b->d.connection) return false;
    return a->d.connection == IMP_NOT_CONNECTED ||
           (x->emitter == y->emitter && same(x->weight, y->weight) &&
            same_decided(x->uv, y->uv, 2) && same(x->dist, y->dist) &&
            same(x->cos_light, y->cos_light) && same_decided(x->d, y->d, 3) &&
            same_decided(x->p, y->p, 3) && same_decided(x->wi, y->wi, 3) &&
            same_located(&x->located, &y->located) &&
            same_color(a->light_f, b->light_f, a->carried) &&
            same_color(a->light_e, b->light_e, a->carried) &&
            same_color(a->light_w, b->light_w, a->carried));
}

static bool same_met(const struct imp_vertex *a, const struct imp_vertex *b)
{
    const struct imp_met *x = &a->d.met, *y = &b->d.met;
    if (x->emitter != y->emitter) return false;
    return x->emitter < 0 ||
           (same(x->weight, y->weight) && same(x->dist, y->dist) &&
            same(x->cos_light, y->cos_light) && same_decided(x->d, y->d, 3));
}

static bool same_vertex(const struct imp_vertex *a, const struct imp_vertex *b)
{
    const struct imp_decision *x = &a->d, *y = &b->d;
    bool all = a->bsdf == b->bsdf && a->shape == b->shape && same(a->t, b->t) &&
               same_color(a->scale, b->scale, a->carried) &&
               same_color(a->e, b->e, a->carried) && same_color(a->b, b->b, a->carried) &&
               same_color(a->w, b->w, a->carried) &&
               same_color(a->beyond, b->beyond, a->carried) && !a->carried == !b->carried;
    all &= x->shape == y->shape && x->scatterer == y->scatterer &&
           same_decided(x->uv, y->uv, 2) && same_decided(x->p, y->p, 3);
    for (int j = 0; a->bsdf && j < a->bsdf->n_in; j++)
        all &= same_color(a->in[j], b->in[j], a->carried);
    if (a->shape)
        all &= same_decided(x->wo, y->wo, 3) && x->back == y->back &&
               x->place == y->place && same_located(&x->located, &y->located) &&
               x->glows == y->glows && same(a->ng[0], b->ng[0]) &&
               same(a->ng[1], b->ng[1]) && same(a->ng[2], b->ng[2]);
    return all && same_step(a, b) && same_light(a, b) && same_met(a, b);
}

/* Vertices that differ, of two records of a walk. */
static int differing(const struct imp_walk *a, const struct imp_walk *b)
{
    const struct imp_vertex *v = a->first, *w = b->first;
    int wrong = a->n != b->n || a->depth != b->depth || a->key.state != b->key.state ||
                (a->point.points &&
                 (a->point.set != b->point.set || a->point.index != b->point.index));
    for (; v && w; v = v->next, w = w->next) wrong += !same_vertex(v, w);
    return wrong + (v != w);
}

/* Walks of a bundle that differ from the same alone; *lit: those with light. */
static int compared(const struct imp_tracer *tracer, int *lit)
{
    struct imp_arena arena, alone;
    struct imp_bundle b;
    int xy[SIDE * SIDE][2], wrong = 0;
    int64_t samples[SAMPLES];
    *lit = 0;
    imp__arena_init(&arena, ctx);
    imp__arena_init(&alone, ctx);
    for (int p = 0; p < SIDE * SIDE; p++) xy[p][0] = p % SIDE, xy[p][1] = p / SIDE;
    for (int k = 0; k < SAMPLES; k++) samples[k] = imp__set_number(4, SAMPLES, k);
    if (!imp__bundle_fits(tracer) ||
        !imp__bundle_trace(tracer, &arena, SIDE * SIDE, (const int(*)[2])xy, SAMPLES,
                           samples, &b))
        return -1;
    for (int k = 0; k < b.n; k++) {
        struct imp_walk one, other;
        const int *at = xy[k / SAMPLES];
        imp__walk_trace(tracer, &alone, at[0], at[1], samples[k % SAMPLES], &one);
        imp__bundle_walk(&b, k, &other);
        bool all = same(one.px, other.px) && same(one.py, other.py) &&
                   one.valid == other.valid && one.dropped == other.dropped &&
                   same(one.time, other.time);
        for (int c = 0; c < 3; c++) all &= same(one.L[c], other.L[c]);
        for (int c = 0; one.waves && c < 4; c++)
            all &= same(one.values[c], other.values[c]);
        if (b.swept) all &= one.n == other.n;
        else if (!tracer->value_only) all &= differing(&one, &other) == 0;
        wrong += !all;
        *lit += one.L[0] > 0;
        imp__arena_rewind(&alone, (struct imp_arena_mark){0});
    }
    imp__arena_free(&arena);
    imp__arena_free(&alone);
    return wrong;
}

/* ---- Sweeps ------------------------------------------------------------------------------ */

enum { NUMBERS_MOST = 1 << 16 };
struct into {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    double *sum; /* [NUMBERS_MOST] */
};
static void add_into(struct imp_sink *sink, int param, size_t element, int channels,
                     const imp_spec *bar)
{
    const struct into *to = (struct into *)sink;
    const int64_t base = to->active->base[param];
    if (base < 0) return;
    double *sum = to->sum + base + element;
    for (int c = 0; channels == 3 && c < 3; c++) sum[c] += (*bar)[c];
    if (channels != 3) *sum += (*bar)[0] + (*bar)[1] + (*bar)[2] + (*bar)[3];
}

/* Walks of a bundle that keeps what is swept, beside the same alone: of so many numbers those differ that
 * sweeps with one adjoint and with two give. *some: those that are not 0. -1: the bundle keeps records. */
static int swept(struct imp_tracer tracer, int *some)
{
    static double sums[2][3][NUMBERS_MOST];
    const size_t n = tracer.active->n;
    struct imp_arena arena, alone;
    struct imp_bundle b;
    int xy[SIDE * SIDE][2], wrong = 0;
    int64_t samples[SAMPLES];
    struct into to[2][3];
    for (int i = 0; i < 6; i++) {
        to[i / 3][i % 3] =
            (struct into){{.add = add_into},
                          tracer.active,
                          memset(sums[i / 3][i % 3], 0, sizeof(sums[0][0]))};
    }
    imp__arena_init(&arena, ctx);
    imp__arena_init(&alone, ctx);
    tracer.swept_only = true;
    for (int p = 0; p < SIDE * SIDE; p++) xy[p][0] = p % SIDE, xy[p][1] = p / SIDE;
    for (int k = 0; k < SAMPLES; k++) samples[k] = imp__set_number(4, SAMPLES, k);
    const bool made = imp__bundle_fits(&tracer) &&
                      imp__bundle_trace(&tracer, &arena, SIDE * SIDE, (const int(*)[2])xy,
                                        SAMPLES, samples, &b) &&
                      b.swept;
    for (int k = 0; made && k < b.n; k++) {
        struct imp_walk walk[2];
        const int *at = xy[k / SAMPLES];
        const imp_spec P = {.3 + k % 5, -1.7, 2.1 / (1 + k)}, Q = {-.4, k % 3, .01 * k};
        imp__walk_trace(&tracer, &alone, at[0], at[1], samples[k % SAMPLES], &walk[0]);
        imp__bundle_walk(&b, k, &walk[1]);
        wrong += walk[0].n != walk[1].n;
        for (int i = 0; i < 2; i++) {
            imp__walk_sweep(&tracer, &walk[i], Q, &to[i][0].sink);
            const struct imp_sink_pair pair = {&to[i][1].sink, &to[i][2].sink, NULL};
            imp__walk_sweep_both(&tracer, &walk[i], P, Q, &pair);
        }
        imp__arena_rewind(&alone, (struct imp_arena_mark){0});
    }
    *some = 0;
    for (size_t j = 0; j < 3 * n; j++) {
        const double x = sums[0][j / n][j % n], y = sums[1][j / n][j % n];
        wrong += !same(x, y);
        *some += x != 0;
    }
    imp__arena_free(&arena);
    imp__arena_free(&alone);
    return made ? wrong : -1;
}

/* lanes: so many shapes have vertices in lanes; -1: any number. */
static void compare(const char *name, enum imp_color_mode mode, int lanes,
                    const char *integrator, const char *sensor, const char *rest)
{
    static char xml[40000];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s%s<sensor type='%s<film type='hdrfilm'><integer "
             "name='width' value='6'/><integer name='height' value='6'/><rfilter "
             "type='box'/></film></sensor>%s</scene>",
             integrator, strstr(sensor, "meter") ? WITHIN : "", sensor,
             strstr(sensor, "meter") ? "</shape>" ROOM LAMP("0", "0", ".5") : rest);
    imp_scene *scene = test_scene_text(ctx, xml, mode);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_tracer tracer = {.scene = scene,
                                .integrator = imp__walk_integrator(scene),
                                .sensor = scene->sensors[0],
                                .value_only = true,
                                .seed = 5};
    struct imp_active active;
    struct imp__lamp_levels levels = {0};
    static uint8_t chosen[1024];
    int lit, binned = 0;
    if (strstr(name, "independent")) run.points = IMP_POINTS_INDEPENDENT;
    imp__tracer_numbers(&tracer, &run, SAMPLES);
    if (level) test_must(ctx, imp__lamp_levels_begin(scene, level, &levels));
    for (int k = 0; k < scene->n_shapes; k++)
        binned += imp__lanes_fit(&tracer) && imp__shape_in_lanes(&tracer, k);
    const int wrong = compared(&tracer, &lit);
    tap_ok(wrong == 0 && lit > SIDE * SIDE / 2 && (lanes < 0 || binned == lanes),
           "%s: of %d walks, %d lit, %d differ; %d shapes in lanes, %d expected", name,
           SIDE * SIDE * SAMPLES, lit, wrong, binned, lanes);

    /* Recorded, with derivatives by all parameters, and by the last one alone. */
    size_t last = 0;
    for (size_t k = 0; k < scene->n_params; k++) {
        chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
        if (chosen[k]) last = k;
    }
    for (int alone = 0; alone < 2; alone++) {
        for (size_t k = 0; alone && k < last; k++) chosen[k] = false;
        test_must(ctx, imp__active_create(scene, chosen, &active));
        tracer.active = &active;
        tracer.value_only = true;
        const int values = compared(&tracer, &lit);
        tracer.value_only = false;
        const int records = compared(&tracer, &lit);
        /* Those that cross media are recorded alone. */
        tap_ok(values == 0 && records == (strstr(integrator, "volpath") ? -1 : 0),
               "... with derivatives%s: %d differ, and of those that are recorded %d",
               alone ? " by one parameter" : "", values, records);
        int some = 0;
        const int sums = active.n <= NUMBERS_MOST ? swept(tracer, &some) : 1;
        const bool kept = !strstr(integrator, "volpath") && !strstr(sensor, "meter");
        tap_ok(sums == (kept ? 0 : -1) && (alone || !kept || some > 0),
               "... swept: of %d numbers that are not 0, %d differ", some, sums);
        imp__active_destroy(ctx, &active);
    }
    tracer.active = NULL;
    tracer.swept_only = true;
    const int losses = compared(&tracer, &lit);
    const bool in_media = strstr(integrator, "volpath"), meter = strstr(sensor, "meter");
    tap_ok(losses == (in_media || meter ? -1 : 0), "... as of a loss: %d differ", losses);
    imp__lamp_levels_end(&levels);
    imp_scene_destroy(scene);
}

#endif
