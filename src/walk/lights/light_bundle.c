/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from lights in lanes, from their keys to what they bring to the film (light_bundle.h). */
#include "light_bundle.h"

static bool material_fits(const struct imp_bsdf *b)
{
    return !b->shaped && !b->straight && !(b->flags & (IMP_BSDF_EMIT | IMP_BSDF_NULL)) &&
           b->n_in <= IMP_INPUTS_MAX;
}

bool imp__light_bundle_fit(const struct imp_tracer *t)
{
#if defined(__AVX2__) /* two lanes do not pay (bundle.h) */
    const struct imp_scene *scene = t->scene;
    bool fits = imp__light_walks_go_together(t) && t->value_only && !t->active &&
                !t->guide && !t->sensor->shape && scene->n_groups == 0 &&
                !scene->timed_lights && material_fits(scene->default_bsdf) &&
                material_fits(scene->black_bsdf);
    for (int k = 0; fits && k < scene->n_bsdfs; k++)
        fits = material_fits(scene->bsdfs[k]);
    return fits;
#else
    (void)t, (void)material_fits;
    return false;
#endif
}

/* ---- Room -------------------------------------------------------------------------------- */

#define TAKE(p) ((p) = imp__arena_take(arena, n + IMP_COLUMN_SLACK, sizeof *(p)))

static bool create(struct imp_light_bundle *l, const struct imp_tracer *tracer,
                   struct imp_arena *arena, size_t n)
{
    const bool instant = !(tracer->sensor->close > tracer->sensor->open);
    const int colors = tracer->wavelengths ? 4 : 3;
    const struct imp_columns_wanted none = {0};
    struct imp_light_views *views = &l->views;
    l->bundle = (struct imp_bundle){.tracer = tracer, .n = (int)n, .colors = colors};
    l->at = (struct imp_depth){.bundle = &l->bundle, .hits = &l->hits, .lone = &l->lone};
    bool ok = imp__hits_create(arena, n, &l->hits) &&
              imp__by_shape_create(tracer, arena, n, &l->by_shape) && TAKE(l->hidden) &&
              TAKE(l->end) && TAKE(l->bundle.set) &&
              (colors == 3 || TAKE(l->bundle.waves)) &&
              imp__rays_create(arena, n, &views->ray) && TAKE(views->px) &&
              TAKE(views->py) && TAKE(views->walk) && (instant || TAKE(views->ray.time));
    views->ray.instant = tracer->sensor->open;
    for (int c = 0; ok && c < colors; c++) ok = TAKE(views->brings[c]);
    for (int i = 0; ok && i < 2; i++) {
        struct imp_light_flights *f = &l->flights[i];
        ok = imp__flights_create(arena, n, colors, none, &f->rays) &&
             (instant || TAKE(f->rays.ray.time));
        f->rays.ray.instant = tracer->sensor->open;
        for (int c = 0; ok && c < colors; c++) ok = TAKE(f->carries[c]);
    }
    return ok;
}

/* ---- A depth ----------------------------------------------------------------------------- */

static void few_vertices(struct imp_depth *d, const int32_t *order, int n)
{
    struct imp_bin bin;
    imp__few_bin(d, order, n, &bin);
    imp__light_vertices((struct imp_light_bundle *)d, &bin, order, n);
}

static void vertices(struct imp_light_bundle *l)
{
    const int rays = l->at.rays->ray.n;
    struct imp_by_shape *s = &l->by_shape;
    int few = 0;
    imp__by_shape_count(s, &l->hits, rays);
    imp__by_shape_order(s, &l->hits, rays);
    for (int k = 0, from = 0; k < s->n; k++) {
        const int shape = s->shape[k], n = s->count[shape] - from;
        const int32_t *order = s->order + from;
        struct imp_bin bin;
        from += n;
        s->count[shape] = 0;
        if (n < IMP_LANES_FEW) {
            for (int i = 0; i < n; i++) s->few[few++] = order[i];
            continue;
        }
        imp__shape_bin(l->bundle.tracer, shape, &bin);
        imp__light_vertices(l, &bin, order, n);
    }
    if (few > 0) imp__by_shape_few(&l->at, s, few, few_vertices);
}

/* What the sensor sees reaches it. False: no memory. */
static bool see(struct imp_light_bundle *l, struct imp_arena *arena)
{
    struct imp_light_views *v = &l->views;
    imp__occluded_columns(l->bundle.tracer->scene, &v->ray, l->hidden);
    for (int i = 0; i < v->ray.n; i++) {
        struct imp_light_walk *out = &l->out[v->walk[i]];
        if (l->hidden[i] || out->walk.dropped) continue;
        struct imp_reach *r = imp__arena_take(arena, 1, sizeof *r);
        if (!r) return false;
        *r = (struct imp_reach){.number = l->at.depth, .px = v->px[i], .py = v->py[i]};
        *l->end[v->walk[i]] = r;
        l->end[v->walk[i]] = &r->next;
        out->n_reach++;
        imp__reach_value(l->bundle.tracer, &out->walk, r,
                         imp__column_color(v->brings, l->bundle.colors, i));
    }
    v->ray.n = 0;
    return !arena->failed;
}

/* Walks that would have too many vertices. */
static void drop_long(struct imp_light_bundle *l)
{
    for (int i = 0; i < l->at.rays->ray.n; i++)
        if (l->hits.shape[i] >= 0)
            l->out[l->at.rays->walk[i]].walk.dropped = IMP_DROP_LONG;
}

bool imp__light_bundle_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                             int64_t first, int n, struct imp_light_walk *out)
{
    const struct imp_walk_integrator *integrator = tracer->integrator;
    const int max = integrator->max_depth;
    struct imp_light_bundle l;
    if (!create(&l, tracer, arena, (size_t)n)) return false;
    l.out = out;
    l.flights[1].rays.ray.n = l.views.ray.n = 0;
    if (!imp__light_bundle_begin(&l, arena, first)) return false;
    for (int depth = 1; l.flights[depth & 1].rays.ray.n > 0; depth++) {
        l.at.depth = depth;
        l.at.rays = &l.flights[depth & 1].rays;
        l.at.next = &l.flights[~depth & 1].rays;
        l.at.next->ray.n = 0;
        l.links = integrator->lights && tracer->sensor->ops->connect &&
                  (max < 0 || depth + 1 <= max);
        l.goes_on = integrator->directions && (max < 0 || depth + 2 <= max);
        imp__intersect_columns(tracer->scene, &l.at.rays->ray, &l.hits);
        if (depth >= IMP_WALK_MAX) {
            drop_long(&l);
            break;
        }
        vertices(&l);
        if (!see(&l, arena)) return false;
    }
    for (int k = 0; k < n; k++) {
        if (!out[k].walk.dropped) continue;
        out[k].reach = NULL;
        out[k].n_reach = 0;
    }
    return !arena->failed;
}
