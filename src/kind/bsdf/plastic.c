/* SPDX-License-Identifier: Apache-2.0
 *
 * plastic: a diffuse base under a smooth clear coat of index eta. The coat reflects like a
 * mirror, the base what comes through it, and what comes back from inside is reflected
 * again with the mean reflectance r = F_dr(1/eta):
 *
 *   delta lobe  tint F(cos_o)
 *   smooth      rho/(1 - k r) (1 - F(cos_i)) (1 - F(cos_o))/eta^2 cos_i/pi,   front only
 *
 * k = rho if `nonlinear`, so that the base's colour deepens with every reflection, else 1.
 * The index bends no path that is followed, and has a gradient. */
#include "blending.h"
#include "bsdf_lanes.h"
#include "fresnel.h"
#include "fresnel_lanes.h"
#include "lambert.h"
#include "presets.h"

enum { DIFFUSE, TINT, ETA };
enum { MIRROR }; /* the delta lobe */

struct plastic {
    bool nonlinear;
};

static const struct imp_input_desc inputs[] = {{.name = "diffuse_reflectance",
                                                .role = IMP_REFLECTANCE,
                                                .fallback = 0.5,
                                                .hi = 1,
                                                .unit = "1"},
                                               IMP_TINT_INPUT("specular_reflectance"),
                                               IMP_IOR_INPUT(1.49 / 1.000277, 0.1, 10),
                                               {0}};

static enum imp_status prepare(const struct imp_build *b)
{
    return imp__ior_prepare(b, "polypropylene", true);
}

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    struct plastic *p = self;
    b->flags = IMP_BSDF_SMOOTH | IMP_BSDF_DELTA;
    b->n_lobes = 1;
    return imp_build_bool(build, "nonlinear", false, &p->nonlinear);
}

static double fresnel(const imp_spec *in, double c)
{
    double cos_t, eta_t;
    return imp__fresnel_dielectric(c, in[ETA][0], &cos_t, &eta_t);
}

/* Probability of the mirror lobe: its share of what is reflected, roughly. Its own input: */
#define OF_MIRROR IMP_INPUT_BIT(TINT)
static double mirror_chance(const imp_spec *in, const struct imp_dirs *d, double F)
{
    return imp__coated_chance(in[TINT], in[DIFFUSE], d, F, OF_MIRROR);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)b;
    if (!(d->wo[2] > 0)) return false;
    if (!(u[0] < mirror_chance(in, d, fresnel(in, d->wo[2]))))
        return imp__lambert_sample(&u[1], d);
    d->lobe = MIRROR;
    d->wi = imp__v3(-d->wo[0], -d->wo[1], d->wo[2]);
    return true;
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    (void)b;
    if (!(d->wo[2] > 0)) return 0;
    const double q = mirror_chance(in, d, fresnel(in, d->wo[2]));
    if (d->lobe == IMP_SMOOTH) return (1 - q) * imp__lambert(d);
    return d->lobe == MIRROR ? q : 0;
}

/* rho/(1 - k r) and its derivatives. */
static imp_spec base(const struct plastic *p, const imp_spec *in, double r,
                     imp_spec *d_rho, imp_spec *d_r)
{
    const imp_spec rho = in[DIFFUSE];
    const imp_spec q = 1 / (1 - (p->nonlinear ? rho : imp__spec(1)) * r);
    *d_rho = p->nonlinear ? q * q : q;
    *d_r = (p->nonlinear ? rho : imp__spec(1)) * rho * q * q;
    return rho * q;
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    imp_spec d_rho, d_r;
    double d_e;
    *f = imp__spec(0);
    if (!(d->wo[2] > 0)) return;
    const double eta = in[ETA][0], Fo = fresnel(in, d->wo[2]);
    if (d->lobe == IMP_SMOOTH && d->wi[2] > 0)
        *f = base(b->self, in, imp__fresnel_diffuse(1 / eta, &d_e), &d_rho, &d_r) *
             ((1 - Fo) * (1 - fresnel(in, d->wi[2])) / (eta * eta) * imp__lambert(d));
    else if (d->lobe == MIRROR) *f = in[TINT] * Fo;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    double d_c, dFo, dFi, dr_de;
    imp_spec d_rho, d_r;
    df[DIFFUSE] = df[TINT] = df[ETA] = imp__spec(0);
    if (!(d->wo[2] > 0)) return;
    const double eta = in[ETA][0];
    const double Fo = imp__fresnel_dielectric_d(d->wo[2], eta, &d_c, &dFo);
    if (d->lobe == MIRROR) {
        df[TINT] = imp__spec(Fo);
        df[ETA] = in[TINT] * dFo;
    }
    if (d->lobe != IMP_SMOOTH || !(d->wi[2] > 0)) return;
    const double Fi = imp__fresnel_dielectric_d(d->wi[2], eta, &d_c, &dFi);
    const double inv2 = 1 / (eta * eta), lambert = imp__lambert(d) * inv2;
    const double T = (1 - Fo) * (1 - Fi), r = imp__fresnel_diffuse(1 / eta, &dr_de);
    const imp_spec rho = base(b->self, in, r, &d_rho, &d_r);
    df[DIFFUSE] = d_rho * (T * lambert);
    df[ETA] = rho * (lambert * (-dFo * (1 - Fi) - dFi * (1 - Fo) - 2 * T / eta)) -
              d_r * (dr_de * inv2 * T * lambert);
}

/* The smooth lobe alone: rho (1 - Fo) (1 - Fi)/eta^2 cos_i/pi. */
static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    double d_e, dFo, dFi;
    imp_spec d_rho, d_r;
    for (int k = 0; k < 3; k++) d_wo[k] = d_wi[k] = imp__spec(0);
    if (!imp__front(d)) return;
    const double eta = in[ETA][0], z = d->wi[2];
    const double Fo = imp__fresnel_dielectric_d(d->wo[2], eta, &dFo, &d_e),
                 Fi = imp__fresnel_dielectric_d(z, eta, &dFi, &d_e);
    const imp_spec rho =
        base(b->self, in, imp__fresnel_diffuse(1 / eta, &d_e), &d_rho, &d_r) *
        (IMP_INV_PI / (eta * eta));
    d_wo[2] = rho * (-dFo * (1 - Fi) * z);
    d_wi[2] = rho * ((1 - Fo) * (1 - Fi - dFi * z));
}

static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    (void)b, (void)wo;
    *rho = in[DIFFUSE];
}

const struct imp_bsdf_ops imp__plastic = {.size = sizeof(struct imp_bsdf_ops),
                                          .name = "plastic",
                                          .object_size = sizeof(struct plastic),
                                          .inputs = inputs,
                                          .prepare = prepare,
                                          .build = build,
                                          .sample = sample,
                                          .eval = eval,
                                          .pdf = pdf,
                                          .eval_d = eval_d,
                                          .albedo = albedo,
                                          .eval_directions_d = eval_directions_d};

/* ---- In lanes ---------------------------------------------------------------------------- */

static imp_wide fresnels(const struct imp_wide_color *in, imp_wide c)
{
    imp_wide cos_t, eta_t;
    return IMP_WIDE_OF(imp__dielectric)(c, in[ETA].c[0], &cos_t, &eta_t);
}

static imp_wide_truth sample_lanes(const struct imp_bsdf *b, uint64_t derivative,
                                   const struct imp_wide_color *in, const imp_wide3 *wo,
                                   const imp_wide u[3], imp_wide3 *wi,
                                   imp_wide_lobe *lobe)
{
    (void)b;
    const imp_wide_truth mirrors =
        u[0] < imp__coated_chances(&in[TINT], &in[DIFFUSE], derivative,
                                   fresnels(in, wo->z), OF_MIRROR);
    const imp_wide_truth drawn = imp__lambert_samples(u, wo, wi);
    *wi = imp__wide3_choose(mirrors, imp__mirrors(wo), *wi);
    imp__lobe_set(lobe, mirrors, MIRROR);
    return (wo->z > imp__wide(0)) & (mirrors | drawn);
}

static imp_wide pdf_eval_lanes(const struct imp_bsdf *b, uint64_t derivative,
                               const struct imp_wide_color *in, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                               struct imp_wide_color *f)
{
    const struct plastic *p = b->self;
    const imp_wide zero = imp__wide(0), eta = in[ETA].c[0];
    const imp_wide Fo = fresnels(in, wo->z), lambert = imp__lamberts(wo, wi),
                   q = imp__coated_chances(&in[TINT], &in[DIFFUSE], derivative, Fo,
                                           OF_MIRROR);
    const imp_wide_truth smooth = imp__is_smooth(*lobe);
    double d_e; /* the index is a number: the same in all lanes */
    const double r = imp__fresnel_diffuse(1 / eta[0], &d_e);
    const imp_wide through = (1 - Fo) * (1 - fresnels(in, wi->z)) / (eta * eta) * lambert;
    for (int c = 0; c < colors; c++) {
        const imp_wide rho = in[DIFFUSE].c[c];
        const imp_wide again = 1 / (1 - (p->nonlinear ? rho : imp__wide(1)) * r);
        f->c[c] = imp__wide_choose(smooth, rho * again * through, in[TINT].c[c] * Fo);
    }
    return imp__wide_choose(wo->z > zero, imp__wide_choose(smooth, (1 - q) * lambert, q),
                            zero);
}

static bool eval_d_lanes(const struct imp_bsdf *b, const struct imp_wide_color *in,
                         const imp_wide3 *wo, const imp_wide3 *wi,
                         const imp_wide_lobe *lobe, int colors, struct imp_wide_color *d)
{
    const struct plastic *p = b->self;
    const imp_wide zero = imp__wide(0), one = imp__wide(1), eta = in[ETA].c[0];
    imp_wide d_c, dFo, dFi;
    double dr_de;
    const double r = imp__fresnel_diffuse(1 / eta[0], &dr_de);
    const imp_wide Fo = IMP_WIDE_OF(imp__dielectric_d)(wo->z, eta, &d_c, &dFo),
                   Fi = IMP_WIDE_OF(imp__dielectric_d)(wi->z, eta, &d_c, &dFi);
    const imp_wide_truth above = wo->z > zero,
                         mirrors = above & (*lobe == (imp_wide_lobe){0} + MIRROR),
                         base = imp__fronts(wo, wi) & imp__is_smooth(*lobe);
    const imp_wide inv2 = 1 / (eta * eta), lambert = imp__lamberts(wo, wi) * inv2,
                   T = (1 - Fo) * (1 - Fi);
    const imp_wide through = T * lambert, again = dr_de * inv2 * T * lambert,
                   by_eta = lambert * (-dFo * (1 - Fi) - dFi * (1 - Fo) - 2 * T / eta);
    for (int c = 0; c < colors; c++) {
        const imp_wide rho = in[DIFFUSE].c[c], k = p->nonlinear ? rho : one;
        const imp_wide q = 1 / (1 - k * r), d_rho = p->nonlinear ? q * q : q,
                       d_r = k * rho * q * q;
        d[DIFFUSE].c[c] = imp__wide_choose(base, d_rho * through, zero);
        d[TINT].c[c] = imp__wide_choose(mirrors, Fo, zero);
        d[ETA].c[c] =
            imp__wide_choose(base, rho * q * by_eta - d_r * again,
                             imp__wide_choose(mirrors, in[TINT].c[c] * dFo, zero));
    }
    return true;
}

const struct imp_bsdf_lanes imp__plastic_lanes = {
    .sample = sample_lanes, .pdf_eval = pdf_eval_lanes, .eval_d = eval_d_lanes};
