/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal equations of a fit (J^T W J and J^T W r) as samples estimate them, with the
 * covariance of the gradient and the deviations of the matrix. */
#ifndef IMP_SEARCH_SAMPLED_H
#define IMP_SEARCH_SAMPLED_H

#include "optimize.h"

/* At most so many times samples are put together: there is room for their deviations. */
#define IMP_SAMPLED_STAGES 3

/* Normal equations at one x, from random numbers of their own. */
struct imp__sampled {
    imp_context *ctx;
    size_t n;
    int rounds;              /* samples, in those of an evaluation */
    struct imp__normal mean; /* over them; cov_g without excess */
    double *cov, *excess;    /* [n][n] of the mean; cov with excess */
    int stages;              /* times that samples were added */
    double *deviations;      /* [stages][IMP_DEVIATIONS][n][n], of the mean's H; see
                                imp__normal */
    double *scale;           /* [n] max(|x|, goal's scale) */
    int taken;               /* samples that are not added yet, */
    struct imp__normal one;  /* where they were taken, */
    double *one_cov;         /* [n][n] covariance of their gradient, without excess */
};

/* No samples yet; s->ctx and s->n are set. Release with imp__sampled_destroy, also after a
 * failure. */
enum imp_status imp__sampled_create(const struct imp__goal *goal, const double *x,
                                    struct imp__sampled *s);
void imp__sampled_destroy(struct imp__sampled *s);

/* Samples at `at`, in s->one. */
enum imp_status imp__sampled_take(const struct imp__goal *goal, const double *at,
                                  uint64_t seed, int rounds, struct imp__sampled *s);
/* They count as samples at x: means are weighted by the samples that they are of. */
enum imp_status imp__sampled_add(const double *x, const double *at,
                                 struct imp__sampled *s);

/* No samples any more: the next are the first. */
void imp__sampled_forget(struct imp__sampled *s);

/* The loss at `to`, by the quadratic of the samples at x, where `part` of the way is that of
 * their own Newton step -G g. */
struct imp_estimate imp__sampled_loss(const struct imp__sampled *s, const double *x,
                                      const double *to, const double *G, double part);

/* Variance of the data in units of 1/weight, where their noise is known: the ratio of the
 * traces of D H_meas D and D H_data D, which the best determined directions dominate. */
double imp__sampled_noise(const struct imp__sampled *s);

#endif
