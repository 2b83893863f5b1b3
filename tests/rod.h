/* SPDX-License-Identifier: Apache-2.0
 *
 * A rod: light goes to and fro along one line. Eight cells of width 1/8, one of them
 * empty, scatter half of it back; light enters at both ends, and what leaves at the left
 * is read. The exact answer is that of the two-stream equations
 *
 *     dL+/dx = -sigma L+ + sigma albedo (L+ + L-)/2,    -dL-/dx = the same for L- */
#ifndef IMP_TEST_ROD_H
#define IMP_TEST_ROD_H

#include <math.h>
#include <string.h>

enum { ROD_CELLS = 8 };
#define ROD_LEFT  .2
#define ROD_RIGHT 1.

static const float rod_sigma[ROD_CELLS] = {4, 0, 2, 8, .05f, 6, 3, 1};
static const float rod_albedo[ROD_CELLS] = {.9f, .5f, .99f, .2f, .9f, .8f, .95f, .6f};

/* What leaves at the left. Of a cell of optical depth t and albedo a the equations have
 * eigenvalues +-k, k^2 = 1 - a, in units of t. */
static inline double rod_exact(const double s[ROD_CELLS], const double a[ROD_CELLS])
{
    double m[2][2] = {{1, 0}, {0, 1}}; /* (L+, L-) at the left to that at the right */
    for (int i = 0; i < ROD_CELLS; i++) {
        const double t = s[i] / ROD_CELLS, k = sqrt(1 - a[i]), h = a[i] / 2;
        const double C = cosh(k * t), S = k > 0 ? sinh(k * t) / k : t;
        const double e[2][2] = {{C - (1 - h) * S, h * S}, {-h * S, C + (1 - h) * S}};
        double next[2][2];
        for (int r = 0; r < 2; r++)
            for (int c = 0; c < 2; c++)
                next[r][c] = e[r][0] * m[0][c] + e[r][1] * m[1][c];
        memcpy(m, next, sizeof m);
    }
    return (ROD_RIGHT - m[1][0] * ROD_LEFT) / m[1][1];
}

/* Its derivative with respect to the extinction of a cell, or the albedo. */
static inline double rod_derivative(int cell, int of_albedo)
{
    double s[ROD_CELLS], a[ROD_CELLS], out[2];
    const double h = 1e-5;
    for (int i = 0; i < ROD_CELLS; i++) {
        s[i] = (double)rod_sigma[i];
        a[i] = (double)rod_albedo[i];
    }
    double *x = of_albedo ? &a[cell] : &s[cell];
    *x += h;
    out[0] = rod_exact(s, a);
    *x -= 2 * h; /* of the empty cell a formal one: the formula is analytic */
    out[1] = rod_exact(s, a);
    return (out[0] - out[1]) / (2 * h);
}

#endif
