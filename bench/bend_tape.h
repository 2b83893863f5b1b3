/* SPDX-License-Identifier: Apache-2.0
 *
 * Reverse-mode automatic differentiation as a library would do it: every operation of the
 * tracer is recorded (two parents, two partial derivatives: 24 bytes), then the tape is
 * read backwards. Knows nothing of the adjoint it is compared with. */
#ifndef BENCH_BEND_TAPE_H
#define BENCH_BEND_TAPE_H

#include <stddef.h>

struct tape_cost {
    double bytes;
};

/* bar += d (sum of exit coordinates at z = plane) / d theta, for rays through a grid of
 * `side`^3 numbers on +-half, cubic or trilinear, leapfrog of step t. */
void tape_gradient(const double *theta, int side, int cubic, double half, size_t n,
                   double (*x)[3], double (*d)[3], double t, double plane, double *bar,
                   struct tape_cost *cost);

#endif
