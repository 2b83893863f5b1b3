/* SPDX-License-Identifier: Apache-2.0
 *
 * Segments that cross media (docs/media.md 2). A free flight ends in a collision with a
 * medium, which is a vertex like any other, or at a surface. Surfaces of type null are
 * passed on the way: they only say where media begin and end.
 *
 * The derivative with respect to an extinction has two forms. In uniform media, on stretches
 * deep enough to collide in, the sampled collisions are kept and each factor below is
 * differentiated (a fixed collision). Shallow stretches and heterogeneous media are probed
 * (probe.h), since a division by sigma has an unbounded variance there. Optical depth of the
 * whole stretch chooses the form, not the flight.
 *
 * What a flight decided is kept as its events, at distances along the segment. The
 * segment's value is a product over them,
 *
 *     a uniform medium crossed for a length t      exp(-sigma t)
 *     a collision after that length                sigma exp(-sigma t)
 *     bounded by b, a null collision at t          1 - sigma(t)/b
 *     bounded by b, a collision at t               sigma(t)/b
 *     near a control c, a null collision at t      1 - (sigma(t) - c)/r
 *     bounded by b, a null collision at t that
 *     had the probability p, inf if it was real    (1 - sigma(t)/b)/p
 *     controls along the way, of optical depth t   exp(-t)
 *     on the way to a light sample, a surface      sum of its lobes that go straight on
 *
 * which is also the density with which each lane would have drawn it, so the weight of a
 * flight is 1 where extinction has no colour (lane_mis.h). Flights are analog: closed
 * form, or delta tracking (Woodcock et al. 1965) under local bounds (majorants.h). To a
 * light sample no collision is drawn: exp(-sigma t), or ratio tracking (Novak, Selle,
 * Jarosz 2014), whose events are all null collisions. Residual ratio tracking (the same)
 * takes a control c out of the extinction of each cell, in closed form, and draws null
 * collisions with a rate r >= |sigma - c| for the rest. Delta tracking decides each of them,
 * with one number for all lanes: the transmittance of a lane is 0 or 1. */
#ifndef IMP_WALK_TRACKING_H
#define IMP_WALK_TRACKING_H

#include "walk/core/step.h"

enum imp_event_kind {
    IMP_CROSSES,
    IMP_COLLIDES,
    IMP_NULL_AT,
    IMP_REAL_AT,
    IMP_PASSES,    /* bound: cosine at the shading normal of the side that it comes from,
                     medium: the shape */
    IMP_PASSES_UV, /* follows it; t, bound: u, v, medium: the primitive */
    IMP_RESIDUAL_AT, /* bound: r */
    IMP_RESIDUAL_OF, /* follows it; t: c */
    IMP_DELTA_AT,    /* bound: b */
    IMP_DELTA_OF,    /* two follow it; t, bound: p of the lanes 0 and 1, 2 and 3 */
    IMP_CONTROL,
    IMP_LINE_AT /* factor 1. A point of the way to a light sample, uniform in the media
                      whose extinction varies and has a derivative; bound: their length l.
                      -l d sigma(t) is an estimate of the derivative of log T */
};

struct imp_event {
    imp_decided t;     /* a length in a uniform medium; else distance from the start */
    imp_decided bound; /* b; in a uniform medium 1: a fixed collision, else 0 */
    int32_t medium;
    int32_t kind;
};

struct imp_track {
    imp_decided o[3], d[3]; /* start and unit direction of the segment, world */
    int n, cap;
    struct imp_event *event; /* [n] */
};

extern const struct imp_segment_ops imp__tracking;

/* The medium on the side of the surface that d points to; `here` where it bounds none. */
static inline const struct imp_medium *imp__medium_beyond(const struct imp_shape *shape,
                                                          imp_v3 ng, imp_v3 d,
                                                          const struct imp_medium *here)
{
    if (!shape || (!shape->interior && !shape->exterior)) return here;
    return imp__dot(ng, d) < 0 ? shape->interior : shape->exterior;
}

/* Rays from a point of a medium begin a little behind it: a boundary as near as Embree's
 * rounding is met then, and met from its wrong side it is not there. */
static inline double imp__begins_behind(imp_v3 p)
{
    return (1 + imp__max3(imp__abs(p))) * IMP_RAY_EPSILON;
}

/* A surface that is met: the segment ends there; or it goes on behind it, from s->o, in
 * s->flight.medium; or the walk is dropped. */
enum imp_passing { IMP_PASSING_ENDS, IMP_PASSING_GOES_ON, IMP_PASSING_DROPS };
/* Which it is of the ray in flight, in medium s->flight.here, at *hit, in place of which another may
 * be found. passed: surfaces before it; hide: lights are passed as well. */
enum imp_passing imp__surface_ahead(struct imp_step *s, bool hide, int passed,
                                    struct imp_hit *hit);

/* Optical depth of the uniform media that it crosses. */
imp_spec imp__track_depth(const struct imp_scene *scene, const struct imp_track *track,
                          const struct imp_carried *carried);
/* The segment's value at the scene's present parameters. */
imp_spec imp__track_eval(const struct imp_scene *scene, const struct imp_track *track,
                         const struct imp_carried *carried);
#define IMP_HEADROOM_MOVES (1 + 1e-9) /* where things move in media that vary */
/* With headroom, the least probability of a real collision (flight.h), 0 without. Where things move, each
 * collision that is not real multiplies weights by up to 1/(1 - least), and there may be hundreds. */
static inline double imp__real_least(double headroom)
{
    return headroom > IMP_HEADROOM_MOVES ? 0.1 : headroom > 1 ? 0.001 : 0;
}
/* The density with which its events would be drawn there, under their bounds; `least`: of a
 * real collision (imp__real_least). At the draw it is the decided one. */
imp_spec imp__track_density(const struct imp_scene *scene, const struct imp_track *track,
                            const struct imp_carried *carried, double least);
/* Along a walk: has it a derivative with the events where they are? */
bool imp__track_counts(const struct imp_tracer *tracer, const struct imp_track *track);
/* This derivative: f_bar to the sink, or along x_dot.
 * value: the segment's, to a light sample; NULL along a walk. */
void imp__track_sweep(const struct imp_tracer *tracer, const struct imp_track *track,
                      const struct imp_carried *carried, const imp_spec *value,
                      imp_spec f_bar, struct imp_sink *sink);
imp_spec imp__track_tangent(const struct imp_tracer *tracer,
                            const struct imp_track *track,
                            const struct imp_carried *carried, const imp_spec *value,
                            double (*dot)(const void *x_dot, int param, size_t element),
                            const void *x_dot);

/* ... along x_dot [active->n] (sweep.c). */
imp_spec imp__track_tangent_along(const struct imp_tracer *tracer,
                                  const struct imp_track *track,
                                  const struct imp_carried *carried,
                                  const imp_spec *value, const double *x_dot);

/* What goes straight on through a surface of this material, in the event and the next. */
imp_spec imp__passes_eval(const struct imp_scene *scene, const struct imp_track *track,
                          const struct imp_event *e, const struct imp_carried *carried);

/* Extinction at p: those inputs alone that it depends on are looked up, the others are 0.
 */
imp_spec imp__extinction_at(const struct imp_medium *m, imp_v3 p,
                            const struct imp_carried *carried, imp_spec *in);

/* Inputs that derivatives with respect to the extinction look at, the others 0. in [n_own]
 */
void imp__seen_inputs(const struct imp_tracer *tracer, const struct imp_medium *m,
                      const struct imp_texcoord *at, imp_spec *in);

/* Factor of IMP_RESIDUAL_AT, and of what follows it. */
static inline imp_spec imp__residual(imp_spec sigma, const struct imp_event e[2])
{
    return 1 - (sigma - (double)e[1].t) * (1 / (double)e[0].bound);
}

/* 1/p of IMP_DELTA_AT, by the two events that follow it. */
static inline imp_spec imp__delta_weight(const struct imp_event e[3])
{
    return 1 / (imp_spec){(double)e[1].t, (double)e[1].bound, (double)e[2].t,
                          (double)e[2].bound};
}

/* exp(-sigma t); 1 where sigma is 0, however large t. */
imp_spec imp__attenuation(imp_spec sigma, double t);

#endif
