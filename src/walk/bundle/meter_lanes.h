/* SPDX-License-Identifier: Apache-2.0
 *
 * Points of a grid in lanes, where they share what their walks meet (reuse.h): their light samples, and
 * the walks of a point after its first.
 *
 * Each walk has several light samples: of the numbers u by which one would choose a lamp, sample l of L
 * has (l + u)/L, so that all are spread over the lamps as L times as many walks. Each counts 1/L,
 * with the weight against directions that a single one has, which is right for any weights that add up
 * to one. */
#ifndef IMP_WALK_BUNDLE_METER_LANES_H
#define IMP_WALK_BUNDLE_METER_LANES_H

#include "depth.h"

/* Are all walks of a pixel from one point, in directions by the cosine from its normal? Then only
 * the first is made by imp__meter_vertex. */
bool imp__meter_in_lanes(const struct imp_tracer *tracer);
/* Walks first + 1 to first + n - 1 of the pixel at xy, with these samples [n], as walk `first`, which
 * has the vertex of the same number and the last of the rays d->next. */
void imp__meter_others(struct imp_depth *d, int first, const int at[2], int n,
                       const int64_t *samples);
/* Adds light samples to the values d->values of the points, whose places d->reuse knows. hidden: room
 * for as many rays. */
void imp__meter_lights(struct imp_depth *d, bool *hidden);

#endif
