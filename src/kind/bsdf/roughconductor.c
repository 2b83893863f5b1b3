/* SPDX-License-Identifier: Apache-2.0
 *
 * roughconductor: mirrors of complex index as small facets (Walter et al. 2007). With h
 * the half-vector and c = wo.h = wi.h
 *
 *   f cos(theta_i) = tint F(c) D(h) G1(wi) G1(wo) / (4 cos(theta_o)),   front only
 *
 * Light that meets a second facet is lost, as in the format. Drawing a normal and
 * mirroring wo in it gives p(wi) = p(h)/(4 c). */
#include "facet_lanes.h"
#include "fresnel.h"
#include "fresnel_lanes.h"
#include "lambert.h"
#include "presets.h"

enum { ETA, K, TINT, ALPHA, ALPHA_U, ALPHA_V, N_INPUTS };

static const struct imp_input_desc inputs[] = {IMP_ETA_INPUT,
                                               IMP_K_INPUT,
                                               IMP_TINT_INPUT("specular_reflectance"),
                                               IMP_ROUGHNESS_INPUTS,
                                               {0}};

static enum imp_status prepare(const struct imp_build *b)
{
    const enum imp_status st = imp__conductor_prepare(b);
    return st == IMP_OK ? imp__roughness_prepare(b) : st;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    bsdf->flags = IMP_BSDF_SMOOTH;
    return imp__roughness_build(b, self);
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    *f = imp__spec(0);
    if (!imp__front(d)) return;
    const struct imp__microfacet m = imp__roughness_at(b->self, &in[ALPHA]);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    const double D = imp__microfacet_d(&m, &h, NULL);
    const double G =
        imp__microfacet_g1(&m, &d->wi, NULL) * imp__microfacet_g1(&m, &d->wo, NULL);
    imp__fresnel_conductor(imp_min(imp__dot(d->wo, h), 1), &in[ETA], &in[K], f);
    *f *= in[TINT] * (D * G / (4 * d->wo[2]));
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    if (!imp__front(d)) return 0;
    const struct imp__microfacet m = imp__roughness_drawn(b->self, &in[ALPHA], d, ALPHA);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    return imp__microfacet_pdf(&m, &d->wo, &h) / (4 * imp__dot(d->wo, h));
}
static double pdf_eval(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f)
{
    if (!imp__front(d)) return 0;
    const struct imp__microfacet m = imp__roughness_drawn(b->self, &in[ALPHA], d, ALPHA);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    const double D = imp__microfacet_d(&m, &h, NULL),
                 Go = imp__microfacet_g1(&m, &d->wo, NULL),
                 G = imp__microfacet_g1(&m, &d->wi, NULL) * Go;
    imp__fresnel_conductor(imp_min(imp__dot(d->wo, h), 1), &in[ETA], &in[K], f);
    *f *= in[TINT] * (D * G / (4 * d->wo[2]));
    return imp__microfacet_pdf_of(&m, &d->wo, &h, D, Go) / (4 * imp__dot(d->wo, h));
}
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    if (!(d->wo[2] > 0)) return false;
    const struct imp__microfacet m = imp__roughness_drawn(b->self, &in[ALPHA], d, ALPHA);
    const imp_v3 h = imp__microfacet_sample(&m, &d->wo, &u[1]);
    const double c = imp__dot(d->wo, h);
    if (!(c > 0)) return false;
    d->wi = imp__normalize(h * (2 * c) - d->wo);
    d->lobe = IMP_SMOOTH;
    if (!(d->wi[2] > 0)) return false; /* the facet sends it into the surface */
    return true;
}

/* ln f = ln tint + ln F + ln D + ln G1(wi) + ln G1(wo), one term an input. */
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    if (!imp__front(d)) return;
    const struct imp__microfacet m = imp__roughness_at(b->self, &in[ALPHA]);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    double dlog_D[2], dGi[2], dGo[2];
    imp_spec F, F_eta, F_k;
    const double D = imp__microfacet_d(&m, &h, dlog_D);
    const double Gi = imp__microfacet_g1(&m, &d->wi, dGi),
                 Go = imp__microfacet_g1(&m, &d->wo, dGo);
    imp__fresnel_conductor_d(imp_min(imp__dot(d->wo, h), 1), &in[ETA], &in[K], &F, &F_eta,
                             &F_k);

    const double c = D / (4 * d->wo[2]);
    df[TINT] = F * (c * Gi * Go);
    df[ETA] = in[TINT] * F_eta * (c * Gi * Go);
    df[K] = in[TINT] * F_k * (c * Gi * Go);
    imp_spec d_alpha[2];
    for (int j = 0; j < 2; j++)
        d_alpha[j] =
            in[TINT] * F * (c * (dlog_D[j] * Gi * Go + dGi[j] * Go + Gi * dGo[j]));
    imp__roughness_d(b->self, &in[ALPHA], d_alpha, &df[ALPHA]);
}

/* f = tint F(c) DG/(4 wo_z). */
static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    for (int k = 0; k < 3; k++) d_wo[k] = d_wi[k] = imp__spec(0);
    if (!imp__front(d)) return;
    const struct imp__microfacet m = imp__roughness_at(b->self, &in[ALPHA]);
    const struct imp__facet_turns x = imp__microfacet_turns(&m, &d->wo, &d->wi);
    const double by = 1 / (4 * d->wo[2]);
    imp_spec F, F_c;
    imp__fresnel_conductor_turned(imp_min(x.c, 1), &in[ETA], &in[K], &F, &F_c);
    F *= in[TINT] * by;
    F_c *= in[TINT] * (by * 0.5 * x.DG);
    for (int k = 0; k < 3; k++) {
        d_wo[k] = F * x.by_wo[k] + F_c * x.h[k];
        d_wi[k] = F * x.by_wi[k] + F_c * x.h[k];
    }
    d_wo[2] -= F * (x.DG / d->wo[2]);
}

const struct imp_bsdf_ops imp__roughconductor = {.size = sizeof(struct imp_bsdf_ops),
                                                 .name = "roughconductor",
                                                 .object_size =
                                                     sizeof(struct imp__roughness),
                                                 .inputs = inputs,
                                                 .prepare = prepare,
                                                 .build = build,
                                                 .sample = sample,
                                                 .eval = eval,
                                                 .pdf = pdf,
                                                 .eval_d = eval_d,
                                                 .pdf_eval = pdf_eval,
                                                 .eval_directions_d = eval_directions_d};

/* ---- In lanes ---------------------------------------------------------------------------- */

IMP_EITHER_WAY imp_wide pdf_eval_as(const bool ggx, const struct imp_bsdf *b,
                                    uint64_t derivative, const struct imp_wide_color *in,
                                    const imp_wide3 *wo, const imp_wide3 *wi,
                                    const imp_wide_lobe *lobe, int colors,
                                    struct imp_wide_color *f)
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    (void)lobe;
    const imp_wide_truth here = imp__fronts(wo, wi);
    const struct imp__facets m =
        imp__roughness_drawn_lanes(ggx, b->self, &in[ALPHA], here, derivative, ALPHA);
    const imp_wide3 h = imp__wide3_unit(imp__wide3_plus(*wo, *wi));
    const imp_wide D = imp__facets_d(&m, h), Go = imp__facets_g1(&m, *wo),
                   G = imp__facets_g1(&m, *wi) * Go;
    const imp_wide vm = imp__wide3_inner(*wo, h), by = D * G / (4 * wo->z),
                   c = imp__wide_lesser(vm, one);
    for (int k = 0; k < colors; k++)
        f->c[k] = IMP_WIDE_OF(imp__conductor)(c, in[ETA].c[k], in[K].c[k]) *
                  (in[TINT].c[k] * by);
    return imp__wide_choose(
        here, imp__facets_normals_pdf(&m, wo, &h, vm, D, Go) / (4 * vm), zero);
}

IMP_EITHER_WAY imp_wide_truth sample_as(const bool ggx, const struct imp_bsdf *b,
                                        uint64_t derivative,
                                        const struct imp_wide_color *in,
                                        const imp_wide3 *wo, const imp_wide u[3],
                                        imp_wide3 *wi, imp_wide_lobe *lobe)
{
    (void)lobe;
    const struct imp__facets m = imp__roughness_drawn_lanes(
        ggx, b->self, &in[ALPHA], wo->z > imp__wide(0), derivative, ALPHA);
    const imp_wide3 h = imp__facets_normals(&m, wo, &u[1]);
    const imp_wide c = imp__wide3_inner(*wo, h);
    *wi = imp__mirrors_in(wo, &h, c);
    return imp__fronts(wo, wi) & (c > imp__wide(0));
}

IMP_EITHER_WAY bool eval_d_as(const bool ggx, const struct imp_bsdf *b,
                              const struct imp_wide_color *in, const imp_wide3 *wo,
                              const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                              struct imp_wide_color *d)
{
    (void)lobe;
    const struct imp__roughness *r = b->self;
    const imp_wide zero = imp__wide(0);
    const imp_wide_truth here = imp__fronts(wo, wi);
    imp_wide dlog_D[2], dGi[2], dGo[2];
    const imp_wide3 h = imp__wide3_unit(imp__wide3_plus(*wo, *wi));
    const struct imp__facets m = imp__roughness_lanes(ggx, r, &in[ALPHA], here);
    const imp_wide Gi = imp__facets_g1_d(&m, *wi, dGi),
                   Go = imp__facets_g1_d(&m, *wo, dGo);
    imp__facets_d_log(&m, h, dlog_D);
    const imp_wide c = imp__wide_choose(here, imp__facets_d(&m, h) / (4 * wo->z), zero);
    imp_wide by[2];
    for (int j = 0; j < 2; j++) {
        const int input = r->anisotropic ? ALPHA_U + j : ALPHA;
        by[j] = c * (dlog_D[j] * Gi * Go + dGi[j] * Go + Gi * dGo[j]);
        by[j] = imp__wide_choose(here & ~(in[input].c[0] < IMP_ALPHA_MIN), by[j], zero);
    }
    const imp_wide om = imp__wide_lesser(imp__wide3_inner(*wo, h), imp__wide(1)),
                   all = c * Gi * Go;
    for (int k = 0; k < colors; k++) {
        const imp_wide tint = in[TINT].c[k];
        imp_wide F_eta, F_k;
        const imp_wide F =
            IMP_WIDE_OF(imp__conductor_d)(om, in[ETA].c[k], in[K].c[k], &F_eta, &F_k);
        d[TINT].c[k] = F * all;
        d[ETA].c[k] = tint * F_eta * all;
        d[K].c[k] = tint * F_k * all;
        const imp_wide of = tint * F;
        d[ALPHA].c[k] = r->anisotropic ? zero : of * by[0] + of * by[1];
        d[ALPHA_U].c[k] = r->anisotropic ? of * by[0] : zero;
        d[ALPHA_V].c[k] = r->anisotropic ? of * by[1] : zero;
    }
    return true;
}

IMP_KERNEL_BY(imp__are_ggx_visible)

const struct imp_bsdf_lanes imp__roughconductor_lanes = {
    .sample = sample_lanes, .pdf_eval = pdf_eval_lanes, .eval_d = eval_d_lanes};
