/* SPDX-License-Identifier: Apache-2.0
 *
 * Sines, cosines and angles, a text in lanes (lane_text.h). */

/* |x| <= pi/4: Taylor polynomials, cut where the next term is below 2^-54, in pairs
 * (Estrin) because a chain of eight dependent products would wait for itself. */
static inline real WIDE(imp__sin_eighth)(real x)
{
    const real z = x * x, z2 = z * z, z4 = z2 * z2;
    const real p = (-1. / 6 + z * (1. / 120)) + z2 * (-1. / 5040 + z * (1. / 362880));
    const real q = (-1. / 39916800 + z * (1. / 6227020800)) - z2 * (1. / 1307674368000);
    return x + x * (z * (p + z4 * q));
}
static inline real WIDE(imp__cos_eighth)(real x)
{
    const real z = x * x, z2 = z * z, z4 = z2 * z2;
    const real p = (1. / 24 + z * (-1. / 720)) + z2 * (1. / 40320 + z * (-1. / 3628800));
    const real q =
        (1. / 479001600 + z * (-1. / 87178291200)) + z2 * (1. / 20922789888000);
    return 1 + (z * -0.5 + z2 * (p + z4 * q));
}

/* Angles of the vectors (x, y), y >= 0 and not both 0: in [0, pi], to 2^-51. With
 * t, the smaller of |x| and y over the larger, atan t = atan c + atan s, s = (t - c) / (1 + c
 * t), where c is the one of 0, 1/2 and 1 for which |s| < .24; then the series, cut where the
 * next term is below 2^-54. */
static inline real WIDE(imp__angles)(real x, real y)
{
    const real zero = number(0), ax = magnitude(x), half = number(0.5), one = number(1);
    const real small = choose(y > ax, ax, y), large = choose(y > ax, y, ax);
    const real c =
        choose(small > large * 0.75, one, choose(small > large * 0.236, half, zero));
    const real atan_c = choose(c == 1, number(IMP_PI / 4),
                               choose(c > 0, number(0.46364760900080611621), zero));
    const real s = (small - c * large) / (large + c * small);
    const real z = s * s, z2 = z * z, z4 = z2 * z2;
    const real p = (-1. / 3 + z * (1. / 5)) + z2 * (-1. / 7 + z * (1. / 9));
    const real q = (-1. / 11 + z * (1. / 13)) + z2 * (-1. / 15 + z * (1. / 17));
    const real r = (-1. / 19 + z * (1. / 21)) + z2 * (-1. / 23);
    const real t = atan_c + (s + s * (z * (p + z4 * (q + z4 * r))));
    const real a = choose(y > ax, IMP_PI / 2 - t, t);
    return choose(x < 0, IMP_PI - a, a);
}

/* Angles of the vectors (x, y), in (-pi, pi], to 2^-51; 0 of the vector 0. */
static inline real WIDE(imp__angles_signed)(real x, real y)
{
    const real high = magnitude(y);
    const real a = WIDE(imp__angles)(choose((x == 0) & (high == 0), number(1), x), high);
    return choose(y < 0, -a, a);
}
