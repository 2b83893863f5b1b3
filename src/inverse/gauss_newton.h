/* SPDX-License-Identifier: Apache-2.0
 *
 * What the two estimators of J^T W J share: walk by walk where a walk reaches one pixel
 * (gauss_newton.c), picture by picture where the filter gives it several (wide.c). */
#ifndef IMP_INVERSE_GAUSS_NEWTON_H
#define IMP_INVERSE_GAUSS_NEWTON_H

#include "estimate.h"
#include "search/optimize.h"
#include "seen.h"

struct imp__normal_sums { /* matrices [K*K], lower triangles */
    double *H, *H_same, *H_meas, *cov_g, *cov_excess, *g;
    double *scalars;    /* [IMP_NORMAL_SCALARS] */
    double *deviations; /* [IMP_DEVIATIONS][K*K], or NULL */
};
/* Of a target: loss and its variance, as those of an evaluation with the same walks; chi^2
 * by all pairs of walks, and its variance. */
enum {
    IMP_NORMAL_OBJECTIVE,
    IMP_NORMAL_VARIANCE,
    IMP_NORMAL_CHI2,
    IMP_NORMAL_CHI2_VARIANCE,
    IMP_NORMAL_SCALARS
};

/* Adds H, H_same, H_meas, g, cov_g, cov_excess, deviations and chi2 of a target whose pixels
 * share walks (a filter wider than a pixel, or walks from the lights), from `rounds` times
 * the samples of an evaluation; lo, hi: the part of the caller's progress. */
enum imp_status imp__gauss_newton_wide(const struct imp_problem *p,
                                       const struct imp_tracer *tracer,
                                       const struct imp__target *target,
                                       const struct imp_run *run, int rounds, double lo,
                                       double hi, struct imp__normal_sums *out);

#endif
