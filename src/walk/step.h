/* SPDX-License-Identifier: Apache-2.0
 *
 * A walk on its way, and the three things that happen at a vertex: emission is met, a
 * light is sampled (light.c), the continuation is drawn (scatter.c). Only trace.c puts
 * them together. */
#ifndef IMP_WALK_STEP_H
#define IMP_WALK_STEP_H

#include "bend.h"
#include "dims.h"

struct imp_step {
    const struct imp_tracer *tracer;
    const struct imp_scene *scene;
    struct imp_walk *walk;
    struct imp_arena *arena;
    imp_v3 o, d; /* the ray in flight */
    double t_min, t_max;
    double pdf;    /* of d per steradian; 0: a delta lobe or the sensor chose it */
    imp_v3 from;   /* where the ray left, for light densities */
    imp_spec beta; /* throughput, zero factors left out: for roulette only */
    double eta;    /* product of index ratios */
    int zeros[3];  /* per lane: factors that are zero but have a derivative */
    int depth;
    struct imp_bending *bend; /* NULL: no medium in the scene */
    /* What the guide knows where the walk is, and where the ray in flight left. */
    bool known, left_known;
    struct imp_guide_place place, left;
    double reference; /* radiance that the guide expects of this walk; 0: none */
    double beyond;    /* what it expects of the continuation here, at throughput 1 */
    imp_spec before;  /* beta on arrival */
    imp_v3 arrived;   /* direction of arrival */
};

/* The shadow ray of a light sample; light -1: there is nothing to see. */
struct imp_shadow {
    imp_v3 o, d;
    double reach;
    int light;
};

/* Emission met by the ray at an area light, or the environment (hit, at NULL). */
void imp__emission_meet(struct imp_step *s, struct imp_vertex *v, int emitter,
                        const struct imp_hit *hit, const struct imp_surface *at);
/* Light sample at v: choose an emitter and a point on it. Whether it is visible is asked
 * later, after the continuation is drawn: neither waits for the other's arithmetic. */
void imp__light_sample(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       struct imp_shadow *shadow);

/* Stam's termination: with probability `absorb` the walk ends and collects what glows
 * here, divided by it; else it goes on, divided by the rest (gradients.md 6, E22-E24). */
bool imp__absorb(struct imp_step *s, struct imp_vertex *v);
/* Draw the continuation at v. False: the walk ends here. */
bool imp__scatter(struct imp_step *s, struct imp_vertex *v, const struct imp_surface *at,
                  const struct imp_frame *frame);

static inline bool imp__wants_lights(const struct imp_integrator *i)
{
    return i->kind == IMP_INTEGRATOR_PATH ||
           (i->kind == IMP_INTEGRATOR_DIRECT && i->emitter_samples > 0);
}

/* Does the guide draw a part of the continuations here? Its directions are on the front,
 * and a delta lobe has no density to mix with. */
static inline bool imp__mixes(const struct imp_step *s, const struct imp_bsdf *b)
{
    return s->known && s->place.share > 0 &&
           (b->flags & (IMP_BSDF_SMOOTH | IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT |
                        IMP_BSDF_NULL)) == IMP_BSDF_SMOOTH;
}
static inline double imp__mixture_pdf(const struct imp_step *s, double bsdf, imp_v3 w)
{
    const struct imp_guide *g = s->tracer->guide;
    const double share = s->place.share;
    return (1 - share) * bsdf + share * g->pdf(g, &s->place, w);
}

#endif
