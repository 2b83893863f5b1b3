/* SPDX-License-Identifier: Apache-2.0
 *
 * thindielectric: a sheet of clear material, so thin that light leaves it where it came
 * in. With R the Fresnel reflectance of one face, all orders of reflection between the
 * two faces add up to
 *
 *   R' = R + (1 - R)^2 R (1 + R^2 + R^4 + ...) = 2 R/(1 + R)
 *
 * Two delta lobes: R' tint_r is reflected, (1 - R') tint_t goes straight on. Lobes are
 * drawn with probabilities R' and 1 - R', whatever the tints are, so that a tint of 0
 * keeps its derivative. The index bends nothing, and has a gradient. */
#include "fresnel.h"
#include "presets.h"

enum { TINT_R, TINT_T, ETA };
enum { REFLECT, PASS }; /* lobes */

static const struct imp_input_desc inputs[] = {IMP_TINT_INPUT("specular_reflectance"),
                                               IMP_TINT_INPUT("specular_transmittance"),
                                               IMP_IOR_INPUT(1.5046 / 1.000277, 0.1, 10),
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
    b->straight = 1u << PASS;
    return IMP_OK;
}

/* R', and its derivative with respect to the index. */
static double sheet(const imp_spec *in, const struct imp_dirs *d, double *d_eta)
{
    double d_c, d_e;
    const double R = imp__fresnel_dielectric_d(fabs(d->wo[2]), in[ETA][0], &d_c, &d_e);
    *d_eta = 2 * d_e / ((1 + R) * (1 + R));
    return 2 * R / (1 + R);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    double d_eta;
    (void)b;
    if (d->wo[2] == 0) return false;
    const bool reflect = u[0] < sheet(in, d, &d_eta);
    d->lobe = reflect ? REFLECT : PASS;
    d->wi = imp__v3(-d->wo[0], -d->wo[1], reflect ? d->wo[2] : -d->wo[2]);
    return true;
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    double d_eta;
    const double R = sheet(in, d, &d_eta);
    (void)b;
    return d->wo[2] == 0 ? 0 : d->lobe == REFLECT ? R : d->lobe == PASS ? 1 - R : 0;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    const double chance = pdf(b, in, d);
    *f = chance == 0 ? imp__spec(0) : in[d->lobe == REFLECT ? TINT_R : TINT_T] * chance;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    const double chance = pdf(b, in, d);
    double d_eta;
    sheet(in, d, &d_eta);
    df[TINT_R] = imp__spec(d->lobe == REFLECT ? chance : 0);
    df[TINT_T] = imp__spec(d->lobe == PASS ? chance : 0);
    df[ETA] = chance == 0 ? imp__spec(0)
                          : in[d->lobe == REFLECT ? TINT_R : TINT_T] *
                                (d->lobe == REFLECT ? d_eta : -d_eta);
}

const struct imp_bsdf_ops imp__thindielectric = {.size = sizeof(struct imp_bsdf_ops),
                                                 .name = "thindielectric",
                                                 .inputs = inputs,
                                                 .prepare = prepare,
                                                 .build = build,
                                                 .sample = sample,
                                                 .eval = eval,
                                                 .pdf = pdf,
                                                 .eval_d = eval_d};
