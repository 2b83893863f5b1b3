/* SPDX-License-Identifier: Apache-2.0
 *
 * rayleigh: 3/(16 pi) (1 + c^2), c the cosine of the turn. */
#include "kind/build.h"
#include "turn.h"

static const struct imp_input_desc inputs[] = {{0}};

/* The cumulative density (c^3 + 3 c + 4)/8 = u is Cardano's depressed cubic. */
static void sample(const struct imp_phase *p, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)p, (void)in;
    const double z = 4 * u[1] - 2, a = cbrt(z + sqrt(z * z + 1));
    d->wi = imp__turn(d->wo, imp_clamp(a - 1 / a, -1.0, 1.0), u[2]);
}
static double pdf(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d)
{
    (void)p, (void)in;
    const double c = imp_phase_cos(d);
    return 3 * IMP_INV_PI / 16 * (1 + c * c);
}
static void eval(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    *f = imp__spec(pdf(p, in, d));
}
static void eval_d(const struct imp_phase *p, const imp_spec *in,
                   const struct imp_dirs *d, imp_spec *df)
{
    (void)p, (void)in, (void)d, (void)df; /* it has no inputs */
}

const struct imp_phase_ops imp__rayleigh = {.size = sizeof(struct imp_phase_ops),
                                            .name = "rayleigh",
                                            .inputs = inputs,
                                            .sample = sample,
                                            .eval = eval,
                                            .pdf = pdf,
                                            .eval_d = eval_d};
