/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of the principled materials (Burley 2012, 2015; docs/scene-format.md 5.4), each
 * with its derivatives. Cosines are those at the shading normal (o, i) and at the
 * half-vector (d = wo.h = wi.h). */
#ifndef IMP_KIND_BSDF_BURLEY_H
#define IMP_KIND_BSDF_BURLEY_H

#include "kind/build.h"
#include "microfacet.h"

#define IMP_WIDE 1
#define IMP_TEXT "kind/bsdf/burley_text.h"
#include "math/lane_text.h"

/* Schlick's weight, and its slope. */
static inline double imp__schlick(double c, double *d_c)
{
    *d_c = imp__schlick_slope_1(c);
    return imp__schlick_1(c);
}

/* At the angle on the side of the lower index, e = behind over before, and its slope by c. */
static inline double imp__schlick_beside(double c, double e, double *d_c)
{
    double slope;
    *d_c = 0;
    if (e > 1) return imp__schlick(c, d_c);
    const double ct2 = 1 - (1 - c * c) / (e * e);
    if (!(ct2 > 0)) return 1;
    const double ct = sqrt(ct2), w = imp__schlick(ct, &slope);
    *d_c = slope * c / (e * e * ct);
    return w;
}

/* Derivatives of the diffuse lobe by the three cosines. */
struct imp__burley_turns {
    double by_o, by_i, by_d;
};
static inline struct imp__burley_turns imp__burley_turns(double cos_o, double cos_i,
                                                         double cos_d, double roughness,
                                                         double flatness)
{
    double dFo, dFi;
    const double Fo = imp__schlick(cos_o, &dFo), Fi = imp__schlick(cos_i, &dFi);
    const double R = 2 * roughness * cos_d * cos_d, dR = 4 * roughness * cos_d;
    const double q_o = 1 + Fo * (0.5 * R - 1), q_i = 1 + Fi * (0.5 * R - 1);
    const double sum = cos_o + cos_i, slab = 1 / sum - 0.5;
    const double full_o = -0.5 * (1 - 0.5 * Fi) + R * (1 + Fi * (R - 1)),
                 full_i = -0.5 * (1 - 0.5 * Fo) + R * (1 + Fo * (R - 1)),
                 full_R = Fo + Fi + Fo * Fi * (2 * R - 1);
    const double flat_o = 1.25 * (0.5 * R - 1) * q_i * slab,
                 flat_i = 1.25 * (0.5 * R - 1) * q_o * slab,
                 flat_R = 1.25 * slab * 0.5 * (Fo * q_i + Fi * q_o),
                 flat_sum = -1.25 * q_o * q_i / (sum * sum);
    return (struct imp__burley_turns){
        (full_o + (flat_o - full_o) * flatness) * dFo + flat_sum * flatness,
        (full_i + (flat_i - full_i) * flatness) * dFi + flat_sum * flatness,
        (full_R + (flat_R - full_R) * flatness) * dR};
}

/* The GGX lobe, by `roughness` and `anisotropic`. */
struct imp__burley_facets {
    struct imp__microfacet f;
    double d_roughness[2], d_anisotropic[2];
};
static inline struct imp__burley_facets imp__burley_facets(double roughness,
                                                           double anisotropic)
{
    double alpha[2];
    struct imp__burley_facets m;
    imp__burley_alpha_1(roughness, anisotropic, alpha);
    imp__burley_alpha_d_1(roughness, anisotropic, m.d_roughness, m.d_anisotropic);
    m.f = (struct imp__microfacet){IMP_GGX, true, alpha[0], alpha[1], 0};
    return m;
}

/* For drawing: by which of the two derivatives are wanted. Roughness scales both. */
static inline unsigned imp__burley_wanted(bool roughness, bool anisotropic)
{
    return (roughness ? IMP_SCORE_SCALE : 0) | (anisotropic ? IMP_SCORE_ASPECT : 0);
}

/* D G1(wo) G1(wi), and its derivatives by roughness and anisotropic. */
struct imp__burley_lobe {
    double DG, d_roughness, d_anisotropic;
};
static inline struct imp__burley_lobe imp__burley_lobe(const struct imp__burley_facets *m,
                                                       const imp_v3 *h, const imp_v3 *wo,
                                                       const imp_v3 *wi)
{
    double dlog_D[2], dGo[2], dGi[2];
    const double D = imp__microfacet_d(&m->f, h, dlog_D);
    const double Go = imp__microfacet_g1(&m->f, wo, dGo),
                 Gi = imp__microfacet_g1(&m->f, wi, dGi);
    struct imp__burley_lobe x = {D * Go * Gi, 0, 0};
    for (int k = 0; k < 2; k++) {
        const double d = D * (dlog_D[k] * Go * Gi + dGo[k] * Gi + Go * dGi[k]);
        x.d_roughness += d * m->d_roughness[k];
        x.d_anisotropic += d * m->d_anisotropic[k];
    }
    return x;
}

/* The colour of tinted lobes, base/lum, 1 where lum is 0; and its derivatives lane by
 * lane. */
static inline imp_spec imp__burley_tint(const imp_spec *base, double lum,
                                        imp_spec *d_base, imp_spec *d_lum)
{
    *d_base = *d_lum = imp__spec(0);
    if (!(lum > 0)) return imp__spec(1);
    *d_base = imp__spec(1 / lum);
    *d_lum = *base * (-1 / (lum * lum));
    return *base * (1 / lum);
}

#define IMP_BURLEY_COLOR(key)                                                            \
    {                                                                                    \
        .name = key, .role = IMP_REFLECTANCE, .fallback = 0.5, .hi = 1, .unit = "1"      \
    }
#define IMP_BURLEY_NUMBER(key, more, value)                                              \
    {                                                                                    \
        .name = key, .role = IMP_REFLECTANCE, .flags = IMP_INPUT_SCALAR | (more),        \
        .fallback = value, .hi = 1, .unit = "1"                                          \
    }

#endif
