/* SPDX-License-Identifier: Apache-2.0
 *
 * Functions of four doubles at once, some of moderate accuracy for where millions are needed.
 * The same bits on every processor: sums, products, roots and shifts alone. */
#ifndef IMP_MATH_LANES_H
#define IMP_MATH_LANES_H

#include "trig.h"

static inline imp_v3 imp__lanes_clamp(imp_v3 x, double lo, double hi)
{
    const imp_v3 l = imp__spec(lo), h = imp__spec(hi);
    return imp__choose_4(x < l, l, imp__choose_4(x > h, h, x));
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
    p *= imp__root_4(1 - a);
    return imp__choose_4(c < imp__spec(0), IMP_PI - p, p);
}

#endif
