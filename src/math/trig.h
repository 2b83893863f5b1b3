/* SPDX-License-Identifier: Apache-2.0
 *
 * Sine and cosine of a fraction of a turn. Every direction drawn needs one; written out
 * they cost a third of the C library's, and give the same bits with every C library. */
#ifndef IMP_MATH_TRIG_H
#define IMP_MATH_TRIG_H

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

#endif
