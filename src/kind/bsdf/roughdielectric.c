/* SPDX-License-Identifier: Apache-2.0
 *
 * roughdielectric: a boundary of two clear media as small facets (Walter et al. 2007).
 * With e the index on the far side of wo over that on its own, c = wo.m and G = G1(wi)
 * G1(wo):
 *
 *   reflection    tint_r F(c) D(m) G/(4 |cos_o|),                m ~ wo + wi
 *   transmission  tint_t (1 - F(c)) D(m) G |wo.m| |wi.m|
 *                 / (|cos_o| (wo.m + e wi.m)^2),                 m ~ wo + e wi
 *
 * times the cosine at wi. Radiance is divided by e^2 on its way, and Walter's e^2 cancels
 * that. Light that meets a second facet is lost, as in the format. A facet is drawn, then
 * reflection with probability F(c) and refraction with 1 - F(c), whatever the tints are,
 * so that a tint of 0 keeps its derivative.
 *
 * Transmission ends where the facet lies in the surface, wo_z + e wi_z = 0. D of Beckmann
 * goes to 0 there: at fixed directions the value is smooth in the index, unlike a ray that it
 * bends, and the index has a gradient. With GGX it jumps (imp__ggx_glass_jumps). */
#include "clear_lanes.h"
#include "fresnel.h"
#include "fresnel_lanes.h"
#include "presets.h"

enum { TINT_R, TINT_T, ETA, ALPHA, ALPHA_U, ALPHA_V, N_INPUTS };

static const struct imp_input_desc inputs[] = {IMP_TINT_INPUT("specular_reflectance"),
                                               IMP_TINT_INPUT("specular_transmittance"),
                                               IMP_IOR_INPUT(1.5046 / 1.000277, 0.1, 10),
                                               IMP_ROUGHNESS_INPUTS,
                                               {0}};

static enum imp_status prepare(const struct imp_build *b)
{
    const enum imp_status st = imp__ior_prepare(b, "bk7", false);
    return st == IMP_OK ? imp__roughness_prepare(b) : st;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    const struct imp__roughness *r = self;
    const enum imp_status st = imp__roughness_build(b, self);
    bsdf->flags = IMP_BSDF_SMOOTH | IMP_BSDF_TRANSMIT;
    if (st == IMP_OK && r->type == IMP_GGX) imp__ggx_glass_jumps(bsdf, ETA);
    return st;
}

/* Seen from behind the boundary is the same with z reversed and the index inverted: below
 * wo is always above. */
struct view {
    imp_v3 wo, wi;
    double e;
    bool back, reflects;
};
static struct view view_of(const imp_spec *in, const struct imp_dirs *d)
{
    const bool back = d->wo[2] < 0;
    struct view v = {.wo = d->wo, .wi = d->wi, .e = in[ETA][0], .back = back};
    if (back) {
        v.wo[2] = -v.wo[2];
        v.wi[2] = -v.wi[2];
        v.e = 1 / v.e;
    }
    v.reflects = v.wi[2] > 0;
    return v;
}

/* The facet that turns wi into wo. n: the length of wo + e wi with the sign that turns m
 * upwards, so that (wo.m + e wi.m)^2 = n^2. */
struct facet {
    imp_v3 m;
    double n, om, im; /* wo.m, wi.m */
};
static bool facet_of(const struct view *v, struct facet *f)
{
    const imp_v3 h = v->wo + v->wi * (v->reflects ? 1 : v->e);
    f->n = copysign(imp__length(h), h[2]);
    f->m = h * (1 / f->n);
    f->om = imp_min(imp__dot(v->wo, f->m), 1.0);
    f->im = imp__dot(v->wi, f->m);
    return v->wo[2] > 0 && v->wi[2] != 0 && fabs(f->n) > 0 && f->om > 0 &&
           (f->im > 0) == v->reflects && f->im != 0;
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    const struct view v = view_of(in, d);
    struct facet x;
    double cos_t, eta_t;
    *f = imp__spec(0);
    if (d->lobe != IMP_SMOOTH || !facet_of(&v, &x)) return;
    const struct imp__microfacet q = imp__roughness_at(b->self, &in[ALPHA]);
    const double DG = imp__microfacet_d(&q, &x.m, NULL) *
                      imp__microfacet_g1(&q, &v.wi, NULL) *
                      imp__microfacet_g1(&q, &v.wo, NULL);
    const double F = imp__fresnel_dielectric(x.om, v.e, &cos_t, &eta_t);
    if (v.reflects) *f = in[TINT_R] * (F * DG / (4 * v.wo[2]));
    else *f = in[TINT_T] * ((1 - F) * DG * x.om * -x.im / (v.wo[2] * x.n * x.n));
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    const struct view v = view_of(in, d);
    struct facet x;
    double cos_t, eta_t;
    if (d->lobe != IMP_SMOOTH || !facet_of(&v, &x)) return 0;
    const struct imp__microfacet q = imp__roughness_drawn(b->self, &in[ALPHA], d, ALPHA);
    const double p = imp__microfacet_pdf(&q, &v.wo, &x.m);
    const double F = imp__fresnel_dielectric(x.om, v.e, &cos_t, &eta_t);
    /* dm/dwi = 1/(4 wo.m), or e^2 |wi.m|/n^2. */
    return v.reflects ? F * p / (4 * x.om)
                      : (1 - F) * p * v.e * v.e * -x.im / (x.n * x.n);
}
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    d->wi = -d->wo;
    struct view v = view_of(in, d);
    double cos_t, eta_t;
    if (!(v.wo[2] > 0)) return false;
    const struct imp__microfacet q = imp__roughness_drawn(b->self, &in[ALPHA], d, ALPHA);
    const imp_v3 m = imp__microfacet_sample(&q, &v.wo, &u[1]);
    const double c = imp__dot(v.wo, m);
    if (!(c > 0)) return false;
    const bool reflects =
        u[0] < imp__fresnel_dielectric(imp_min(c, 1.0), v.e, &cos_t, &eta_t);
    imp_v3 wi = reflects ? m * (2 * c) - v.wo : m * (c / v.e - cos_t) - v.wo * (1 / v.e);
    wi = imp__normalize(wi);
    if ((wi[2] > 0) != reflects) return false; /* the facet sends it to the wrong side */
    if (v.back) wi[2] = -wi[2];
    d->wi = wi;
    d->lobe = IMP_SMOOTH;
    return true;
}
static double index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    const struct view v = view_of(in, d);
    (void)b;
    return v.reflects ? 1 : v.e;
}

/* ln f = ln tint + ln F + ln D + ln G1(wi) + ln G1(wo) + ..., one term an input. The index
 * (of Beckmann) turns the facet of a transmission, with h = wo + e wi and m = h/n:
 *
 *   dm/de = (wi - m (m.wi))/n,   dn/de = m.wi                                        */
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    const struct view v = view_of(in, d);
    struct facet x;
    double dlog_D[2], dGi[2], dGo[2], F_c, F_e;
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    if (d->lobe != IMP_SMOOTH || !facet_of(&v, &x)) return;
    const struct imp__microfacet q = imp__roughness_at(b->self, &in[ALPHA]);
    const double D = imp__microfacet_d(&q, &x.m, dlog_D);
    const double Gi = imp__microfacet_g1(&q, &v.wi, dGi),
                 Go = imp__microfacet_g1(&q, &v.wo, dGo);
    const double F = imp__fresnel_dielectric_d(x.om, v.e, &F_c, &F_e);
    const double share = v.reflects ? F : 1 - F; /* times what is left of the value: */
    const double rest =
        v.reflects ? D / (4 * v.wo[2]) : D * x.om * -x.im / (v.wo[2] * x.n * x.n);
    const imp_spec tint = in[v.reflects ? TINT_R : TINT_T];
    imp_spec d_alpha[2];

    df[v.reflects ? TINT_R : TINT_T] = imp__spec(share * rest * Gi * Go);
    for (int j = 0; j < 2; j++)
        d_alpha[j] =
            tint * (share * rest * (dlog_D[j] * Gi * Go + dGi[j] * Go + Gi * dGo[j]));
    imp__roughness_d(b->self, &in[ALPHA], d_alpha, &df[ALPHA]);

    if (q.type == IMP_GGX) return;
    double d_e = F_e;
    if (!v.reflects) {
        const imp_v3 dm = (v.wi - x.m * x.im) * (1 / x.n);
        const double dom = imp__dot(v.wo, dm), dim = imp__dot(v.wi, dm);
        const double dlog = imp__microfacet_d_turned(&q, &x.m, &dm) + dom / x.om +
                            dim / x.im - 2 * x.im / x.n;
        d_e = -(F_e + F_c * dom) + share * dlog;
    }
    df[ETA] = tint * (d_e * rest * Gi * Go * (v.back ? -v.e * v.e : 1));
}

static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    const struct view v = view_of(in, d);
    struct facet x;
    for (int k = 0; k < 3; k++) d_wo[k] = d_wi[k] = imp__spec(0);
    if (!facet_of(&v, &x)) return;
    const struct imp__microfacet q = imp__roughness_at(b->self, &in[ALPHA]);
    const struct imp__clear_turns t = imp__microfacet_clear_turns(&q, &v.wo, &v.wi, v.e);
    const imp_spec tint = in[v.reflects ? TINT_R : TINT_T];
    for (int k = 0; k < 3; k++) {
        const imp_spec by = k == 2 && v.back ? -tint : tint;
        d_wo[k] = by * t.by_wo[k];
        d_wi[k] = by * t.by_wi[k];
    }
}

const struct imp_bsdf_ops imp__roughdielectric = {.size = sizeof(struct imp_bsdf_ops),
                                                  .name = "roughdielectric",
                                                  .object_size =
                                                      sizeof(struct imp__roughness),
                                                  .inputs = inputs,
                                                  .prepare = prepare,
                                                  .build = build,
                                                  .sample = sample,
                                                  .eval = eval,
                                                  .pdf = pdf,
                                                  .index_ratio = index_ratio,
                                                  .eval_d = eval_d,
                                                  .eval_directions_d = eval_directions_d};

/* ---- In lanes ---------------------------------------------------------------------------- */

IMP_EITHER_WAY imp_wide_truth sample_as(const bool ggx, const struct imp_bsdf *b,
                                        uint64_t derivative,
                                        const struct imp_wide_color *in,
                                        const imp_wide3 *wo, const imp_wide u[3],
                                        imp_wide3 *wi, imp_wide_lobe *lobe)
{
    const imp_wide zero = imp__wide(0);
    const struct imp__clear_side v = imp__clear_side(in[ETA].c[0], wo, wo);
    imp_wide cos_t, eta_t;
    (void)lobe;
    const struct imp__facets q = imp__roughness_drawn_lanes(
        ggx, b->self, &in[ALPHA], v.wo.z > zero, derivative, ALPHA);
    const imp_wide3 m = imp__facets_normals(&q, &v.wo, &u[1]);
    const imp_wide c = imp__wide3_inner(v.wo, m);
    const imp_wide_truth reflects =
        u[0] < IMP_WIDE_OF(imp__dielectric)(imp__wide_lesser(c, imp__wide(1)), v.e,
                                            &cos_t, &eta_t);
    const imp_wide3 mirrored = imp__wide3_minus(imp__wide3_times(m, 2 * c), v.wo),
                    refracted = imp__wide3_minus(imp__wide3_times(m, c / v.e - cos_t),
                                                 imp__wide3_times(v.wo, 1 / v.e));
    *wi = imp__wide3_unit(imp__wide3_choose(reflects, mirrored, refracted));
    const imp_wide_truth kept =
        ~((wi->z > zero) ^ reflects); /* its side is the right one */
    wi->z = imp__wide_choose(v.back, -wi->z, wi->z);
    return (v.wo.z > zero) & (c > zero) & kept;
}

IMP_EITHER_WAY imp_wide pdf_eval_as(const bool ggx, const struct imp_bsdf *b,
                                    uint64_t derivative, const struct imp_wide_color *in,
                                    const imp_wide3 *wo, const imp_wide3 *wi,
                                    const imp_wide_lobe *lobe, int colors,
                                    struct imp_wide_color *f)
{
    const struct imp__clear_side v = imp__clear_side(in[ETA].c[0], wo, wi);
    struct imp__clear_half x;
    imp_wide cos_t, eta_t;
    const imp_wide_truth there = imp__is_smooth(*lobe) & imp__clear_half(&v, &x);
    const struct imp__facets q =
        imp__roughness_drawn_lanes(ggx, b->self, &in[ALPHA], there, derivative, ALPHA);
    const imp_wide om = x.om, im = x.im, n = x.n;
    const imp_wide D = imp__facets_d(&q, x.m), Go = imp__facets_g1(&q, v.wo),
                   DG = D * imp__facets_g1(&q, v.wi) * Go;
    const imp_wide F = IMP_WIDE_OF(imp__dielectric)(om, v.e, &cos_t, &eta_t);
    const imp_wide of = imp__wide_choose(v.reflects, F * DG / (4 * v.wo.z),
                                         (1 - F) * DG * om * -im / (v.wo.z * n * n));
    for (int c = 0; c < colors; c++)
        f->c[c] = imp__wide_choose(v.reflects, in[TINT_R].c[c], in[TINT_T].c[c]) * of;
    const imp_wide p = imp__facets_normals_pdf(&q, &v.wo, &x.m, x.vm, D, Go);
    return imp__wide_choose(there,
                            imp__wide_choose(v.reflects, F * p / (4 * om),
                                             (1 - F) * p * v.e * v.e * -im / (n * n)),
                            imp__wide(0));
}

/* By the index, of Beckmann's facets: what `share` times rest has, where the facet turns. */
static imp_wide by_index(const struct imp__facets *q, const struct imp__clear_side *v,
                         const struct imp__clear_half *x, imp_wide share, imp_wide F_c,
                         imp_wide F_e)
{
    const imp_wide3 dm = imp__wide3_times(
        imp__wide3_minus(v->wi, imp__wide3_times(x->m, x->im)), 1 / x->n);
    const imp_wide dom = imp__wide3_inner(v->wo, dm), dim = imp__wide3_inner(v->wi, dm);
    /* imp__microfacet_d_turned */
    const imp_wide au2 = q->au * q->au, av2 = q->av * q->av, z = x->m.z, dz = dm.z;
    const imp_wide s = x->m.x * x->m.x / au2 + x->m.y * x->m.y / av2,
                   ds = 2 * (x->m.x * dm.x / au2 + x->m.y * dm.y / av2);
    const imp_wide turned = (2 * s * dz / z - ds) / (z * z) - 4 * dz / z;
    const imp_wide dlog = turned + dom / x->om + dim / x->im - 2 * x->im / x->n;
    return imp__wide_choose(v->reflects, F_e, -(F_e + F_c * dom) + share * dlog);
}

IMP_EITHER_WAY bool eval_d_as(const bool ggx, const struct imp_bsdf *b,
                              const struct imp_wide_color *in, const imp_wide3 *wo,
                              const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                              struct imp_wide_color *d)
{
    const struct imp__roughness *r = b->self;
    const imp_wide zero = imp__wide(0);
    const struct imp__clear_side v = imp__clear_side(in[ETA].c[0], wo, wi);
    struct imp__clear_half x;
    imp_wide F_c, F_e, dlog_D[2], dGi[2], dGo[2], by[2], by_eta = zero;
    const imp_wide_truth there = imp__is_smooth(*lobe) & imp__clear_half(&v, &x);
    const struct imp__facets q = imp__roughness_lanes(ggx, r, &in[ALPHA], there);
    const imp_wide D = imp__facets_d(&q, x.m), Gi = imp__facets_g1_d(&q, v.wi, dGi),
                   Go = imp__facets_g1_d(&q, v.wo, dGo),
                   F = IMP_WIDE_OF(imp__dielectric_d)(x.om, v.e, &F_c, &F_e);
    imp__facets_d_log(&q, x.m, dlog_D);
    const imp_wide share = imp__wide_choose(v.reflects, F, 1 - F),
                   rest = imp__wide_choose(v.reflects, D / (4 * v.wo.z),
                                           D * x.om * -x.im / (v.wo.z * x.n * x.n)),
                   all = share * rest * Gi * Go;
    for (int j = 0; j < 2; j++) {
        const int input = r->anisotropic ? ALPHA_U + j : ALPHA;
        by[j] = share * rest * (dlog_D[j] * Gi * Go + dGi[j] * Go + Gi * dGo[j]);
        by[j] = imp__wide_choose(there & ~(in[input].c[0] < IMP_ALPHA_MIN), by[j], zero);
    }
    if (q.type != IMP_GGX) /* else the index has none (imp__ggx_glass_jumps) */
        by_eta = imp__wide_choose(there,
                                  by_index(&q, &v, &x, share, F_c, F_e) * rest * Gi * Go *
                                      imp__wide_choose(v.back, -v.e * v.e, imp__wide(1)),
                                  zero);
    for (int c = 0; c < colors; c++) {
        const imp_wide tint =
            imp__wide_choose(v.reflects, in[TINT_R].c[c], in[TINT_T].c[c]);
        d[TINT_R].c[c] = imp__wide_choose(there & v.reflects, all, zero);
        d[TINT_T].c[c] = imp__wide_choose(there & ~v.reflects, all, zero);
        d[ETA].c[c] = tint * by_eta;
        d[ALPHA].c[c] = r->anisotropic ? zero : tint * by[0] + tint * by[1];
        d[ALPHA_U].c[c] = r->anisotropic ? tint * by[0] : zero;
        d[ALPHA_V].c[c] = r->anisotropic ? tint * by[1] : zero;
    }
    return true;
}

static imp_wide index_ratio_lanes(const struct imp_bsdf *b,
                                  const struct imp_wide_color *in, const imp_wide3 *wo,
                                  const imp_wide3 *wi, const imp_wide_lobe *lobe)
{
    const struct imp__clear_side v = imp__clear_side(in[ETA].c[0], wo, wi);
    (void)b, (void)lobe;
    return imp__wide_choose(v.reflects, imp__wide(1), v.e);
}

IMP_KERNEL_BY(imp__are_ggx_visible)

const struct imp_bsdf_lanes imp__roughdielectric_lanes = {.sample = sample_lanes,
                                                          .pdf_eval = pdf_eval_lanes,
                                                          .eval_d = eval_d_lanes,
                                                          .index_ratio =
                                                              index_ratio_lanes};
