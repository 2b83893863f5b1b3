/* SPDX-License-Identifier: Apache-2.0
 *
 * constvolume: one value. Its box matters to what ends with its volume. */
#include "box.h"
#include <string.h>

enum { VALUE };

struct constvolume {
    struct imp_mat4 to_unit;
};

static const struct imp_input_desc inputs[] = {
    {.name = "value", .role = IMP_UNBOUNDED, .fallback = 1, .unit = "1"}, {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_texture *t)
{
    struct constvolume *v = self;
    t->param = -1;
    return imp__box_read(b, &v->to_unit);
}

static void eval(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value)
{
    imp_input_eval(t->input[VALUE], at, scalar, value);
}
static void scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    imp_input_scatter(t->input[VALUE], at, scalar, bar, sink);
}
static void tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    imp_input_tangent(t->input[VALUE], at, scalar, dot, x_dot, value_dot);
}
static void bound(const struct imp_texture *t, const imp_v3 *lo, const imp_v3 *hi,
                  bool scalar, imp_spec *most)
{
    imp__input_most(t->input[VALUE], lo, hi, most);
    if (scalar) imp_spec_fill(most, fmax(fmax((*most)[0], (*most)[1]), (*most)[2]));
}
static void extent(const struct imp_texture *t, double to_unit[12], int cells[3])
{
    const struct constvolume *v = t->self;
    memcpy(to_unit, v->to_unit.m, 12 * sizeof *to_unit);
    cells[0] = cells[1] = cells[2] = 1;
}

const struct imp_texture_ops imp__constvolume = {.size = sizeof(struct imp_texture_ops),
                                                 .name = "constvolume",
                                                 .object_size =
                                                     sizeof(struct constvolume),
                                                 .flags = IMP_TEXTURE_CONSTANT,
                                                 .inputs = inputs,
                                                 .build = build,
                                                 .eval = eval,
                                                 .scatter = scatter,
                                                 .tangent = tangent,
                                                 .bound = bound,
                                                 .extent = extent};
