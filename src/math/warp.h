/* SPDX-License-Identifier: Apache-2.0
 *
 * From the unit square to directions and points: each warp with its density, and its
 * inverse where a guide needs it.
 */
#ifndef IMP_MATH_WARP_H
#define IMP_MATH_WARP_H

#include "pair.h"
#include "trig.h"
#include "vec.h"

/* Uniform unit disk, concentric map (Shirley and Chiu 1997). Density 1/pi. */
static inline void imp__concentric_disk(const double u[2], double xy[2])
{
    const double a = 2 * u[0] - 1, b = 2 * u[1] - 1;
    if (a == 0 && b == 0) {
        xy[0] = xy[1] = 0;
        return;
    }
    /* phi = pi/4 b/a, or pi/2 - pi/4 a/b: sine and cosine change places. */
    const imp_pair_mask wide = imp__pair_exceeds(fabs(a), fabs(b));
    const imp_pair larger = imp__pair_choose(wide, (imp_pair){a, b}, (imp_pair){b, a});
    const double r = larger[0], x = IMP_PI / 4 * (larger[1] / r);
    const double s = imp__sin_eighth_1(x), c = imp__cos_eighth_1(x);
    const imp_pair p = imp__pair_choose(wide, (imp_pair){c, s}, (imp_pair){s, c});
    xy[0] = r * p[0];
    xy[1] = r * p[1];
}
static inline void imp__concentric_disk_inverse(const double xy[2], double u[2])
{
    const double r = hypot(xy[0], xy[1]);
    double phi = atan2(xy[1], xy[0]);
    if (phi < -IMP_PI / 4) phi += IMP_2PI;
    double a, b;
    if (phi < IMP_PI / 4) {
        a = r;
        b = phi * a / (IMP_PI / 4);
    } else if (phi < 3 * IMP_PI / 4) {
        b = r;
        a = (IMP_PI / 2 - phi) * b / (IMP_PI / 4);
    } else if (phi < 5 * IMP_PI / 4) {
        a = -r;
        b = (phi - IMP_PI) * a / (IMP_PI / 4);
    } else {
        b = -r;
        a = -(phi - 3 * IMP_PI / 2) * b / (IMP_PI / 4);
    }
    u[0] = (a + 1) / 2;
    u[1] = (b + 1) / 2;
}

/* Cosine-weighted hemisphere about +z (Malley). Density cos/pi. */
static inline imp_v3 imp__cosine_hemisphere(const double u[2])
{
    double d[2];
    imp__concentric_disk(u, d);
    return imp__v3(d[0], d[1], sqrt(imp_max(0, 1 - d[0] * d[0] - d[1] * d[1])));
}
static inline double imp__cosine_hemisphere_pdf(imp_v3 w)
{
    return w[2] > 0 ? w[2] * IMP_INV_PI : 0;
}
static inline void imp__cosine_hemisphere_inverse(imp_v3 w, double u[2])
{
    const double d[2] = {w[0], w[1]};
    imp__concentric_disk_inverse(d, u);
}

/* Uniform sphere. Density 1/(4 pi). */
static inline imp_v3 imp__uniform_sphere(const double u[2])
{
    const double z = 1 - 2 * u[0], r = sqrt(imp_max(0, 1 - z * z));
    double s, c;
    imp__sincos_turn(u[1], &s, &c);
    return imp__v3(r * c, r * s, z);
}

/* Uniform triangle: barycentric weights of the second and third vertex. Density 1/area.
 * The square is folded along its diagonal: no root, no branch, and neighbours stay
 * neighbours (Heitz, "A Low-Distortion Map Between Triangle and Square", 2019). */
static inline void imp__uniform_triangle(const double u[2], double b[2])
{
    const double half = 0.5 * imp_min(u[0], u[1]);
    b[0] = u[0] - half;
    b[1] = u[1] - half;
}
static inline void imp__uniform_triangle_inverse(const double b[2], double u[2])
{
    const double least = imp_min(b[0], b[1]);
    u[0] = b[0] + least;
    u[1] = b[1] + least;
}

#endif
