/* SPDX-License-Identifier: Apache-2.0
 *
 * volume: a texture that is a volume, looked up at the place in the world. */
#include "input.h"

enum { VOLUME };

static const struct imp_input_desc inputs[] = {
    {.name = "volume",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_REQUIRED | IMP_INPUT_VOLUME,
     .fallback = 1,
     .unit = "1"},
    {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_texture *t)
{
    (void)b, (void)self;
    t->param = -1;
    return IMP_OK;
}
static void eval(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value)
{
    imp_input_eval(t->input[VOLUME], at, scalar, value);
}
static void scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    imp_input_scatter(t->input[VOLUME], at, scalar, bar, sink);
}
static void tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    imp_input_tangent(t->input[VOLUME], at, scalar, dot, x_dot, value_dot);
}

const struct imp_texture_ops imp__volume_texture = {.size =
                                                        sizeof(struct imp_texture_ops),
                                                    .name = "volume",
                                                    .inputs = inputs,
                                                    .build = build,
                                                    .eval = eval,
                                                    .scatter = scatter,
                                                    .tangent = tangent};
