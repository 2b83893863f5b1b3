/* SPDX-License-Identifier: Apache-2.0
 *
 * null: a surface that is not seen. It bounds a medium whose index matches what is
 * outside, or marks a place; light passes straight on. One delta lobe. */
#include "kind/build.h"
#include "math/vec.h"

enum { PASS }; /* the lobe */

static const struct imp_input_desc inputs[] = {{0}};

static enum imp_status build(const struct imp_build *build, void *self,
                             struct imp_bsdf *b)
{
    (void)build, (void)self;
    b->flags = IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT | IMP_BSDF_NULL;
    b->n_lobes = 1;
    b->straight = 1u << PASS;
    return IMP_OK;
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    (void)b, (void)in, (void)u;
    d->lobe = PASS;
    d->wi = -d->wo;
    return true;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b, (void)in;
    *f = imp__spec(d->lobe == PASS);
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    (void)b, (void)in;
    return d->lobe == PASS;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b, (void)in, (void)d, (void)df; /* it has no inputs */
}

static bool directional_albedo(const struct imp_bsdf *b, const imp_spec *in,
                               const imp_v3 *wo, imp_spec *rho)
{
    (void)b, (void)in, (void)wo;
    *rho = imp__spec(1);
    return true;
}

const struct imp_bsdf_ops imp__null = {.size = sizeof(struct imp_bsdf_ops),
                                       .name = "null",
                                       .inputs = inputs,
                                       .build = build,
                                       .sample = sample,
                                       .eval = eval,
                                       .pdf = pdf,
                                       .eval_d = eval_d,
                                       .directional_albedo = directional_albedo};
