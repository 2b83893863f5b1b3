/* SPDX-License-Identifier: Apache-2.0
 *
 * What the two estimators of J^T W J share: walk by walk where a walk reaches one pixel
 * (gauss_newton.c), picture by picture where the filter gives it several (wide.c). */
#ifndef IMP_INVERSE_GAUSS_NEWTON_H
#define IMP_INVERSE_GAUSS_NEWTON_H

#include "inverse/estimate/replicates.h"
#include "inverse/problem/target_channels.h"
#include "search/optimize.h"
#include <math.h>

/* Gauss-Newton pieces for all targets, from one set of walks, K = p->n <= 256
 * (docs/estimators.md 15). Regularisers are not included. Targets that are not quadratic have
 * their Gauss-Newton weights at the present pictures; what bias that leaves in value and
 * gradient is objective.bias_order. */
struct imp__gauss_newton {
    double *H;      /* [K*K] U-statistic of J^T W J: unbiased, may be indefinite */
    double *H_same; /* [K*K] same-sample matrix: biased upwards, positive semi-definite */
    double *H_meas; /* [K*K] sum of w^2 sigma^2 J J^T for the measurement's covariance, or
                       NULL; sigma^2 from the residuals where a target gives none */
    double *g, *g_se; /* [K] leave-one-out gradient of the data term, standard errors; or
                         NULL */
    double *cov_g;    /* [K*K] covariance of g, too large by */
    double *cov_excess; /* [K*K] this, unbiased (pair_noise.h); or NULL both */
    double *deviations; /* [IMP_DEVIATIONS][K*K] of H (search/optimize.h); or NULL */
    int rounds;         /* set by the caller: so many times the samples; 0: once */
    struct imp_estimate objective; /* data term */
    /* sum w (mean - T)^2 - w Var(mean), unbiased; with its standard error for losses that
     * are quadratic in the picture */
    double chi2, chi2_se;
    double n_residuals;
    /* Where channels of a pixel may share their noise in H_meas: pixels that count. 0: there are too
     * few of them for so many values, and channels are independent in it. */
    double n_pixels;
};
enum imp_status imp__gauss_newton(struct imp_problem *p, const double *x,
                                  const struct imp_run *run,
                                  struct imp__gauss_newton *out);

/* Pixels that products of two channels' residuals take for each value: with fewer, a fit follows their
 * noise, and what is left of it tells little. */
#define IMP_PIXELS_A_VALUE 4

/* What tells how the noise of two channels whose sigmas are given is correlated: sums over the pixels
 * where both count. */
struct imp__channel_pair {
    double cc, dd, cd; /* of products of residuals, without our own noise */
    double c, d;       /* of sigma^2 */
    double pixels;
};
_Static_assert(sizeof(struct imp__channel_pair) == 6 * sizeof(double), "six sums");
/* Their correlation. 0, as if they were independent, where pixels are few, and where residuals are not
 * the noise that was given: then they tell of a model that does not fit. */
static inline double imp__channel_correlation(const struct imp__channel_pair *p)
{
    const bool fits = p->cc > 0.5 * p->c && p->cc < 1.5 * p->c && p->dd > 0.5 * p->d &&
                      p->dd < 1.5 * p->d;
    if (p->pixels < 64 || !fits) return 0;
    return fmin(fmax(p->cd / sqrt(p->cc * p->dd), -1), 1);
}

struct imp__normal_sums { /* matrices [K*K], lower triangles */
    double *H, *H_same, *H_meas, *cov_g, *cov_excess, *g;
    /* Where the sigmas of a target with several channels are given: the parts of H_meas by pairs of
     * channels 01, 02, 12 as if they were fully correlated, [3][K*K]; else NULL. */
    double *cross;
    double *scalars;    /* [IMP_NORMAL_SCALARS] */
    double *deviations; /* [IMP_DEVIATIONS][K*K], or NULL */
};
/* Scalars of a target: loss and its variance, as those of an evaluation with the same walks; chi^2
 * by all pairs of walks, and its variance. */
enum {
    IMP_NORMAL_OBJECTIVE,
    IMP_NORMAL_VARIANCE,
    IMP_NORMAL_CHI2,
    IMP_NORMAL_CHI2_VARIANCE, /* its jackknife, */
    IMP_NORMAL_CHI2_EXCESS,   /* and what that has too much (excess.h) */
    IMP_NORMAL_CHANNELS,      /* struct imp__channel_pair of 01, 02, 12 */
    IMP_NORMAL_CHANNELS_LAST = IMP_NORMAL_CHANNELS + 3 * 6 - 1,
    IMP_NORMAL_SCALARS
};

struct imp__moved_gradient;

/* Adds H, H_same, H_meas, g, cov_g, cov_excess, deviations and chi2 of a target whose
 * pixels share walks (a filter wider than a pixel, or light walks) or draws from edges (moved; NULL:
 * no pose is active), from `rounds` times the samples of an evaluation; pairs: channels may share their
 * noise; lo, hi: the part of the caller's progress. */
enum imp_status imp__gauss_newton_wide(const struct imp_problem *p,
                                       const struct imp_tracer *tracer,
                                       const struct imp__moved_gradient *moved,
                                       const struct imp__target *target,
                                       const struct imp_run *run, int rounds, bool pairs,
                                       double lo, double hi,
                                       struct imp__normal_sums *out);

#endif
