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

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    return imp__turning_build(b, self, normal, bsdf);
}

const struct imp_bsdf_ops imp__normalmap = {IMP__TURNED_OPS, .name = "normalmap",
                                            .inputs = inputs, .build = build};
