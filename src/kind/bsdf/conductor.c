/* SPDX-License-Identifier: Apache-2.0
 *
 * conductor: a smooth mirror of complex index eta + i k. One delta lobe, tint times
 * Fresnel; its derivatives are those of the coefficient (docs/estimators.md 9.3). Front
 * only. */
#include "fresnel.h"
#include "kind/build.h"
#include "presets.h"

enum { ETA, K, TINT };

static const struct imp_input_desc inputs[] = {
    IMP_ETA_INPUT, IMP_K_INPUT, IMP_TINT_INPUT("specular_reflectance"), {0}};

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    (void)build, (void)self;
    b->flags = IMP_BSDF_DELTA;
    b->n_lobes = 1;
    return IMP_OK;
}
static bool lit(const struct imp_dirs *d) { return d->lobe == 0 && d->wo[2] > 0; }

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b;
    *f = imp__spec(0);
    if (!lit(d)) return;
    imp__fresnel_conductor(d->wo[2], &in[ETA], &in[K], f);
    *f *= in[TINT];
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    (void)b, (void)in;
    return lit(d) ? 1 : 0;
}
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)b, (void)in, (void)u;
    if (!(d->wo[2] > 0)) return false;
    d->wi = imp__v3(-d->wo[0], -d->wo[1], d->wo[2]);
    d->lobe = 0;
    return true;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b;
    df[ETA] = df[K] = df[TINT] = imp__spec(0);
    if (!lit(d)) return;
    imp__fresnel_conductor_d(d->wo[2], &in[ETA], &in[K], &df[TINT], &df[ETA], &df[K]);
    df[ETA] *= in[TINT];
    df[K] *= in[TINT];
}

static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *rho)
{
    const struct imp_dirs d = {.wo = *wo, .lobe = 0};
    eval(b, in, &d, rho);
    return true;
}

const struct imp_bsdf_ops imp__conductor = {.size = sizeof(struct imp_bsdf_ops),
                                            .name = "conductor",
                                            .inputs = inputs,
                                            .prepare = imp__conductor_prepare,
                                            .build = build,
                                            .sample = sample,
                                            .eval = eval,
                                            .pdf = pdf,
                                            .eval_d = eval_d,
                                            .directional_albedo = directional_albedo};
