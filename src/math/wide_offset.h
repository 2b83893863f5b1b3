/* SPDX-License-Identifier: Apache-2.0
 *
 * imp__offset in lanes: where rays leave a surface. */
#ifndef IMP_MATH_WIDE_OFFSET_H
#define IMP_MATH_WIDE_OFFSET_H

#include "offset.h"
#include "wide_real.h"

static inline imp_wide3 imp__wide_offset(imp_wide3 p, imp_wide3 ng, imp_wide3 d)
{
    const imp_wide scale = imp__wide_larger(
        imp__wide_magnitude(p.x),
        imp__wide_larger(imp__wide_magnitude(p.y), imp__wide_magnitude(p.z)));
    return imp__wide3_plus(
        p, imp__wide3_times(ng, imp__wide_signed_as((1 + scale) * IMP_RAY_EPSILON,
                                                    imp__wide3_inner(ng, d))));
}

#endif
