/* SPDX-License-Identifier: Apache-2.0
 *
 * dielectric: a smooth boundary of two clear media, two delta lobes. With F the Fresnel
 * reflectance, F tint_r is reflected and (1 - F) tint_t (n_wo/n_wi)^2 refracted: radiance is
 * compressed where the index is higher. Lobes are drawn with probabilities F and 1 - F,
 * whatever the tints are, so that a tint of 0 keeps its derivative. The indices bend paths
 * and have no gradient: they are properties, not inputs (gradients.md 9.3). */
#include "fresnel.h"
#include "kind/build.h"
#include "presets.h"

enum { TINT_R, TINT_T };
enum { REFLECT, REFRACT }; /* lobes */

struct dielectric { double eta; }; /* inside/outside */

static const struct imp_input_desc inputs[] = {
    {.name = "specular_reflectance", .role = IMP_REFLECTANCE, .flags = IMP_INPUT_OPTIONAL,
     .fallback = 1, .hi = 1, .unit = "1"},
    {.name = "specular_transmittance", .role = IMP_REFLECTANCE, .flags = IMP_INPUT_OPTIONAL,
     .fallback = 1, .hi = 1, .unit = "1"},
    {0}};

static enum imp_status build(const struct imp_build *build, void *self, struct imp_bsdf *b)
{
    enum imp_status st = IMP_OK;
    struct dielectric *m = self;
    double inside, outside;
    IMP_TRY(imp__ior_read(build, "int_ior", "bk7", &inside));
    IMP_TRY(imp__ior_read(build, "ext_ior", "air", &outside));
    m->eta = inside / outside;
    b->flags = IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT;
out:
    return st;
}

/* Coefficient of a lobe without its tint; 0: nothing goes there. */
static double coefficient(const struct imp_bsdf *b, const struct imp_dirs *d, double *chance)
{
    const struct dielectric *m = b->self;
    double cos_t, eta_t;
    *chance = 0;
    if (d->wo[2] == 0) return 0;
    const double F = imp__fresnel_dielectric(d->wo[2], m->eta, &cos_t, &eta_t);
    if (d->lobe == REFLECT) return *chance = F;
    if (d->lobe != REFRACT) return 0;
    *chance = 1 - F;
    return (1 - F) / (eta_t * eta_t);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d, struct imp_bsdf_sample *s)
{
    const struct dielectric *m = b->self;
    double cos_t, eta_t;
    if (d->wo[2] == 0) return false;
    const double F = imp__fresnel_dielectric(d->wo[2], m->eta, &cos_t, &eta_t);
    if (u[0] < F) {
        d->lobe = REFLECT;
        d->wi = imp__v3(-d->wo[0], -d->wo[1], d->wo[2]);
        s->eta = 1;
        s->f = in[TINT_R] * F;
        s->pdf = F;
    } else {
        d->lobe = REFRACT;
        d->wi = imp__v3(-d->wo[0] / eta_t, -d->wo[1] / eta_t, -copysign(cos_t, d->wo[2]));
        s->eta = eta_t;
        s->f = in[TINT_T] * ((1 - F) / (eta_t * eta_t));
        s->pdf = 1 - F;
    }
    return s->pdf > 0;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    double chance;
    const double c = coefficient(b, d, &chance);
    *f = c == 0 ? imp__spec(0) : in[d->lobe == REFLECT ? TINT_R : TINT_T] * c;
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    double chance;
    (void)in;
    coefficient(b, d, &chance);
    return chance;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    double chance;
    const double c = coefficient(b, d, &chance);
    (void)in;
    df[TINT_R] = imp__spec(d->lobe == REFLECT ? c : 0);
    df[TINT_T] = imp__spec(d->lobe == REFRACT ? c : 0);
}

const struct imp_bsdf_ops imp__dielectric = {
    .size = sizeof(struct imp_bsdf_ops), .name = "dielectric",
    .object_size = sizeof(struct dielectric), .inputs = inputs, .build = build,
    .sample = sample, .eval = eval, .pdf = pdf, .eval_d = eval_d};
