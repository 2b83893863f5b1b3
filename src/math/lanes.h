/* SPDX-License-Identifier: Apache-2.0
 *
 * Functions of four doubles at once, where millions of values of moderate accuracy are needed.
 * The same bits on every processor: sums, products, roots and shifts alone. */
#ifndef IMP_MATH_LANES_H
#define IMP_MATH_LANES_H

#include "vec.h"

typedef int64_t imp_lanes_bits __attribute__((vector_size(32)));

/* a where the lanes of `mask` are set, else b. */
static inline imp_v3 imp__lanes_pick(imp_lanes_bits mask, imp_v3 a, imp_v3 b)
{
    return (imp_v3)((mask & (imp_lanes_bits)a) | (~mask & (imp_lanes_bits)b));
}
static inline imp_v3 imp__lanes_clamp(imp_v3 x, double lo, double hi)
{
    const imp_v3 l = imp__spec(lo), h = imp__spec(hi);
    return imp__lanes_pick(x < l, l, imp__lanes_pick(x > h, h, x));
}
static inline imp_v3 imp__lanes_sqrt(imp_v3 x)
{
#ifdef __AVX__
    return (imp_v3)__builtin_ia32_sqrtpd256(x);
#else
    return (imp_v3){sqrt(x[0]), sqrt(x[1]), sqrt(x[2]), sqrt(x[3])};
#endif
}

/* e^x = 2^k e^r, |r| <= ln 2 / 2, by Taylor's series to r^9: to 1e-11. x in [-700, 700]: the
 * nearest of these elsewhere. */
static inline imp_v3 imp__lanes_exp(imp_v3 x)
{
    const double shift = 0x1.8p52; /* x + shift is rounded to a whole number */
    x = imp__lanes_clamp(x, -700, 700);
    const imp_v3 raised = x * 1.44269504088896340736 + shift, k = raised - shift;
    const imp_v3 r = (x - k * 0x1.62e42fefp-1) - k * 0x1.473de6af278edp-34;
    imp_v3 p = r * (1 / 362880.) + 1 / 40320.;
    p = p * r + 1 / 5040.;
    p = p * r + 1 / 720.;
    p = p * r + 1 / 120.;
    p = p * r + 1 / 24.;
    p = p * r + 1 / 6.;
    p = p * r + 0.5;
    p = p * r + 1;
    p = p * r + 1;
    return (imp_v3)((imp_lanes_bits)p + ((imp_lanes_bits)raised << 52));
}

/* Abramowitz and Stegun 4.4.46, to 2e-8; c in [-1, 1]. */
static inline imp_v3 imp__lanes_acos(imp_v3 c)
{
    const imp_v3 a = imp__abs(c);
    imp_v3 p = a * -0.0012624911 + 0.0066700901;
    p = p * a - 0.0170881256;
    p = p * a + 0.0308918810;
    p = p * a - 0.0501743046;
    p = p * a + 0.0889789874;
    p = p * a - 0.2145988016;
    p = p * a + 1.5707963050;
    p *= imp__lanes_sqrt(1 - a);
    return imp__lanes_pick(c < imp__spec(0), IMP_PI - p, p);
}

#endif
