/* SPDX-License-Identifier: Apache-2.0
 *
 * What the one step (core/one_step.h) does at the end of a walk that begins at the sensor: path
 * tracing with light samples, and Stam's walk that collects emission only where it is absorbed,
 * are settings of it. Walks alone (trace.c) and walks in bundles (bundle/) have it in common; of
 * both, only how a connection is seen is their own.
 *
 * Estimator (docs/estimators.md 8): E_k = w^B Le for emission met by chance, B_k = w^E f
 * Le/p^e for a light sample, power heuristic with exponent 2, w^B = 1 at the first vertex
 * and after a delta lobe. Depth: emission at vertex k counts if k < max_depth, scattering
 * goes on and samples lights if k + 1 < max_depth (docs/scene-format.md 11). */
#ifndef IMP_WALK_SENSOR_END_H
#define IMP_WALK_SENSOR_END_H

#include "scene/sealed.h"
#include "walk/core/one_step.h"

/* Light that leaves the vertex by itself: what its BSDF glows with, and its emitter. */
static inline __attribute__((always_inline)) void
imp__end_emission_add(struct imp_step *s, struct imp_vertex *v, double weight,
                      const struct imp_hit *hit, const struct imp_surface *at)
{
    if (v->bsdf->flags & IMP_BSDF_EMIT) {
        imp_spec glow;
        v->bsdf->ops->emit(v->bsdf, s->in, &s->wo, &glow);
        v->e += glow * weight;
        if (s->recorded) {
            v->d.glows = true;
            v->d.glow_weight = (imp_decided)weight;
        }
    }
    if (v->shape && v->shape->emitter >= 0) {
        imp__emission_meet(s, v, v->shape->emitter, weight, hit, at);
        s->walk->valid |= imp__met_is_seen(s);
    }
}

/* The densities at the vertex that was met, and whether it splits. */
static __attribute__((noinline)) void imp__end_mixture_meet(struct imp_step *s,
                                                            const struct imp_bsdf *b,
                                                            const struct imp_surface *at)
{
    imp__mixture_prepare(s, b, at->p);
    /* The vertex of a sensor that is a surface, of depth -1, is not scattering. */
    s->mixed.splits =
        s->mixed.here && s->depth >= 0 && s->depth < s->tracer->integrator->split;
}

/* ---- The end ----------------------------------------------------------------------- */

static inline bool imp__end_counts(const struct imp_step *s)
{
    const int max_depth = s->tracer->integrator->max_depth;
    return max_depth < 0 || imp__bounces(s) < max_depth;
}
static inline bool imp__end_bounces(const struct imp_step *s)
{
    const int max_depth = s->tracer->integrator->max_depth;
    return max_depth < 0 || imp__bounces(s) + 1 < max_depth;
}
/* What a sensor that is a surface receives at once is what a camera sees: with hide_emitters
 * its first vertex has no light sample. */
static inline bool imp__end_looks_past_lights(const struct imp_step *s)
{
    return imp_unlikely(s->tracer->integrator->hide_emitters) && s->depth < 0;
}

static inline bool imp__end_arrive(struct imp_step *s, struct imp_vertex *v,
                                   const struct imp_hit *hit,
                                   const struct imp_surface *at,
                                   const struct imp_frame *frame)
{
    (void)v, (void)frame;
    if (imp_unlikely(s->guided.guide != NULL)) imp__guided_arrive(s, hit, at);
    return true;
}

static inline void imp__end_densities(struct imp_step *s, const struct imp_vertex *v,
                                      const struct imp_surface *at)
{
    if (imp_unlikely(s->mixed.all != NULL || s->guided.here))
        imp__end_mixture_meet(s, v->bsdf, at);
    else s->mixed.here = s->mixed.splits = false;
}

/* Emission that is met; Stam's walk collects it only where it is absorbed. */
static inline bool imp__end_meet(struct imp_step *s, struct imp_vertex *v,
                                 const struct imp_hit *hit, const struct imp_surface *at)
{
    const bool absorbs = s->tracer->integrator->ends_by == IMP_ENDS_BY_ABSORPTION;
    const bool within = imp__end_counts(s);
    double emits = 1;
    const bool absorbed = absorbs && within && imp__absorb(s, v->bsdf, &emits);
    if (absorbs) s->walk->valid = true;
    if (within && emits > 0) imp__end_emission_add(s, v, emits, hit, at);
    return !absorbed;
}

static inline void imp__end_goes_on(struct imp_step *s, const struct imp_vertex *v)
{
    if (!(v->bsdf->flags & IMP_BSDF_NULL) && !imp__end_looks_past_lights(s))
        s->walk->valid = true;
}

/* A point of a medium that no light sample leaves. */
static inline bool imp__end_is_sealed(const struct imp_step *s,
                                      const struct imp_vertex *v)
{
    return imp_unlikely(s->scene->sealed != NULL) && !v->shape && s->flight.here &&
           imp__is_sealed(s->scene, s->flight.here);
}

static inline bool imp__end_link_draw(struct imp_step *s, const struct imp_vertex *v,
                                      const struct imp_surface *at, struct imp_link *link)
{
    return s->segment->connects && s->tracer->integrator->lights && imp__end_bounces(s) &&
           !imp__end_looks_past_lights(s) && !imp__end_is_sealed(s, v) &&
           imp__light_point(s, v->bsdf, at, &link->light);
}

static inline void imp__end_link_weigh(struct imp_step *s, struct imp_vertex *v,
                                       const struct imp_surface *at,
                                       const struct imp_frame *frame,
                                       struct imp_link *link)
{
    imp__light_sample(s, v, at, frame, &link->light, &link->shadow);
}

static inline bool imp__end_splits(const struct imp_step *s)
{
    return imp_unlikely(s->mixed.splits) ||
           (imp_unlikely(s->tracer->split > 1) && s->depth == 0 &&
            s->scene->n_bodies + s->scene->n_media == 0);
}

#endif
