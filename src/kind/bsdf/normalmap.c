/* SPDX-License-Identifier: Apache-2.0
 *
 * normalmap: a material whose normal is that of a picture, n' = normalize(2 c - 1) in the
 * shading frame (turned.h). The map has no derivative: where the turned horizon cuts wi
 * off, the value jumps, and the jump moves with n'. */
#include "math/vec.h"
#include "turned.h"

enum { NORMAL };

static const struct imp_input_desc inputs[] = {
    {.name = "normalmap",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_VECTOR | IMP_INPUT_FIXED | IMP_INPUT_REQUIRED,
     .fallback = 0.5,
     .hi = 1,
     .unit = "1"},
    {0}};

static imp_v3 normal(const imp_spec *in)
{
    const imp_spec c = in[NORMAL];
    return imp__v3(2 * c[0] - 1, 2 * c[1] - 1, 2 * c[2] - 1);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    return imp__turned_sample(b, in, u, d, normal);
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    imp__turned_eval(b, in, d, normal, f);
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    return imp__turned_pdf(b, in, d, normal);
}
static double index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    return imp__turned_index_ratio(b, in, d, normal);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    imp__turned_eval_d(b, in, d, normal, df);
}
static void emit(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                 imp_spec *e)
{
    imp__turned_emit(b, in, wo, normal, e);
}
static void emit_d(const struct imp_bsdf *b, const imp_spec *in, const imp_v3 *wo,
                   imp_spec *de)
{
    imp__turned_emit_d(b, in, wo, normal, de);
}

const struct imp_bsdf_ops imp__normalmap = {.size = sizeof(struct imp_bsdf_ops),
                                            .name = "normalmap",
                                            .object_size = sizeof(struct imp__turning),
                                            .inputs = inputs,
                                            .min_children = 1,
                                            .max_children = 1,
                                            .build = imp__turning_build,
                                            .sample = sample,
                                            .eval = eval,
                                            .pdf = pdf,
                                            .index_ratio = index_ratio,
                                            .eval_d = eval_d,
                                            .emit = emit,
                                            .emit_d = emit_d,
                                            .albedo = imp__turned_albedo};
