/* SPDX-License-Identifier: Apache-2.0
 *
 * hg: the phase function of Henyey and Greenstein (1941) with mean cosine g, which may be
 * a colour,
 *
 *     p(c) = (1 - g^2) / (4 pi D^(3/2)),    D = 1 + g^2 - 2 g c,
 *
 * c the cosine of the turn: g > 0 scatters forward. */
#include "kind/build.h"
#include "turn.h"

enum { G };

static const struct imp_input_desc inputs[] = {{.name = "g",
                                                .role = IMP_UNBOUNDED,
                                                .flags = IMP_INPUT_VOLUME,
                                                .fallback = 0.8,
                                                .lo = -0.9999,
                                                .hi = 0.9999,
                                                .unit = "1"},
                                               {0}};

/* Directions are drawn for one of three colours, which is once for all if they agree. */
#define COLOURS 3

static void sample(const struct imp_phase *p, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)p;
    const double g = in[G][imp_min((int)(u[0] * COLOURS), COLOURS - 1)];
    d->wi = imp__turn(d->wo, imp__hg_cosine_1(g, u[1]), u[2]);
}
static double pdf(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d)
{
    (void)p;
    const double c = imp_phase_cos(d);
    const imp_spec g = in[G];
    if (g[0] == g[1] && g[0] == g[2]) return imp__hg_value_1(g[0], c);
    return (imp__hg_value_1(g[0], c) + imp__hg_value_1(g[1], c) +
            imp__hg_value_1(g[2], c)) /
           COLOURS;
}
static void eval(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)p;
    const double c = imp_phase_cos(d);
    const imp_spec g = in[G];
    *f = imp__spec(imp__hg_value_1(g[0], c));
    for (int k = 1; k < 4; k++)
        if (g[k] != g[0]) (*f)[k] = imp__hg_value_1(g[k], c);
}
static void eval_d(const struct imp_phase *p, const imp_spec *in,
                   const struct imp_dirs *d, imp_spec *df)
{
    (void)p;
    const double c = imp_phase_cos(d);
    for (int k = 0; k < 4; k++) {
        const double g = in[G][k], D = 1 + g * g - 2 * g * c;
        df[G][k] =
            -(2 * g * D + 3 * (1 - g * g) * (g - c)) * IMP_INV_PI / (4 * D * D * sqrt(D));
    }
}

const struct imp_phase_ops imp__hg = {.size = sizeof(struct imp_phase_ops),
                                      .name = "hg",
                                      .inputs = inputs,
                                      .sample = sample,
                                      .eval = eval,
                                      .pdf = pdf,
                                      .eval_d = eval_d};
