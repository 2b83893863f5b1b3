/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays of a bundle on their way through media, to collisions and surfaces (walk/media/tracking.c and
 * flight.c, of walks alone). */
#include "in_media.h"
#include "math/exp.h"
#include "scene/instances.h"
#include "walk/media/flight.h"
#include "walk/path/first_segment.h"
#include <string.h>

/* ---- What fits --------------------------------------------------------------------------- */

/* Nothing of it varies, neither by place nor along a walk. */
static bool is_uniform(const struct imp_medium *m)
{
    if (m->majorants || m->emits || m->scatterer->shaped) return false;
    for (int j = 0; j < m->n_in; j++)
        if (!m->input[j]->plain) return false;
    return true;
}

bool imp__media_fit(const struct imp_tracer *t)
{
    const struct imp_scene *scene = t->scene;
    if (imp__segment_first(t) != &imp__tracking || !t->value_only || t->wavelengths ||
        t->sensor->shape || t->integrator->hide_emitters || t->headroom > 1 ||
        scene->world)
        return false;
    for (int k = 0; k < scene->n_media; k++)
        if (!is_uniform(scene->media[k])) return false;
    /* Light samples pass what is null, and nothing else. */
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_bsdf *b = imp__shape_bsdf(scene, scene->shapes[k]);
        if (b->straight && !(b->flags & IMP_BSDF_NULL)) return false;
    }
    return true;
}

#define TAKE(p) ((p) = imp__arena_take(arena, n + IMP_COLUMN_SLACK, sizeof *(p)))

struct imp_in_media *imp__in_media_create(const struct imp_tracer *tracer,
                                          struct imp_arena *arena, size_t n)
{
    const struct imp_scene *scene = tracer->scene;
    const imp_v3 nowhere = {0};
    struct imp_in_media *x = imp__arena_take(arena, 1, sizeof *x);
    if (!x) return NULL;
    x->n_lanes = scene->channels;
    for (int c = 0; c < 3; c++) {
        x->sigma[c] = imp__arena_take(arena, (size_t)scene->n_media + 1, sizeof(double));
        if (!x->sigma[c] || !TAKE(x->start[c]) || !TAKE(x->f[c]) ||
            !TAKE(x->ahead.o[c]) || !TAKE(x->ahead.d[c]))
            return NULL;
    }
    if (!TAKE(x->here) || !TAKE(x->base) || !TAKE(x->near) || !TAKE(x->far) ||
        !TAKE(x->tmax) || !TAKE(x->path) || !TAKE(x->medium) || !TAKE(x->number) ||
        !TAKE(x->crossed) || !TAKE(x->active) || !TAKE(x->flying) || !TAKE(x->going) ||
        !TAKE(x->ahead.far) || !imp__hits_create(arena, n, &x->met))
        return NULL;
    x->ahead.near = NULL;
    x->ahead.time = NULL;
    x->ahead.instant = tracer->sensor->open;
    if (tracer->sensor->close > tracer->sensor->open && !TAKE(x->ahead.time)) return NULL;
    for (int m = 0; m < scene->n_media; m++) {
        imp_spec in[IMP_INPUTS_MAX];
        const imp_spec sigma = imp__extinction_at(scene->media[m], nowhere, NULL, in);
        for (int c = 0; c < 3; c++) x->sigma[c][m] = sigma[c];
    }
    return x;
}

/* ---- In lanes ---------------------------------------------------------------------------- */

/* Rays of a list, IMP_WIDE_LANES at a time; the lanes that are left repeat one. */
struct few {
    int32_t ray[IMP_WIDE_LANES], medium[IMP_WIDE_LANES], walk[IMP_WIDE_LANES];
    int n;
};
static inline void few_take(const struct imp_depth *d, const int32_t *list, int n, int i,
                            struct few *w)
{
    w->n = imp_min(n - i, IMP_WIDE_LANES);
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        w->ray[k] = list[i + (k < w->n ? k : 0)];
        w->medium[k] = d->media->medium[w->ray[k]];
        w->walk[k] = d->rays->walk[w->ray[k]];
    }
}
static inline void few_put(double *column, const struct few *w, imp_wide x)
{
    for (int k = 0; k < w->n; k++) column[w->ray[k]] = x[k];
}

/* x of the colour that draws, of each walk. */
static inline imp_wide of_drew(const struct imp_depth *d, const struct few *w,
                               const imp_wide x[3])
{
    const imp_wide drew = imp__wide_taken(d->bundle->drew, w->walk);
    return imp__wide_choose(drew == 0, x[0], imp__wide_choose(drew == 1, x[1], x[2]));
}

/* Free paths of the stretches to come, and how far rays need look (imp__flight_reach). */
static void paths_draw(struct imp_depth *d, const int32_t *list, int n)
{
    struct imp_in_media *x = d->media;
    const double radius = d->bundle->tracer->scene->ball.radius;
    const uint64_t where = (uint64_t)d->depth << 32 | (uint32_t)IMP_FLIGHT_ALONG;
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        struct few w;
        imp_wide_word key = {0}, turned = {0};
        imp_wide sigma[3];
        few_take(d, list, n, i, &w);
        for (int k = 0; k < IMP_WIDE_LANES; k++) {
            key[k] = d->bundle->keys[w.walk[k]];
            turned[k] = (uint64_t)x->number[w.ray[k]] * 0x9e3779b97f4a7c15u;
        }
        const struct imp_wide_block block = {
            .hash = imp__wide_mix64(key ^ (where + 0xa0761d6478bd642fu)) + turned};
        for (int c = 0; c < 3; c++) sigma[c] = imp__media_sigma(x, c, w.medium);
        const imp_wide mine = of_drew(d, &w, sigma),
                       path = -IMP_WIDE_OF(imp__log)(1 - imp__wide_number(&block, 0)),
                       near = imp__wide_taken(x->near, w.ray),
                       far = imp__wide_taken(x->tmax, w.ray),
                       base = imp__wide_taken(x->base, w.ray);
        const imp_wide reach = (near + path / mine) * (1 + IMP_REACH_SLACK) +
                               IMP_REACH_SLACK * radius - base;
        few_put(x->path, &w, path);
        few_put(d->rays->ray.far, &w,
                imp__wide_choose(mine > 0, imp__wide_lesser(far, reach), far));
    }
}

/* Through a medium, from near to far. */
static void fly(struct imp_depth *d, const int32_t *list, int n)
{
    struct imp_in_media *x = d->media;
    const struct imp_hit_columns *hits = d->hits;
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        struct few w;
        imp_wide sigma[3];
        few_take(d, list, n, i, &w);
        for (int c = 0; c < 3; c++) sigma[c] = imp__media_sigma(x, c, w.medium);
        const imp_wide mine = of_drew(d, &w, sigma), zero = imp__wide(0),
                       path = imp__wide_taken(x->path, w.ray),
                       near = imp__wide_taken(x->near, w.ray),
                       whole = imp__wide_taken(x->far, w.ray) - near;
        const imp_wide_truth hit = (mine > zero) & (path < whole * mine);
        const imp_wide length = imp__wide_choose(hit, path / mine, whole),
                       stored = imp__wide_decide(length);
        for (int c = 0; c < 3; c++) {
            const imp_wide T = imp__wide_choose(
                sigma[c] > zero, IMP_WIDE_OF(imp__exp)(-sigma[c] * stored), imp__wide(1));
            few_put(x->f[c], &w,
                    imp__wide_taken(x->f[c], w.ray) *
                        imp__wide_choose(hit, sigma[c] * T, T));
        }
        const imp_wide3 o = imp__wide3_taken(d->rays->ray.o, w.ray),
                        dir = imp__wide3_taken(d->rays->ray.d, w.ray);
        const imp_wide t = near + length - imp__wide_taken(x->base, w.ray);
        const imp_wide3 p = imp__wide3_plus(o, imp__wide3_times(dir, t));
        for (int k = 0; k < w.n; k++) {
            const int ray = w.ray[k];
            x->crossed[ray] = true;
            x->number[ray]++;
            if (!hit[k]) continue;
            hits->shape[ray] = IMP_HIT_COLLISION;
            hits->t[ray] = p.x[k];
            hits->u[ray] = p.y[k];
            hits->v[ray] = p.z[k];
        }
    }
}

/* Transmittance of the whole way, to throughput, colours (lane_mis.c) and the vertex before. */
static void pass(struct imp_depth *d, const struct imp_bundle_values *before,
                 const int32_t *list, int n)
{
    const struct imp_in_media *x = d->media;
    const struct imp_flights *rays = d->rays;
    const double lanes = x->n_lanes;
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        struct few w;
        imp_wide p[3], ratio[3];
        few_take(d, list, n, i, &w);
        imp_wide_truth certain = ~(imp_wide_truth){0};
        for (int c = 0; c < 3; c++) {
            p[c] = imp__wide_taken(x->f[c], w.ray);
            ratio[c] = imp__wide_taken(rays->ratio[c], w.ray);
            if (c < x->n_lanes) certain &= p[c] == 1;
        }
        const imp_wide drew = imp__wide_taken(d->bundle->drew, w.walk),
                       mine = of_drew(d, &w, p), by = 1 / mine, one = imp__wide(1),
                       share = imp__wide_taken(rays->share, w.ray);
        imp_wide sum = imp__wide(0);
        for (int c = 0; c < 3; c++) {
            const imp_wide changed =
                imp__wide_choose(drew == c, one, ratio[c] * (p[c] * by));
            ratio[c] = imp__wide_choose(certain, ratio[c], changed);
            if (c < x->n_lanes) sum += ratio[c];
        }
        const imp_wide now = lanes / sum;
        const imp_wide factor =
            imp__wide_choose(certain, one, imp__wide_decide(now / (share * mine)));
        few_put(rays->share, &w, imp__wide_choose(certain, share, now));
        for (int c = 0; c < 3; c++) {
            const imp_wide weight = p[c] * factor;
            few_put(rays->ratio[c], &w, ratio[c]);
            few_put(rays->beta[c], &w, imp__wide_taken(rays->beta[c], w.ray) * weight);
            for (int k = 0; k < w.n; k++) before->w[c][rays->up[w.ray[k]]] *= weight[k];
        }
    }
}

/* ---- Stretches -------------------------------------------------------------------------------- */

/* Rays list[n] to the next surfaces, of which the first search has been made. */
static void stretches_meet(struct imp_depth *d, const int32_t *list, int n)
{
    struct imp_in_media *x = d->media;
    const struct imp_ray_columns *rays = &d->rays->ray;
    const struct imp_hit_columns *hits = d->hits;
    for (int k = 0; k < n; k++) {
        for (int c = 0; c < 3; c++) {
            x->ahead.o[c][k] = rays->o[c][list[k]];
            x->ahead.d[c][k] = rays->d[c][list[k]];
        }
        x->ahead.far[k] = rays->far[list[k]];
        if (x->ahead.time) x->ahead.time[k] = rays->time[list[k]];
    }
    x->ahead.n = n;
    imp__intersect_columns(d->bundle->tracer->scene, &x->ahead, &x->met);
    for (int k = 0; k < n; k++) {
        const int i = list[k];
        hits->t[i] = x->met.t[k];
        hits->u[i] = x->met.u[k];
        hits->v[i] = x->met.v[k];
        hits->shape[i] = x->met.shape[k];
        hits->prim[i] = x->met.prim[k];
        hits->place[i] = x->met.place[k];
    }
}

/* It has nothing to do with media. */
static bool is_plain(const struct imp_scene *scene, const struct imp_shape *s)
{
    return !s->interior && !s->exterior &&
           !(imp__shape_bsdf(scene, s)->flags & IMP_BSDF_NULL);
}

/* Ray i has met a surface. True: it goes on behind it. */
static bool passes(struct imp_depth *d, int i, int passed)
{
    struct imp_in_media *x = d->media;
    const struct imp_scene *scene = d->bundle->tracer->scene;
    const struct imp_hit_columns *hits = d->hits;
    const struct imp_flights *rays = d->rays;
    if (is_plain(scene, scene->shapes[hits->shape[i]])) return false;
    struct imp_step *s = &d->lone->step;
    struct imp_hit hit = {.shape = hits->shape[i],
                          .prim = hits->prim[i],
                          .t = hits->t[i],
                          .u = hits->u[i],
                          .v = hits->v[i],
                          .place = hits->place[i],
                          .time = d->bundle->time[rays->walk[i]]};
    s->o = imp__column_v3(rays->ray.o, i);
    s->d = imp__column_v3(rays->ray.d, i);
    s->walk = &d->lone->walk;
    s->walk->time = hit.time;
    s->walk->dropped = IMP_DROP_NONE;
    s->flight.behind = rays->behind[i];
    s->flight.medium = s->flight.here = x->here[i] < 0 ? NULL : scene->media[x->here[i]];
    switch (imp__surface_ahead(s, false, passed, &hit)) {
    case IMP_PASSING_ENDS: imp__hit_put(hits, i, &hit); return false;
    case IMP_PASSING_DROPS:
        hits->shape[i] = IMP_HIT_DROPPED;
        d->bundle->dropped[rays->walk[i]] = (uint8_t)s->walk->dropped;
        return false;
    case IMP_PASSING_GOES_ON:
    default: break;
    }
    imp__column_put(rays->ray.o, i, s->o);
    x->medium[i] = s->flight.medium ? s->flight.medium->index : -1;
    x->base[i] = imp__dot(s->o - imp__column_v3(x->start, i), s->d);
    x->near[i] = x->base[i];
    rays->ray.far[i] = x->tmax[i] -= hit.t;
    return true;
}

static void begin(struct imp_depth *d)
{
    struct imp_in_media *x = d->media;
    const struct imp_flights *rays = d->rays;
    const size_t n = (size_t)rays->ray.n;
    for (int c = 0; c < 3; c++) {
        memcpy(x->start[c], rays->ray.o[c], n * sizeof(double));
        for (size_t i = 0; i < n; i++) x->f[c][i] = 1;
    }
    memcpy(x->tmax, rays->ray.far, n * sizeof(double));
    memcpy(x->medium, rays->medium, n * sizeof *x->medium);
    for (int i = 0; i < rays->ray.n; i++) {
        x->base[i] = 0;
        x->near[i] = imp_max(rays->ray.near ? rays->ray.near[i] : 0, rays->behind[i]);
        x->number[i] = 0;
        x->crossed[i] = false;
        x->active[i] = i;
    }
}

/* One stretch of the rays active[n]; those that go on are in x->active. Their number. */
static int stretch(struct imp_depth *d, int n, int passed)
{
    struct imp_in_media *x = d->media;
    const struct imp_hit_columns *hits = d->hits;
    int in_medium = 0, going = 0;
    for (int k = 0; k < n; k++)
        if (x->medium[x->active[k]] >= 0) x->flying[in_medium++] = x->active[k];
    paths_draw(d, x->flying, in_medium);
    if (passed == 0)
        imp__intersect_columns(d->bundle->tracer->scene, &d->rays->ray, d->hits);
    else stretches_meet(d, x->active, n);

    in_medium = 0;
    for (int k = 0; k < n; k++) {
        const int i = x->active[k];
        x->here[i] = x->medium[i];
        x->far[i] = x->base[i] + (hits->shape[i] >= 0 ? hits->t[i] : x->tmax[i]);
        if (x->medium[i] >= 0 && x->near[i] < x->far[i]) x->flying[in_medium++] = i;
    }
    fly(d, x->flying, in_medium);
    for (int k = 0; k < n; k++) {
        const int i = x->active[k];
        if (hits->shape[i] >= 0 && passes(d, i, passed)) x->going[going++] = i;
    }
    memcpy(x->active, x->going, (size_t)going * sizeof *x->active);
    return going;
}

void imp__media_meet(struct imp_depth *d, const struct imp_bundle_values *before)
{
    struct imp_in_media *x = d->media;
    int n = d->rays->ray.n, crossed = 0;
    begin(d);
    for (int passed = 0; n > 0; passed++) n = stretch(d, n, passed);
    for (int i = 0; i < d->rays->ray.n; i++) /* or dropped on the way to a light */
        if (d->bundle->dropped[d->rays->walk[i]]) d->hits->shape[i] = IMP_HIT_DROPPED;
    for (int i = 0; i < d->rays->ray.n; i++)
        if (x->crossed[i] && d->hits->shape[i] != IMP_HIT_DROPPED)
            x->flying[crossed++] = i;
    pass(d, before, x->flying, crossed);
}
