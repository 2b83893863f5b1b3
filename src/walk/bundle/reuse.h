/* SPDX-License-Identifier: Apache-2.0
 *
 * Points of a grid that share what their walks meet first (Bekaert, Sbert and Halton, "Accelerating path
 * tracing by re-using paths", 2002). The walks of some neighbours that have one number are a group.
 * What an even surface sends back at x, S, is the same for all who see that side of it. Where walk k
 * meets x, each point j of its group takes
 *
 *     S p_j(x) V_j / sum_l p_l(x) V_l,     p_l(x) = p(w_l) |n . w_l| / |x - x_l|^2,
 *
 * with p the density by which a point's walks leave in the direction w_l of x, which is the weight of
 * directions in what it reads, too: the balance heuristic (Veach 1997) over the ways in which the
 * group's walks meet x. Points near walls have m_l such walks, and m_l p_l in that sum (near_walls.h);
 * the film knows of one of them, the others give only. V_l: point l sees x, from the side that k sees; a ray tells. Surfaces that
 * are not even (lamps, mirrors, panes) share nothing, whichever walk meets them. */
#ifndef IMP_WALK_BUNDLE_REUSE_H
#define IMP_WALK_BUNDLE_REUSE_H

#include "depth.h"

/* What is known of the walks of a bundle. */
struct imp_reuse {
    const struct imp_bundle *bundle;
    /* Their points. */
    double *from[3], *normal[3], *facing[3];
    bool *begun,
        across; /* across: directions count by their part across the normal, too */
    /* The film's walks of the group, from that of the own point on; -1: there are fewer. */
    int32_t *on[IMP_REUSE_MOST];
    double *times; /* of the film's: m, the walks of its point for each of these */
    /* The surfaces that they meet first, by their places among the values of depth 0. */
    double *x[3], *ng[3], *n[3];
    bool *even;
    double *part[IMP_REUSE_MOST], *sent[4]; /* of S, for the walks `on`; S */
    double *given;                          /* their sum */
    double *taken[4]; /* what walks have from others, less what those have from them */
};
/* False: no memory. */
bool imp__reuse_create(struct imp_arena *arena, const struct imp_bundle *bundle,
                       const int (*xy)[2], struct imp_reuse *out);
/* Walks that give only, for each of the film's at this pixel. */
static inline int imp__reuse_more(const struct imp_tracer *t, const int at[2])
{
    return t->more
               ? t->more[(size_t)at[1] * (size_t)t->sensor->film.crop_w + (size_t)at[0]]
               : 0;
}
/* The point of a walk. */
void imp__reuse_point(struct imp_reuse *reuse, int walk, imp_v3 p, imp_v3 n);
/* When the vertices of depth 0 are made: what the points take. shadows, hidden: room for rays. */
void imp__reuse_connect(struct imp_reuse *reuse, const struct imp_bundle_values *values,
                        struct imp_shadows *shadows, bool *hidden);
/* When the values beyond them are there: gives S to the vertices of the points. */
void imp__reuse_give(struct imp_reuse *reuse, struct imp_bundle_values *values,
                     struct imp_bundle_values *points);
/* When the values at the sensor are there: what they are if each point has all that its walks give,
 * which is independent of other points, and of what others give nothing: sums over a group are the
 * same. */
void imp__reuse_alone(const struct imp_reuse *reuse,
                      const struct imp_bundle_values *sensor, struct imp_bundle *bundle);

#endif
