/* SPDX-License-Identifier: Apache-2.0
 *
 * Nodes and weights of Gauss-Legendre quadrature, for any number of points. */
#include "quadrature.h"
#include <math.h>

/* Roots of P_n by Newton from Tricomi's asymptotic places; w = 2/((1 - x^2) P_n'(x)^2).
 */
void imp__gauss_legendre(size_t n, double lo, double hi, double *x, double *w)
{
    const double mid = 0.5 * (hi + lo), half = 0.5 * (hi - lo);
    for (size_t i = 0; i < (n + 1) / 2; i++) {
        double z = cos(3.14159265358979323846 * (i + 0.75) / (n + 0.5)), slope = 1;
        for (int k = 0; k < 100; k++) {
            double p0 = 1, p1 = z;
            for (size_t j = 2; j <= n; j++) {
                const double p2 = ((2.0 * j - 1) * z * p1 - (j - 1.0) * p0) / j;
                p0 = p1;
                p1 = p2;
            }
            slope = n * (z * p1 - p0) / (z * z - 1);
            const double step = p1 / slope;
            z -= step;
            if (fabs(step) < 1e-16) break;
        }
        if (2 * i + 1 == n) z = 0;
        x[i] = mid - half * z;
        x[n - 1 - i] = mid + half * z;
        w[i] = w[n - 1 - i] = 2 * half / ((1 - z * z) * slope * slope);
    }
}
