/* SPDX-License-Identifier: Apache-2.0
 *
 * A vertex of a bundle by the step of walks that go alone (core/one_step.h): out of the columns,
 * through the kinds' functions, and back. */
#include "in_media.h"
#include "reuse.h"
#include "swept.h"
#include "walk/media/tracking.h"
#include "walk/path/sensor_end.h"
#include "walk/path/surface_sensor.h"

/* The connection is seen later, with all shadow rays of the depth. */
static inline void link_see(struct imp_step *s, struct imp_vertex *v,
                            const struct imp_surface *at, const struct imp_link *link)
{
    struct imp_lone *lone = (struct imp_lone *)s;
    v->b = link->shadow.brings;
    lone->shadow = link->shadow;
    if (imp_likely(s->segment->sees == NULL)) return;
    const imp_v3 d = link->shadow.d * (1 / imp__length(link->shadow.d));
    lone->medium = imp__media_beyond(v->shape, at->ng, d,
                                     s->flight.here ? s->flight.here->index : -1);
    lone->behind = imp__is_zero(at->ng) ? imp__begins_behind(at->p) : 0;
}

static const struct imp_end_ops bundle_end = {.nothing = imp__sky_meet,
                                              .arrive = imp__end_arrive,
                                              .bounces = imp__end_bounces,
                                              .passes = imp__end_counts,
                                              .densities = imp__end_densities,
                                              .meet = imp__end_meet,
                                              .goes_on = imp__end_goes_on,
                                              .link_draw = imp__end_link_draw,
                                              .link_weigh = imp__end_link_weigh,
                                              .link_see = link_see,
                                              .direction_draw = imp__direction_begin,
                                              .scatter = imp__scatter_along};

/* Points of a grid that share have their light samples later (meter_lanes.h). */
static inline bool link_later(struct imp_step *s, const struct imp_vertex *v,
                              const struct imp_surface *at, struct imp_link *link)
{
    (void)s, (void)v, (void)at, (void)link;
    return false;
}
static const struct imp_end_ops meter_end = {.nothing = imp__sky_meet,
                                             .arrive = imp__end_arrive,
                                             .bounces = imp__end_bounces,
                                             .passes = imp__end_counts,
                                             .densities = imp__end_densities,
                                             .meet = imp__end_meet,
                                             .goes_on = imp__end_goes_on,
                                             .link_draw = link_later,
                                             .direction_draw = imp__direction_begin,
                                             .scatter = imp__scatter_along};

/* The ray in flight, as it has been for a walk that goes alone. */
static void take(struct imp_depth *d, int i)
{
    const struct imp_flights *f = d->rays;
    const struct imp_bundle *b = d->bundle;
    struct imp_step *s = &d->lone->step;
    struct imp_walk *w = &d->lone->walk;
    const int walk = f->walk[i];
    if (b->walks) {
        s->walk = &b->walks[walk];
    } else {
        w->first = w->last = NULL;
        w->n = d->depth + b->before;
        w->valid = false;
        w->dropped = IMP_DROP_NONE;
        w->key.state = w->point.set = b->set[walk]; /* the second with points */
        w->point.index = b->index[walk];
        w->time = b->time[walk];
    }
    if (imp_unlikely(b->waves != NULL)) {
        w->waves = b->waves[walk];
        s->at.carried = &w->waves->carried;
    }
    for (int c = 0; f->zeros && c < 4; c++) s->zeros[c] = f->zeros[i] >> c & 1;
    s->depth = d->depth;
    s->o = imp__column_v3(f->ray.o, i);
    s->d = imp__column_v3(f->ray.d, i);
    s->from = imp__column_v3(f->from, i);
    s->pdf = f->pdf[i];
    s->beta = imp__column_color(f->beta, b->colors, i);
    s->eta = f->eta[i];
    if (f->medium) {
        const int here = d->media->here[i];
        s->flight.here = here < 0 ? NULL : s->scene->media[here];
        s->flight.medium = s->flight.here;
        s->lanes.ratio = (imp_spec){f->ratio[0][i], f->ratio[1][i], f->ratio[2][i], 1};
        s->lanes.weight = f->share[i];
        s->lanes.drew = (int)b->drew[walk];
    }
    if (imp_unlikely(f->left != NULL)) s->left = f->left[i];
}

static void give_back(struct imp_depth *d, int walk)
{
    const struct imp_walk *w = &d->lone->walk;
    if (d->bundle->walks) return;
    d->bundle->valid[walk] |= w->valid;
    if (imp_unlikely(w->dropped != IMP_DROP_NONE))
        d->bundle->dropped[walk] = (uint8_t)w->dropped;
}

static void shadow_add(struct imp_shadows *to, const struct imp_lone *lone, double time,
                       int walk, int at, struct imp_vertex *of)
{
    const struct imp_shadow *shadow = &lone->shadow;
    const int n = to->ray.n++;
    imp__column_put(to->ray.o, n, shadow->o);
    imp__column_put(to->ray.d, n, shadow->d);
    to->ray.far[n] = shadow->reach;
    if (to->ray.time) to->ray.time[n] = time;
    to->at[n] = at;
    to->of[n] = of;
    if (!to->medium) return;
    to->walk[n] = walk;
    to->medium[n] = lone->medium;
    to->behind[n] = lone->behind;
}

static void ray_add(struct imp_flights *to, const struct imp_step *s, int walk, int up)
{
    const int n = to->ray.n++;
    imp__column_put(to->ray.o, n, s->o);
    imp__column_put(to->ray.d, n, s->d);
    to->ray.far[n] = INFINITY;
    if (to->ray.time) to->ray.time[n] = s->walk->time;
    imp__column_put(to->from, n, s->from);
    to->pdf[n] = s->pdf;
    imp__color_put(to->beta, s->walk->waves ? 4 : 3, n, s->beta);
    to->eta[n] = s->eta;
    if (imp_unlikely(to->left != NULL)) to->left[n] = s->left;
    if (to->zeros) {
        to->zeros[n] = 0;
        for (int c = 0; c < 4; c++) to->zeros[n] |= (uint8_t)((s->zeros[c] > 0) << c);
    }
    if (to->medium) {
        to->medium[n] = s->flight.medium ? s->flight.medium->index : -1;
        to->behind[n] = s->flight.behind;
        imp__column_put(to->ratio, n, s->lanes.ratio);
        to->share[n] = s->lanes.weight;
    }
    to->walk[n] = walk;
    to->up[n] = up;
}

/* Values, the shadow ray and the next ray of vertex v, at place `at`; NULL: it is dropped. */
static void vertex_give_back(struct imp_depth *d, struct imp_vertex *v, bool goes_on,
                             int walk, int up, int at)
{
    const struct imp_step *s = &d->lone->step;
    const imp_spec none = {0};
    const int colors = d->bundle->colors;
    if (!d->bundle->walks) {
        d->values->up[at] = up;
        imp__color_put(d->values->e, colors, at, v ? v->e : none);
        imp__color_put(d->values->b, colors, at, v ? v->b : none);
        imp__color_put(d->values->w, colors, at, v ? v->w : none);
        imp__color_put(d->values->beyond, colors, at, none);
    }
    if (d->lone->shadow.wanted)
        shadow_add(d->shadows, d->lone, s->walk->time, walk, at, v);
    if (goes_on) ray_add(d->next, s, walk, at);
    if (d->bundle->swept) imp__swept_alone(d->bundle, walk, at, IMP_SWEPT_ALONE, v);
    give_back(d, walk);
}

/* What is recorded stays, and what is swept. */
static void forget(const struct imp_depth *d, struct imp_arena_mark mark)
{
    const struct imp_bundle *b = d->bundle;
    if (!b->walks && !(b->swept && b->tracer->active))
        imp__arena_rewind(d->lone->step.arena, mark);
}

void imp__vertex_alone(struct imp_depth *d, int i, int at)
{
    struct imp_step *s = &d->lone->step;
    const int walk = d->rays->walk[i];
    const struct imp_arena_mark mark = imp__arena_mark(s->arena);
    struct imp_hit hit = {.shape = d->hits->shape[i],
                          .prim = d->hits->prim[i],
                          .t = d->hits->t[i],
                          .u = d->hits->u[i],
                          .v = d->hits->v[i],
                          .place = d->hits->place[i],
                          .time = d->bundle->time[walk]};
    struct imp_surface surface;
    struct imp_frame frame;
    take(d, i);
    imp__step_numbers(s);
    struct imp_vertex *v = imp__surface_meet(s, &hit, &surface, &frame);
    d->lone->shadow.wanted = false;
    const bool goes_on = v && imp__vertex_work(&bundle_end, s, v, &hit, &surface, &frame);
    if (imp_unlikely(d->reuse != NULL) && d->depth == 0) {
        imp__column_put(d->reuse->x, at, surface.p);
        imp__column_put(d->reuse->ng, at, surface.ng);
        imp__column_put(d->reuse->n, at, frame.n);
        d->reuse->even[at] = v && imp__shape_is_even(d->bundle->tracer, hit.shape);
    }
    vertex_give_back(d, v, goes_on, walk, d->rays->up[i], at);
    forget(d, mark);
}

void imp__collision_alone(struct imp_depth *d, int i, int at)
{
    struct imp_step *s = &d->lone->step;
    const int walk = d->rays->walk[i];
    const struct imp_arena_mark mark = imp__arena_mark(s->arena);
    const imp_v3 p = imp__v3(d->hits->t[i], d->hits->u[i], d->hits->v[i]);
    struct imp_surface surface;
    struct imp_frame frame;
    take(d, i);
    imp__step_numbers(s);
    struct imp_vertex *v = imp__medium_meet(
        s, s->flight.here->scatterer, s->flight.here->index, p, 0, &surface, &frame);
    const struct imp_hit none = {.shape = -1};
    d->lone->shadow.wanted = false;
    const bool goes_on =
        v && imp__vertex_work(&bundle_end, s, v, &none, &surface, &frame);
    vertex_give_back(d, v, goes_on, walk, d->rays->up[i], at);
    forget(d, mark);
}

void imp__meet_alone(struct imp_depth *d, const struct imp_hit_columns *hits)
{
    struct imp_step *s = &d->lone->step;
    const struct imp_ray_columns *rays = &d->rays->ray;
    for (int i = 0; i < rays->n; i++) {
        struct imp_hit hit;
        take(d, i);
        s->t_min = rays->near ? rays->near[i] : 0;
        s->t_max = rays->far[i];
        hits->shape[i] = -1;
        if (imp__straight_meet(s, &hit) == IMP_MEETS_SURFACE) imp__hit_put(hits, i, &hit);
    }
    s->t_min = 0;
    s->t_max = INFINITY;
}

void imp__meter_vertex(struct imp_depth *d, const struct imp_walk *begun, int walk,
                       double *weight)
{
    struct imp_step *s = &d->lone->step;
    struct imp_walk *w = d->bundle->walks ? &d->bundle->walks[walk] : &d->lone->walk;
    const struct imp_arena_mark mark = imp__arena_mark(s->arena);
    struct imp_surface surface;
    struct imp_frame frame;
    if (d->bundle->walks) s->walk = w;
    else *w = *begun;
    s->at.carried = w->waves ? &w->waves->carried : NULL;
    s->o = s->from = w->ray.o;
    s->d = w->ray.d;
    s->pdf = 0;
    s->beta = imp__spec(1);
    s->eta = 1;
    s->depth = 0;
    struct imp_vertex *v = imp__meter_begin(s, &surface, &frame);
    d->lone->shadow.wanted = false;
    bool goes_on = false;
    if (v && imp_unlikely(d->reuse != NULL)) {
        goes_on = imp__vertex_work(&meter_end, s, v, NULL, &surface, &frame);
        imp__reuse_point(d->reuse, walk, surface.p, surface.ng);
    } else if (v) {
        goes_on = imp__vertex_work(&bundle_end, s, v, NULL, &surface, &frame);
    }
    *weight = w->first ? w->first->w[0] : 0;
    d->bundle->set[walk] = w->point.points ? w->point.set : w->key.state;
    vertex_give_back(d, v, goes_on, walk, walk, walk);
    forget(d, mark);
}

/* A vertex of its own. */
static void sky_swept(struct imp_depth *d, int i, imp_spec met)
{
    struct imp_bundle_values *values = d->values;
    const int colors = d->bundle->colors, at = values->n++;
    const imp_spec none = {0};
    imp__color_put(values->e, colors, at, met);
    imp__color_put(values->b, colors, at, none);
    imp__color_put(values->w, colors, at, none);
    imp__color_put(values->beyond, colors, at, none);
    values->up[at] = d->rays->up[i];
    imp__swept_alone(d->bundle, d->rays->walk[i], at, IMP_SWEPT_SKY, d->lone->walk.first);
}

void imp__sky_alone(struct imp_depth *d, int i, double *const beyond[4])
{
    const struct imp_arena_mark mark = imp__arena_mark(d->lone->step.arena);
    take(d, i);
    imp__sky_meet(&d->lone->step);
    if (d->bundle->walks) return;
    const imp_spec met = imp__walk_fold(&d->lone->walk);
    if (d->bundle->swept) sky_swept(d, i, met);
    else imp__color_put(beyond, d->bundle->colors, d->rays->up[i], met);
    give_back(d, d->rays->walk[i]);
    forget(d, mark);
}
