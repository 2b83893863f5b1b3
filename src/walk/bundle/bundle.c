/* SPDX-License-Identifier: Apache-2.0
 *
 * A bundle of walks from its pixels to its radiance: rays of the sensor; segment after segment
 * hits, vertices and shadow rays; the fold. Recorded walks have vertices of their own (walk_parts.h) in
 * place of columns of values, or columns of what a sweep takes (swept.h). */
#include "by_shape.h"
#include "in_media.h"
#include "lanes_light.h"
#include "meter_lanes.h"
#include "reuse.h"
#include "scene/ray_columns.h"
#include "swept.h"
#include "walk/path/first_segment.h"
#include <string.h>

/* Is there a material whose lobes depend on the wavelength? Walks carry more there. */
static bool is_shaped(const struct imp_scene *scene)
{
    for (int k = 0; k < scene->n_bsdfs; k++)
        if (scene->bsdfs[k]->shaped) return true;
    return false;
}

bool imp__bundle_fits(const struct imp_tracer *t)
{
    const struct imp_walk_integrator *w = t->integrator;
    return (t->value_only || t->active || imp__swept_fits(t)) && !t->kept && !t->guide &&
           (!t->wavelengths || !is_shaped(t->scene)) && !t->mixing && t->split <= 1 &&
           !w->mixes && !w->both && !(w->hide_emitters && t->sensor->shape) &&
           !w->from_lights && !w->first_hit && !t->scene->priorities &&
           (imp__segment_first(t) == &imp__straight_ops || imp__media_fit(t));
}

static bool crosses_media(const struct imp_tracer *t)
{
    return imp__segment_first(t) != &imp__straight_ops;
}

/* ---- The beginning ----------------------------------------------------------------------- */

#define TAKE(p) ((p) = imp__arena_take(arena, n + IMP_COLUMN_SLACK, sizeof *(p)))

static bool bundle_create(struct imp_arena *arena, size_t n, struct imp_bundle *b)
{
    return TAKE(b->px) && TAKE(b->py) && TAKE(b->time) && TAKE(b->set) &&
           TAKE(b->index) && TAKE(b->L[0]) && TAKE(b->L[1]) && TAKE(b->L[2]) &&
           TAKE(b->L[3]) && (b->colors == 3 || TAKE(b->waves)) && TAKE(b->valid) &&
           TAKE(b->dropped) && (b->tracer->value_only || b->swept || TAKE(b->walks)) &&
           (b->tracer->together == 0 || (TAKE(b->alone[0]) && TAKE(b->alone[1]) &&
                                         TAKE(b->alone[2]) && TAKE(b->alone[3]))) &&
           (!crosses_media(b->tracer) || (TAKE(b->keys) && TAKE(b->drew)));
}

/* ---- A depth ----------------------------------------------------------------------------- */

/* What hidden lights would have brought. */
static void unlit(struct imp_bundle_values *values, int colors,
                  const struct imp_shadows *shadows, const bool *hidden)
{
    for (int k = 0; k < shadows->ray.n; k++)
        if (hidden[k]) imp__color_put(values->b, colors, shadows->at[k], (imp_spec){0});
}

/* The same of recorded vertices, which keep what became of their connection. */
static void connect(const struct imp_shadows *shadows, const bool *hidden)
{
    for (int k = 0; k < shadows->ray.n; k++) {
        struct imp_vertex *v = shadows->of[k];
        if (hidden[k]) v->b = (imp_spec){0};
        else v->d.connection = IMP_CONNECTED;
    }
}

static void fold(const struct imp_bundle_values *v, int colors, double *const beyond[4])
{
    for (int c = 0; c < colors; c++)
        for (int i = 0; i < v->n; i++)
            beyond[c][v->up[i]] = v->e[c][i] + v->w[c][i] * v->beyond[c][i] + v->b[c][i];
}

/* ---- All --------------------------------------------------------------------------------- */

/* Values of a depth, and those of the one before. */
struct link {
    struct imp_bundle_values values;
    struct link *before;
};
static struct link *link_add(struct imp_arena *arena, size_t n, int colors,
                             struct link *before)
{
    struct link *link = imp__arena_take(arena, 1, sizeof *link);
    if (!link || !imp__bundle_values_create(arena, n, colors, &link->values)) return NULL;
    link->before = before;
    return link;
}

/* What walks of a bundle work with. */
struct room {
    struct imp_flights flights[2];
    struct imp_hit_columns hits;
    struct imp_shadows shadows;
    struct imp_by_shape by_shape;
    bool *hidden;
    struct imp_lone lone;
    struct imp_bundle_values recorded; /* in place of values that walks have themselves */
};

static bool room_create(const struct imp_tracer *tracer, struct imp_arena *arena,
                        size_t n, struct room *r)
{
    const struct imp_columns_wanted wanted = {.left = tracer->integrator->light_tree &&
                                                      tracer->scene->light_tree,
                                              .zeros = tracer->active != NULL,
                                              .media = crosses_media(tracer)};
    const bool instant = !(tracer->sensor->close > tracer->sensor->open);
    const int colors = tracer->wavelengths ? 4 : 3;
    if (!imp__flights_create(arena, n, colors, wanted, &r->flights[0]) ||
        !imp__flights_create(arena, n, colors, wanted, &r->flights[1]) ||
        !imp__hits_create(arena, n, &r->hits) ||
        !imp__shadows_create(arena, n, wanted, &r->shadows) ||
        !imp__by_shape_create(tracer, arena, n, &r->by_shape) || !TAKE(r->hidden))
        return false;
    if (!instant && (!TAKE(r->flights[0].ray.time) || !TAKE(r->flights[1].ray.time) ||
                     !TAKE(r->shadows.ray.time)))
        return false;
    r->flights[0].ray.instant = r->flights[1].ray.instant = r->shadows.ray.instant =
        tracer->sensor->open;
    r->recorded = (struct imp_bundle_values){.n = 0};
    imp__walk_clear(&r->lone.walk);
    r->lone.walk.point.points = tracer->points;
    imp__step_begin(tracer, arena, &r->lone.walk, r->lone.scratch, &r->lone.step);
    r->lone.cut.made = false;
    if (tracer->sensor->shape) r->lone.step.cut = &r->lone.cut;
    r->lone.step.t_min = 0;
    r->lone.step.t_max = INFINITY;
    return true;
}

/* The lights of the depth's vertices that are hidden. */
static void see(struct imp_depth *d, struct room *r)
{
    if (imp_unlikely(d->media != NULL)) {
        imp__media_see(d);
        return;
    }
    imp__occluded_columns(d->bundle->tracer->scene, &r->shadows.ray, r->hidden);
    if (d->bundle->walks) connect(&r->shadows, r->hidden);
    else unlit(d->values, d->bundle->colors, &r->shadows, r->hidden);
    if (d->bundle->swept) imp__swept_connect(d->bundle, &r->shadows, r->hidden);
    r->shadows.ray.n = 0;
}

/* Values of vertices where walks from a sensor begin, with these weights set or to be set. */
static struct link *sensor_link(struct imp_arena *arena, struct imp_bundle *b,
                                struct link *before)
{
    struct link *link = link_add(arena, (size_t)b->all, b->colors, before);
    if (!link) return NULL;
    link->values.n = b->all;
    for (int k = 0; k < b->all; k++) {
        imp__color_put(link->values.e, b->colors, k, imp__spec(0));
        imp__color_put(link->values.b, b->colors, k, imp__spec(0));
        imp__color_put(link->values.w, b->colors, k, imp__spec(1));
        imp__color_put(link->values.beyond, b->colors, k, imp__spec(0));
        link->values.up[k] = k;
    }
    return link;
}

/* Walks from a sensor that is a surface: their first vertices, in links of their own. False: no
 * memory. */
static bool meter_begin(struct imp_arena *arena, struct imp_depth *d, const int (*xy)[2],
                        int n_samples, const int64_t *samples, struct room *r,
                        struct link **out)
{
    struct imp_bundle *b = d->bundle;
    const size_t n = (size_t)b->all;
    int giver = b->n;
    struct link *sensor = b->walks ? NULL : sensor_link(arena, b, NULL),
                *first = sensor ? link_add(arena, n, b->colors, sensor) : NULL;
    if (!b->walks && !first) return false;
    if (first) first->values.n = b->all;
    for (int k = b->n; k < b->all; k++) { /* where the film's first walk has no ray */
        imp__color_put(first->values.e, b->colors, k, imp__spec(0));
        imp__color_put(first->values.b, b->colors, k, imp__spec(0));
        imp__color_put(first->values.w, b->colors, k, imp__spec(0));
        imp__color_put(first->values.beyond, b->colors, k, imp__spec(0));
        first->values.up[k] = k;
    }
    d->values = first ? &first->values : &r->recorded;
    d->next = &r->flights[0];
    d->next->ray.n = r->shadows.ray.n = 0;
    const bool lanes = imp__meter_in_lanes(b->tracer);
    for (int k = 0; k < b->n; k++) {
        struct imp_walk own, *walk = b->walks ? &b->walks[k] : &own;
        const int rays = d->next->ray.n;
        double weight;
        if (!imp__begin_alone(b, arena, xy[k / n_samples], samples[k % n_samples], k,
                              walk))
            return false;
        imp__meter_vertex(d, walk, k, &weight);
        if (sensor) imp__color_put(sensor->values.w, b->colors, k, imp__spec(weight));
        if (imp_likely(!lanes) || k % n_samples > 0) continue;
        const int more = imp__reuse_more(b->tracer, xy[k / n_samples]);
        if (imp_unlikely(d->next->ray.n ==
                         rays)) { /* those that give only have none either */
            for (int of = k; of < k + n_samples && d->reuse; of++)
                d->reuse->times[of] = 1;
            giver += more * n_samples;
            continue;
        }
        struct imp_meter_others others = {.first = k,
                                          .ray = rays,
                                          .from = k + 1,
                                          .n = n_samples - 1,
                                          .at = xy[k / n_samples],
                                          .samples = samples + 1};
        imp__meter_others(d, &others);
        others.n = n_samples;
        others.samples = samples;
        for (int left = more; left > 0; left--) {
            others.copy++;
            others.from = giver;
            imp__meter_others(d, &others);
            giver += n_samples;
        }
        for (int last = k + n_samples - 1; k < last; k++)
            imp__color_put(sensor->values.w, b->colors, k + 1, imp__spec(weight));
    }
    if (imp_unlikely(d->reuse != NULL)) imp__meter_lights(d, r->hidden);
    else see(d, r);
    *out = first;
    return true;
}

bool imp__bundle_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                       int n_pixels, const int (*xy)[2], int n_samples,
                       const int64_t *samples, struct imp_bundle *b)
{
    struct room r;
    struct imp_reuse reuse;
    struct imp_swept *swept = NULL;
    struct imp_depth d = {
        .bundle = b, .hits = &r.hits, .shadows = &r.shadows, .lone = &r.lone};
    struct link *last = NULL, *met_first = NULL; /* met_first: by points that share */
    const bool failed = arena->failed;           /* not here */
    if (imp__swept_fits(tracer)) {
        swept = imp__arena_take(arena, 1, sizeof *swept);
        if (!swept) return false;
        arena->failed = false;
    }
    *b = (struct imp_bundle){.tracer = tracer,
                             .swept = swept,
                             .n = n_pixels * n_samples,
                             .all = n_pixels * n_samples,
                             .n_samples = n_samples,
                             .colors = tracer->wavelengths ? 4 : 3,
                             .arena = arena,
                             .before = tracer->sensor->shape   ? 2
                                       : crosses_media(tracer) ? 1
                                                               : 0};
    for (int k = 0; tracer->more && k < n_pixels; k++)
        b->all += imp__reuse_more(tracer, xy[k]) * n_samples;
    const size_t n = (size_t)b->all;
    if (!bundle_create(arena, n, b) || !room_create(tracer, arena, n, &r) ||
        (swept && !imp__swept_create(arena, b, swept)))
        return false;
    memset(b->valid, 0, n * sizeof *b->valid);
    memset(b->dropped, 0, n * sizeof *b->dropped);
    for (int c = 0; c < 4; c++) memset(b->L[c], 0, n * sizeof *b->L[c]);
    if (imp_unlikely(tracer->together > 0)) {
        if (!imp__reuse_create(arena, b, xy, &reuse)) return false;
        d.reuse = &reuse;
    }
    if (!tracer->sensor->shape) {
        if (!imp__camera_begin(arena, b, xy, n_samples, samples, &r.flights[0]))
            return false;
        if (crosses_media(tracer)) {
            d.media = imp__in_media_create(tracer, arena, n);
            last = sensor_link(arena, b, NULL);
            if (!d.media || !last) return false;
        }
    } else {
        if (!meter_begin(arena, &d, xy, n_samples, samples, &r, &last)) return false;
    }

    r.shadows.ray.n = 0;
    for (d.depth = 0; r.flights[d.depth & 1].ray.n > 0; d.depth++) {
        d.rays = &r.flights[d.depth & 1];
        d.next = &r.flights[~d.depth & 1];
        struct link *here =
            b->walks ? NULL : link_add(arena, (size_t)d.rays->ray.n, b->colors, last);
        if (!b->walks && !here) return false;
        d.values = here ? &here->values : &r.recorded;
        if (swept && !imp__swept_deeper(arena, b, (size_t)d.rays->ray.n, d.values))
            return false;
        d.next->ray.n = 0;
        if (d.media) imp__media_meet(&d, &last->values);
        else if (d.depth == 0 && tracer->integrator->hide_emitters)
            imp__meet_alone(&d, &r.hits);
        else imp__intersect_columns(tracer->scene, &d.rays->ray, &r.hits);
        imp__vertices(&d, last ? last->values.beyond : b->L, &r.by_shape);
        see(&d, &r);
        if (imp_unlikely(d.reuse != NULL) && d.depth == 0) {
            imp__reuse_connect(&reuse, d.values, &r.shadows, r.hidden);
            met_first = here;
        }
        r.flights[0].ray.near = NULL;
        last = here;
    }
    for (; last; last = last->before) {
        if (imp_unlikely(last == met_first))
            imp__reuse_give(&reuse, &last->values, &last->before->values);
        fold(&last->values, b->colors, last->before ? last->before->values.beyond : b->L);
    }
    if (imp_unlikely(met_first != NULL))
        imp__reuse_alone(&reuse, &met_first->before->before->values, b);
    else if (tracer->together > 0) /* no walk has a segment */
        for (int c = 0; c < b->colors; c++)
            memcpy(b->alone[c], b->L[c], n * sizeof(double));
    for (int k = 0; b->walks && k < b->n; k++) {
        imp__vertex_fetch(b->walks[imp_min(k + 2, b->n - 1)].last, IMP_VERTEX_VALUES);
        imp__walk_close(tracer, &b->walks[k]);
    }
    if (swept && imp_unlikely(arena->failed)) return false;
    if (swept) arena->failed = failed;
    return true;
}

void imp__bundle_walk(const struct imp_bundle *b, int k, struct imp_walk *walk)
{
    if (b->walks) {
        *walk = b->walks[k];
        return;
    }
    imp__walk_clear(walk);
    walk->px = b->px[k];
    walk->py = b->py[k];
    walk->time = b->time[k];
    walk->valid = b->valid[k];
    walk->dropped = (enum imp_drop)b->dropped[k];
    walk->waves = b->waves ? b->waves[k] : NULL;
    if (b->swept) {
        walk->n = b->swept->count[k];
        walk->reduced = &b->swept->walks[k].ops;
    }
    imp__walk_value(b->tracer, walk, imp__column_color(b->L, b->colors, k));
}
