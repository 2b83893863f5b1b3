/* SPDX-License-Identifier: Apache-2.0
 *
 * expvolume: a value that falls with the height over a sphere, as the density of an
 * atmosphere does,
 *
 *     v(p) = value exp(-h/scale_height),    h = max(|p - center| - radius, 0)
 *
 * and 0 above `top`. So the optical depth of a column of it is value scale_height
 * (1 - exp(-top/scale_height)). Within the sphere it is the value at its surface. */
#include "base/required.h"
#include "box.h"
#include "math/vec.h"
#include <math.h>

enum { VALUE, SCALE_HEIGHT };

struct expvolume {
    imp_v3 center;
    double radius, top; /* of the sphere; height above which there is nothing */
};

static const struct imp_input_desc inputs[] = {
    {.name = "value", .role = IMP_UNBOUNDED, .fallback = 1, .unit = "1"},
    {.name = "scale_height",
     .role = IMP_UNBOUNDED,
     .flags = IMP_INPUT_SCALAR | IMP_INPUT_NUMBER | IMP_INPUT_REQUIRED,
     .fallback = 1,
     .lo = 1e-12,
     .hi = INFINITY,
     .unit = "length"},
    {0}};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_texture *t)
{
    enum imp_status st = IMP_OK;
    struct expvolume *v = self;
    double center[3];
    t->param = -1;
    IMP_TRY(imp_build_vector(b, "center", (double[3]){0}, center));
    IMP_TRY(
        imp__props_float_in(b->ctx, b->node, "radius", 0, IMP_NOT_NEGATIVE, &v->radius));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "top", 0, IMP_POSITIVE, &v->top));
    v->center = imp__v3(center[0], center[1], center[2]);
    if (!imp_build_has(b, "top")) IMP_TRY(imp__node_missing(b->ctx, b->node, "top"));
    if (t->input[VALUE]->texture)
        IMP_TRY(imp_build_error(b, "value", IMP_E_SCENE, "value cannot be a texture"));
out:
    return st;
}

static double height(const struct expvolume *v, imp_v3 p)
{
    return imp_max(imp__length(p - v->center) - v->radius, 0.0);
}

/* exp(-h/H), and its derivative by H. */
static double fall(const struct imp_texture *t, const struct imp_texcoord *at, double *d)
{
    const struct expvolume *v = t->self;
    const double h = height(v, at->p);
    imp_spec H;
    imp_input_eval(t->input[SCALE_HEIGHT], at, true, &H);
    const double f = h > v->top ? 0 : exp(-h / H[0]);
    *d = f * h / (H[0] * H[0]);
    return f;
}

static void eval(const struct imp_texture *t, const struct imp_texcoord *at, bool scalar,
                 imp_spec *value)
{
    double d;
    imp_input_eval(t->input[VALUE], at, scalar, value);
    *value *= fall(t, at, &d);
}
static void scatter(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, const imp_spec *bar, struct imp_sink *sink)
{
    imp_spec value;
    double d;
    const imp_spec of_value = *bar * fall(t, at, &d);
    imp_input_eval(t->input[VALUE], at, scalar, &value);
    imp_spec of_height = *bar * value * d;
    imp_input_scatter(t->input[VALUE], at, scalar, &of_value, sink);
    imp_input_scatter(t->input[SCALE_HEIGHT], at, true, &of_height, sink);
}
static void tangent(const struct imp_texture *t, const struct imp_texcoord *at,
                    bool scalar, imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    imp_spec value, height_dot;
    double d;
    const double f = fall(t, at, &d);
    imp_input_eval(t->input[VALUE], at, scalar, &value);
    imp_input_tangent(t->input[VALUE], at, scalar, dot, x_dot, value_dot);
    imp_input_tangent(t->input[SCALE_HEIGHT], at, true, dot, x_dot, &height_dot);
    *value_dot = *value_dot * f + value * d * height_dot;
}

/* That of the point of the box that is nearest to the centre. */
static void bound(const struct imp_texture *t, const imp_v3 *lo, const imp_v3 *hi,
                  bool scalar, imp_spec *most)
{
    const struct expvolume *v = t->self;
    struct imp_texcoord at = {.p = v->center};
    double d;
    for (int a = 0; a < 3; a++) at.p[a] = imp_clamp(at.p[a], (*lo)[a], (*hi)[a]);
    imp__input_most(t->input[VALUE], lo, hi, most);
    *most *= fall(t, &at, &d);
    if (scalar) imp_spec_fill(most, fmax(fmax((*most)[0], (*most)[1]), (*most)[2]));
}
static void extent(const struct imp_texture *t, double to_unit[12], int cells[3])
{
    const struct expvolume *v = t->self;
    const double side = 2 * (v->radius + v->top);
    for (int a = 0; a < 3; a++) {
        for (int k = 0; k < 4; k++) to_unit[4 * a + k] = k == a ? 1 / side : 0;
        to_unit[4 * a + 3] = 0.5 - v->center[a] / side;
        cells[a] = 64;
    }
}

const struct imp_texture_ops imp__expvolume = {.size = sizeof(struct imp_texture_ops),
                                               .name = "expvolume",
                                               .object_size = sizeof(struct expvolume),
                                               .inputs = inputs,
                                               .build = build,
                                               .eval = eval,
                                               .scatter = scatter,
                                               .tangent = tangent,
                                               .bound = bound,
                                               .extent = extent};
