/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of a BSDF's value with respect to its inputs against fourth-order differences. */
#include "scene/in_medium.h"
#include "selftest.h"

const struct imp_input_desc *imp__bsdf_input(const struct imp_bsdf *b, int j)
{
    if (imp__is_in_medium(b)) return imp__in_medium_input(b, j);
    if (j < b->n_own) return &b->ops->inputs[j];
    for (int k = b->n_child - 1; k >= 0; k--)
        if (j >= b->child_in[k]) return imp__bsdf_input(b->child[k], j - b->child_in[k]);
    return NULL;
}

bool imp__bsdf_input_fixed(const struct imp_bsdf *b, int j)
{
    const struct imp_input_desc *d = imp__bsdf_input(b, j);
    if (d->flags & (IMP_INPUT_FIXED | IMP_INPUT_WAVELENGTH)) return true;
    for (int k = b->n_child - 1; k >= 0; k--)
        if (j >= b->child_in[k])
            return imp__bsdf_input_fixed(b->child[k], j - b->child_in[k]);
    return b->fixed >> j & 1;
}

/* Fourth-order differences of lane c, central where there is room and one-sided at a
 * bound, with steps `scale` times the usual. The base value is taken off first, so that
 * what does not move gives exactly 0. */
static double difference(const struct imp_bsdf *b, imp_spec *in, const struct imp_dirs *d,
                         int j, int c, imp__bsdf_value *value, double scale, int lanes,
                         bool *lanes_mixed)
{
    static const double central[4][2] = {
        {-2, 1.0 / 12}, {-1, -8.0 / 12}, {1, 8.0 / 12}, {2, -1.0 / 12}};
    static const double forward[4][2] = {{1, 4}, {2, -3}, {3, 4.0 / 3}, {4, -0.25}};
    const struct imp_input_desc *desc = imp__bsdf_input(b, j);
    const bool scalar =
        desc->flags & (IMP_INPUT_SCALAR | IMP_INPUT_LUMINANCE | IMP_INPUT_COMPONENT);
    const imp_spec x = in[j];
    const double lo = desc->lo, hi = desc->lo == 0 && desc->hi == 0 ? INFINITY : desc->hi;
    const double h = scale * 4e-5 * fmax(fabs(x[c]), 0.02);
    const bool room_lo = x[c] - 2 * h >= lo, two = room_lo && x[c] + 2 * h <= hi;
    const double sign = room_lo && !two ? -1 : 1;
    imp_spec sum = imp__spec(0), f0, f;
    value(b, in, d, &f0);
    for (int k = 0; k < 4; k++) {
        const double step = two ? central[k][0] : sign * forward[k][0];
        const double weight = two ? central[k][1] : sign * forward[k][1];
        if (scalar) in[j] = x + step * h;
        else in[j][c] = x[c] + step * h;
        value(b, in, d, &f);
        in[j] = x;
        sum += (f - f0) * (weight / h);
    }
    for (int o = 0; o < lanes; o++)
        if (o != c && !scalar && sum[o] != 0) *lanes_mixed = true;
    return sum[c];
}

/* Two steps that disagree mean that the value is not smooth there (the fit of Beckmann's
 * masking has a step): such points are counted, not compared. A wrong derivative does not
 * hide there: it has two steps that agree. */
double imp__bsdf_derivative_error(const struct imp_bsdf *b, imp_spec *in,
                                  const struct imp_dirs *d, imp__bsdf_value *value,
                                  const imp_spec *df, int lanes,
                                  struct imp__derivative_tally *t)
{
    imp_spec f;
    double worst = 0;
    value(b, in, d, &f);
    for (int j = 0; j < b->n_in; j++) {
        if (imp__bsdf_input_fixed(b, j)) {
            /* no gradient is offered */
            if (!imp__is_zero(df[j])) worst = INFINITY;
            continue;
        }
        for (int c = 0; c < lanes; c++) {
            const double scale =
                fabs(df[j][c]) + 1e-5 * fabs(f[c]) / fmax(fabs(in[j][c]), 0.02);
            const double fd =
                difference(b, in, d, j, c, value, 1, lanes, &t->lanes_mixed);
            const double e = fabs(fd - df[j][c]);
            t->numbers++;
            if (e <= 1e-280) continue;
            if (e > 1e-6 * scale) {
                const double finer =
                    difference(b, in, d, j, c, value, 0.25, lanes, &t->lanes_mixed);
                if (fabs(fd - finer) > 0.2 * e) {
                    t->kinks++;
                    continue;
                }
            }
            worst = fmax(worst, isfinite(e) ? e / scale : INFINITY);
        }
    }
    return worst;
}
