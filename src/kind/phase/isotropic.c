/* SPDX-License-Identifier: Apache-2.0
 *
 * isotropic: 1/4pi in all directions. */
#include "kind/build.h"
#include "turn.h"

static const struct imp_input_desc inputs[] = {{0}};

static void sample(const struct imp_phase *p, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)p, (void)in;
    d->wi = imp__turn(d->wo, 1 - 2 * u[1], u[2]);
}
static double pdf(const struct imp_phase *p, const imp_spec *in, const struct imp_dirs *d)
{
    (void)p, (void)in, (void)d;
    return IMP_INV_PI / 4;
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

const struct imp_phase_ops imp__isotropic = {.size = sizeof(struct imp_phase_ops),
                                             .name = "isotropic",
                                             .inputs = inputs,
                                             .sample = sample,
                                             .eval = eval,
                                             .pdf = pdf,
                                             .eval_d = eval_d};
