/* SPDX-License-Identifier: Apache-2.0
 *
 * Exponential function of four numbers at a time: what media let through in their channels. It has
 * the same bits with every C library. */
#ifndef IMP_MATH_EXP_H
#define IMP_MATH_EXP_H

#include "trig.h"
#include <math.h>

/* exp(x), one a lane, to 2^-52.5 of itself; 0 below -708, where it would be less than the least
 * normal number, and infinite above 709. With k the nearest integer to x/ln 2,
 *
 *     exp(x) = 2^k exp(r),    r = x - k ln 2,  |r| <= ln(2)/2,
 *
 * where ln 2 is the sum of a number of 20 bits, whose product with k is exact, and a small one; then
 * Taylor's series, cut where the next term is below 2^-57. */
static inline imp_v3 imp__exp(imp_v3 x)
{
    typedef __typeof__((imp_v3){0} > 0) bits;
    const imp_v3 shift = imp__spec(0x1.8p52); /* its last bit counts ones */
    const imp_v3 t = x * 1.44269504088896340736 + shift, k = t - shift;
    const imp_v3 r = (x - k * 0x1.62e4p-1) - k * 0x1.7f7d1cf79abcap-20;
    const imp_v3 z = r * r, z2 = z * z, z4 = z2 * z2;
    const imp_v3 a = (1. / 2 + r * (1. / 6)) + z * (1. / 24 + r * (1. / 120));
    const imp_v3 b = (1. / 720 + r * (1. / 5040)) + z * (1. / 40320 + r * (1. / 362880));
    const imp_v3 c = (1. / 3628800 + r * (1. / 39916800)) +
                     z * (1. / 479001600 + r * (1. / 6227020800));
    const imp_v3 e = 1 + (r + z * ((a + z2 * b) + z4 * c));
    const imp_v3 power = (imp_v3)(((bits)t - (bits)shift + 1023) << 52);
    const imp_v3 least = imp__choose_4(x < -708, (imp_v3){0}, e * power);
    return imp__choose_4(x > 709, imp__spec(INFINITY), least);
}

#endif
