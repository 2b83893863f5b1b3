/* SPDX-License-Identifier: Apache-2.0
 *
 * Decisions whose density differs between the lanes of a walk: a free flight where
 * extinction has a colour, a lobe whose width or index depends on the wavelength. One of C
 * lanes, chosen once a walk with probability 1/C, makes all of them, and the density of
 * the walk is the mean over the lanes, whichever drew (balance heuristic; Miller,
 * Georgiev, Jarosz, "A null-scattering path integral formulation of light transport",
 * 2019). With p_j the density of all decisions so far had lane j drawn them, lane c of an
 * estimate is
 *
 *     f_c / ((1/C) sum_j p_j) = (f_c / p_drew) W,    W = C / sum_j (p_j / p_drew) <= C
 *
 * W changes along the walk: a step takes W'/W into its decided weight, so that emission
 * and light samples of a vertex have the W of the walk up to there. */
#ifndef IMP_WALK_LANE_MIS_H
#define IMP_WALK_LANE_MIS_H

#include "dims.h"
#include "math/rng.h"
#include <importon/kinds.h>

struct imp_step;

struct imp_lane_mis {
    imp_spec ratio; /* p_j / p_drew */
    double weight;  /* W */
    int drew;       /* -1: no decision has asked yet */
};
#define IMP_LANE_MIS_INIT                                                                \
    (struct imp_lane_mis) { .ratio = {1, 1, 1, 1}, .weight = 1, .drew = -1 }

/* The lane of n that draws in the walk of this key. */
static inline int imp__lane_drawn(struct imp_key key, int n)
{
    const int lane = (int)(imp__u01(key, imp__dim_start(IMP_DIM_LANE)) * n);
    return lane < n ? lane : n - 1;
}
/* Lanes that have numbers of their own. */
int imp__lane_mis_count(const struct imp_step *s);
/* The lane that draws. */
int imp__lane_mis_drew(struct imp_step *s);
/* A decision was drawn that has density p[j] for lane j; p of the lane that drew is not
 * 0. Returns W'/(W p_drew), as decided: the factor of all that follows. */
double imp__lane_mis_decide(struct imp_step *s, imp_spec p);
/* Density of a decision that was not drawn: the mean of p over the lanes, weighted by the
 * densities of the walk so far. */
double imp__lane_mis_density(const struct imp_step *s, imp_spec p);

#endif
