/* SPDX-License-Identifier: Apache-2.0
 *
 * Sine and cosine of a fraction of a turn, and angles of vectors. Every direction drawn needs
 * the former; every hit of a sphere, direction to a photometric file, pixel of a sky and edge of a
 * form factor the latter. Written out they cost a third of the C library's, and give the same bits
 * with every C library. */
#ifndef IMP_MATH_TRIG_H
#define IMP_MATH_TRIG_H

#include "vec.h"

/* |x| <= pi/4: Taylor polynomials, cut where the next term is below 2^-54, in pairs
 * (Estrin) because a chain of eight dependent products would wait for itself. */
static inline double imp__sin_eighth(double x)
{
    const double z = x * x, z2 = z * z, z4 = z2 * z2;
    const double p = (-1. / 6 + z * (1. / 120)) + z2 * (-1. / 5040 + z * (1. / 362880));
    const double q = (-1. / 39916800 + z * (1. / 6227020800)) - z2 * (1. / 1307674368000);
    return x + x * (z * (p + z4 * q));
}
static inline double imp__cos_eighth(double x)
{
    const double z = x * x, z2 = z * z, z4 = z2 * z2;
    const double p =
        (1. / 24 + z * (-1. / 720)) + z2 * (1. / 40320 + z * (-1. / 3628800));
    const double q =
        (1. / 479001600 + z * (-1. / 87178291200)) + z2 * (1. / 20922789888000);
    return 1 + (z * -0.5 + z2 * (p + z4 * q));
}

/* sin and cos of 2 pi u, |u| < 2^20. */
static inline void imp__sincos_turn(double u, double *s, double *c)
{
    const double four = 4 * u,
                 quarter = (double)(long long)(four + (four < 0 ? -0.5 : 0.5));
    const double x = (four - quarter) * 1.57079632679489661923;
    const double a = imp__sin_eighth(x), b = imp__cos_eighth(x);
    switch ((long long)quarter & 3) {
    case 0: *s = a, *c = b; break;
    case 1: *s = b, *c = -a; break;
    case 2: *s = -a, *c = -b; break;
    default: *s = -b, *c = a; break;
    }
}

/* a where `first`, else b. */
static inline imp_v3 imp__lanes_choose(__typeof__((imp_v3){0} > 0) first, imp_v3 a,
                                       imp_v3 b)
{
    typedef __typeof__(first) mask;
    return (imp_v3)(((mask)a & first) | ((mask)b & ~first));
}

/* Angles of the vectors (x, y), one a lane, y >= 0 and not both 0: in [0, pi], to 2^-51. With
 * t, the smaller of |x| and y over the larger, atan t = atan c + atan s, s = (t - c) / (1 + c
 * t), where c is the one of 0, 1/2 and 1 for which |s| < .24; then the series, cut where the
 * next term is below 2^-54. */
static inline imp_v3 imp__angles(imp_v3 x, imp_v3 y)
{
    const imp_v3 zero = {0}, ax = imp__abs(x), half = imp__spec(0.5), one = imp__spec(1);
    const imp_v3 small = imp__lanes_choose(y > ax, ax, y),
                 large = imp__lanes_choose(y > ax, y, ax);
    const imp_v3 c = imp__lanes_choose(
        small > large * 0.75, one, imp__lanes_choose(small > large * 0.236, half, zero));
    const imp_v3 atan_c = imp__lanes_choose(
        c == 1, imp__spec(IMP_PI / 4),
        imp__lanes_choose(c > 0, imp__spec(0.46364760900080611621), zero));
    const imp_v3 s = (small - c * large) / (large + c * small);
    const imp_v3 z = s * s, z2 = z * z, z4 = z2 * z2;
    const imp_v3 p = (-1. / 3 + z * (1. / 5)) + z2 * (-1. / 7 + z * (1. / 9));
    const imp_v3 q = (-1. / 11 + z * (1. / 13)) + z2 * (-1. / 15 + z * (1. / 17));
    const imp_v3 r = (-1. / 19 + z * (1. / 21)) + z2 * (-1. / 23);
    const imp_v3 t = atan_c + (s + s * (z * (p + z4 * (q + z4 * r))));
    const imp_v3 a = imp__lanes_choose(y > ax, IMP_PI / 2 - t, t);
    return imp__lanes_choose(x < 0, IMP_PI - a, a);
}

/* Angles of the vectors (x, y), one a lane, in (-pi, pi], to 2^-51; 0 of the vector 0. */
static inline imp_v3 imp__angles_signed(imp_v3 x, imp_v3 y)
{
    const imp_v3 high = imp__abs(y);
    const imp_v3 a =
        imp__angles(imp__lanes_choose((x == 0) & (high == 0), imp__spec(1), x), high);
    return imp__lanes_choose(y < 0, -a, a);
}

#endif
