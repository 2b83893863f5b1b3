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
/* Walks `from` to from + n - 1 of the pixel `at`, with these samples [n], as walk `first`, which has the
 * vertex of that number and this one of the rays d->next. Of the walks that give only (near_walls.h)
 * copy > 0 has the points of a set that follow those of copies before, and sets of its own where
 * there are no more. */
struct imp_meter_others {
    int first, ray, from, n;
    const int *at;
    const int64_t *samples;
    int copy;
};
void imp__meter_others(struct imp_depth *d, const struct imp_meter_others *others);
/* Adds light samples to the values d->values of the points, whose places d->reuse knows. hidden: room
 * for as many rays. */
void imp__meter_lights(struct imp_depth *d, bool *hidden);

#endif
