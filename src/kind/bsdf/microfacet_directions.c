/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of D and G1 with respect to directions, and what glass of GGX lacks. */
#include "fresnel.h"
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

/* By m, as if it were not unit. */
static imp_v3 log_d_turns(const struct imp__microfacet *f, imp_v3 m)
{
    imp_v3 by = imp__v3(0, 0, 0);
    for (int k = 0; k < 3; k++) {
        imp_v3 e = imp__v3(0, 0, 0);
        e[k] = 1;
        by[k] = imp__microfacet_d_turned(f, &m, &e);
    }
    return by;
}

struct imp__facet_turns imp__microfacet_turns(const struct imp__microfacet *f,
                                              const imp_v3 *wo, const imp_v3 *wi)
{
    const imp_v3 sum = *wo + *wi;
    const double length = imp__length(sum);
    struct imp__facet_turns x = {.h = sum * (1 / length)};
    const imp_v3 dlog_D = log_d_turns(f, x.h);
    imp_v3 dGo, dGi;
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

/* F D G/(4 wo_z). */
static struct imp__clear_turns reflected(const struct imp__microfacet *f,
                                         const imp_v3 *wo, const imp_v3 *wi, double e)
{
    const struct imp__facet_turns x = imp__microfacet_turns(f, wo, wi);
    const double by = 1 / (4 * (*wo)[2]);
    double F_c, F_e;
    const double F = imp__fresnel_dielectric_d(imp_min(x.c, 1.0), e, &F_c, &F_e) * by;
    const imp_v3 by_c = x.h * (0.5 * F_c * by * x.DG);
    struct imp__clear_turns out = {x.by_wo * F + by_c, x.by_wi * F + by_c};
    out.by_wo[2] -= F * x.DG / (*wo)[2];
    return out;
}

/* S D G with S = (1 - F) |om im|/(wo_z n^2), of m, om, im and n, and n m = wo + e wi. */
static struct imp__clear_turns refracted(const struct imp__microfacet *f,
                                         const imp_v3 *wo, const imp_v3 *wi, double e)
{
    const imp_v3 h = *wo + *wi * e;
    const double n = copysign(imp__length(h), h[2]);
    const imp_v3 m = h * (1 / n);
    const double om = imp_min(imp__dot(*wo, m), 1.0), im = imp__dot(*wi, m);
    double F_c, F_e;
    const double F = imp__fresnel_dielectric_d(om, e, &F_c, &F_e);
    const double c = om * -im / ((*wo)[2] * n * n), S = (1 - F) * c;
    const double S_om = S / om - F_c * c, S_im = S / im;
    imp_v3 dGo, dGi;
    const double D = imp__microfacet_d(f, &m, NULL);
    const double Go = imp__microfacet_g1_turned(f, wo, &dGo),
                 Gi = imp__microfacet_g1_turned(f, wi, &dGi), DG = D * Go * Gi;
    const imp_v3 by_m = (log_d_turns(f, m) * S + *wo * S_om + *wi * S_im) * DG;
    const imp_v3 by_h = (by_m - m * imp__dot(by_m, m)) * (1 / n) - m * (2 * S * DG / n);
    struct imp__clear_turns out = {by_h + m * (DG * S_om) + dGo * (S * D * Gi),
                                   by_h * e + m * (DG * S_im) + dGi * (S * D * Go)};
    out.by_wo[2] -= S * DG / (*wo)[2];
    return out;
}

void imp__ggx_glass_jumps(struct imp_bsdf *bsdf, int index)
{
    bsdf->flags |= IMP_BSDF_STEPS;
    bsdf->fixed |= UINT64_C(1) << index;
    bsdf->why =
        "light passes facets of GGX up to those that lie in the surface, where the "
        "value jumps, and the jump moves with the index (roughdielectric with the "
        "distribution beckmann has none)";
}

struct imp__clear_turns imp__microfacet_clear_turns(const struct imp__microfacet *f,
                                                    const imp_v3 *wo, const imp_v3 *wi,
                                                    double e)
{
    return (*wi)[2] > 0 ? reflected(f, wo, wi, e) : refracted(f, wo, wi, e);
}
