/* SPDX-License-Identifier: Apache-2.0
 *
 * Where rays that leave a surface start. */
#ifndef IMP_MATH_OFFSET_H
#define IMP_MATH_OFFSET_H

#include "base/compiler.h"
#include "vec.h"

/* Origin of a ray leaving p on a surface with geometric normal ng towards d, moved to the
 * side of d by (1 + max|p_k|) eps. Hits are recomputed in double, so what has to be
 * cleared is Embree's own rounding, a few units of 2^-24; Mitsuba takes 1500 of them
 * (docs/scene-format.md 3.1), which shows at grazing angles inside a glowing sphere
 * (tests/grad/closed_forms.c). */
#define IMP_RAY_EPSILON (96 * 0x1p-24)
static inline imp_v3 imp__offset(imp_v3 p, imp_v3 ng, imp_v3 d)
{
    const double scale = imp_max(fabs(p[0]), imp_max(fabs(p[1]), fabs(p[2])));
    return p + ng * copysign((1 + scale) * IMP_RAY_EPSILON, imp__dot(ng, d));
}

#endif
