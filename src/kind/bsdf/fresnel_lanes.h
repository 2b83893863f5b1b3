/* SPDX-License-Identifier: Apache-2.0
 *
 * Fresnel reflectance in lanes: imp__conductor and imp__dielectric, of so many numbers as a register
 * holds. */
#ifndef IMP_KIND_BSDF_FRESNEL_LANES_H
#define IMP_KIND_BSDF_FRESNEL_LANES_H

#include "math/wide_real.h"

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "kind/bsdf/conductor_text.h"
#include "math/lane_text.h"
#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "kind/bsdf/dielectric_text.h"
#include "math/lane_text.h"

#endif
