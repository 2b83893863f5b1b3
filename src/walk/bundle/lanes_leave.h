/* SPDX-License-Identifier: Apache-2.0
 *
 * What leaves vertices in lanes, of walks from either end: the rays that go on, those that look for a
 * light, a sensor or another point, and survival. Rays of the lanes with bits are appended to columns
 * from `to->n` on; the caller, who fills their other columns, counts them. */
#ifndef IMP_WALK_BUNDLE_LANES_LEAVE_H
#define IMP_WALK_BUNDLE_LANES_LEAVE_H

#include "lanes_light.h"
#include "math/wide_offset.h"
#include "scene/ray_columns.h"

/* From p, whose true normal is ng, along d. */
static inline void imp__lanes_ray_append(const struct imp_ray_columns *to, unsigned bits,
                                         imp_wide3 p, imp_wide3 ng, imp_wide3 d)
{
    imp__wide3_append(to->o, to->n, bits, imp__wide_offset(p, ng, d));
    imp__wide3_append(to->d, to->n, bits, d);
    imp__wide_append(&to->far[to->n], bits, imp__wide(INFINITY));
}

/* From p to q, which lies in direction `along`; reach: its part up to there. */
static inline void imp__lanes_sight_append(const struct imp_ray_columns *to,
                                           unsigned bits, imp_wide3 p, imp_wide3 ng,
                                           imp_wide3 along, imp_wide3 q, imp_wide reach)
{
    const imp_wide3 o = imp__wide_offset(p, ng, along);
    imp__wide3_append(to->o, to->n, bits, o);
    imp__wide3_append(to->d, to->n, bits, imp__wide3_minus(q, o));
    imp__wide_append(&to->far[to->n], bits, reach);
}

/* From p to a point of a light, or to one that is infinitely far. */
static inline void imp__lanes_shadow_append(const struct imp_ray_columns *to,
                                            unsigned bits, imp_wide3 p, imp_wide3 ng,
                                            const struct imp_lanes_light *l)
{
    const imp_wide3 o = imp__wide_offset(p, ng, l->at.wi);
    imp__wide3_append(to->o, to->n, bits, o);
    imp__wide3_append(to->d, to->n, bits,
                      imp__wide3_choose(l->far, l->at.wi, imp__wide3_minus(l->at.p, o)));
    imp__wide_append(&to->far[to->n], bits,
                     imp__wide_choose(l->far, imp__wide(INFINITY),
                                      imp__wide(1 - 10 * IMP_RAY_EPSILON)));
}

/* Survival as decided, by throughput and the product of index ratios; at least `least`. */
static inline imp_wide imp__lanes_survival(const imp_wide beta[4], int colors,
                                           imp_wide eta, double least)
{
    imp_wide most = imp__wide_larger(beta[0], imp__wide_larger(beta[1], beta[2]));
    if (colors > 3) most = imp__wide_larger(most, beta[3]);
    const imp_wide q = imp__wide_lesser(most * eta * eta, imp__wide(0.95));
    return imp__wide_decide(imp__wide_larger(q, imp__wide(least)));
}

/* The next of n rays to be worked on together: the lanes that are left repeat one, in `room`. */
static inline const int32_t *imp__lanes_filled(const int32_t *order, int n,
                                               int32_t room[IMP_WIDE_LANES])
{
    if (imp_likely(n >= IMP_WIDE_LANES)) return order;
    for (int k = 0; k < IMP_WIDE_LANES; k++) room[k] = order[k < n ? k : 0];
    return room;
}

#endif
