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

/* These facets, without a part of the draws for a derivative that is wanted. The first of the three
 * inputs of roughness.h has bit `first`. */
static inline bool imp__facets_cover(const struct imp__roughness *r, uint64_t derivative,
                                     int first)
{
    const struct imp_dirs d = {.derivative = derivative};
    const imp_spec in[3] = {imp__spec(1), imp__spec(1), imp__spec(1)};
    return r->type == IMP_GGX && r->visible &&
           !imp__roughness_drawn(r, in, &d, first).wanted;
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
static inline imp_wide3 imp__ggx_normals(imp_wide au, imp_wide av, const imp_wide3 *wo,
                                         const imp_wide u[2])
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

/* imp__microfacet_pdf_of: the density of that normal h, where D of it and G1 of wo are known; vm =
 * wo.h. */
static inline imp_wide imp__ggx_normals_pdf(const imp_wide3 *wo, imp_wide vm, imp_wide D,
                                            imp_wide G1)
{
    return imp__wide_choose(vm > imp__wide(0), D * G1 * vm / wo->z, imp__wide(0));
}

/* The mirror image of wo in h, which it is before. */
static inline imp_wide3 imp__mirrors_in(const imp_wide3 *wo, const imp_wide3 *h,
                                        imp_wide c)
{
    return imp__wide3_unit(imp__wide3_minus(imp__wide3_times(*h, 2 * c), *wo));
}

#endif
