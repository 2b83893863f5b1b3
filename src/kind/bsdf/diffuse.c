/* SPDX-License-Identifier: Apache-2.0
 *
 * diffuse: Lambert. f cos = rho cos(theta_i)/pi on the front, so that the integral over the
 * hemisphere is rho, the albedo. */
#include "kind/build.h"
#include "math/warp.h"

enum { RHO };

static const struct imp_input_desc inputs[] = {
    {.name = "reflectance", .role = IMP_REFLECTANCE, .fallback = 0.5, .hi = 1, .unit = "1"},
    {0}};

static bool above(const struct imp_dirs *d) { return d->wo[2] > 0 && d->wi[2] > 0; }

/* p = cos(theta_i)/pi, so f/p = rho for every draw: no variance from this choice. */
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d, struct imp_bsdf_sample *s)
{
    (void)b;
    if (!(d->wo[2] > 0)) return false;
    d->wi = imp__cosine_hemisphere(&u[1]);
    d->lobe = IMP_SMOOTH;
    s->pdf = d->wi[2] * IMP_INV_PI;
    s->f = in[RHO] * s->pdf;
    s->eta = 1;
    return s->pdf > 0;
}
static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    (void)b;
    *f = above(d) ? in[RHO] * (d->wi[2] * IMP_INV_PI) : imp__spec(0);
}
static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    (void)b, (void)in;
    return above(d) ? d->wi[2] * IMP_INV_PI : 0;
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    (void)b, (void)in;
    df[RHO] = imp__spec(above(d) ? d->wi[2] * IMP_INV_PI : 0);
}

const struct imp_bsdf_ops imp__diffuse = {
    .size = sizeof(struct imp_bsdf_ops), .name = "diffuse", .inputs = inputs,
    .sample = sample, .eval = eval, .pdf = pdf, .eval_d = eval_d};
