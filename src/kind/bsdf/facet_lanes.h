/* SPDX-License-Identifier: Apache-2.0
 *
 * Small facets in lanes (microfacet.c). Visible normals of GGX are drawn in lanes, others one by one;
 * Beckmann's exponentials and error functions are the C library's, one by one, too. */
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

/* struct imp__microfacet. */
struct imp__facets {
    enum imp__distribution type;
    bool visible;
    unsigned wanted;
    imp_wide au, av;
    imp_wide_truth here; /* lanes that count */
};
/* Most are so: what is compiled for them knows it (`ggx`). */
static inline bool imp__are_ggx_visible(const struct imp_bsdf *b)
{
    const struct imp__roughness *r = b->self;
    return r->type == IMP_GGX && r->visible;
}
/* in: the three inputs. */
static inline struct imp__facets imp__roughness_lanes(const bool ggx,
                                                      const struct imp__roughness *r,
                                                      const struct imp_wide_color *in,
                                                      imp_wide_truth here)
{
    const imp_wide least = imp__wide(IMP_ALPHA_MIN);
    return (struct imp__facets){ggx ? IMP_GGX : r->type,
                                ggx || r->visible,
                                0,
                                imp__wide_larger(in[r->anisotropic ? 1 : 0].c[0], least),
                                imp__wide_larger(in[r->anisotropic ? 2 : 0].c[0], least),
                                here};
}
/* imp__roughness_drawn. */
static inline struct imp__facets
imp__roughness_drawn_lanes(const bool ggx, const struct imp__roughness *r,
                           const struct imp_wide_color *in, imp_wide_truth here,
                           uint64_t derivative, int first)
{
    struct imp__facets f = imp__roughness_lanes(ggx, r, in, here);
    f.wanted = imp__roughness_wanted(r, derivative, first);
    return f;
}
static inline struct imp__microfacet imp__facets_lane(const struct imp__facets *f, int k)
{
    return (struct imp__microfacet){f->type, f->visible, f->au[k], f->av[k], f->wanted};
}

/* ---- D and G1 ------------------------------------------------------------------------ */

static __attribute__((noinline, unused)) imp_wide
imp__beckmann_d(const struct imp__facets *f, const imp_wide3 *m)
{
    const imp_wide q = IMP_WIDE_OF(imp__beckmann_q)(f->au, f->av, *m);
    imp_wide e = imp__wide(0);
    for (unsigned left = imp__wide_bits(f->here); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        e[k] = exp(-q[k]);
    }
    return IMP_WIDE_OF(imp__beckmann_d_of)(f->au, f->av, m->z, e);
}
/* imp__microfacet_d. */
static inline imp_wide imp__facets_d(const struct imp__facets *f, imp_wide3 m)
{
    return imp_likely(f->type == IMP_GGX) ? IMP_WIDE_OF(imp__ggx_d)(f->au, f->av, m)
                                          : imp__beckmann_d(f, &m);
}
static inline void imp__facets_d_log(const struct imp__facets *f, imp_wide3 m,
                                     imp_wide d[2])
{
    if (imp_likely(f->type == IMP_GGX)) IMP_WIDE_OF(imp__ggx_d_log)(f->au, f->av, m, d);
    else IMP_WIDE_OF(imp__beckmann_d_log)(f->au, f->av, m, d);
}
/* imp__microfacet_g1. */
static inline imp_wide imp__facets_g1(const struct imp__facets *f, imp_wide3 v)
{
    imp_wide d[2];
    return imp_likely(f->type == IMP_GGX)
               ? IMP_WIDE_OF(imp__ggx_g1)(f->au, f->av, v)
               : IMP_WIDE_OF(imp__beckmann_g1_d)(f->au, f->av, v, d);
}
static inline imp_wide imp__facets_g1_d(const struct imp__facets *f, imp_wide3 v,
                                        imp_wide d[2])
{
    return imp_likely(f->type == IMP_GGX)
               ? IMP_WIDE_OF(imp__ggx_g1_d)(f->au, f->av, v, d)
               : IMP_WIDE_OF(imp__beckmann_g1_d)(f->au, f->av, v, d);
}

/* ---- Normals ------------------------------------------------------------------------- */

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

static __attribute__((noinline, unused)) imp_wide3
imp__normals_alone(const struct imp__facets *f, const imp_wide3 *wo, const imp_wide u[2])
{
    imp_wide3 h = *wo; /* elsewhere */
    for (unsigned left = imp__wide_bits(f->here); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const struct imp__microfacet own = imp__facets_lane(f, k);
        const imp_v3 v = imp__wide3_lane(wo, k);
        imp__wide3_set(&h, k,
                       imp__microfacet_sample(&own, &v, (double[]){u[0][k], u[1][k]}));
    }
    return h;
}
/* imp__microfacet_sample: a part of them where D changes, one by one. */
static inline imp_wide3 imp__facets_normals(const struct imp__facets *f,
                                            const imp_wide3 *wo, const imp_wide u[2])
{
    const double below = 0x1.fffffffffffffp-1;
    if (imp_unlikely(f->type != IMP_GGX || !f->visible))
        return imp__normals_alone(f, wo, u);
    if (imp_likely(!f->wanted)) return imp__ggx_visible_normals(f->au, f->av, wo, u);
    const imp_wide share = IMP_WIDE_OF(imp__facets_share)(f->au, f->av);
    const imp_wide_truth parted = share > imp__wide(0);
    const imp_wide rest = imp__wide_clamp((u[0] - share) / (1 - share), 0, below);
    const imp_wide own[2] = {imp__wide_choose(parted, rest, u[0]), u[1]};
    imp_wide3 h = imp__ggx_visible_normals(f->au, f->av, wo, own);
    for (unsigned left = imp__wide_bits(f->here & parted & (u[0] < share)); left;
         left &= left - 1) {
        const int k = __builtin_ctz(left);
        const struct imp__microfacet of = imp__facets_lane(f, k);
        const double v[2] = {imp_min(u[0][k] / share[k], below), u[1][k]};
        imp__wide3_set(&h, k, imp__score_sample(&of, v));
    }
    return h;
}

static __attribute__((noinline, unused)) imp_wide
imp__masking_alone(const struct imp__facets *f, const imp_wide3 *v)
{
    imp_wide g = imp__wide(0);
    for (unsigned left = imp__wide_bits(f->here); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const struct imp__microfacet own = imp__facets_lane(f, k);
        const imp_v3 of = imp__wide3_lane(v, k);
        g[k] = imp__microfacet_g1_exact(&own, &of);
    }
    return g;
}
static __attribute__((noinline, unused)) imp_wide
imp__score_alone(const struct imp__facets *f, const imp_wide3 *m, imp_wide D)
{
    imp_wide p = imp__wide(0);
    for (unsigned left = imp__wide_bits(f->here); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const struct imp__microfacet own = imp__facets_lane(f, k);
        const imp_v3 of = imp__wide3_lane(m, k);
        p[k] = imp__score_pdf(&own, &of, D[k]);
    }
    return p;
}
/* imp__microfacet_pdf_of: the density of that normal h, where D of it and G1 of wo are known; vm =
 * wo.h. */
static inline imp_wide imp__facets_normals_pdf(const struct imp__facets *f,
                                               const imp_wide3 *wo, const imp_wide3 *h,
                                               imp_wide vm, imp_wide D, imp_wide G1)
{
    const bool ggx = f->type == IMP_GGX;
    imp_wide p;
    if (imp_unlikely(!f->visible)) p = D * h->z;
    else p = D * (imp_likely(ggx) ? G1 : imp__masking_alone(f, wo)) * vm / wo->z;
    if (imp_unlikely(f->wanted != 0)) {
        const imp_wide share = IMP_WIDE_OF(imp__facets_share)(f->au, f->av),
                       score = ggx ? IMP_WIDE_OF(imp__ggx_score_pdf)(
                                         f->au, f->av, h->x, h->y, h->z, D, f->wanted)
                                   : imp__score_alone(f, h, D);
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
