/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses of one number of a picture: l(I) for the mean I, against the target T. The
 * derivatives up to the third are what leave-one-out needs: l' is the adjoint, and what
 * remains of the bias when l is not quadratic is 1/2 l''' Var(L)/(N-1) dI
 * (docs/estimators.md 5.4). */
#ifndef IMP_INVERSE_LOSS_H
#define IMP_INVERSE_LOSS_H

#include "base/context.h"

struct imp__loss_at {
    double value, d1, d2, d3;
};

/* `weight` is the pixel's weight times the target's scale. */
void imp__loss_eval(enum imp_loss loss, double weight, double epsilon, double I, double T,
                    struct imp__loss_at *at);

/* Is it 1/2 w (I - T)^2? Then leave-one-out leaves no bias, and w is this: */
bool imp__loss_quadratic(enum imp_loss loss);
double imp__loss_weight(enum imp_loss loss, double weight, double epsilon, double T);

/* Gauss and Newton's weight of a residual: l'' but for the term with the residual itself,
 * so never negative. L1 has none: 0. */
double imp__loss_gauss_newton(enum imp_loss loss, double weight, double epsilon, double I,
                              double T);

/* imp_estimate.bias_order of leave-one-out (with jackknife where l is smooth). */
int imp__loss_bias_order(enum imp_loss loss);

/* ---- One pixel, from sums over its N >= 2 samples ------------------------------ */

/* Unbiased 1/2 w [(mean - T)^2 - s^2/N], s^2 the sample variance. */
double imp__loss_unbiased(double weight, double T, double n, double sum, double sum_sq);
/* What sample i's derivative x_i is multiplied with, mean over the N samples being the
 * gradient: w [(S - L_i)/(N-1) - T] (LOO). */
static inline double imp__loss_loo(double weight, double T, double n, double sum,
                                   double l)
{
    return weight * ((sum - l) / (n - 1) - T);
}

#endif
