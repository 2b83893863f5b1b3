/* SPDX-License-Identifier: Apache-2.0
 *
 * lobes.h: directions about an axis, for authors of kinds: a lobe that is a power of the
 * cosine, and the direction at an angle. A material that draws by
 *
 *     p(w) = (n + 1)/(2 pi) max(0, cos)^n,    cos = axis . w
 *
 * calls imp_lobe_sample with the mirror direction for an axis (Phong), with the half vector's
 * normal (Blinn), or with the normal and n = 1 (cosine/pi, the density of a diffuse surface);
 * imp_lobe_pdf is the density of that. A phase function calls imp_about with its axis along
 * the light's travel, -wo.
 *
 * Vectors are of any frame, the answer is of the same; axes have length 1.
 */
#ifndef IMPORTON_LOBES_H
#define IMPORTON_LOBES_H

#include <importon/kinds.h>
#include <math.h>

#define IMP_LOBE_TURN 6.28318530717958647693 /* 2 pi */

/** Two unit vectors that with n make a right-handed orthonormal frame, without a branch
 * (Duff et al., "Building an Orthonormal Basis, Revisited", 2017). */
static inline void imp_frame_about(const imp_v3 *n, imp_v3 *s, imp_v3 *t)
{
    const double x = (*n)[0], y = (*n)[1], z = (*n)[2];
    const double sign = copysign(1, z), a = -1 / (sign + z), b = x * y * a;
    const imp_v3 first = {1 + sign * x * x * a, sign * b, -sign * x, 0};
    const imp_v3 second = {b, sign + y * y * a, -y, 0};
    *s = first;
    *t = second;
}

/** The direction whose angle with the axis has this cosine; u in [0, 1) is the azimuth, in
 * turns. */
static inline void imp_about(const imp_v3 *axis, double cosine, double u, imp_v3 *w)
{
    const double rest = 1 - cosine * cosine, r = sqrt(rest > 0 ? rest : 0);
    const double phi = IMP_LOBE_TURN * u;
    imp_v3 s, t;
    imp_frame_about(axis, &s, &t);
    *w = s * (r * cos(phi)) + t * (r * sin(phi)) + *axis * cosine;
}

/** Draw w by u[0], u[1] in [0, 1) with density imp_lobe_pdf(n, axis . w); n > -1. */
static inline void imp_lobe_sample(const imp_v3 *axis, double n, const double u[2],
                                   imp_v3 *w)
{
    imp_about(axis, pow(1 - u[0], 1 / (n + 1)), u[1], w);
}

/** That density, per steradian; 0 from a cosine of 0 on. */
static inline double imp_lobe_pdf(double n, double cosine)
{
    return cosine > 0 ? (n + 1) / IMP_LOBE_TURN * pow(cosine, n) : 0;
}

#endif
