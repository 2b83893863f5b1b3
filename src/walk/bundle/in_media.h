/* SPDX-License-Identifier: Apache-2.0
 *
 * Bundles in media (walk/media/tracking.h, of walks alone): values of walks through media whose
 * extinction is uniform. A segment takes rays through the boundaries on their way to a collision or a
 * surface, stretch by stretch: rays in columns, free paths and transmittances in lanes, boundaries one by one.
 * Shadow rays go likewise. Collisions are vertices like others, in lanes where the phase function is. */
#ifndef IMP_WALK_BUNDLE_IN_MEDIA_H
#define IMP_WALK_BUNDLE_IN_MEDIA_H

#include "depth.h"

/* What hit columns have in place of a shape, besides -1. */
enum { IMP_HIT_COLLISION = -2, IMP_HIT_DROPPED = -3 };

/* A bundle's room for stretches; columns have a row for each ray. */
struct imp_in_media {
    int n_lanes;      /* colours that have numbers of their own */
    double *sigma[3]; /* [n_media] */
    int32_t *
        here; /* medium that the vertex lies in, or is reached from; -1: none. The point of a
                         collision stands in t, u and v of the hit */
    /* While stretches go on: */
    double *start[3], *base, *near, *far, *tmax, *path, *f[3];
    int32_t *medium;
    uint32_t *number; /* of random numbers used */
    bool *crossed;
    int32_t *active, *flying, *going; /* rays */
    struct imp_ray_columns ahead;
    struct imp_hit_columns met;
};

/* Can walks of this tracer go in bundles, as far as media are concerned? */
bool imp__media_fit(const struct imp_tracer *tracer);
/* Room for n rays; NULL: no memory. */
struct imp_in_media *imp__in_media_create(const struct imp_tracer *tracer,
                                          struct imp_arena *arena, size_t n);

/* Takes the rays of the depth to what they meet; what lies on the way goes to their throughput and to
 * the values of the vertices before them. */
void imp__media_meet(struct imp_depth *d, const struct imp_bundle_values *before);
/* Takes the shadow rays of the depth to the lights, and their transmittance to the values, which are 0
 * where something is in the way. */
void imp__media_see(struct imp_depth *d);

/* Extinctions in colour c, of media at[k]. */
static inline imp_wide imp__media_sigma(const struct imp_in_media *x, int c,
                                        const int32_t at[IMP_WIDE_LANES])
{
    return imp__wide_taken(x->sigma[c], at);
}

/* The index of the medium on the side of the surface that dir points to. */
static inline int imp__media_beyond(const struct imp_shape *shape, imp_v3 ng, imp_v3 dir,
                                    int here)
{
    if (imp_likely(!shape || (!shape->interior && !shape->exterior))) return here;
    const struct imp_medium *m =
        imp__dot(ng, dir) < 0 ? shape->interior : shape->exterior;
    return m ? m->index : -1;
}

#endif
