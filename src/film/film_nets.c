/* SPDX-License-Identifier: Apache-2.0
 *
 * The variance of a net, from the spread of its quarters. With V_P, V_H, V_Q the variances of
 * means over a net, its halves and its quarters, their squared deviations have the means
 *
 *     D_1 = V_H - V_P   (halves from the net),     D_2 = V_Q - V_H   (quarters from halves)
 *
 * and the spread of four quarters gives (D_1 + D_2)/3, which is V_P for independent samples
 * (D_2 = 2 D_1) and too large where points gain. With a variance A/n^2 + B/n and
 * r = D_2/(2 D_1),
 *
 *     V_P / ((D_1 + D_2)/3)  =  rho(r)  =  (5 - 2 r)/(1 + 2 r),    1 <= r <= 2.
 *
 * r is found from the mean of f = d_1/(d_1 + d_2) over the pixels of a tile: a part, so that no
 * pixel counts more than others. For normal quarters d_1 is D_1 chi^2_1 and d_2 is
 * D_2 chi^2_2/2, and
 *
 *     E f  =  int_0^1 t^2/(r + (1 - r) t^2) dt.
 *
 * Pixels of a tile differ in r, and none of them may have an error that is much too small:
 * errors are multiplied with rho^(1/4), the geometric mean of the bound and the estimate. */
#include "film_nets.h"
#include "base/compiler.h"
#include "math/points.h"
#include <math.h>

/* Pixels of which a mean is formed, at least. */
#define FEWEST 64

bool imp__nets_whole(int64_t walks, int set)
{
    if (set < IMP_NET_PARTS || walks % ((int64_t)set * IMP_NET_PARTS) != 0) return false;
    return walks >= IMP_SET_POINTS
               ? set * IMP_NET_PARTS == IMP_SET_POINTS
               : (walks & (walks - 1)) == 0 && walks == set * IMP_NET_PARTS;
}

void imp__nets_add(double *sums, const double *parts, int n)
{
    for (int c = 0; c < n; c++) {
        const double a = parts[c], b = parts[n + c];
        const double e = parts[2 * n + c], g = parts[3 * n + c];
        const double halves = a + b - e - g;
        const double d1 = halves * halves;
        const double d2 = 2 * ((a - b) * (a - b) + (e - g) * (e - g));
        if (!(d1 + d2 > 0)) continue;
        sums[2 * c] += d1 / (d1 + d2);
        sums[2 * c + 1]++;
    }
}

/* E f of r > 1. */
static double share_of(double r)
{
    const double k = r - 1;
    return (sqrt(r / k) * atanh(sqrt(k / r)) - 1) / k;
}

double imp__nets_factor(const double sums[2])
{
    if (sums[1] < FEWEST) return 1;
    const double f = sums[0] / sums[1];
    double lo = 1, hi = 2; /* share_of falls from 1/3 */
    if (!(f < 1. / 3)) return 1;
    for (int k = 0; k < 30; k++) {
        const double r = (lo + hi) / 2;
        if (share_of(r) > f) lo = r;
        else hi = r;
    }
    return sqrt(sqrt((5 - 2 * lo) / (1 + 2 * lo)));
}
