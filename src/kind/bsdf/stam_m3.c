/* SPDX-License-Identifier: Apache-2.0
 *
 * stam_m3: Lambert with an ambient term that acts as emission (Stam 2020, App. C;
 * controls theta_6, theta_7 of docs/estimators.md 2.1). `absorb` is the chance that a
 * walk of integrator `stam` ends here: it is sampling, no expectation depends on it. */
#include "kind/build.h"
#include "lambert.h"
#include "stam.h"

enum { AMBIENT = IMP_AMBIENT, DIFFUSE };

static const struct imp_input_desc inputs[] = {
    IMP_STAM_AMBIENT,
    {.name = "diffuse", .role = IMP_REFLECTANCE, .fallback = 0.5, .hi = 1, .unit = "1"},
    {0}};

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    (void)self;
    b->flags = IMP_BSDF_SMOOTH | IMP_BSDF_EMIT | IMP_BSDF_LINEAR;
    return imp__stam_absorb_read(build, &b->absorb);
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b;
    *f = in[DIFFUSE] * imp__lambert(d);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b, (void)in;
    df[AMBIENT] = imp__spec(0);
    df[DIFFUSE] = imp__spec(imp__lambert(d));
}
static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *rho)
{
    (void)b;
    *rho = (*wo)[2] > 0 ? in[DIFFUSE] : imp__spec(0);
    return true;
}
const struct imp_bsdf_ops imp__stam_m3 = {.size = sizeof(struct imp_bsdf_ops),
                                          .name = "stam_m3",
                                          .inputs = inputs,
                                          .build = build,
                                          .sample = imp__lambert_only_sample,
                                          .eval = eval,
                                          .pdf = imp__lambert_only_pdf,
                                          .eval_d = eval_d,
                                          .emit = imp__stam_emit,
                                          .emit_d = imp__stam_emit_d,
                                          .directional_albedo = directional_albedo};
