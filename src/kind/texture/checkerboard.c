/* SPDX-License-Identifier: Apache-2.0
 *
 * checkerboard: two colours by the parity of the half-unit cells. Read as one number the
 * two are swapped, as in Mitsuba (docs/scene-format.md 6.1, 15: followed so that pictures
 * agree). */
#include "input.h"
#include "texture_lanes.h"
#include "uv.h"

extern const struct imp_texture_ops imp__checkerboard;

struct checkerboard {
    struct imp__to_uv to_uv;
};

static const struct imp_input_desc inputs[] = {{.name = "color0",
                                                .role = IMP_REFLECTANCE,
                                                .flags = IMP_INPUT_SOFT,
                                                .fallback = 0.4,
                                                .hi = 1,
                                                .unit = "1"},
                                               {.name = "color1",
                                                .role = IMP_REFLECTANCE,
                                                .flags = IMP_INPUT_SOFT,
                                                .fallback = 0.2,
                                                .hi = 1,
                                                .unit = "1"},
                                               {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_texture *t)
{
    struct checkerboard *c = self;
    t->param = -1;
    return imp__to_uv_read(b, &c->to_uv);
}

static const struct imp_input *choose(const struct imp_texture *t,
                                      const struct imp_texcoord *at, bool scalar)
{
    const struct checkerboard *c = t->self;
    double uv[2];
    imp__to_uv_apply(&c->to_uv, at->uv, uv);
    const bool bx = uv[0] - floor(uv[0]) > 0.5, by = uv[1] - floor(uv[1]) > 0.5;
    return t->input[(bx == by) == scalar];
}

const struct imp_input *imp__checkerboard_input(const struct imp_texture *t,
                                                const struct imp_texcoord *at)
{
    return t->ops == &imp__checkerboard ? choose(t, at, false) : NULL;
}

static void eval(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value)
{
    imp_input_eval(choose(t, at, scalar), at, scalar, value);
}
static void scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    imp_input_scatter(choose(t, at, scalar), at, scalar, bar, sink);
}
static void tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    imp_input_tangent(choose(t, at, scalar), at, scalar, dot, x_dot, value_dot);
}

const struct imp_texture_ops imp__checkerboard = {.size = sizeof(struct imp_texture_ops),
                                                  .name = "checkerboard",
                                                  .object_size =
                                                      sizeof(struct checkerboard),
                                                  .inputs = inputs,
                                                  .build = build,
                                                  .eval = eval,
                                                  .scatter = scatter,
                                                  .tangent = tangent};

/* ---- In lanes ---------------------------------------------------------------------------- */

static bool covers(const struct imp_texture *t)
{
    return !t->input[0]->texture && !t->input[1]->texture;
}
/* Where it is the first input. */
static imp_wide_truth is_first(const struct imp_texture *t, const imp_wide uv[2],
                               bool scalar)
{
    const struct checkerboard *c = t->self;
    imp_wide_truth second[2];
    for (int k = 0; k < 2; k++) {
        const imp_wide x =
            c->to_uv.m[k][0] * uv[0] + c->to_uv.m[k][1] * uv[1] + c->to_uv.m[k][2];
        second[k] = x - imp__wide_floor(x) > imp__wide(0.5);
    }
    const imp_wide_truth differ = second[0] ^ second[1];
    return scalar ? differ : ~differ;
}
static void eval_lanes(const struct imp_texture *t, const imp_wide uv[2], bool scalar,
                       struct imp_wide_color *value)
{
    const struct imp_texcoord anywhere = {.prim = -1};
    const imp_wide_truth first = is_first(t, uv, scalar);
    imp_spec color[2];
    for (int k = 0; k < 2; k++) imp_input_eval(t->input[k], &anywhere, scalar, &color[k]);
    for (int k = 0; k < 4; k++)
        value->c[k] =
            imp__wide_choose(first, imp__wide(color[0][k]), imp__wide(color[1][k]));
}

static bool texels_lanes(const struct imp_texture *t, const imp_wide uv[2], bool scalar,
                         struct imp_wide_texels *out)
{
    const imp_wide_truth first = is_first(t, uv, scalar);
    for (int k = 0; k < 2; k++)
        if (t->input[k]->spectrum || (scalar && t->input[k]->count == 3)) return false;
    out->n = 1;
    out->element[0] = imp__wide(0);
    out->weight[0] = imp__wide(1);
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const struct imp_input *i = t->input[first[k] ? 0 : 1];
        out->param[k] = i->param;
        out->channels[k] = i->count == 3 ? 3 : 1;
    }
    return true;
}

const struct imp_texture_lanes imp__checkerboard_lanes = {
    .covers = covers, .eval = eval_lanes, .texels = texels_lanes};
