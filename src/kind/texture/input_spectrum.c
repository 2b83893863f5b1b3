/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of inputs that are spectra: by wavelength, and where they are read as colours. */
#include "color/spectrum.h"
#include "input_parts.h"
#include "math/vec.h"

void imp__input_spectrum_scatter(const struct imp_input *input,
                                 const struct imp_carried *c, const imp_spec *bar,
                                 struct imp_sink *sink)
{
    for (int k = 0; k < c->n; k++) {
        struct imp__spectrum_at at;
        imp__spectrum_at(input->spectrum, c->nm[k], &at);
        for (int i = 0; i < at.n; i++) {
            imp_spec part = {0};
            part[k] = at.d[i] * (*bar)[k];
            if (part[k] != 0)
                sink->add(sink, input->param, at.first + (size_t)i, 1, &part);
        }
    }
}

void imp__input_spectrum_tangent(const struct imp_input *input,
                                 const struct imp_carried *c, imp_dot_fn *dot,
                                 const void *x_dot, imp_spec *value_dot)
{
    for (int k = 0; k < c->n; k++) {
        struct imp__spectrum_at at;
        double sum = 0;
        imp__spectrum_at(input->spectrum, c->nm[k], &at);
        for (int i = 0; i < at.n; i++)
            sum += at.d[i] * dot(x_dot, input->param, at.first + (size_t)i);
        (*value_dot)[k] = sum;
    }
    for (int k = c->n; k < 4; k++) (*value_dot)[k] = (*value_dot)[0];
}

static double colour_slope(const struct imp_input *input, size_t k, size_t c)
{
    const bool cut = input->value[c] == 0 || input->value[c] == 1;
    if (cut && input->spectrum->form != IMP_SPECTRUM_COLOR) return 0;
    return input->spectrum->color_d[3 * k + c];
}

void imp__input_colour_scatter(const struct imp_input *input, bool number,
                               const imp_spec *bar, struct imp_sink *sink)
{
    for (size_t k = 0; k < input->spectrum->n; k++) {
        imp_spec part = {0};
        double sum = 0;
        for (size_t c = 0; c < 3; c++) {
            part[c] = (*bar)[c] * colour_slope(input, k, c);
            sum += colour_slope(input, k, c) / 3;
        }
        if (number) part = *bar * sum;
        sink->add(sink, input->param, k, 1, &part);
    }
}

void imp__input_colour_tangent(const struct imp_input *input, bool number,
                               imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    imp_spec sum = {0};
    for (size_t k = 0; k < input->spectrum->n; k++)
        for (size_t c = 0; c < 3; c++)
            sum[c] += colour_slope(input, k, c) * dot(x_dot, input->param, k);
    *value_dot = number ? imp__spec((sum[0] + sum[1] + sum[2]) / 3) : sum;
}
