/* SPDX-License-Identifier: Apache-2.0
 *
 * A ray marcher for single scattering, as a yardstick: look-ups in the middle of steps along
 * the ray, and along a shadow ray from each of them. It is biased by its steps, has no
 * derivatives, and is no integrator of the library. */
#ifndef IMP_BENCH_MARCHER_H
#define IMP_BENCH_MARCHER_H

#include <math.h>
#include <stdint.h>

/* Layers of extinction in the unit cube, z = 0 to 1, and a point light outside. */
struct marcher {
    int n; /* layers */
    const float *sigma;
    double albedo, light[3], intensity;
    int64_t lookups;
};

static inline double marcher_lookup(struct marcher *m, double z)
{
    const int i = (int)(z * m->n);
    m->lookups++;
    return (double)m->sigma[i < 0 ? 0 : i < m->n ? i : m->n - 1];
}

/* Optical depth from p towards the light to the cube's wall, in `steps`. */
static inline double marcher_depth(struct marcher *m, const double p[3], int steps)
{
    double d[3], length = 0, reach = INFINITY, depth = 0;
    for (int a = 0; a < 3; a++) d[a] = m->light[a] - p[a];
    for (int a = 0; a < 3; a++) length += d[a] * d[a];
    length = sqrt(length);
    for (int a = 0; a < 3; a++) {
        d[a] /= length;
        if (d[a] != 0) reach = fmin(reach, ((d[a] > 0) - p[a]) / d[a]);
    }
    for (int k = 0; k < steps; k++)
        depth += marcher_lookup(m, p[2] + d[2] * reach * (k + .5) / steps);
    return depth * reach / steps;
}

/* Radiance that leaves the cube at (x, y, 0) against the z axis: light of the lamp that is
 * scattered once, uniformly over directions. */
static inline double marcher_radiance(struct marcher *m, double x, double y, int steps)
{
    double sum = 0, depth = 0;
    for (int k = 0; k < steps; k++) {
        const double p[3] = {x, y, (k + .5) / steps};
        const double sigma = marcher_lookup(m, p[2]), half = sigma / steps / 2;
        double d2 = 0;
        for (int a = 0; a < 3; a++) d2 += (m->light[a] - p[a]) * (m->light[a] - p[a]);
        sum += sigma * m->albedo * m->intensity / (4 * M_PI * d2) *
               exp(-depth - half - marcher_depth(m, p, steps)) / steps;
        depth += 2 * half;
    }
    return sum;
}

#endif
