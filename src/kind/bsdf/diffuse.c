/* SPDX-License-Identifier: Apache-2.0
 *
 * diffuse: Lambert. f cos = rho cos(theta_i)/pi on the front, so that the integral over
 * the hemisphere is rho, the albedo. */
#include "bsdf_lanes.h"
#include "kind/build.h"
#include "lambert.h"

enum { RHO };

static const struct imp_input_desc inputs[] = {{.name = "reflectance",
                                                .role = IMP_REFLECTANCE,
                                                .fallback = 0.5,
                                                .hi = 1,
                                                .unit = "1"},
                                               {0}};

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b;
    *f = in[RHO] * imp__lambert(d);
}
static double pdf_eval(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f)
{
    (void)b;
    const double p = imp__lambert(d);
    *f = in[RHO] * p;
    return p;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b, (void)in;
    df[RHO] = imp__spec(imp__lambert(d));
}
static void eval_directions_d(const struct imp_bsdf *b, const imp_spec *in,
                              const struct imp_dirs *d, imp_spec d_wo[3],
                              imp_spec d_wi[3])
{
    (void)b;
    for (int k = 0; k < 3; k++) d_wo[k] = d_wi[k] = imp__spec(0);
    if (imp__front(d)) d_wi[2] = in[RHO] * IMP_INV_PI;
}
static void albedo(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *rho)
{
    (void)b, (void)wo;
    *rho = in[RHO];
}

static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *rho)
{
    (void)b;
    *rho = (*wo)[2] > 0 ? in[RHO] : imp__spec(0);
    return true;
}

const struct imp_bsdf_ops imp__diffuse = {.size = sizeof(struct imp_bsdf_ops),
                                          .name = "diffuse",
                                          .inputs = inputs,
                                          .sample = imp__lambert_only_sample,
                                          .eval = eval,
                                          .pdf = imp__lambert_only_pdf,
                                          .eval_d = eval_d,
                                          .albedo = albedo,
                                          .directional_albedo = directional_albedo,
                                          .pdf_eval = pdf_eval,
                                          .eval_directions_d = eval_directions_d};

/* ---- In lanes ---------------------------------------------------------------------------- */

static imp_wide_truth sample_lanes(const struct imp_bsdf *b, uint64_t derivative,
                                   const struct imp_wide_color *in, const imp_wide3 *wo,
                                   const imp_wide u[3], imp_wide3 *wi,
                                   imp_wide_lobe *lobe)
{
    (void)b, (void)derivative, (void)in, (void)lobe;
    return imp__lambert_samples(u, wo, wi);
}
static imp_wide pdf_eval_lanes(const struct imp_bsdf *b, uint64_t derivative,
                               const struct imp_wide_color *in, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                               struct imp_wide_color *f)
{
    (void)b, (void)derivative, (void)lobe;
    const imp_wide p = imp__lamberts(wo, wi);
    for (int c = 0; c < colors; c++) f->c[c] = in[RHO].c[c] * p;
    return p;
}

static bool eval_d_lanes(const struct imp_bsdf *b, const struct imp_wide_color *in,
                         const imp_wide3 *wo, const imp_wide3 *wi,
                         const imp_wide_lobe *lobe, int colors, struct imp_wide_color *d)
{
    (void)b, (void)in, (void)lobe;
    const imp_wide p = imp__lamberts(wo, wi);
    for (int c = 0; c < colors; c++) d[RHO].c[c] = p;
    return true;
}

static bool even(const struct imp_bsdf *b)
{
    (void)b;
    return true;
}

const struct imp_bsdf_lanes imp__diffuse_lanes = {.sample = sample_lanes,
                                                  .pdf_eval = pdf_eval_lanes,
                                                  .eval_d = eval_d_lanes,
                                                  .even = even};
