/* SPDX-License-Identifier: Apache-2.0
 *
 * The Lambertian lobe: cos(theta_i)/pi on the front, times an albedo. Value over albedo,
 * density and derivative by albedo are this one number. */
#ifndef IMP_KIND_BSDF_LAMBERT_H
#define IMP_KIND_BSDF_LAMBERT_H

#include "math/warp.h"

/* Both directions on the front: else every one-sided lobe is structurally 0. */
static inline bool imp__front(const struct imp_dirs *d)
{
    return d->wo[2] > 0 && d->wi[2] > 0;
}
static inline double imp__lambert(const struct imp_dirs *d)
{
    return imp__front(d) ? d->wi[2] * IMP_INV_PI : 0;
}
/* Draw wi with density cos/pi: value over density is the albedo, for every draw. */
static inline bool imp__lambert_sample(const double u[2], struct imp_dirs *d)
{
    if (!(d->wo[2] > 0)) return false;
    d->wi = imp__cosine_hemisphere(u);
    d->lobe = IMP_SMOOTH;
    return d->wi[2] > 0;
}

/* Sampling and density of materials that are this lobe alone. */
static inline bool imp__lambert_only_sample(const struct imp_bsdf *b, const imp_spec *in,
                                            const double u[3], struct imp_dirs *d)
{
    (void)b, (void)in;
    return imp__lambert_sample(&u[1], d);
}
static inline double imp__lambert_only_pdf(const struct imp_bsdf *b, const imp_spec *in,
                                           const struct imp_dirs *d)
{
    (void)b, (void)in;
    return imp__lambert(d);
}

#endif
