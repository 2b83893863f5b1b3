/* SPDX-License-Identifier: Apache-2.0
 *
 * Uncertainty of a fit: covariance in two parts, intervals, and directions that the data
 * do not determine (docs/estimators.md 15). */
#ifndef IMP_SEARCH_COVARIANCE_H
#define IMP_SEARCH_COVARIANCE_H

#include "optimize.h"

struct imp__uncertainty {
    size_t n;
    double *x;           /* [n] a last Newton step from the x handed in, made with random
                            numbers of its own: its error is what the covariances say */
    double *measurement; /* [n][n] covariance: noise of the data */
    double *monte_carlo; /* [n][n] covariance: noise of the estimator */
    double *G;           /* [n][n] inverse of H in the directions that are determined */
    double condition;    /* of the scaled H; INFINITY if it is singular */
    int n_loose;         /* directions that are not determined */
    double *loosest;     /* [n] unit vector, in units of the scales: the worst of them */
    double
        noise_scale; /* estimated variance of the data in units of 1/weight; 0: known */
};

/* Evaluate the normal equations at x `replicates` (>= 2) times with fresh random numbers.
 * Sets value, se, lo95, hi95, at_bound, determined of variables [n].
 *
 * share: the part of all walks behind the answer that these are; less than 1 where x is
 * an average over a search. If the Newton step is then no longer than its own noise, it
 * is taken by that share only, as the mean of two estimates would be; the errors stated
 * are still those of the whole step, and so an upper bound. */
enum imp_status imp__covariance(const struct imp__goal *goal, const double *x,
                                int replicates, double share,
                                struct imp_fit_variable *variables,
                                struct imp__uncertainty *out);
void imp__uncertainty_destroy(imp_context *ctx, struct imp__uncertainty *u);

#endif
