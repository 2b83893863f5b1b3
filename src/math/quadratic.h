/* SPDX-License-Identifier: Apache-2.0
 *
 * Both roots of a t^2 - 2 b t + c = 0 from e = (b^2 - a c)/a, which is known without
 * cancellation where rays meet round shapes; the small root comes from the product of the roots,
 * so that no digits are lost far away (Haines et al., Ray Tracing Gems, ch. 7). */
#ifndef IMP_MATH_QUADRATIC_H
#define IMP_MATH_QUADRATIC_H

#include "vec.h"
#include <math.h>

/* a > 0, e >= 0; t[0] <= t[1]. */
static inline void imp__quadratic_roots(double a, double b, double c, double e,
                                        double t[2])
{
    const double q = b + copysign(sqrt(a * e), b);
    const double ta = q / a, tb = q != 0 ? c / q : ta;
    t[0] = imp_min(ta, tb);
    t[1] = imp_max(ta, tb);
}

#endif
