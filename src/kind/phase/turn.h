/* SPDX-License-Identifier: Apache-2.0
 *
 * Directions about a direction of travel. */
#ifndef IMP_KIND_PHASE_TURN_H
#define IMP_KIND_PHASE_TURN_H

#include "math/trig.h"

#define IMP_WIDE 1
#define IMP_TEXT "math/vec_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 1
#define IMP_TEXT "kind/phase/turn_text.h"
#include "math/lane_text.h"

/* Light that travels along -wo has turned by an angle of this cosine; u: azimuth. */
static inline imp_v3 imp__turn(imp_v3 wo, double cosine, double u)
{
    const struct imp_real3_1 from = {wo[0], wo[1], wo[2]};
    double sin_u, cos_u;
    imp__sincos_turn(u, &sin_u, &cos_u);
    const struct imp_real3_1 w = imp__turned_1(from, cosine, sin_u, cos_u);
    return imp__v3(w.x, w.y, w.z);
}

#endif
