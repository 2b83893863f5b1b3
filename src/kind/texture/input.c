/* SPDX-License-Identifier: Apache-2.0 */
#include "input.h"
#include "color/rgb.h"
#include "math/vec.h"

static void weighted_scatter(struct imp_sink *sink, int param, size_t element,
                             imp_spec bar, const double weight[3])
{
    for (size_t c = 0; c < 3; c++) {
        const imp_spec part = bar * weight[c];
        sink->add(sink, param, element + c, 1, &part);
    }
}

void imp__luminance_scatter(struct imp_sink *sink, int param, size_t element,
                            imp_spec bar)
{
    static const double weight[3] = {IMP_LUM_R, IMP_LUM_G, IMP_LUM_B};
    weighted_scatter(sink, param, element, bar, weight);
}

/* A constant colour read as one number is the mean of its three, as in Mitsuba. */
static const double third[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
static imp_spec mean(double r, double g, double b) { return imp__spec((r + g + b) / 3); }

void imp__input_eval(const struct imp_input *input, bool scalar,
                     const struct imp_texcoord *at, imp_spec *value)
{
    if (input->texture) input->texture->ops->eval(input->texture, at, scalar, value);
    else if (scalar && input->count == 3)
        *value = mean(input->value[0], input->value[1], input->value[2]);
    else *value = input->value;
}

void imp__input_scatter(const struct imp_input *input, bool scalar,
                        const struct imp_texcoord *at, const imp_spec *bar,
                        struct imp_sink *sink)
{
    if (input->texture)
        input->texture->ops->scatter(input->texture, at, scalar, bar, sink);
    else if (input->param < 0) return;
    else if (scalar && input->count == 3)
        weighted_scatter(sink, input->param, 0, *bar, third);
    else sink->add(sink, input->param, 0, input->count == 3 ? 3 : 1, bar);
}

void imp__input_tangent(const struct imp_input *input, bool scalar,
                        const struct imp_texcoord *at, imp_dot_fn *dot, const void *x_dot,
                        imp_spec *value_dot)
{
    if (input->texture) {
        input->texture->ops->tangent(input->texture, at, scalar, dot, x_dot, value_dot);
    } else if (input->param < 0) {
        *value_dot = imp__spec(0);
    } else if (input->count != 3) {
        *value_dot = imp__spec(dot(x_dot, input->param, 0));
    } else {
        const double r = dot(x_dot, input->param, 0), g = dot(x_dot, input->param, 1),
                     b = dot(x_dot, input->param, 2);
        *value_dot = scalar ? mean(r, g, b) : (imp_spec){r, g, b, 0};
    }
}

void imp__inputs_eval(const struct imp_input *const *input, int n,
                      const struct imp_texcoord *at, imp_spec *in)
{
    for (int j = 0; j < n; j++) {
        if (imp_likely(!input[j]->texture && !input[j]->scalar)) in[j] = input[j]->value;
        else imp__input_eval(input[j], input[j]->scalar, at, &in[j]);
    }
}

void imp__inputs_scatter(const struct imp_input *const *input, int n,
                         const struct imp_texcoord *at, const imp_spec *in_bar,
                         struct imp_sink *sink)
{
    for (int j = 0; j < n; j++)
        imp__input_scatter(input[j], input[j]->scalar, at, &in_bar[j], sink);
}

void imp__inputs_tangent(const struct imp_input *const *input, int n,
                         const struct imp_texcoord *at, imp_dot_fn *dot,
                         const void *x_dot, imp_spec *in_dot)
{
    for (int j = 0; j < n; j++)
        imp__input_tangent(input[j], input[j]->scalar, at, dot, x_dot, &in_dot[j]);
}
