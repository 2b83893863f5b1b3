/* SPDX-License-Identifier: Apache-2.0
 *
 * black: nothing is reflected. What shapes with a light and without a material have. */
#include "kind/build.h"
#include "math/vec.h"

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)b, (void)in, (void)u, (void)d;
    return false;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b, (void)in, (void)d;
    *f = imp__spec(0);
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    (void)b, (void)in, (void)d;
    return 0;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b, (void)in, (void)d, (void)df; /* it has no inputs */
}

const struct imp_bsdf_ops imp__black = {.size = sizeof(struct imp_bsdf_ops),
                                        .name = "black",
                                        .sample = sample,
                                        .eval = eval,
                                        .pdf = pdf,
                                        .eval_d = eval_d};
