/* SPDX-License-Identifier: Apache-2.0
 *
 * Values and derivatives l, l', l'', l''' of the losses, their Gauss-Newton weight, and the order
 * of the bias that remains (loss.h). */
#include "loss.h"
#include <math.h>

void imp__loss_eval(enum imp_loss loss, double weight, double epsilon, double I, double T,
                    struct imp__loss_at *at)
{
    const double r = I - T;
    switch (loss) {
    case IMP_LOSS_L2:
    case IMP_LOSS_RELATIVE_L2: {
        const double w = imp__loss_weight(loss, weight, epsilon, T);
        *at = (struct imp__loss_at){0.5 * w * r * r, w * r, w, 0};
        return;
    }
    case IMP_LOSS_L1: /* subgradient 0 at the kink */
        *at = (struct imp__loss_at){weight * fabs(r),
                                    r > 0   ? weight
                                    : r < 0 ? -weight
                                            : 0,
                                    0, 0};
        return;
    case IMP_LOSS_LOG: {
        /* q = log(I+e) - log(T+e), q' = 1/(I+e) = v: l' = w q v, l'' = w v^2 (1 - q),
         * l''' = w v^3 (2 q - 3). Noise below 0 in either picture counts as 0. */
        const double v = 1 / (fmax(I, 0) + epsilon);
        const double q = -log(v * (fmax(T, 0) + epsilon));
        *at = (struct imp__loss_at){0.5 * weight * q * q, weight * q * v,
                                    weight * v * v * (1 - q),
                                    weight * v * v * v * (2 * q - 3)};
        return;
    }
    }
}

bool imp__loss_quadratic(enum imp_loss loss)
{
    return loss == IMP_LOSS_L2 || loss == IMP_LOSS_RELATIVE_L2;
}

double imp__loss_weight(enum imp_loss loss, double weight, double epsilon, double T)
{
    return loss == IMP_LOSS_RELATIVE_L2 ? weight / (T * T + epsilon) : weight;
}

double imp__loss_gauss_newton(enum imp_loss loss, double weight, double epsilon, double I,
                              double T)
{
    if (loss == IMP_LOSS_L1) return 0;
    if (loss == IMP_LOSS_LOG) return weight / pow(fmax(I, 0) + epsilon, 2);
    return imp__loss_weight(loss, weight, epsilon, T);
}

int imp__loss_bias_order(enum imp_loss loss)
{
    switch (loss) {
    case IMP_LOSS_L2:
    case IMP_LOSS_RELATIVE_L2: return 0;
    case IMP_LOSS_L1: return 1;
    case IMP_LOSS_LOG: return 2;
    }
    return 1;
}

double imp__loss_unbiased(double weight, double T, double n, double sum, double sum_sq)
{
    const double mean = sum / n, var = (sum_sq - n * mean * mean) / (n - 1);
    return 0.5 * weight * ((mean - T) * (mean - T) - var / n);
}
