/* SPDX-License-Identifier: Apache-2.0
 *
 * What materials share in lanes: lobes, among them the Lambertian (lambert.h). */
#ifndef IMP_KIND_BSDF_LANES_H
#define IMP_KIND_BSDF_LANES_H

#include "kind/kind_lanes.h"
#include "math/trig.h"

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "math/warp_text.h"
#include "math/lane_text.h"

extern const struct imp_bsdf_lanes imp__conductor_lanes, imp__dielectric_lanes,
    imp__diffuse_lanes, imp__roughconductor_lanes, imp__twosided_lanes;

static inline imp_wide_truth imp__fronts(const imp_wide3 *wo, const imp_wide3 *wi)
{
    const imp_wide zero = imp__wide(0);
    return (wo->z > zero) & (wi->z > zero);
}
/* The mirror image of wo. */
static inline imp_wide3 imp__mirrors(const imp_wide3 *wo)
{
    return (imp_wide3){-wo->x, -wo->y, wo->z};
}
/* Lobe k where here is true. */
static inline void imp__lobe_set(imp_wide_lobe *lobe, imp_wide_truth here, int k)
{
    *lobe = (*lobe & ~here) | (((imp_wide_lobe){0} + k) & here);
}
static inline imp_wide imp__lamberts(const imp_wide3 *wo, const imp_wide3 *wi)
{
    return imp__wide_choose(imp__fronts(wo, wi), wi->z * IMP_INV_PI, imp__wide(0));
}
/* u as of imp_bsdf_ops.sample. */
static inline imp_wide_truth imp__lambert_samples(const imp_wide u[3],
                                                  const imp_wide3 *wo, imp_wide3 *wi)
{
    *wi = IMP_WIDE_OF(imp__cosine_directions)(u[1], u[2]);
    return imp__fronts(wo, wi);
}

#endif
