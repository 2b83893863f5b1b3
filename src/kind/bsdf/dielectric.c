/* SPDX-License-Identifier: Apache-2.0
 *
 * dielectric: a smooth boundary of two clear media, two delta lobes. With F the Fresnel
 * reflectance, F tint_r is reflected and (1 - F) tint_t (n_wo/n_wi)^2 refracted: radiance
 * is compressed where the index is higher. Lobes are drawn with probabilities F and 1 -
 * F, whatever the tints are, so that a tint of 0 keeps its derivative. The index bends
 * paths and has no gradient: it can be set, and a request for its derivative is refused
 * (docs/estimators.md 9.3).
 *
 * Where things move, directions turn, and with them F. Next to the limb of a ball little is refracted: at the
 * distance x from it 1 - F ~ sqrt(x), whose derivative by x is of the same size over x. Drawn with the probability
 * 1 - F its square would have no mean. F and 1 - F have derivatives of one size: the lobe that has less of the
 * power is then drawn with at least a tenth, and half where much is reflected. */
#include "bsdf_lanes.h"
#include "fresnel.h"
#include "fresnel_lanes.h"
#include "kind/build.h"
#include "presets.h"

enum { TINT_R, TINT_T, ETA };
enum { REFLECT, REFRACT }; /* lobes */

static const struct imp_input_desc inputs[] = {
    IMP_TINT_INPUT("specular_reflectance"),
    IMP_TINT_INPUT("specular_transmittance"),
    {.name = "eta",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_FIXED | IMP_INPUT_INDEX,
     .fallback = 1.5046 / 1.000277,
     .lo = 1e-3,
     .hi = 1e3,
     .unit = "1"}, /* inside/outside */
    {0}};

static enum imp_status prepare(const struct imp_build *b)
{
    return imp__ior_prepare(b, "bk7", true);
}

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    (void)build, (void)self;
    b->flags = IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT;
    b->n_lobes = 2;
    return IMP_OK;
}

#define LEAST 0.1
static bool turns(uint64_t derivative) { return derivative >> ETA & 1; }
/* The probability of the lobe that reflects, which has this part of the power. */
static double chance_of(uint64_t derivative, double part)
{
    return turns(derivative) && part < 1 ? LEAST + (1 - 2 * LEAST) * fmin(part, 0.5)
                                         : part;
}

/* Coefficient of a lobe without its tint; 0: nothing goes there. */
static double coefficient(const imp_spec *in, const struct imp_dirs *d, double *chance)
{
    double cos_t, eta_t;
    *chance = 0;
    if (d->wo[2] == 0) return 0;
    const double F = imp__fresnel_dielectric(d->wo[2], in[ETA][0], &cos_t, &eta_t);
    const double reflects = chance_of(d->derivative, F);
    if (d->lobe == REFLECT) {
        *chance = reflects;
        return F;
    }
    if (d->lobe != REFRACT) return 0;
    *chance = 1 - reflects;
    return (1 - F) / (eta_t * eta_t);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    double cos_t, eta_t;
    (void)b;
    if (d->wo[2] == 0) return false;
    const double F = imp__fresnel_dielectric(d->wo[2], in[ETA][0], &cos_t, &eta_t);
    if (u[0] < chance_of(d->derivative, F)) {
        d->lobe = REFLECT;
        d->wi = imp__v3(-d->wo[0], -d->wo[1], d->wo[2]);
    } else {
        d->lobe = REFRACT;
        d->wi = imp__v3(-d->wo[0] / eta_t, -d->wo[1] / eta_t, -copysign(cos_t, d->wo[2]));
    }
    return true;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    double chance;
    const double c = coefficient(in, d, &chance);
    (void)b;
    *f = c == 0 ? imp__spec(0) : in[d->lobe == REFLECT ? TINT_R : TINT_T] * c;
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    double chance;
    (void)b;
    coefficient(in, d, &chance);
    return chance;
}
static double index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    (void)b;
    if (d->lobe != REFRACT) return 1;
    return d->wo[2] > 0 ? in[ETA][0] : 1 / in[ETA][0];
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    double chance;
    const double c = coefficient(in, d, &chance);
    (void)b;
    df[ETA] = imp__spec(0);
    df[TINT_R] = imp__spec(d->lobe == REFLECT ? c : 0);
    df[TINT_T] = imp__spec(d->lobe == REFRACT ? c : 0);
}

static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *rho)
{
    double cos_t, eta_t;
    (void)b;
    *rho = imp__spec(0);
    if ((*wo)[2] == 0) return true;
    const double F = imp__fresnel_dielectric((*wo)[2], in[ETA][0], &cos_t, &eta_t);
    *rho = in[TINT_R] * F + in[TINT_T] * (1 - F);
    return true;
}

const struct imp_bsdf_ops imp__dielectric = {.size = sizeof(struct imp_bsdf_ops),
                                             .name = "dielectric",
                                             .inputs = inputs,
                                             .prepare = prepare,
                                             .build = build,
                                             .sample = sample,
                                             .eval = eval,
                                             .pdf = pdf,
                                             .index_ratio = index_ratio,
                                             .eval_d = eval_d,
                                             .directional_albedo = directional_albedo};

/* ---- In lanes ---------------------------------------------------------------------------- */

static imp_wide_truth is_lobe(const imp_wide_lobe *lobe, int k)
{
    return *lobe == (imp_wide_lobe){0} + k;
}

static imp_wide chance_of_lanes(uint64_t derivative, imp_wide part)
{
    const imp_wide half = imp__wide(0.5),
                   least = imp__wide_choose(part < half, part, half),
                   mixed = LEAST + (1 - 2 * LEAST) * least;
    return turns(derivative) ? imp__wide_choose(part < imp__wide(1), mixed, part) : part;
}

static imp_wide_truth sample_lanes(const struct imp_bsdf *b, uint64_t derivative,
                                   const struct imp_wide_color *in, const imp_wide3 *wo,
                                   const imp_wide u[3], imp_wide3 *wi,
                                   imp_wide_lobe *lobe)
{
    imp_wide cos_t, eta_t;
    (void)b;
    const imp_wide F = IMP_WIDE_OF(imp__dielectric)(wo->z, in[ETA].c[0], &cos_t, &eta_t);
    const imp_wide_truth reflects = u[0] < chance_of_lanes(derivative, F);
    const imp_wide3 through = {-wo->x / eta_t, -wo->y / eta_t,
                               -imp__wide_signed_as(cos_t, wo->z)};
    *wi = imp__wide3_choose(reflects, imp__mirrors(wo), through);
    imp__lobe_set(lobe, reflects, REFLECT);
    imp__lobe_set(lobe, ~reflects, REFRACT);
    return wo->z != imp__wide(0);
}
static imp_wide pdf_eval_lanes(const struct imp_bsdf *b, uint64_t derivative,
                               const struct imp_wide_color *in, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                               struct imp_wide_color *f)
{
    imp_wide cos_t, eta_t;
    const imp_wide zero = imp__wide(0);
    (void)b, (void)wi;
    const imp_wide F = IMP_WIDE_OF(imp__dielectric)(wo->z, in[ETA].c[0], &cos_t, &eta_t);
    const imp_wide_truth reflects = is_lobe(lobe, REFLECT);
    const imp_wide drawn = chance_of_lanes(derivative, F),
                   chance = imp__wide_choose(reflects, drawn, 1 - drawn),
                   of = imp__wide_choose(reflects, F, (1 - F) / (eta_t * eta_t));
    for (int c = 0; c < colors; c++)
        f->c[c] = imp__wide_choose(reflects, in[TINT_R].c[c], in[TINT_T].c[c]) * of;
    return imp__wide_choose((wo->z != zero) & ~imp__is_smooth(*lobe), chance, zero);
}
static bool eval_d_lanes(const struct imp_bsdf *b, const struct imp_wide_color *in,
                         const imp_wide3 *wo, const imp_wide3 *wi,
                         const imp_wide_lobe *lobe, int colors, struct imp_wide_color *d)
{
    imp_wide cos_t, eta_t;
    const imp_wide zero = imp__wide(0);
    (void)b, (void)wi;
    const imp_wide F = IMP_WIDE_OF(imp__dielectric)(wo->z, in[ETA].c[0], &cos_t, &eta_t);
    const imp_wide_truth there = wo->z != zero;
    for (int c = 0; c < colors; c++) {
        d[TINT_R].c[c] = imp__wide_choose(there & is_lobe(lobe, REFLECT), F, zero);
        d[TINT_T].c[c] = imp__wide_choose(there & is_lobe(lobe, REFRACT),
                                          (1 - F) / (eta_t * eta_t), zero);
        d[ETA].c[c] = zero;
    }
    return true;
}
static imp_wide index_ratio_lanes(const struct imp_bsdf *b,
                                  const struct imp_wide_color *in, const imp_wide3 *wo,
                                  const imp_wide3 *wi, const imp_wide_lobe *lobe)
{
    const imp_wide eta = in[ETA].c[0];
    (void)b, (void)wi;
    return imp__wide_choose(is_lobe(lobe, REFRACT),
                            imp__wide_choose(wo->z > imp__wide(0), eta, 1 / eta),
                            imp__wide(1));
}

const struct imp_bsdf_lanes imp__dielectric_lanes = {.sample = sample_lanes,
                                                     .pdf_eval = pdf_eval_lanes,
                                                     .eval_d = eval_d_lanes,
                                                     .index_ratio = index_ratio_lanes};
