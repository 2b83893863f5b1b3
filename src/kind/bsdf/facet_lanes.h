/* SPDX-License-Identifier: Apache-2.0
 *
 * Small facets in lanes: GGX, of visible normals (microfacet.c). */
#ifndef IMP_KIND_BSDF_FACET_LANES_H
#define IMP_KIND_BSDF_FACET_LANES_H

#include "bsdf_lanes.h"
#include "roughness.h"

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "kind/bsdf/microfacet_text.h"
#include "math/lane_text.h"
#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "kind/bsdf/microfacet_score_text.h"
#include "math/lane_text.h"

static inline bool imp__facets_cover(const struct imp__roughness *r)
{
    return r->type == IMP_GGX && r->visible;
}

/* in: the three inputs. */
static inline void imp__roughness_lanes(const struct imp__roughness *r,
                                        const struct imp_wide_color *in, imp_wide *au,
                                        imp_wide *av)
{
    const imp_wide least = imp__wide(IMP_ALPHA_MIN);
    *au = imp__wide_larger(in[r->anisotropic ? 1 : 0].c[0], least);
    *av = imp__wide_larger(in[r->anisotropic ? 2 : 0].c[0], least);
}

/* ggx_visible: a normal for wo, wo.z > 0. */
static inline imp_wide3 imp__ggx_visible_normals(imp_wide au, imp_wide av,
                                                 const imp_wide3 *wo, const imp_wide u[2])
{
    const imp_wide zero = imp__wide(0);
    imp_wide si, co;
    const imp_wide3 w = imp__wide3_unit((imp_wide3){au * wo->x, av * wo->y, wo->z});
    const imp_wide phi = IMP_2PI * u[0], z = (1 - u[1]) * (1 + w.z) - w.z;
    const imp_wide r = imp__wide_root(imp__wide_larger((1 - z) * (1 + z), zero));
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        si[k] = sin(phi[k]);
        co[k] = cos(phi[k]);
    }
    const imp_wide3 cap = imp__wide3_plus((imp_wide3){r * co, r * si, z}, w);
    return imp__wide3_unit(
        (imp_wide3){au * cap.x, av * cap.y, imp__wide_larger(cap.z, zero)});
}

/* imp__microfacet_sample: a part of them where D changes, one by one. */
static inline imp_wide3 imp__ggx_normals(imp_wide au, imp_wide av, unsigned wanted,
                                         const imp_wide3 *wo, const imp_wide u[2])
{
    const double below = 0x1.fffffffffffffp-1;
    if (imp_likely(!wanted)) return imp__ggx_visible_normals(au, av, wo, u);
    const imp_wide share = IMP_WIDE_OF(imp__facets_share)(au, av);
    const imp_wide_truth parted = share > imp__wide(0);
    const imp_wide rest = imp__wide_clamp((u[0] - share) / (1 - share), 0, below);
    const imp_wide own[2] = {imp__wide_choose(parted, rest, u[0]), u[1]};
    imp_wide3 h = imp__ggx_visible_normals(au, av, wo, own);
    for (unsigned left = imp__wide_bits(parted & (u[0] < share)); left;
         left &= left - 1) {
        const int k = __builtin_ctz(left);
        const struct imp__microfacet f = {IMP_GGX, true, au[k], av[k], wanted};
        const double v[2] = {imp_min(u[0][k] / share[k], below), u[1][k]};
        imp__wide3_set(&h, k, imp__score_sample(&f, v));
    }
    return h;
}

/* imp__microfacet_pdf_of: the density of that normal h, where D of it and G1 of wo are known; vm =
 * wo.h. */
static inline imp_wide imp__ggx_normals_pdf(imp_wide au, imp_wide av, unsigned wanted,
                                            const imp_wide3 *wo, const imp_wide3 *h,
                                            imp_wide vm, imp_wide D, imp_wide G1)
{
    imp_wide p = D * G1 * vm / wo->z;
    if (imp_unlikely(wanted != 0)) {
        const imp_wide share = IMP_WIDE_OF(imp__facets_share)(au, av),
                       score = IMP_WIDE_OF(imp__ggx_score_pdf)(au, av, h->x, h->y, h->z,
                                                               D, wanted);
        p = imp__wide_choose(share > imp__wide(0), p + share * (score - p), p);
    }
    return imp__wide_choose(vm > imp__wide(0), p, imp__wide(0));
}

/* The mirror image of wo in h, which it is before. */
static inline imp_wide3 imp__mirrors_in(const imp_wide3 *wo, const imp_wide3 *h,
                                        imp_wide c)
{
    return imp__wide3_unit(imp__wide3_minus(imp__wide3_times(*h, 2 * c), *wo));
}

#endif
