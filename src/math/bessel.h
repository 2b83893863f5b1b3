/* SPDX-License-Identifier: Apache-2.0
 *
 * The modified Bessel function I_0. */
#ifndef IMP_MATH_BESSEL_H
#define IMP_MATH_BESSEL_H

#include <math.h>

/* I_0(x) e^-x for x >= 0, and *ratio (if not NULL) I_1(x)/I_0(x). To some 1e-15: by the
 * power series, whose terms are positive, and from 20 on by the asymptotic one, whose least
 * term is e^-2x (Abramowitz and Stegun 9.6.10, 9.7.1). */
static inline double imp__bessel_i0(double x, double *ratio)
{
    double i0 = 1, i1 = 1, term = 1, term1 = 1;
    if (x < 20) {
        const double q = 0.25 * x * x;
        for (int k = 1; term > 1e-17 * i0; k++) {
            term *= q / (k * (double)k);
            i0 += term;
            if (ratio) i1 += term / (k + 1);
        }
        if (ratio) *ratio = 0.5 * x * i1 / i0;
        return i0 * exp(-x);
    }
    for (int k = 1; k < 40 && fabs(term1) > 1e-17; k++) {
        const double odd = 2 * k - 1, step = 1 / (8 * x * k);
        term *= odd * odd * step;
        term1 *= (odd * odd - 4) * step;
        i0 += term;
        i1 += term1;
    }
    if (ratio) *ratio = i1 / i0;
    return i0 / sqrt(6.28318530717958647693 * x);
}

#endif
