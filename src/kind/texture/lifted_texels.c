/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectra of RGB texels, lifted when texels change; value, reverse and forward derivatives of their
 * interpolation at a wavelength. */
#include "lifted_texels.h"
#include "color/rgb_basis.h"
#include "math/vec.h"
#include <string.h>

static void lift(const struct imp__lifted_texels *t, const float *p,
                 struct imp__lifted *out)
{
    const double rgb[3] = {p[0], p[1], p[2]};
    const bool beyond = rgb[0] > 1 || rgb[1] > 1 || rgb[2] > 1;
    if (t->rule == IMP__LIFT_ANY_SIZE || (t->rule == IMP__LIFT_BY_SIZE && beyond))
        imp__lift_unbounded(rgb, out);
    else imp__lift_reflectance(rgb, out);
}

/* Spectra of texels that have others now; `all`: of all. Equal neighbours have equal
 * spectra. */
static void texels_lift(struct imp__lifted_texels *t, bool all)
{
    for (size_t i = 0; i < t->n; i++) {
        struct imp__lifted_texel *to = &t->texel[i];
        const float *p = t->data + 3 * i;
        const struct imp__lifted_texel *before = i ? to - 1 : NULL,
                                       *above = i >= t->width ? to - t->width : NULL;
        if (!all && memcmp(p, to->of, sizeof to->of) == 0) continue;
        if (all && before && memcmp(p, before->of, sizeof to->of) == 0) {
            *to = *before;
            continue;
        }
        if (all && above && memcmp(p, above->of, sizeof to->of) == 0) {
            *to = *above;
            continue;
        }
        lift(t, p, &to->lifted);
        memcpy(to->of, p, sizeof to->of);
    }
}

enum imp_status imp__lifted_texels_make(const struct imp_build *b, const float *data,
                                        size_t n, size_t width,
                                        struct imp__lifted_texels *out)
{
    *out = (struct imp__lifted_texels){.data = data, .n = n, .width = width};
    if (b->linear_colors) return IMP_OK;
    out->texel = imp__arena_take(b->arena, n, sizeof *out->texel);
    if (!out->texel)
        return imp__error(b->ctx, IMP_E_NOMEM, "texels do not fit as spectra");
    return IMP_OK;
}

void imp__lifted_texels_update(struct imp__lifted_texels *t, enum imp__lift_rule rule)
{
    const bool all = !t->made || t->rule != rule;
    t->rule = rule;
    t->made = true;
    if (t->texel) texels_lift(t, all);
}

/* Value of a texel at one wavelength and its derivatives by its three numbers. */
static double texel_at(const struct imp__lifted_texels *t, size_t k, double nm,
                       double d[3])
{
    if (t->texel) return imp__lifted_value_d(&t->texel[k].lifted, nm, d);
    imp__rgb_basis(nm, d);
    const float *p = t->data + 3 * k;
    return p[0] * d[0] + p[1] * d[1] + p[2] * d[2];
}

static void linear_eval(const struct imp__lifted_texels *t,
                        const struct imp__texel_sum *sum,
                        const struct imp_carried *carried, imp_spec *value)
{
    double rgb[3] = {0, 0, 0}, b[3];
    for (int k = 0; k < sum->n; k++)
        for (size_t c = 0; c < 3; c++)
            rgb[c] += sum->weight[k] * t->data[3 * sum->texel[k] + c];
    for (int j = 0; j < carried->n; j++) {
        imp__rgb_basis(carried->nm[j], b);
        (*value)[j] = rgb[0] * b[0] + rgb[1] * b[1] + rgb[2] * b[2];
    }
}

void imp__lifted_texels_eval(const struct imp__lifted_texels *t,
                             const struct imp__texel_sum *sum,
                             const struct imp_carried *carried, imp_spec *value)
{
    if (!t->texel) {
        linear_eval(t, sum, carried, value);
    } else {
        for (int j = 0; j < carried->n; j++) {
            double at = 0;
            for (int k = 0; k < sum->n; k++)
                at += sum->weight[k] *
                      imp__lifted_value(&t->texel[sum->texel[k]].lifted, carried->nm[j]);
            (*value)[j] = at;
        }
    }
    for (int j = carried->n; j < 4; j++) (*value)[j] = (*value)[0];
}

void imp__lifted_texels_scatter(const struct imp__lifted_texels *t,
                                const struct imp__texel_sum *sum,
                                const struct imp_carried *carried, int param,
                                const imp_spec *bar, struct imp_sink *sink)
{
    for (int k = 0; k < sum->n; k++) {
        imp_spec part[3] = {{0}, {0}, {0}};
        for (int j = 0; j < carried->n; j++) {
            double d[3];
            texel_at(t, sum->texel[k], carried->nm[j], d);
            for (int c = 0; c < 3; c++) part[c][j] = (*bar)[j] * sum->weight[k] * d[c];
        }
        for (size_t c = 0; c < 3; c++)
            sink->add(sink, param, 3 * sum->texel[k] + c, 1, &part[c]);
    }
}

void imp__lifted_texels_tangent(const struct imp__lifted_texels *t,
                                const struct imp__texel_sum *sum,
                                const struct imp_carried *carried, int param,
                                imp_dot_fn *dot, const void *x_dot, imp_spec *value_dot)
{
    *value_dot = imp__spec(0);
    for (int k = 0; k < sum->n && param >= 0; k++)
        for (int j = 0; j < carried->n; j++) {
            double d[3];
            texel_at(t, sum->texel[k], carried->nm[j], d);
            for (size_t c = 0; c < 3; c++)
                (*value_dot)[j] +=
                    sum->weight[k] * d[c] * dot(x_dot, param, 3 * sum->texel[k] + c);
        }
    for (int j = carried->n; j < 4; j++) (*value_dot)[j] = (*value_dot)[0];
}

double imp__lifted_texels_most(const struct imp__lifted_texels *t, size_t k)
{
    const float *p = t->data + 3 * k;
    if (t->texel) return imp__lifted_most(&t->texel[k].lifted);
    return fmax(fmax(p[0], p[1]), p[2]);
}
