/* SPDX-License-Identifier: Apache-2.0
 *
 * What principled in lanes (principled.c, whose letters these are) has whether it transmits or not:
 * numbers, facets, clearcoat, and the lobes in front. */
#ifndef IMP_KIND_BSDF_PRINCIPLED_FRONT_H
#define IMP_KIND_BSDF_PRINCIPLED_FRONT_H

#include "facet_lanes.h"
#include "fresnel_lanes.h"
#include "principled.h"

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "kind/bsdf/burley_text.h"
#include "math/lane_text.h"

static inline bool imp__is_coated(const struct imp_bsdf *b)
{
    return ((const struct imp__principled_self *)b->self)->coated;
}

/* Numbers, cut. */
static inline imp_wide imp__cut_of(const struct imp_wide_color *in, int j)
{
    return imp__wide_larger(imp__wide_lesser(in[j].c[0], imp__wide(1)), imp__wide(0));
}

/* eta_of, seen from in front, by the number `specular`. */
static inline imp_wide imp__index_of(const struct imp__principled_self *p,
                                     const struct imp_wide_color *in, imp_wide specular)
{
    if (p->by_eta) return in[ETA].c[0];
    const imp_wide least = imp__wide(p->transmits ? 1e-3 : 1e-14),
                   q = imp__wide_root(0.08 * imp__wide_larger(specular, least));
    return 2 / (1 - q) - 1;
}

/* imp__burley_facets. */
static inline struct imp__facets imp__facets_of(const struct imp_wide_color *in,
                                                imp_wide_truth here, uint64_t derivative)
{
    imp_wide alpha[2];
    IMP_WIDE_OF(imp__burley_alpha)
    (imp__cut_of(in, ROUGHNESS), imp__cut_of(in, ANISOTROPIC), alpha);
    return (struct imp__facets){IMP_GGX,  true,     imp__principled_wanted(derivative),
                                alpha[0], alpha[1], here};
}

/* ---- Clearcoat ------------------------------------------------------------------- */

static inline imp_wide imp__coats_alpha(const struct imp_wide_color *in)
{
    return 0.1 - 0.099 * imp__cut_of(in, GLOSS);
}
/* coat_d; logarithms are the C library's. */
static inline imp_wide imp__coats_d(const struct imp_wide_color *in, imp_wide z,
                                    imp_wide *d_log)
{
    const imp_wide alpha = imp__coats_alpha(in), A = alpha * alpha;
    imp_wide l;
    for (int k = 0; k < IMP_WIDE_LANES; k++)
        l[k] = k > 0 && A[k] == A[k - 1] ? l[k - 1] : log(A[k]);
    return IMP_WIDE_OF(imp__clearcoat_d)(alpha, l, z, d_log);
}
/* coat_normal, where `here`. */
static inline void imp__coats_normals(const struct imp_wide_color *in,
                                      const imp_wide u[2], imp_wide_truth here,
                                      imp_wide3 *m)
{
    const imp_wide alpha = imp__coats_alpha(in), A = alpha * alpha;
    for (unsigned left = imp__wide_bits(here); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const double phi = IMP_2PI * u[1][k],
                     z2 = (1 - pow(A[k], 1 - u[0][k])) / (1 - A[k]),
                     s = sqrt(imp_max(0, 1 - z2));
        imp__wide3_set(m, k, imp__v3(s * cos(phi), s * sin(phi), sqrt(imp_max(z2, 0))));
    }
}

/* ---- Lobes in front -------------------------------------------------------------- */

/* Directions on one side of the surface, the side of wo, and the facet between them: struct
 * imp__principled_look. vm: wo.m, which om is but for rounding. */
struct imp__principled_sides {
    imp_wide3 wo, wi, m;
    imp_wide e, vm, om;
};
/* What value and derivatives of front_add have in common. */
struct imp__front {
    imp_wide e, D, Go, DG, W, F, R0, c, m, t, st, sheen, s_tint, lum, lambert, gloss;
    imp_wide coat_D, dlog_coat, coat, coat_F, cc; /* if coated */
    struct imp__facets facets;
    struct IMP_WIDE_OF(imp_burley) burley;
};
IMP_EITHER_WAY struct imp__front imp__front_of(const bool coated, const bool clear,
                                               const struct imp_wide_color *in,
                                               const struct imp__principled_sides *l,
                                               imp_wide_truth here, uint64_t derivative)
{
    struct imp__front x = {.e = l->e};
    imp_wide cos_t;
    x.facets = imp__facets_of(in, here, derivative);
    x.D = imp__facets_d(&x.facets, l->m);
    x.Go = imp__facets_g1(&x.facets, l->wo);
    x.DG = x.D * x.Go * imp__facets_g1(&x.facets, l->wi);
    x.W = IMP_WIDE_OF(imp__schlick_at)(l->e, l->om);
    x.F = IMP_WIDE_OF(imp__dielectric_from)(l->om, l->e, &cos_t);
    const imp_wide r = (x.e - 1) / (x.e + 1);
    x.R0 = r * r;
    x.c = 1 / (4 * l->wo.z);
    x.m = imp__cut_of(in, METALLIC);
    x.t = clear ? imp__cut_of(in, TRANS) : imp__wide(0);
    x.st = imp__cut_of(in, SPEC_TINT);
    x.sheen = imp__cut_of(in, SHEEN);
    x.s_tint = imp__cut_of(in, SHEEN_TINT);
    x.lum = in[LUM].c[0];
    x.lambert = l->wi.z * IMP_INV_PI;
    x.gloss = IMP_WIDE_OF(imp__schlick)(l->om) * l->wi.z;
    x.burley = IMP_WIDE_OF(imp__burley)(
        l->wo.z, l->wi.z, l->om, imp__cut_of(in, ROUGHNESS), imp__cut_of(in, FLATNESS));
    if (!coated) return x;
    const imp_wide quarter = imp__wide(0.25);
    x.coat_D = imp__coats_d(in, l->m.z, &x.dlog_coat);
    x.coat = 0.25 * x.coat_D * IMP_WIDE_OF(imp__ggx_g1)(quarter, quarter, l->wo) *
             IMP_WIDE_OF(imp__ggx_g1)(quarter, quarter, l->wi) * l->wi.z;
    x.coat_F = 0.04 + 0.96 * x.W;
    x.cc = imp__cut_of(in, CLEARCOAT);
    return x;
}
/* Its colours. */
struct imp__dyes {
    imp_wide base, tint, metal, dyed, Fp, dye;
};
static inline struct imp__dyes imp__dyes_of(const struct imp__front *x, imp_wide base)
{
    const imp_wide one = imp__wide(1), m = x->m, st = x->st;
    struct imp__dyes y = {
        .base = base,
        .tint = imp__wide_choose(x->lum > imp__wide(0), base * (1 / x->lum), one)};
    y.metal = base + (one - base) * x->W;
    y.dyed = y.tint * x->R0 + (one - y.tint * x->R0) * x->W;
    y.Fp = y.metal * m + y.dyed * ((1 - m) * st) + (1 - m) * (1 - st) * x->F;
    y.dye = one + (y.tint - one) * x->s_tint;
    return y;
}
/* One colour of the value. */
IMP_EITHER_WAY imp_wide imp__front_value(const bool coated, const struct imp__front *x,
                                         imp_wide base)
{
    const struct imp__dyes y = imp__dyes_of(x, base);
    const imp_wide brdf = (1 - x->m) * (1 - x->t);
    const imp_wide f = y.Fp * (x->DG * x->c) +
                       y.base * (x->burley.value * x->lambert * brdf) +
                       y.dye * (x->sheen * (1 - x->m) * x->gloss);
    return coated ? f + x->cc * x->coat * x->coat_F : f;
}
/* Derivatives of DG by roughness and anisotropic (imp__burley_lobe). */
static inline void imp__facets_turn(const struct imp_wide_color *in,
                                    const struct imp__front *x,
                                    const struct imp__principled_sides *l, imp_wide d[2])
{
    imp_wide by[2][2], dlog_D[2], dGo[2], dGi[2];
    IMP_WIDE_OF(imp__burley_alpha_d)
    (imp__cut_of(in, ROUGHNESS), imp__cut_of(in, ANISOTROPIC), by[0], by[1]);
    const imp_wide Go = imp__facets_g1_d(&x->facets, l->wo, dGo),
                   Gi = imp__facets_g1_d(&x->facets, l->wi, dGi);
    imp__facets_d_log(&x->facets, l->m, dlog_D);
    d[0] = d[1] = imp__wide(0);
    for (int k = 0; k < 2; k++) {
        const imp_wide turn = x->D * (dlog_D[k] * Go * Gi + dGo[k] * Gi + Go * dGi[k]);
        for (int j = 0; j < 2; j++) d[j] += turn * by[j][k];
    }
}

/* One colour of all derivatives but those by the index; d_DG as of imp__facets_turn. */
IMP_EITHER_WAY void imp__front_d(const bool coated, const struct imp__front *x,
                                 const imp_wide d_DG[2], const struct imp__dyes *y,
                                 imp_wide own[N_INPUTS])
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1), m = x->m, t = x->t,
                   st = x->st, DG = x->DG, c = x->c, sheen = x->sheen, gloss = x->gloss,
                   lambert = x->lambert, brdf = (1 - m) * (1 - t), base = y->base;
    const imp_wide by_tint =
        (1 - m) * st * x->R0 * (1 - x->W) * DG * c + sheen * (1 - m) * gloss * x->s_tint;
    const imp_wide_truth dyes = x->lum > zero;
    own[BASE] = m * (1 - x->W) * DG * c + x->burley.value * lambert * brdf +
                by_tint * imp__wide_choose(dyes, 1 / x->lum, zero);
    own[LUM] = imp__wide_choose(dyes, by_tint * (base * (-1 / (x->lum * x->lum))), zero);
    own[ROUGHNESS] =
        y->Fp * (d_DG[0] * c) + base * (x->burley.d_roughness * lambert * brdf);
    own[ANISOTROPIC] = y->Fp * (d_DG[1] * c);
    own[METALLIC] = (y->metal - y->dyed * st - (1 - st) * x->F) * (DG * c) -
                    base * (x->burley.value * lambert * (1 - t)) -
                    y->dye * (sheen * gloss);
    own[TRANS] = zero - base * (x->burley.value * lambert * (1 - m));
    own[SPEC_TINT] = (y->dyed - x->F) * ((1 - m) * DG * c);
    own[SHEEN] = y->dye * ((1 - m) * gloss);
    own[SHEEN_TINT] = (y->tint - one) * (sheen * (1 - m) * gloss);
    own[FLATNESS] = base * (x->burley.d_flatness * lambert * brdf);
    own[CLEARCOAT] = coated ? x->coat * x->coat_F : zero;
    own[GLOSS] = coated ? x->cc * x->coat * x->coat_F * x->dlog_coat : zero;
    own[ETA] = own[SPECULAR] = zero;
}
/* Where the derivative by input j counts: textures may leave [0, 1]. */
static inline imp_wide_truth imp__counts(const struct imp_wide_color *in, int j,
                                         imp_wide_truth there)
{
    const bool number = j >= ROUGHNESS && j != ETA;
    return number ? there & (imp__cut_of(in, j) == in[j].c[0]) : there;
}

/* ---- Drawing --------------------------------------------------------------------- */

struct imp__lobe_chances {
    imp_wide facets, glass, diffuse, coat;
};
/* cos_o: on the side of wo; back: wo is behind. */
IMP_EITHER_WAY struct imp__lobe_chances
imp__lobe_chances(const bool coated, const bool clear, const struct imp_wide_color *in,
                  uint64_t derivative, imp_wide cos_o, imp_wide e, imp_wide_truth back)
{
    const imp_wide zero = imp__wide(0);
    imp_wide cos_t, eta_t;
    const imp_wide m = imp__cut_of(in, METALLIC),
                   t = clear ? imp__cut_of(in, TRANS) : zero,
                   F = IMP_WIDE_OF(imp__dielectric)(cos_o, e, &cos_t, &eta_t);
    struct imp__lobe_chances q = {
        imp__wide_larger(m + (1 - m) * F,
                         imp__wide(imp__lobe_least(derivative, IMP_OF_FACETS))),
        zero, (1 - m) * imp__wide_larger(1 - t, imp__cut_of(in, SHEEN)), zero};
    if (derivative)
        q.diffuse = imp__wide_larger(
            q.diffuse, imp__wide(imp__lobe_least(derivative, IMP_OF_DIFFUSE)));
    if (coated) {
        const imp_wide coat = 0.25 * imp__cut_of(in, CLEARCOAT),
                       own = imp__wide_larger(coat, imp__wide(0.03));
        q.coat = derivative ? own : imp__wide_choose(coat > zero, own, zero);
    }
    if (clear) {
        const imp_wide own = imp__wide_larger(
            (1 - m) * t * (1 - F), imp__wide(imp__lobe_least(derivative, IMP_OF_GLASS)));
        q.glass = derivative ? own : imp__wide_choose(t > zero, own, zero);
        q.diffuse = imp__wide_choose(back, zero, q.diffuse);
        q.coat = imp__wide_choose(back, zero, q.coat);
    }
    const imp_wide all = 1 / (q.facets + q.glass + q.diffuse + q.coat);
    return (struct imp__lobe_chances){q.facets * all, q.glass * all, q.diffuse * all,
                                      q.coat * all};
}

#endif
