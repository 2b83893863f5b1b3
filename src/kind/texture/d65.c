/* SPDX-License-Identifier: Apache-2.0
 *
 * d65 around a texture: daylight of the texture's colour. In rgb and mono modes it scales
 * (docs/scene-format.md 2.4); d65 around a colour is a constant (color/convert.c). */
#include "color/spectrum.h"
#include "input.h"
#include "math/vec.h"

struct d65 {
    double scale;
};

static const struct imp_input_desc inputs[] = {{.name = "nested_texture",
                                                .role = IMP_EMISSION,
                                                .flags = IMP_INPUT_REQUIRED,
                                                .fallback = 1,
                                                .unit = "1"},
                                               {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_texture *t)
{
    struct d65 *d = self;
    t->param = -1;
    return imp__props_float_in(b->ctx, b->node, "scale", 1, IMP_NOT_NEGATIVE, &d->scale);
}
/* As one number it is the scale alone. */
static imp_spec factor(const struct imp_texture *t, const struct imp_texcoord *at,
                       bool scalar)
{
    const struct d65 *d = t->self;
    imp_spec f = imp__spec(d->scale);
    if (at->carried && !scalar)
        for (int k = 0; k < 4; k++)
            f[k] *= imp__spectrum_value(&imp__daylight, at->carried->nm[k]);
    return f;
}
static void eval(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value)
{
    imp_input_eval(t->input[0], at, scalar, value);
    *value *= factor(t, at, scalar);
}
static void scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    const imp_spec scaled = *bar * factor(t, at, scalar);
    imp_input_scatter(t->input[0], at, scalar, &scaled, sink);
}
static void tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    imp_input_tangent(t->input[0], at, scalar, dot, x_dot, value_dot);
    *value_dot *= factor(t, at, scalar);
}

const struct imp_texture_ops imp__d65 = {.size = sizeof(struct imp_texture_ops),
                                         .name = "d65",
                                         .object_size = sizeof(struct d65),
                                         .flags = IMP_TEXTURE_SPECTRUM,
                                         .inputs = inputs,
                                         .build = build,
                                         .eval = eval,
                                         .scatter = scatter,
                                         .tangent = tangent};
