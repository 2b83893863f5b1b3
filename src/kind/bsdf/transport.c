/* SPDX-License-Identifier: Apache-2.0
 *
 * Transposed value, draw and density of a BSDF, made from those of radiance by exchange of wo and
 * wi and Veach's factor (transport.h). */
#include "transport.h"
#include "math/vec.h"

void imp__bsdf_value(const struct imp_bsdf *b, const imp_spec *in,
                     const struct imp_dirs *d, imp_spec *f)
{
    const double cos_i = fabs(d->wi[2]);
    b->ops->eval(b, in, d, f);
    *f = cos_i > 0 ? *f * (1 / cos_i) : imp__spec(0);
}

void imp__bsdf_transposed(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d, imp_spec *f)
{
    if (d->lobe == IMP_SMOOTH) {
        imp__bsdf_value(b, in, d, f);
        *f *= fabs(d->wo[2]);
        return;
    }
    const double ratio = b->ops->index_ratio ? b->ops->index_ratio(b, in, d) : 1;
    b->ops->eval(b, in, d, f);
    *f *= ratio * ratio;
}

double imp__bsdf_exchange(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d, double cos_o, double cos_i)
{
    if (!(fabs(cos_i) > 0)) return 0;
    const double cosines = fabs(cos_o) / fabs(cos_i);
    if (d->lobe == IMP_SMOOTH) return cosines;
    const double ratio = b->ops->index_ratio ? b->ops->index_ratio(b, in, d) : 1;
    const double shading = fabs(d->wi[2]) / fabs(d->wo[2]);
    return isfinite(shading) ? ratio * ratio * cosines * shading : 0;
}

static struct imp_dirs exchanged(const struct imp_dirs *d)
{
    return (struct imp_dirs){d->wi, d->wo, d->lobe, d->derivative};
}

bool imp__bsdf_transposed_sample(const struct imp_bsdf *b, const imp_spec *in,
                                 const double u[3], struct imp_dirs *d)
{
    struct imp_dirs e = exchanged(d);
    if (!b->ops->sample(b, in, u, &e)) return false;
    *d = exchanged(&e);
    return true;
}

double imp__bsdf_transposed_pdf(const struct imp_bsdf *b, const imp_spec *in,
                                const struct imp_dirs *d)
{
    const struct imp_dirs e = exchanged(d);
    return b->ops->pdf(b, in, &e);
}
