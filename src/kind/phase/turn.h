/* SPDX-License-Identifier: Apache-2.0
 *
 * Directions about a direction of travel. */
#ifndef IMP_KIND_PHASE_TURN_H
#define IMP_KIND_PHASE_TURN_H

#include "math/trig.h"
#include "math/vec.h"

/* Light that travels along -wo has turned by an angle of this cosine; u: azimuth. */
static inline imp_v3 imp__turn(imp_v3 wo, double cosine, double u)
{
    const struct imp_frame f = imp__frame_from_normal(imp__normalize(-wo));
    const double s = sqrt(imp_max(0.0, 1 - cosine * cosine)), phi = IMP_2PI * u;
    return imp__to_world(&f, imp__v3(s * cos(phi), s * sin(phi), cosine));
}

#endif
