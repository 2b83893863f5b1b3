/* SPDX-License-Identifier: Apache-2.0
 *
 * Directions about a direction of travel. */
#ifndef IMP_KIND_PHASE_TURN_H
#define IMP_KIND_PHASE_TURN_H

#include "math/vec.h"
#include <importon/lobes.h>

/* Light that travels along -wo has turned by an angle of this cosine; u: azimuth. */
static inline imp_v3 imp__turn(imp_v3 wo, double cosine, double u)
{
    const imp_v3 along = imp__normalize(-wo);
    imp_v3 w;
    imp_about(&along, cosine, u, &w);
    return w;
}

#endif
