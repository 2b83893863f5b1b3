/* SPDX-License-Identifier: Apache-2.0
 *
 * Brown and Conrady's map, and its inverse by Newton's method, followed from the middle of the film
 * so that the continuous branch is found. */
#include "distortion.h"
#include "base/compiler.h"
#include <math.h>

#define LEAST_SLOPE 0.01 /* of the map, in any direction: below, it is about to fold */
#define PATH        16   /* steps from the middle to a node */
#define NEWTON      12   /* iterations, at most */

void imp__distort(const struct imp_distortion *d, const double at[2], double out[2],
                  double slope[3])
{
    const double x = at[0], y = at[1], r2 = x * x + y * y;
    const double R = 1 + r2 * (d->k1 + r2 * (d->k2 + r2 * d->k3));
    const double by_r2 = d->k1 + r2 * (2 * d->k2 + r2 * 3 * d->k3);
    out[0] = x * R + 2 * d->p1 * x * y + d->p2 * (r2 + 2 * x * x);
    out[1] = y * R + d->p1 * (r2 + 2 * y * y) + 2 * d->p2 * x * y;
    slope[0] = R + 2 * x * x * by_r2 + 2 * d->p1 * y + 6 * d->p2 * x;
    slope[1] = 2 * x * y * by_r2 + 2 * d->p1 * x + 2 * d->p2 * y;
    slope[2] = R + 2 * y * y * by_r2 + 6 * d->p1 * y + 2 * d->p2 * x;
}

void imp__distort_by(const double at[2], int k, double out[2])
{
    const double x = at[0], y = at[1], r2 = x * x + y * y;
    const double radial[5] = {r2, r2 * r2, 0, 0, r2 * r2 * r2};
    out[0] = x * radial[k];
    out[1] = y * radial[k];
    if (k == 2) out[0] = 2 * x * y, out[1] = r2 + 2 * y * y;
    if (k == 3) out[0] = r2 + 2 * x * x, out[1] = 2 * x * y;
}

/* Newton's method from x, which it replaces. Returns the smaller eigenvalue of the slope
 * where it ends; NAN where it does not converge. */
static double newton(const struct imp_distortion *d, const double seen[2], double x[2])
{
    double at[2], s[3];
    bool there = false;
    for (int i = 0; !there && i < NEWTON; i++) {
        imp__distort(d, x, at, s);
        const double det = s[0] * s[2] - s[1] * s[1];
        const double rx = seen[0] - at[0], ry = seen[1] - at[1];
        const double dx = (s[2] * rx - s[1] * ry) / det,
                     dy = (s[0] * ry - s[1] * rx) / det;
        x[0] += dx;
        x[1] += dy;
        /* Squared by one more step, which is below rounding. */
        there = fabs(dx) + fabs(dy) < 1e-9 * (1 + fabs(x[0]) + fabs(x[1]));
    }
    if (!there) return NAN;
    imp__distort(d, x, at, s);
    return 0.5 * (s[0] + s[2]) - hypot(0.5 * (s[0] - s[2]), s[1]);
}

void imp__undistort(const struct imp_distortion *d, const double seen[2], double out[2])
{
    double f[2];
    int k[2];
    for (int i = 0; i < 2; i++) {
        const double u = (seen[i] - d->lo[i]) / d->step[i];
        k[i] = (int)imp_max(fmin(floor(u), IMP_DISTORTION_NODES - 2), 0.0);
        f[i] = u - k[i];
    }
    const double *const a = d->node[k[1]][k[0]], *const b = d->node[k[1]][k[0] + 1],
                        *const c = d->node[k[1] + 1][k[0]],
                        *const e = d->node[k[1] + 1][k[0] + 1];
    for (int i = 0; i < 2; i++)
        out[i] = (1 - f[1]) * ((1 - f[0]) * a[i] + f[0] * b[i]) +
                 f[1] * ((1 - f[0]) * c[i] + f[0] * e[i]);
    newton(d, seen, out);
}

/* Along the straight line from the middle, where the map is the identity: as long as its
 * slope stays positive, what is reached is the continuous inverse. */
static bool follow(const struct imp_distortion *d, const double seen[2], double x[2])
{
    x[0] = x[1] = 0;
    for (int i = 1; i <= PATH; i++) {
        const double part[2] = {seen[0] * i / PATH, seen[1] * i / PATH};
        if (!(newton(d, part, x) > LEAST_SLOPE)) return false;
    }
    return true;
}

bool imp__distortion_invert(struct imp_distortion *d, const double lo[2],
                            const double hi[2], double seen[2])
{
    enum { N = IMP_DISTORTION_NODES };
    for (int i = 0; i < 2; i++) {
        d->lo[i] = lo[i];
        d->step[i] = (hi[i] - lo[i]) / (N - 1);
    }
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++) {
            seen[0] = lo[0] + i * d->step[0];
            seen[1] = lo[1] + j * d->step[1];
            if (!follow(d, seen, d->node[j][i])) return false;
        }
    /* And between the nodes, from the table. */
    for (int j = 0; j < N - 1; j++)
        for (int i = 0; i < N - 1; i++) {
            double x[2], back[2], s[3];
            seen[0] = lo[0] + (i + 0.5) * d->step[0];
            seen[1] = lo[1] + (j + 0.5) * d->step[1];
            imp__undistort(d, seen, x);
            imp__distort(d, x, back, s);
            if (!(fabs(back[0] - seen[0]) + fabs(back[1] - seen[1]) < 1e-9)) return false;
        }
    return true;
}
