/* SPDX-License-Identifier: Apache-2.0
 *
 * principled in lanes, where nothing is transmitted: facets, clearcoat, diffuse lobe and sheen of
 * principled.c, whose letters these are. */
#include "facet_lanes.h"
#include "fresnel_lanes.h"
#include "principled.h"

static bool covers(const struct imp_bsdf *b)
{
    const struct imp__principled_self *p = b->self;
    return !p->transmits;
}

static bool is_coated(const struct imp_bsdf *b)
{
    return ((const struct imp__principled_self *)b->self)->coated;
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
static inline struct imp__facets facets_of(const struct imp_wide_color *in,
                                           imp_wide_truth here, uint64_t derivative)
{
    const imp_wide a = imp__wide_root(1 - 0.9 * cut(in, ANISOTROPIC)),
                   roughness = cut(in, ROUGHNESS), r2 = roughness * roughness,
                   least = imp__wide(1e-3);
    return (struct imp__facets){IMP_GGX,
                                true,
                                imp__principled_wanted(derivative),
                                imp__wide_larger(r2 / a, least),
                                imp__wide_larger(r2 * a, least),
                                here};
}

/* ---- Clearcoat ------------------------------------------------------------------- */

static imp_wide coat_alpha(const struct imp_wide_color *in)
{
    return 0.1 - 0.099 * cut(in, GLOSS);
}
/* coat_d; logarithms are the C library's. */
static imp_wide coat_d(const struct imp_wide_color *in, imp_wide z, imp_wide *d_log)
{
    const imp_wide alpha = coat_alpha(in), A = alpha * alpha, q = 1 + (A - 1) * z * z;
    imp_wide l;
    for (int k = 0; k < IMP_WIDE_LANES; k++)
        l[k] = k > 0 && A[k] == A[k - 1] ? l[k - 1] : log(A[k]);
    *d_log = (1 / (A - 1) - 1 / (A * l) - z * z / q) * 2 * alpha * -0.099;
    return (A - 1) / (IMP_PI * l * q);
}
/* coat_normal, where `here`. */
static void coat_normals(const struct imp_wide_color *in, const imp_wide u[2],
                         imp_wide_truth here, imp_wide3 *m)
{
    const imp_wide alpha = coat_alpha(in), A = alpha * alpha;
    for (unsigned left = imp__wide_bits(here); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const double phi = IMP_2PI * u[1][k],
                     z2 = (1 - pow(A[k], 1 - u[0][k])) / (1 - A[k]),
                     s = sqrt(imp_max(0, 1 - z2));
        imp__wide3_set(m, k, imp__v3(s * cos(phi), s * sin(phi), sqrt(imp_max(z2, 0))));
    }
}

/* ---- Drawing --------------------------------------------------------------------- */

struct chances {
    imp_wide facets, diffuse, coat;
};
IMP_EITHER_WAY struct chances chances_of(const bool coated,
                                         const struct imp_wide_color *in,
                                         uint64_t derivative, imp_wide cos_o, imp_wide e)
{
    const imp_wide zero = imp__wide(0);
    imp_wide cos_t, eta_t;
    const imp_wide m = cut(in, METALLIC),
                   F = IMP_WIDE_OF(imp__dielectric)(cos_o, e, &cos_t, &eta_t);
    struct chances q = {
        imp__wide_larger(m + (1 - m) * F,
                         imp__wide(imp__lobe_least(derivative, IMP_OF_FACETS))),
        (1 - m) * imp__wide_larger(imp__wide(1), cut(in, SHEEN)), zero};
    if (derivative)
        q.diffuse = imp__wide_larger(
            q.diffuse, imp__wide(imp__lobe_least(derivative, IMP_OF_DIFFUSE)));
    if (coated) {
        const imp_wide coat = 0.25 * cut(in, CLEARCOAT),
                       own = imp__wide_larger(coat, imp__wide(0.03));
        q.coat = derivative ? own : imp__wide_choose(coat > zero, own, zero);
    }
    const imp_wide all = 1 / (q.facets + q.diffuse + q.coat);
    return (struct chances){q.facets * all, q.diffuse * all, q.coat * all};
}

IMP_EITHER_WAY imp_wide_truth sample_as(const bool coated, const struct imp_bsdf *b,
                                        uint64_t derivative,
                                        const struct imp_wide_color *in,
                                        const imp_wide3 *wo, const imp_wide u[3],
                                        imp_wide3 *wi, imp_wide_lobe *lobe)
{
    (void)lobe;
    const struct chances q =
        chances_of(coated, in, derivative, wo->z, index_of(b->self, in));
    const imp_wide_truth lambert = u[0] < q.diffuse,
                         coat = coated ? ~lambert & (u[0] < q.diffuse + q.coat)
                                       : (imp_wide_truth){0};
    const struct imp__facets f = facets_of(in, ~(lambert | coat), derivative);
    imp_wide3 m = imp__facets_normals(&f, wo, &u[1]);
    if (coated) coat_normals(in, &u[1], coat, &m);
    const imp_wide c = imp__wide3_inner(*wo, m);
    imp__lambert_samples(u, wo, wi);
    *wi = imp__wide3_choose(lambert, *wi, imp__mirrors_in(wo, &m, c));
    return imp__fronts(wo, wi) &
           (lambert |
            ((c > imp__wide(0)) & (coat | (u[0] < q.diffuse + q.coat + q.facets))));
}
/* ---- Value and derivatives ------------------------------------------------------- */

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
/* Its derivative by e. */
static imp_wide schlick_by_index(imp_wide e, imp_wide om)
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    const imp_wide s2 = 1 - om * om, ct2 = 1 - s2 / (e * e);
    const imp_wide_truth passes = (ct2 > zero) & ~(e > one);
    const imp_wide ct = imp__wide_root(imp__wide_choose(passes, ct2, one));
    const imp_wide x = imp__wide_larger(imp__wide_lesser(1 - ct, one), zero), x2 = x * x;
    const imp_wide slope = imp__wide_choose(ct > zero, -5 * x2 * x2, zero);
    return imp__wide_choose(passes, slope * s2 / (e * e * e * ct), zero);
}

/* imp__burley. */
struct burley {
    imp_wide value, d_roughness, d_flatness;
};
IMP_EITHER_WAY struct burley burley(imp_wide cos_o, imp_wide cos_i, imp_wide cos_d,
                                    imp_wide roughness, imp_wide flatness)
{
    const imp_wide Fo = schlick(cos_o), Fi = schlick(cos_i);
    const imp_wide R = 2 * roughness * cos_d * cos_d, dR = 2 * cos_d * cos_d;
    const imp_wide full =
        (1 - 0.5 * Fo) * (1 - 0.5 * Fi) + R * (Fo + Fi + Fo * Fi * (R - 1));
    const imp_wide d_full = Fo + Fi + Fo * Fi * (2 * R - 1);
    const imp_wide q_o = 1 + Fo * (0.5 * R - 1), q_i = 1 + Fi * (0.5 * R - 1);
    const imp_wide slab = 1 / (cos_o + cos_i) - 0.5;
    const imp_wide flat = 1.25 * (q_o * q_i * slab + 0.5);
    const imp_wide d_flat = 1.25 * slab * 0.5 * (Fo * q_i + Fi * q_o);
    return (struct burley){full + (flat - full) * flatness,
                           dR * (d_full + (d_flat - d_full) * flatness), flat - full};
}

/* What value and derivatives have in common: the letters of front_add. */
struct front {
    imp_wide e, vm, om, D, Go, DG, W, F, R0, c, m, st, sheen, s_tint, lum, lambert, gloss;
    imp_wide coat_D, dlog_coat, coat, coat_F, cc; /* if coated */
    imp_wide3 h;
    struct imp__facets facets;
    struct burley burley;
    imp_wide_truth there;
};
IMP_EITHER_WAY struct front front_of(const bool coated, const struct imp_bsdf *b,
                                     const struct imp_wide_color *in, const imp_wide3 *wo,
                                     const imp_wide3 *wi, uint64_t derivative)
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    struct front x = {.e = index_of(b->self, in)};
    imp_wide cos_t;
    x.facets = facets_of(in, imp__fronts(wo, wi), derivative);
    x.h = imp__wide3_unit(imp__wide3_plus(*wo, *wi));
    x.vm = imp__wide3_inner(*wo, x.h);
    x.om = imp__wide_lesser(x.vm, one);
    x.there = imp__fronts(wo, wi) & (x.om > zero) & (imp__wide3_inner(*wi, x.h) > zero);
    x.D = imp__facets_d(&x.facets, x.h);
    x.Go = imp__facets_g1(&x.facets, *wo);
    x.DG = x.D * x.Go * imp__facets_g1(&x.facets, *wi);
    x.W = schlick_at(x.e, x.om);
    x.F = IMP_WIDE_OF(imp__dielectric_from)(x.om, x.e, &cos_t);
    const imp_wide r = (x.e - 1) / (x.e + 1);
    x.R0 = r * r;
    x.c = 1 / (4 * wo->z);
    x.m = cut(in, METALLIC);
    x.st = cut(in, SPEC_TINT);
    x.sheen = cut(in, SHEEN);
    x.s_tint = cut(in, SHEEN_TINT);
    x.lum = in[LUM].c[0];
    x.lambert = wi->z * IMP_INV_PI;
    x.gloss = schlick(x.om) * wi->z;
    x.burley = burley(wo->z, wi->z, x.om, cut(in, ROUGHNESS), cut(in, FLATNESS));
    if (!coated) return x;
    const imp_wide quarter = imp__wide(0.25);
    x.coat_D = coat_d(in, x.h.z, &x.dlog_coat);
    x.coat = 0.25 * x.coat_D * IMP_WIDE_OF(imp__ggx_g1)(quarter, quarter, *wo) *
             IMP_WIDE_OF(imp__ggx_g1)(quarter, quarter, *wi) * wi->z;
    x.coat_F = 0.04 + 0.96 * x.W;
    x.cc = cut(in, CLEARCOAT);
    return x;
}
/* Its colours. */
struct dyes {
    imp_wide base, tint, metal, dyed, Fp, dye;
};
static inline struct dyes dyes_of(const struct front *x, imp_wide base)
{
    const imp_wide one = imp__wide(1), m = x->m, st = x->st;
    struct dyes y = {
        .base = base,
        .tint = imp__wide_choose(x->lum > imp__wide(0), base * (1 / x->lum), one)};
    y.metal = base + (one - base) * x->W;
    y.dyed = y.tint * x->R0 + (one - y.tint * x->R0) * x->W;
    y.Fp = y.metal * m + y.dyed * ((1 - m) * st) + (1 - m) * (1 - st) * x->F;
    y.dye = one + (y.tint - one) * x->s_tint;
    return y;
}

IMP_EITHER_WAY imp_wide pdf_eval_as(const bool coated, const struct imp_bsdf *b,
                                    uint64_t derivative, const struct imp_wide_color *in,
                                    const imp_wide3 *wo, const imp_wide3 *wi,
                                    const imp_wide_lobe *lobe, int colors,
                                    struct imp_wide_color *f)
{
    (void)lobe;
    const struct front x = front_of(coated, b, in, wo, wi, derivative);
    const struct chances q = chances_of(coated, in, derivative, wo->z, x.e);
    for (int k = 0; k < colors; k++) {
        const struct dyes y = dyes_of(&x, in[BASE].c[k]);
        f->c[k] = y.Fp * (x.DG * x.c) +
                  y.base * (x.burley.value * x.lambert * (1 - x.m)) +
                  y.dye * (x.sheen * (1 - x.m) * x.gloss);
        if (coated) f->c[k] += x.cc * x.coat * x.coat_F;
    }
    imp_wide sum = q.facets *
                       imp__facets_normals_pdf(&x.facets, wo, &x.h, x.vm, x.D, x.Go) /
                       (4 * x.om) +
                   q.diffuse * wi->z * IMP_INV_PI;
    if (coated) sum += q.coat * x.coat_D * x.h.z / (4 * x.om);
    return imp__wide_choose(x.there, sum, imp__wide(0));
}
/* Derivatives of DG by roughness and anisotropic (imp__burley_lobe). */
static inline void facets_d(const struct imp_wide_color *in, const struct front *x,
                            const imp_wide3 *wo, const imp_wide3 *wi, imp_wide d[2])
{
    const imp_wide zero = imp__wide(0), least = imp__wide(1e-3),
                   roughness = cut(in, ROUGHNESS), r2 = roughness * roughness,
                   a = imp__wide_root(1 - 0.9 * cut(in, ANISOTROPIC));
    const imp_wide_truth own[2] = {r2 / a > least, r2 * a > least};
    const imp_wide by[2][2] = {{2 * roughness / a, 2 * roughness * a},
                               {0.45 * r2 / (a * a * a), -0.45 * r2 / a}};
    imp_wide dlog_D[2], dGo[2], dGi[2];
    const imp_wide Go = imp__facets_g1_d(&x->facets, *wo, dGo),
                   Gi = imp__facets_g1_d(&x->facets, *wi, dGi);
    imp__facets_d_log(&x->facets, x->h, dlog_D);
    d[0] = d[1] = zero;
    for (int k = 0; k < 2; k++) {
        const imp_wide turn = x->D * (dlog_D[k] * Go * Gi + dGo[k] * Gi + Go * dGi[k]);
        for (int j = 0; j < 2; j++)
            d[j] += turn * imp__wide_choose(own[k], by[j][k], zero);
    }
}

/* d eta/d specular (eta_of). */
static imp_wide index_slope(const struct imp__principled_self *p,
                            const struct imp_wide_color *in)
{
    if (p->by_eta) return imp__wide(1);
    const imp_wide q =
        imp__wide_root(0.08 * imp__wide_larger(cut(in, SPECULAR), imp__wide(1e-14)));
    return 2 / ((1 - q) * (1 - q)) * 0.04 / q;
}

IMP_EITHER_WAY bool eval_d_as(const bool coated, const struct imp_bsdf *b,
                              const struct imp_wide_color *in, const imp_wide3 *wo,
                              const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                              struct imp_wide_color *d)
{
    (void)lobe;
    const struct imp__principled_self *p = b->self;
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    const struct front x = front_of(coated, b, in, wo, wi, 0);
    imp_wide d_DG[2], F_c, F_e;
    facets_d(in, &x, wo, wi, d_DG);
    IMP_WIDE_OF(imp__dielectric_d)(x.om, x.e, &F_c, &F_e);
    const imp_wide W = x.W, W_e = schlick_by_index(x.e, x.om), F = x.F, m = x.m,
                   st = x.st, R0 = x.R0, DG = x.DG, c = x.c, sheen = x.sheen,
                   gloss = x.gloss, lambert = x.lambert, brdf = 1 - m,
                   r = (x.e - 1) / (x.e + 1), dR0 = 4 * r / ((x.e + 1) * (x.e + 1)),
                   de = index_slope(p, in);
    const imp_wide by_tint =
        (1 - m) * st * R0 * (1 - W) * DG * c + sheen * (1 - m) * gloss * x.s_tint;
    const imp_wide_truth dyes = x.lum > zero;
    const imp_wide tint_base = imp__wide_choose(dyes, 1 / x.lum, zero),
                   tint_lum = -1 / (x.lum * x.lum);
    imp_wide_truth there[N_INPUTS];
    for (int j = 0; j < N_INPUTS; j++) {
        const bool number = j >= ROUGHNESS && j != ETA;
        there[j] = x.there;
        if (number) there[j] &= cut(in, j) == in[j].c[0];
    }
    for (int k = 0; k < colors; k++) {
        const struct dyes y = dyes_of(&x, in[BASE].c[k]);
        const imp_wide base = y.base, tint = y.tint;
        imp_wide d_e =
            ((one - base) * (m * W_e) +
             ((one - tint * R0) * W_e + tint * ((1 - W) * dR0)) * ((1 - m) * st) +
             (1 - m) * (1 - st) * F_e) *
            (DG * c);
        if (coated) d_e += x.cc * x.coat * 0.96 * W_e;
        const imp_wide own[N_INPUTS] = {
            [BASE] = m * (1 - W) * DG * c + x.burley.value * lambert * brdf +
                     by_tint * tint_base,
            [LUM] = imp__wide_choose(dyes, by_tint * (base * tint_lum), zero),
            [ROUGHNESS] =
                y.Fp * (d_DG[0] * c) + base * (x.burley.d_roughness * lambert * brdf),
            [ANISOTROPIC] = y.Fp * (d_DG[1] * c),
            [METALLIC] = (y.metal - y.dyed * st - (1 - st) * F) * (DG * c) -
                         base * (x.burley.value * lambert) - y.dye * (sheen * gloss),
            [SPEC_TINT] = (y.dyed - F) * ((1 - m) * DG * c),
            [SHEEN] = y.dye * ((1 - m) * gloss),
            [SHEEN_TINT] = (tint - one) * (sheen * (1 - m) * gloss),
            [FLATNESS] = base * (x.burley.d_flatness * lambert * brdf),
            [CLEARCOAT] = coated ? x.coat * x.coat_F : zero,
            [GLOSS] = coated ? x.cc * x.coat * x.coat_F * x.dlog_coat : zero,
            [ETA] = p->by_eta ? d_e * de : zero,
            [SPECULAR] = p->by_eta ? zero : d_e * de};
        for (int j = 0; j < N_INPUTS; j++)
            d[j].c[k] = imp__wide_choose(there[j], own[j], zero);
    }
    return true;
}
IMP_KERNEL_BY(is_coated)

const struct imp_bsdf_lanes imp__principled_lanes = {.covers = covers,
                                                     .sample = sample_lanes,
                                                     .pdf_eval = pdf_eval_lanes,
                                                     .eval_d = eval_d_lanes};
