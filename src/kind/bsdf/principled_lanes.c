/* SPDX-License-Identifier: Apache-2.0
 *
 * principled in lanes, where nothing is transmitted and there is no clearcoat: facets, diffuse lobe and
 * sheen of principled.c, whose letters these are. */
#include "facet_lanes.h"
#include "fresnel_lanes.h"
#include "principled.h"

static bool covers(const struct imp_bsdf *b)
{
    const struct imp__principled_self *p = b->self;
    return !p->transmits && !p->coated;
}

/* Numbers, cut. */
static imp_wide cut(const struct imp_wide_color *in, int j)
{
    return imp__wide_larger(imp__wide_lesser(in[j].c[0], imp__wide(1)), imp__wide(0));
}

static imp_wide index_of(const struct imp__principled_self *p,
                         const struct imp_wide_color *in)
{
    if (p->by_eta) return in[ETA].c[0];
    const imp_wide q =
        imp__wide_root(0.08 * imp__wide_larger(cut(in, SPECULAR), imp__wide(1e-14)));
    return 2 / (1 - q) - 1;
}

/* imp__burley_facets. */
static void roughness_of(const struct imp_wide_color *in, imp_wide *au, imp_wide *av)
{
    const imp_wide a = imp__wide_root(1 - 0.9 * cut(in, ANISOTROPIC)),
                   roughness = cut(in, ROUGHNESS), r2 = roughness * roughness,
                   least = imp__wide(1e-3);
    *au = imp__wide_larger(r2 / a, least);
    *av = imp__wide_larger(r2 * a, least);
}

/* Chances of the facets and of the diffuse lobe (chances_of). */
static void chances_of(const struct imp_wide_color *in, uint64_t derivative,
                       imp_wide cos_o, imp_wide e, imp_wide *facets, imp_wide *diffuse)
{
    imp_wide cos_t, eta_t;
    const imp_wide m = cut(in, METALLIC),
                   F = IMP_WIDE_OF(imp__dielectric)(cos_o, e, &cos_t, &eta_t);
    const imp_wide f = imp__wide_larger(
        m + (1 - m) * F, imp__wide(imp__lobe_least(derivative, IMP_OF_FACETS)));
    imp_wide d = (1 - m) * imp__wide_larger(imp__wide(1), cut(in, SHEEN));
    if (derivative)
        d = imp__wide_larger(d, imp__wide(imp__lobe_least(derivative, IMP_OF_DIFFUSE)));
    const imp_wide all = 1 / (f + d);
    *facets = f * all;
    *diffuse = d * all;
}

static imp_wide_truth sample_lanes(const struct imp_bsdf *b, uint64_t derivative,
                                   const struct imp_wide_color *in, const imp_wide3 *wo,
                                   const imp_wide u[3], imp_wide3 *wi,
                                   imp_wide_lobe *lobe)
{
    imp_wide au, av, facets, diffuse;
    (void)lobe;
    chances_of(in, derivative, wo->z, index_of(b->self, in), &facets, &diffuse);
    roughness_of(in, &au, &av);
    const imp_wide_truth lambert = u[0] < diffuse;
    const imp_wide3 m =
        imp__ggx_normals(au, av, imp__principled_wanted(derivative), wo, &u[1]);
    const imp_wide c = imp__wide3_inner(*wo, m);
    imp__lambert_samples(u, wo, wi);
    *wi = imp__wide3_choose(lambert, *wi, imp__mirrors_in(wo, &m, c));
    return imp__fronts(wo, wi) &
           (lambert | ((c > imp__wide(0)) & (u[0] < diffuse + facets)));
}

static imp_wide schlick(imp_wide c)
{
    const imp_wide x =
        imp__wide_larger(imp__wide_lesser(1 - c, imp__wide(1)), imp__wide(0));
    const imp_wide x2 = x * x;
    return x2 * x2 * x;
}
/* weight. */
static imp_wide schlick_at(imp_wide e, imp_wide om)
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    const imp_wide s2 = 1 - om * om, ct2 = 1 - s2 / (e * e);
    const imp_wide_truth passes = ct2 > zero;
    const imp_wide ct = imp__wide_root(imp__wide_choose(passes, ct2, zero));
    return imp__wide_choose(e > one, schlick(om),
                            imp__wide_choose(passes, schlick(ct), one));
}
/* imp__burley. */
static imp_wide burley(imp_wide cos_o, imp_wide cos_i, imp_wide cos_d, imp_wide roughness,
                       imp_wide flatness)
{
    const imp_wide Fo = schlick(cos_o), Fi = schlick(cos_i);
    const imp_wide R = 2 * roughness * cos_d * cos_d;
    const imp_wide full =
        (1 - 0.5 * Fo) * (1 - 0.5 * Fi) + R * (Fo + Fi + Fo * Fi * (R - 1));
    const imp_wide q_o = 1 + Fo * (0.5 * R - 1), q_i = 1 + Fi * (0.5 * R - 1);
    const imp_wide slab = 1 / (cos_o + cos_i) - 0.5;
    const imp_wide flat = 1.25 * (q_o * q_i * slab + 0.5);
    return full + (flat - full) * flatness;
}

static imp_wide pdf_eval_lanes(const struct imp_bsdf *b, uint64_t derivative,
                               const struct imp_wide_color *in, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                               struct imp_wide_color *f)
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1), e = index_of(b->self, in);
    imp_wide au, av, q_facets, q_diffuse, cos_t;
    (void)lobe;
    chances_of(in, derivative, wo->z, e, &q_facets, &q_diffuse);
    roughness_of(in, &au, &av);
    const imp_wide3 h = imp__wide3_unit(imp__wide3_plus(*wo, *wi));
    const imp_wide vm = imp__wide3_inner(*wo, h), om = imp__wide_lesser(vm, one);
    const imp_wide_truth there =
        imp__fronts(wo, wi) & (om > zero) & (imp__wide3_inner(*wi, h) > zero);
    const imp_wide D = IMP_WIDE_OF(imp__ggx_d)(au, av, h),
                   Go = IMP_WIDE_OF(imp__ggx_g1)(au, av, *wo),
                   DG = D * Go * IMP_WIDE_OF(imp__ggx_g1)(au, av, *wi);

    /* front_add */
    const imp_wide m = cut(in, METALLIC), cos_i = wi->z, W = schlick_at(e, om),
                   F = IMP_WIDE_OF(imp__dielectric_from)(om, e, &cos_t);
    const imp_wide r = (e - 1) / (e + 1), R0 = r * r;
    const imp_wide st = cut(in, SPEC_TINT), sheen = cut(in, SHEEN),
                   s_tint = cut(in, SHEEN_TINT), lum = in[LUM].c[0];
    const imp_wide c = 1 / (4 * wo->z), lambert = cos_i * IMP_INV_PI, brdf = 1 - m;
    const imp_wide value =
        burley(wo->z, cos_i, om, cut(in, ROUGHNESS), cut(in, FLATNESS));
    const imp_wide gloss = schlick(om) * cos_i;
    for (int k = 0; k < colors; k++) {
        const imp_wide base = in[BASE].c[k],
                       tint = imp__wide_choose(lum > zero, base * (1 / lum), one);
        const imp_wide metal = base + (one - base) * W,
                       dyed = tint * R0 + (one - tint * R0) * W;
        const imp_wide Fp = metal * m + dyed * ((1 - m) * st) + (1 - m) * (1 - st) * F;
        const imp_wide dye = one + (tint - one) * s_tint;
        f->c[k] = Fp * (DG * c) + base * (value * lambert * brdf) +
                  dye * (sheen * (1 - m) * gloss);
    }
    return imp__wide_choose(
        there,
        q_facets *
                imp__ggx_normals_pdf(au, av, imp__principled_wanted(derivative), wo, &h,
                                     vm, D, Go) /
                (4 * om) +
            q_diffuse * cos_i * IMP_INV_PI,
        zero);
}

const struct imp_bsdf_lanes imp__principled_lanes = {
    .covers = covers, .sample = sample_lanes, .pdf_eval = pdf_eval_lanes};
