/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal equations of a fit (J^T W J and J^T W r) as samples tell them, with the
 * covariance of the gradient and the deviations of the matrix. */
#ifndef IMP_SEARCH_SAMPLED_H
#define IMP_SEARCH_SAMPLED_H

#include "optimize.h"

/* At most so many calls of imp__sampled_add: there is room for their deviations. */
#define IMP_SAMPLED_STAGES 2

/* Normal equations at one x, from random numbers of their own. */
struct imp__sampled {
    imp_context *ctx;
    size_t n;
    int rounds;                /* samples, in those of an evaluation */
    struct imp__normal mean;   /* over them; cov_g without excess */
    double *cov, *excess;      /* [n][n] of the mean; cov with excess */
    double *last_g, *last_cov; /* [n], [n][n] of the last samples, where they were taken;
                                  without excess */
    int n_deviations;          /* see imp__normal.deviations */
    double *deviations;        /* [n_deviations][n][n], of the mean's H */
    double *scale;             /* [n] max(|x|, goal's scale) */
};

/* No samples yet; s->ctx and s->n are set. Release with imp__sampled_destroy, also after a
 * failure. */
enum imp_status imp__sampled_create(const struct imp__goal *goal, const double *x,
                                    struct imp__sampled *s);
void imp__sampled_destroy(struct imp__sampled *s);

/* More samples, taken at `at`, of the normal equations at x: means are weighted by the
 * samples that they are of. */
enum imp_status imp__sampled_add(const struct imp__goal *goal, const double *x,
                                 const double *at, uint64_t seed, int rounds,
                                 struct imp__sampled *s);

/* Variance of the data in units of 1/weight, where their noise is known: the ratio of the
 * traces of D H_meas D and D H_data D, which the best determined directions dominate. */
double imp__sampled_noise(const struct imp__sampled *s);

#endif
