/* SPDX-License-Identifier: Apache-2.0
 *
 * What materials share in lanes: lobes, among them the Lambertian (lambert.h). */
#ifndef IMP_KIND_BSDF_LANES_H
#define IMP_KIND_BSDF_LANES_H

#include "blending.h"
#include "kind/kind_lanes.h"
#include "math/trig.h"

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "math/warp_text.h"
#include "math/lane_text.h"

extern const struct imp_bsdf_lanes imp__conductor_lanes, imp__dielectric_lanes,
    imp__diffuse_lanes, imp__plastic_lanes, imp__principled_lanes,
    imp__principled_clear_lanes, imp__roughconductor_lanes, imp__roughdielectric_lanes,
    imp__roughplastic_lanes, imp__twosided_lanes;

/* sample, pdf_eval and eval_d of struct imp_bsdf_lanes, compiled for both values of a condition on the
 * material, which is their first argument: sample_as, pdf_eval_as, eval_d_as. */
#define IMP_EITHER_WAY static inline __attribute__((always_inline))
#define IMP_KERNEL_BY(is)                                                                \
    static imp_wide_truth sample_lanes(                                                  \
        const struct imp_bsdf *b, uint64_t derivative, const struct imp_wide_color *in,  \
        const imp_wide3 *wo, const imp_wide u[3], imp_wide3 *wi, imp_wide_lobe *lobe)    \
    {                                                                                    \
        return imp_likely(is(b)) ? sample_as(true, b, derivative, in, wo, u, wi, lobe)   \
                                 : sample_as(false, b, derivative, in, wo, u, wi, lobe); \
    }                                                                                    \
    static imp_wide pdf_eval_lanes(const struct imp_bsdf *b, uint64_t derivative,        \
                                   const struct imp_wide_color *in, const imp_wide3 *wo, \
                                   const imp_wide3 *wi, const imp_wide_lobe *lobe,       \
                                   int colors, struct imp_wide_color *f)                 \
    {                                                                                    \
        return imp_likely(is(b))                                                         \
                   ? pdf_eval_as(true, b, derivative, in, wo, wi, lobe, colors, f)       \
                   : pdf_eval_as(false, b, derivative, in, wo, wi, lobe, colors, f);     \
    }                                                                                    \
    static bool eval_d_lanes(const struct imp_bsdf *b, const struct imp_wide_color *in,  \
                             const imp_wide3 *wo, const imp_wide3 *wi,                   \
                             const imp_wide_lobe *lobe, int colors,                      \
                             struct imp_wide_color *d)                                   \
    {                                                                                    \
        return imp_likely(is(b)) ? eval_d_as(true, b, in, wo, wi, lobe, colors, d)       \
                                 : eval_d_as(false, b, in, wo, wi, lobe, colors, d);     \
    }

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
static inline imp_wide imp__wide_clamp(imp_wide x, double lo, double hi)
{
    return imp__wide_larger(imp__wide_lesser(x, imp__wide(hi)), imp__wide(lo));
}
/* imp__coated_chance (blending.h). */
static inline imp_wide imp__coated_chances(const struct imp_wide_color *coat,
                                           const struct imp_wide_color *base,
                                           uint64_t derivative, imp_wide F,
                                           uint64_t wanted)
{
    const imp_wide least = imp__wide(imp__coated_least(derivative));
    const imp_wide most[2] = {
        imp__wide_larger(coat->c[0], imp__wide_larger(coat->c[1], coat->c[2])),
        imp__wide_larger(base->c[0], imp__wide_larger(base->c[1], base->c[2]))};
    const imp_wide s = F * imp__wide_larger(most[0], least),
                   r = (1 - F) * imp__wide_larger(most[1], least);
    const imp_wide q = imp__wide_choose(s + r > imp__wide(0), s / (s + r), imp__wide(1));
    return derivative ? imp__wide_clamp(q, imp__coat_least(derivative, wanted),
                                        1 - IMP_MIXING_LEAST)
                      : q;
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
