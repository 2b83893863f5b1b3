/* SPDX-License-Identifier: Apache-2.0
 *
 * From a walk to the picture: what the camera makes of a walk's values, which are
 * wavelengths or colours, and the transpose for adjoints. */
#ifndef IMP_WALK_SEEN_H
#define IMP_WALK_SEEN_H

#include "tracer.h"

/* ---- The camera's own numbers (gain.c) --------------------------------------------- */

/* The camera's factor for this walk, by channel, and what is added behind it. */
imp_spec imp__walk_gain(const struct imp_tracer *tracer, const struct imp_walk *walk);
imp_spec imp__walk_offset(const struct imp_tracer *tracer, const struct imp_walk *walk);
/* What an adjoint of the walk's channels gives to the camera's own numbers. */
void imp__gain_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                     imp_spec adjoint, struct imp_sink *sink);
/* What the camera makes of the walk's values, in the direction x_dot of its own numbers. */
imp_spec imp__gain_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot);

/* ---- Channels and lanes ------------------------------------------------------------ */

/* Channels of a walk's values, without the camera's factor, and the transpose. */
static inline imp_spec imp__walk_seen(const struct imp_walk *walk, imp_spec values)
{
    return imp_likely(!walk->waves) ? values : imp__waves_channels(walk->waves, values);
}
static inline imp_spec imp__walk_lanes(const struct imp_walk *walk, imp_spec channels)
{
    return imp_likely(!walk->waves) ? channels : imp__waves_lanes(walk->waves, channels);
}
/* With it. */
static inline imp_spec imp__walk_channels(const struct imp_tracer *tracer,
                                          const struct imp_walk *walk, imp_spec values)
{
    const imp_spec seen = imp__walk_seen(walk, values);
    return imp_likely(!tracer->sensor->gain) ? seen : seen * imp__walk_gain(tracer, walk);
}
/* As the target sees them. */
static inline imp_spec imp__walk_shown(const struct imp_tracer *tracer,
                                       const struct imp_walk *walk, imp_spec values)
{
    const imp_spec L = imp__walk_channels(tracer, walk, values);
    return imp_likely(!tracer->photograph) ? L : L + imp__walk_offset(tracer, walk);
}
static inline imp_spec imp__walk_values(const struct imp_tracer *tracer,
                                        const struct imp_walk *walk, imp_spec channels)
{
    if (imp_unlikely(tracer->sensor->gain != NULL))
        channels *= imp__walk_gain(tracer, walk);
    return imp__walk_lanes(walk, channels);
}

#endif
