/* SPDX-License-Identifier: Apache-2.0
 *
 * L-BFGS with bounds for objectives without noise, as fits of bent rays are. */
#ifndef IMP_BEND_LBFGS_H
#define IMP_BEND_LBFGS_H

#include "search/optimize.h"

/* The inverse Hessian that pairs correct: a symmetric positive definite M, x = M x in place
 * for x [n]. */
struct imp__lbfgs_metric {
    void (*apply)(double *x, void *payload);
    void *payload;
};

/* As imp__optimize, for objectives without noise; `s` was created for IMP_LBFGS. `metric`
 * NULL: the identity. */
enum imp_status imp__lbfgs(const struct imp__goal *goal,
                           const struct imp__opt_options *options,
                           const struct imp__lbfgs_metric *metric, struct imp__search *s);

/* A search that has not begun takes over the pairs of `old`; y is scaled so that the
 * curvature s.y along s does not change. */
enum imp_status imp__lbfgs_carry(const struct imp__search *old,
                                 const struct imp__carry *carry, struct imp__search *s);

#endif
