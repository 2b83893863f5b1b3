/* SPDX-License-Identifier: Apache-2.0
 *
 * conductor: a smooth mirror of complex index eta + i k. One delta lobe, tint times
 * Fresnel; its derivatives are those of the coefficient (docs/estimators.md 9.3). Front
 * only. */
#include "bsdf_lanes.h"
#include "fresnel.h"
#include "fresnel_lanes.h"
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

/* ---- In lanes ---------------------------------------------------------------------------- */

static imp_wide_truth sample_lanes(const struct imp_bsdf *b, uint64_t derivative,
                                   const struct imp_wide_color *in, const imp_wide3 *wo,
                                   const imp_wide u[3], imp_wide3 *wi,
                                   imp_wide_lobe *lobe)
{
    (void)b, (void)derivative, (void)in, (void)u;
    *wi = imp__mirrors(wo);
    *lobe = (imp_wide_lobe){0};
    return wo->z > imp__wide(0);
}
static imp_wide pdf_eval_lanes(const struct imp_bsdf *b, uint64_t derivative,
                               const struct imp_wide_color *in, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                               struct imp_wide_color *f)
{
    (void)b, (void)derivative, (void)wi;
    for (int c = 0; c < colors; c++)
        f->c[c] =
            IMP_WIDE_OF(imp__conductor)(wo->z, in[ETA].c[c], in[K].c[c]) * in[TINT].c[c];
    return imp__wide_choose((*lobe == (imp_wide_lobe){0}) & (wo->z > imp__wide(0)),
                            imp__wide(1), imp__wide(0));
}

static bool eval_d_lanes(const struct imp_bsdf *b, const struct imp_wide_color *in,
                         const imp_wide3 *wo, const imp_wide3 *wi,
                         const imp_wide_lobe *lobe, int colors, struct imp_wide_color *d)
{
    const imp_wide zero = imp__wide(0);
    const imp_wide_truth here = (*lobe == (imp_wide_lobe){0}) & (wo->z > zero);
    (void)b, (void)wi;
    for (int c = 0; c < colors; c++) {
        imp_wide F_eta, F_k;
        const imp_wide tint = in[TINT].c[c],
                       F = IMP_WIDE_OF(imp__conductor_d)(wo->z, in[ETA].c[c], in[K].c[c],
                                                         &F_eta, &F_k);
        d[TINT].c[c] = imp__wide_choose(here, F, zero);
        d[ETA].c[c] = imp__wide_choose(here, F_eta * tint, zero);
        d[K].c[c] = imp__wide_choose(here, F_k * tint, zero);
    }
    return true;
}

const struct imp_bsdf_lanes imp__conductor_lanes = {
    .sample = sample_lanes, .pdf_eval = pdf_eval_lanes, .eval_d = eval_d_lanes};
