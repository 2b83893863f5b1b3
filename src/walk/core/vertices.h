/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of a walk that is being decided: one is added behind the last, and placed where a
 * segment ended, on a surface or in a medium. Inline, for the steps of walks; vertices.c has
 * the same as functions, and the vertices that begin or end a walk. */
#ifndef IMP_WALK_VERTICES_H
#define IMP_WALK_VERTICES_H

#include "scene/located.h"
#include "step.h"
#include <stddef.h>

/* With room behind it for n_in inputs of its BSDF, unless only its value counts. */
static inline struct imp_vertex *imp__vertex_add_here(struct imp_step *s, int n_in)
{
    struct imp_walk *w = s->walk;
    if (imp_unlikely(w->n == IMP_WALK_MAX)) {
        w->dropped = IMP_DROP_LONG;
        return NULL;
    }
    struct imp_vertex *v = imp__arena_take(
        s->arena, 1,
        s->recorded ? sizeof *v + (size_t)n_in * sizeof *v->in : IMP_VERTEX_VALUES);
    if (imp_unlikely(!v)) {
        w->dropped = IMP_DROP_MEMORY;
        return NULL;
    }
    v->prev = w->last;
    v->next = NULL;
    if (w->last) w->last->next = v;
    else w->first = v;
    w->last = v;
    w->n++;
    v->bsdf = NULL;
    v->shape = NULL;
    v->side = NULL;
    v->w = v->e = v->b = v->beyond = (imp_spec){0};
    v->scale = (imp_spec){0};
    if (!s->recorded) return v;

    v->segment = &imp__straight;
    v->on = v->to_light = NULL;
    v->probe = NULL;
    v->in = (imp_spec *)(v + 1);
    v->carried = s->at.carried;
    struct imp_decision *d = &v->d;
    d->shape = d->met.emitter = -1;
    d->connection = IMP_NOT_CONNECTED;
    d->located.prim = -1;
    d->place = 0;
    d->back = false;
    d->glows = d->goes_on = d->fixed = d->from_light = d->alone = false;
    d->drawn = IMP_DENSITY_KERNEL;
    d->pdf = d->rest = 0;
    d->survive = d->passes = d->share = 1;
    d->met.weight = d->glow_weight = 1;
    return v;
}

static inline void imp__vertex_place_here(struct imp_step *s, struct imp_vertex *v,
                                          const struct imp_surface *at,
                                          const struct imp_frame *frame, imp_v3 d,
                                          double t)
{
    imp_spec *in = s->recorded ? v->in : s->scratch;
    v->t = t;
    s->at.uv[0] = imp__decide1(at->uv[0]);
    s->at.uv[1] = imp__decide1(at->uv[1]);
    s->at.p = imp__decide(at->p);
    s->at.shape = v->shape;
    s->wo_drawn = imp__to_local(frame, -d);
    s->wo = imp__decide(s->wo_drawn);
    s->in = in;
    imp__evaluate_inputs(v->bsdf, v->shape, &s->at, in);
    if (!s->recorded) return;
    v->ng = at->ng;
    v->d.uv[0] = (imp_decided)s->at.uv[0];
    v->d.uv[1] = (imp_decided)s->at.uv[1];
    imp__store_v3(v->d.p, s->at.p);
    imp__store_v3(v->d.wo, s->wo);
}
/* The point of the shape that was met, in decisions: what uv and p do not say. */
static inline void imp__vertex_locate(const struct imp_step *s, struct imp_vertex *v,
                                      const struct imp_hit *hit,
                                      const struct imp_surface *at)
{
    struct imp_decision *d = &v->d;
    d->located = imp__located_hit(s->scene, v->shape, hit, at);
    d->place = imp__place_decided(hit->place);
    d->back = imp__dot(at->ng, s->d) > 0;
}

/* The surface that was met, and its material there. NULL: the walk is dropped. */
static inline __attribute__((always_inline)) struct imp_vertex *
imp__surface_meet(struct imp_step *s, struct imp_hit *hit, struct imp_surface *at,
                  struct imp_frame *frame)
{
    const struct imp_shape *shape = s->scene->shapes[hit->shape];
    imp__hit_surface(s->scene, hit, &s->o, &s->d, at);
    const struct imp_bsdf *bsdf =
        imp_unlikely(s->scene->priorities != NULL)
            ? imp__nest_bsdf(s->scene, &s->flight.nest_here, shape)
            : imp__shape_bsdf(s->scene, shape);
    struct imp_vertex *v = imp__vertex_add_here(s, bsdf->n_in);
    if (!v) return NULL;
    v->shape = shape;
    v->bsdf = bsdf;
    if (s->recorded) {
        v->d.shape = hit->shape;
        v->d.scatterer = bsdf->flags & IMP_BSDF_NULL ? IMP_AT_BOUNDARY : IMP_AT_SURFACE;
    }
    *frame = (struct imp_frame){at->s, at->t, at->n};
    s->at.prim = hit->prim;
    imp__vertex_place_here(s, v, at, frame, s->d, hit->t);
    if (imp_unlikely(s->segment->arrive != NULL)) {
        if (!s->segment->arrive(s, v, hit, at)) return NULL;
        *frame = (struct imp_frame){at->s, at->t, at->n};
    }
    if (s->recorded) imp__vertex_locate(s, v, hit, at);
    return v;
}

/* The point of a medium where the segment ended in a collision; `medium`: its index, or -1. */
struct imp_vertex *imp__medium_meet(struct imp_step *s, const struct imp_bsdf *scatterer,
                                    int medium, imp_v3 p, double t,
                                    struct imp_surface *at, struct imp_frame *frame);

/* May light that is met here make the sample valid (docs/scene-format.md 11)? What is hidden from
 * the camera stays hidden behind a null material for path, and not for direct. */
static inline bool imp__met_is_seen(const struct imp_step *s)
{
    const struct imp_walk_integrator *integrator = s->tracer->integrator;
    return !integrator->hide_emitters || (integrator->first_hit && imp__bounces(s) > 0);
}

#endif
