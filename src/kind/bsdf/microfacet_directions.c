/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of D and G1 with respect to directions. */
#include "microfacet.h"

/* G1 is a function of t2 = (au^2 x^2 + av^2 y^2)/z^2 (microfacet.c). */
double imp__microfacet_g1_turned(const struct imp__microfacet *f, const imp_v3 *v,
                                 imp_v3 *d_v)
{
    const double z = (*v)[2], au2 = f->au * f->au, av2 = f->av * f->av;
    const double x = au2 * (*v)[0] / (z * z), y = av2 * (*v)[1] / (z * z);
    const double t2 = x * (*v)[0] + y * (*v)[1];
    double slope;
    const double g = imp__microfacet_g1_of(f, t2, &slope);
    *d_v = imp__v3(x, y, -t2 / z) * (2 * slope);
    return g;
}

struct imp__facet_turns imp__microfacet_turns(const struct imp__microfacet *f,
                                              const imp_v3 *wo, const imp_v3 *wi)
{
    const imp_v3 sum = *wo + *wi;
    const double length = imp__length(sum);
    struct imp__facet_turns x = {.h = sum * (1 / length)};
    imp_v3 dlog_D = imp__v3(0, 0, 0), dGo, dGi;
    for (int k = 0; k < 3; k++) {
        imp_v3 e = imp__v3(0, 0, 0);
        e[k] = 1;
        dlog_D[k] = imp__microfacet_d_turned(f, &x.h, &e);
    }
    const double D = imp__microfacet_d(f, &x.h, NULL);
    const double Go = imp__microfacet_g1_turned(f, wo, &dGo),
                 Gi = imp__microfacet_g1_turned(f, wi, &dGi);
    const imp_v3 by_sum = (dlog_D - x.h * imp__dot(dlog_D, x.h)) * (1 / length);
    x.c = 0.5 * length; /* 1 + wo.wi = 2 c^2 */
    x.DG = D * Go * Gi;
    x.by_wo = by_sum * x.DG + dGo * (D * Gi);
    x.by_wi = by_sum * x.DG + dGi * (D * Go);
    return x;
}
