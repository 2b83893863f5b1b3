/* SPDX-License-Identifier: Apache-2.0
 *
 * roughplastic: a diffuse base under a coat of small facets. With h the half-vector, T
 * what the coat lets through and R its mean reflectance from inside (coat.h)
 *
 *   f cos(theta_i) = tint F(wo.h) D(h) G1(wi) G1(wo)/(4 cos_o)
 *                  + rho/(1 - k R) T(cos_i) T(cos_o)/eta^2 cos_i/pi,       front only
 *
 * with k = rho if `nonlinear`, else 1. Roughness and index are numbers, since T and R are
 * tables that are made for them, and made anew when they change. */
#include "blending.h"
#include "coat.h"
#include "facet_lanes.h"
#include "fresnel.h"
#include "fresnel_lanes.h"
#include "lambert.h"
#include "presets.h"
#include "roughness.h"

enum { DIFFUSE, TINT, ETA, ALPHA, N_INPUTS };

struct roughplastic {
    struct imp__roughness r; /* first (imp__are_ggx_visible) */
    bool nonlinear;
    struct imp__coat coat;
};

static const struct imp_input_desc inputs[] = {
    {.name = "diffuse_reflectance",
     .role = IMP_REFLECTANCE,
     .fallback = 0.5,
     .hi = 1,
     .unit = "1"},
    IMP_TINT_INPUT("specular_reflectance"),
    IMP_IOR_INPUT(1.49 / 1.000277, 0.1, 10),
    IMP_ROUGHNESS_INPUT("alpha", IMP_INPUT_NUMBER),
    {0}};

static enum imp_status prepare(const struct imp_build *b)
{
    const enum imp_status st = imp__ior_prepare(b, "polypropylene", false);
    return st == IMP_OK ? imp__roughness_prepare(b) : st;
}

static void changed(const struct imp_bsdf *b)
{
    struct roughplastic *p = b->self;
    imp__coat_make(&p->coat, p->r.type, imp_max(b->input[ALPHA]->value[0], IMP_ALPHA_MIN),
                   b->input[ETA]->value[0]);
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    enum imp_status st = IMP_OK;
    struct roughplastic *p = self;
    IMP_TRY(imp__roughness_build(b, &p->r));
    IMP_TRY(imp_build_bool(b, "nonlinear", false, &p->nonlinear));
    if (p->r.anisotropic)
        IMP_TRY(imp_build_error(b, "alpha_u", IMP_E_SCENE,
                                "has one roughness, 'alpha', for all directions"));
    bsdf->flags = IMP_BSDF_SMOOTH;
    changed(bsdf);
out:
    return st;
}

/* All that the functions below need at their inputs. */
struct at {
    const struct roughplastic *p;
    struct imp__microfacet facets;
    double alpha, eta;
};
static struct at at_inputs(const struct imp_bsdf *b, const imp_spec *in)
{
    const struct roughplastic *p = b->self;
    const double alpha = imp_max(in[ALPHA][0], IMP_ALPHA_MIN);
    return (struct at){p, {p->r.type, p->r.visible, alpha, alpha, 0}, alpha, in[ETA][0]};
}

static unsigned wanted_of(uint64_t derivative)
{
    return derivative & IMP_INPUT_BIT(ALPHA) ? IMP_SCORE_SCALE : 0;
}
/* The same, for drawing directions. */
static struct at at_drawn(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    struct at a = at_inputs(b, in);
    a.facets.wanted = wanted_of(d->derivative);
    return a;
}

static double number(const struct at *a, imp__dual x)
{
    return imp__coat_at(&a->p->coat, x, a->alpha, a->eta);
}

/* Probability of the lobe of facets. Its own inputs: */
#define OF_FACETS (IMP_INPUT_BIT(TINT) | IMP_INPUT_BIT(ALPHA))
static double facet_chance(const struct at *a, const imp_spec *in,
                           const struct imp_dirs *d)
{
    const double T = imp_clamp(number(a, imp__coat_T(&a->p->coat, d->wo[2])), 0, 1);
    return imp__coated_chance(in[TINT], in[DIFFUSE], d, 1 - T, OF_FACETS);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    if (!(d->wo[2] > 0)) return false;
    const struct at a = at_drawn(b, in, d);
    if (!(u[0] < facet_chance(&a, in, d))) return imp__lambert_sample(&u[1], d);
    const imp_v3 h = imp__microfacet_sample(&a.facets, &d->wo, &u[1]);
    const double c = imp__dot(d->wo, h);
    if (!(c > 0)) return false;
    d->wi = imp__normalize(h * (2 * c) - d->wo);
    d->lobe = IMP_SMOOTH;
    return d->wi[2] > 0;
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    if (!imp__front(d)) return 0;
    const struct at a = at_drawn(b, in, d);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    const double q = facet_chance(&a, in, d);
    return q * imp__microfacet_pdf(&a.facets, &d->wo, &h) / (4 * imp__dot(d->wo, h)) +
           (1 - q) * imp__lambert(d);
}

/* rho/(1 - k R) and its derivatives. */
static imp_spec base(const struct at *a, const imp_spec *in, imp_spec *d_rho,
                     imp_spec *d_R)
{
    const imp_spec rho = in[DIFFUSE], k = a->p->nonlinear ? rho : imp__spec(1);
    const imp_spec q = 1 / (1 - k * number(a, a->p->coat.R_int));
    *d_rho = a->p->nonlinear ? q * q : q;
    *d_R = k * rho * q * q;
    return rho * q;
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    imp_spec d_rho, d_R;
    double cos_t, eta_t;
    *f = imp__spec(0);
    if (!imp__front(d)) return;
    const struct at a = at_inputs(b, in);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    const double F =
        imp__fresnel_dielectric(imp_min(imp__dot(d->wo, h), 1), a.eta, &cos_t, &eta_t);
    const double lobe = F * imp__microfacet_d(&a.facets, &h, NULL) *
                        imp__microfacet_g1(&a.facets, &d->wi, NULL) *
                        imp__microfacet_g1(&a.facets, &d->wo, NULL) / (4 * d->wo[2]);
    const double T = number(&a, imp__coat_T(&a.p->coat, d->wi[2])) *
                     number(&a, imp__coat_T(&a.p->coat, d->wo[2]));
    *f = in[TINT] * lobe +
         base(&a, in, &d_rho, &d_R) * (T / (a.eta * a.eta) * imp__lambert(d));
}

static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    imp_spec d_rho, d_R;
    double dlog_D[2], dGi[2], dGo[2], F_c, F_e;
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    if (!imp__front(d)) return;
    const struct at a = at_inputs(b, in);
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    const double F =
        imp__fresnel_dielectric_d(imp_min(imp__dot(d->wo, h), 1), a.eta, &F_c, &F_e);
    const double c = imp__microfacet_d(&a.facets, &h, dlog_D) / (4 * d->wo[2]);
    const double Gi = imp__microfacet_g1(&a.facets, &d->wi, dGi),
                 Go = imp__microfacet_g1(&a.facets, &d->wo, dGo);
    df[TINT] = imp__spec(F * c * Gi * Go);
    df[ETA] = in[TINT] * (F_e * c * Gi * Go);
    df[ALPHA] = in[TINT] * (F * c *
                            ((dlog_D[0] + dlog_D[1]) * Gi * Go + (dGi[0] + dGi[1]) * Go +
                             Gi * (dGo[0] + dGo[1])));

    const imp__dual Ti = imp__coat_T(&a.p->coat, d->wi[2]),
                    To = imp__coat_T(&a.p->coat, d->wo[2]), R = a.p->coat.R_int;
    const double ti = number(&a, Ti), to = number(&a, To), T = ti * to;
    const double lambert = imp__lambert(d) / (a.eta * a.eta);
    const imp_spec rho = base(&a, in, &d_rho, &d_R);
    df[DIFFUSE] = d_rho * (T * lambert);
    df[ALPHA] += rho * ((Ti[1] * to + ti * To[1]) * lambert) + d_R * (R[1] * T * lambert);
    df[ETA] += rho * ((Ti[2] * to + ti * To[2] - 2 * T / a.eta) * lambert) +
               d_R * (R[2] * T * lambert);
}

static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    imp_spec d_rho, d_R;
    double F_c, F_e;
    for (int k = 0; k < 3; k++) d_wo[k] = d_wi[k] = imp__spec(0);
    if (!imp__front(d)) return;
    const struct at a = at_inputs(b, in);
    const struct imp__facet_turns x = imp__microfacet_turns(&a.facets, &d->wo, &d->wi);
    const double F = imp__fresnel_dielectric_d(imp_min(x.c, 1), a.eta, &F_c, &F_e);
    const imp_spec tint = in[TINT] * (1 / (4 * d->wo[2]));
    for (int k = 0; k < 3; k++) {
        d_wo[k] = tint * (F * x.by_wo[k] + 0.5 * F_c * x.h[k] * x.DG);
        d_wi[k] = tint * (F * x.by_wi[k] + 0.5 * F_c * x.h[k] * x.DG);
    }
    d_wo[2] -= tint * (F * x.DG / d->wo[2]);

    const double mu[2] = {d->wo[2], d->wi[2]};
    double T[2], slope[2];
    for (int k = 0; k < 2; k++) {
        T[k] = number(&a, imp__coat_T(&a.p->coat, mu[k]));
        slope[k] = number(&a, imp__coat_T_slope(&a.p->coat, mu[k]));
    }
    const imp_spec rho = base(&a, in, &d_rho, &d_R) * (IMP_INV_PI / (a.eta * a.eta));
    d_wo[2] += rho * (slope[0] * T[1] * mu[1]);
    d_wi[2] += rho * (T[0] * (slope[1] * mu[1] + T[1]));
}

static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    (void)b, (void)wo;
    *rho = in[DIFFUSE];
}

const struct imp_bsdf_ops imp__roughplastic = {.size = sizeof(struct imp_bsdf_ops),
                                               .name = "roughplastic",
                                               .object_size = sizeof(struct roughplastic),
                                               .inputs = inputs,
                                               .prepare = prepare,
                                               .build = build,
                                               .sample = sample,
                                               .eval = eval,
                                               .pdf = pdf,
                                               .eval_d = eval_d,
                                               .albedo = albedo,
                                               .changed = changed,
                                               .eval_directions_d = eval_directions_d};

/* ---- In lanes ---------------------------------------------------------------------------- */

/* Roughness and index are numbers, the same in all lanes. */
static struct at at_lanes(const struct imp_bsdf *b, const struct imp_wide_color *in)
{
    imp_spec own[N_INPUTS] = {0};
    own[ALPHA] = imp__spec(in[ALPHA].c[0][0]);
    own[ETA] = imp__spec(in[ETA].c[0][0]);
    return at_inputs(b, own);
}

/* imp__coat_T at mu, the first n of the dual. */
static inline void coats(const struct at *a, imp_wide mu, int n, imp_wide T[3])
{
    const imp_wide zero = imp__wide(0), one = imp__wide(1);
    const imp_wide x =
        imp__wide_larger(imp__wide_lesser(mu, one), zero) * (IMP_COAT_NODES - 1);
    const imp_wide k =
        imp__wide_lesser(imp__wide_floor(x), imp__wide(IMP_COAT_NODES - 2));
    for (int j = 0; j < n; j++) {
        const double *from = (const double *)a->p->coat.T + j;
        const imp_wide own = imp__wide_found(from, 4 * k),
                       next = imp__wide_found(from + 4, 4 * k);
        T[j] = own + (next - own) * (x - k);
    }
}
/* number(). */
static inline imp_wide numbers(const struct at *a, const imp_wide T[3])
{
    const struct imp__coat *coat = &a->p->coat;
    return T[0] + T[1] * (a->alpha - coat->alpha) + T[2] * (a->eta - coat->eta);
}
/* number() of imp__coat_T at mu: as a rule what the table was made for, so that the rest is 0. */
static imp_wide lets_through(const struct at *a, imp_wide mu)
{
    const bool own = a->alpha == a->p->coat.alpha && a->eta == a->p->coat.eta;
    imp_wide T[3] = {imp__wide(0), imp__wide(0), imp__wide(0)};
    coats(a, mu, own ? 1 : 3, T);
    return numbers(a, T);
}

static imp_wide facet_chances(const struct imp_wide_color *in, uint64_t derivative,
                              imp_wide through)
{
    const imp_wide T = imp__wide_clamp(through, 0, 1);
    return imp__coated_chances(&in[TINT], &in[DIFFUSE], derivative, 1 - T, OF_FACETS);
}

IMP_EITHER_WAY imp_wide_truth sample_as(const bool ggx, const struct imp_bsdf *b,
                                        uint64_t derivative,
                                        const struct imp_wide_color *in,
                                        const imp_wide3 *wo, const imp_wide u[3],
                                        imp_wide3 *wi, imp_wide_lobe *lobe)
{
    const struct at a = at_lanes(b, in);
    const imp_wide_truth facets =
        u[0] < facet_chances(in, derivative, lets_through(&a, wo->z));
    const struct imp__facets m = imp__roughness_drawn_lanes(
        ggx, &a.p->r, &in[ALPHA], facets & (wo->z > imp__wide(0)), derivative, ALPHA);
    const imp_wide3 h = imp__facets_normals(&m, wo, &u[1]);
    const imp_wide c = imp__wide3_inner(*wo, h);
    const imp_wide_truth drawn = imp__lambert_samples(u, wo, wi);
    (void)lobe;
    *wi = imp__wide3_choose(facets, imp__mirrors_in(wo, &h, c), *wi);
    return imp__fronts(wo, wi) & ((facets & (c > imp__wide(0))) | (~facets & drawn));
}

IMP_EITHER_WAY imp_wide pdf_eval_as(const bool ggx, const struct imp_bsdf *b,
                                    uint64_t derivative, const struct imp_wide_color *in,
                                    const imp_wide3 *wo, const imp_wide3 *wi,
                                    const imp_wide_lobe *lobe, int colors,
                                    struct imp_wide_color *f)
{
    const struct at a = at_lanes(b, in);
    const imp_wide_truth here = imp__fronts(wo, wi);
    const struct imp__facets m =
        imp__roughness_drawn_lanes(ggx, &a.p->r, &in[ALPHA], here, derivative, ALPHA);
    const imp_wide eta = imp__wide(a.eta);
    const imp_wide3 h = imp__wide3_unit(imp__wide3_plus(*wo, *wi));
    const imp_wide vm = imp__wide3_inner(*wo, h), lambert = imp__lamberts(wo, wi);
    const imp_wide D = imp__facets_d(&m, h), Go = imp__facets_g1(&m, *wo),
                   Gi = imp__facets_g1(&m, *wi);
    const imp_wide To = lets_through(&a, wo->z), Ti = lets_through(&a, wi->z);
    imp_wide cos_t, eta_t;
    (void)lobe;
    const imp_wide F = IMP_WIDE_OF(imp__dielectric)(imp__wide_lesser(vm, imp__wide(1)),
                                                    eta, &cos_t, &eta_t);
    const imp_wide facets = F * D * Gi * Go / (4 * wo->z),
                   base = Ti * To / (eta * eta) * lambert;
    const double R = number(&a, a.p->coat.R_int);
    for (int c = 0; c < colors; c++) {
        const imp_wide rho = in[DIFFUSE].c[c];
        const imp_wide again = 1 / (1 - (a.p->nonlinear ? rho : imp__wide(1)) * R);
        f->c[c] = in[TINT].c[c] * facets + rho * again * base;
    }
    const imp_wide q = facet_chances(in, derivative, To);
    return imp__wide_choose(
        here,
        q * imp__facets_normals_pdf(&m, wo, &h, vm, D, Go) / (4 * vm) + (1 - q) * lambert,
        imp__wide(0));
}

IMP_EITHER_WAY bool eval_d_as(const bool ggx, const struct imp_bsdf *b,
                              const struct imp_wide_color *in, const imp_wide3 *wo,
                              const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                              struct imp_wide_color *d)
{
    const struct at a = at_lanes(b, in);
    const imp_wide_truth here = imp__fronts(wo, wi);
    const struct imp__facets m =
        imp__roughness_drawn_lanes(ggx, &a.p->r, &in[ALPHA], here, 0, ALPHA);
    const imp_wide zero = imp__wide(0), one = imp__wide(1), eta = imp__wide(a.eta);
    const imp_wide3 h = imp__wide3_unit(imp__wide3_plus(*wo, *wi));
    imp_wide dlog_D[2], dGi[2], dGo[2], F_c, F_e, Ti[3], To[3];
    (void)lobe;
    const imp_wide F = IMP_WIDE_OF(imp__dielectric_d)(
        imp__wide_lesser(imp__wide3_inner(*wo, h), one), eta, &F_c, &F_e);
    const imp_wide Gi = imp__facets_g1_d(&m, *wi, dGi),
                   Go = imp__facets_g1_d(&m, *wo, dGo),
                   c = imp__facets_d(&m, h) / (4 * wo->z);
    imp__facets_d_log(&m, h, dlog_D);
    const imp_wide by_tint = F * c * Gi * Go, facets_eta = F_e * c * Gi * Go,
                   facets_alpha = F * c *
                                  ((dlog_D[0] + dlog_D[1]) * Gi * Go +
                                   (dGi[0] + dGi[1]) * Go + Gi * (dGo[0] + dGo[1]));

    coats(&a, wi->z, 3, Ti);
    coats(&a, wo->z, 3, To);
    const imp__dual R = a.p->coat.R_int;
    const double r = number(&a, R);
    const imp_wide ti = numbers(&a, Ti), to = numbers(&a, To), T = ti * to;
    const imp_wide lambert = imp__lamberts(wo, wi) / (eta * eta), through = T * lambert;
    const imp_wide base_alpha = (Ti[1] * to + ti * To[1]) * lambert,
                   base_eta = (Ti[2] * to + ti * To[2] - 2 * T / eta) * lambert,
                   again_alpha = R[1] * T * lambert, again_eta = R[2] * T * lambert;
    for (int k = 0; k < colors; k++) {
        const imp_wide in_rho = in[DIFFUSE].c[k], tint = in[TINT].c[k],
                       again = a.p->nonlinear ? in_rho : one;
        const imp_wide q = 1 / (1 - again * r), d_rho = a.p->nonlinear ? q * q : q,
                       d_R = again * in_rho * q * q, rho = in_rho * q;
        const imp_wide own[N_INPUTS] = {
            [DIFFUSE] = d_rho * through,
            [TINT] = by_tint,
            [ETA] = tint * facets_eta + (rho * base_eta + d_R * again_eta),
            [ALPHA] = tint * facets_alpha + (rho * base_alpha + d_R * again_alpha)};
        for (int j = 0; j < N_INPUTS; j++)
            d[j].c[k] = imp__wide_choose(here, own[j], zero);
    }
    return true;
}

IMP_KERNEL_BY(imp__are_ggx_visible)

const struct imp_bsdf_lanes imp__roughplastic_lanes = {
    .sample = sample_lanes, .pdf_eval = pdf_eval_lanes, .eval_d = eval_d_lanes};
