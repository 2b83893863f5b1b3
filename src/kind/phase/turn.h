/* SPDX-License-Identifier: Apache-2.0
 *
 * Directions about a direction of travel. */
#ifndef IMP_KIND_PHASE_TURN_H
#define IMP_KIND_PHASE_TURN_H

#include "math/trig.h"
#include <importon/lobes.h>

/* Light that travels along -wo has turned by an angle of this cosine; u: azimuth. */
static inline imp_v3 imp__turn(imp_v3 wo, double cosine, double u)
{
    const imp_v3 along = imp__normalize(-wo);
    const double r = sqrt(imp_max(1 - cosine * cosine, 0.0));
    double sin_u, cos_u;
    imp_v3 s, t;
    imp_frame_about(&along, &s, &t);
    imp__sincos_turn(u, &sin_u, &cos_u);
    return s * (r * cos_u) + t * (r * sin_u) + along * cosine;
}

#endif
