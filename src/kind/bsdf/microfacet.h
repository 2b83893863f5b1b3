/* SPDX-License-Identifier: Apache-2.0
 *
 * Microfacet distributions, anisotropic (Walter et al. 2007; Heitz 2014): density of
 * normals D, Smith's masking G1, sampling of normals, and derivatives with respect to the
 * two roughnesses. int D(m) cos(theta_m) dm = 1.
 *
 * Two masking functions for Beckmann: the value of a material uses the rational fit that
 * the scene format prescribes, the density of visible normals the exact one, without
 * which it would not integrate to 1. */
#ifndef IMP_KIND_BSDF_MICROFACET_H
#define IMP_KIND_BSDF_MICROFACET_H

#include "kind/build.h"
#include "math/vec.h"

enum imp__distribution { IMP_BECKMANN, IMP_GGX };
#define IMP_ALPHA_MIN 1e-4

struct imp__microfacet {
    enum imp__distribution type;
    bool visible; /* sample visible normals; false: all normals */
    double au, av;
    /* For sampling: derivatives that will be taken at what is drawn, so that a part of the
     * normals is drawn where D changes (microfacet_score.c). 0: none. */
    unsigned wanted; /* enum imp__score */
};
/* By ln au + ln av, ln au, ln av, ln au - ln av. */
enum imp__score {
    IMP_SCORE_SCALE = 1,
    IMP_SCORE_U = 2,
    IMP_SCORE_V = 4,
    IMP_SCORE_ASPECT = 8
};
/* Means of |d ln D|/2 for scale and aspect, and of |d ln D| for au, under D cos(theta), of GGX. */
#define IMP_GGX_SCORE_SCALE  0.5
#define IMP_GGX_SCORE_AU     0.82699334313268808 /* 3 sqrt(3)/(2 pi) */
#define IMP_GGX_SCORE_ASPECT 0.63661977236758134 /* 2/pi: of 2 v |2 a - 1| */
/* That part, of f with `wanted`: where lobes are wide nothing is gained (docs/estimators.md 8.2),
 * and then there is none. */
double imp__score_share(const struct imp__microfacet *f);

/* D, in 1/sr; 0 for m below the surface. d_log (may be NULL): d ln D / d(au, av). */
double imp__microfacet_d(const struct imp__microfacet *f, const imp_v3 *m,
                         double d_log[2]);
/* Derivative of ln D(m) where m turns by dm. */
double imp__microfacet_d_turned(const struct imp__microfacet *f, const imp_v3 *m,
                                const imp_v3 *dm);
/* G1(v) on the side of m (v.m > 0 is the caller's business); d (may be NULL): dG1/d(au,
 * av). */
double imp__microfacet_g1(const struct imp__microfacet *f, const imp_v3 *v, double d[2]);
/* What G1 of visible normals is divided by, v above the surface. */
double imp__microfacet_g1_exact(const struct imp__microfacet *f, const imp_v3 *v);
/* G1 and its slope as a function of t2 = (au^2 x^2 + av^2 y^2)/z^2. */
double imp__microfacet_g1_of(const struct imp__microfacet *f, double t2, double *slope);
/* G1(v), and its derivative by v. */
double imp__microfacet_g1_turned(const struct imp__microfacet *f, const imp_v3 *v,
                                 imp_v3 *d_v);
/* D(h) G1(wo) G1(wi) for the half-vector h of wo and wi, and its derivatives by the two
 * directions; c = wo.h = wi.h, of which either derivative is h/2. */
struct imp__facet_turns {
    imp_v3 h, by_wo, by_wi;
    double c, DG;
};
struct imp__facet_turns imp__microfacet_turns(const struct imp__microfacet *f,
                                              const imp_v3 *wo, const imp_v3 *wi);
/* Facets between clear media, with the index e behind over that before, and wo above: derivatives by
 * the two directions of F D G/(4 wo_z), wi above, or of (1 - F) D G |wo.m| |wi.m|/(wo_z (wo.m + e wi.m)^2),
 * m ~ wo + e wi, where these are not structurally zero. */
struct imp__clear_turns {
    imp_v3 by_wo, by_wi;
};
struct imp__clear_turns imp__microfacet_clear_turns(const struct imp__microfacet *f,
                                                    const imp_v3 *wo, const imp_v3 *wi,
                                                    double e);
/* Transmission ends where m lies in the surface, and D is 1/(pi au av (x^2/au^2 + y^2/av^2)^2) there
 * for GGX, 0 for Beckmann. No draw looks at that curve, which moves with directions and with the
 * index: such glass has neither derivative. index: the input. For imp_bsdf_ops.build. */
void imp__ggx_glass_jumps(struct imp_bsdf *bsdf, int index);
/* A normal for direction v (v.z > 0), and its density per steradian of normals. */
imp_v3 imp__microfacet_sample(const struct imp__microfacet *f, const imp_v3 *v,
                              const double u[2]);
double imp__microfacet_pdf(const struct imp__microfacet *f, const imp_v3 *v,
                           const imp_v3 *m);
/* The same where D of m, and G1 of v, are known. */
double imp__microfacet_pdf_of(const struct imp__microfacet *f, const imp_v3 *v,
                              const imp_v3 *m, double D, double G1);
/* Normals where D changes, and their density, where D of m is known; `wanted` is not 0. */
imp_v3 imp__score_sample(const struct imp__microfacet *f, const double u[2]);
double imp__score_pdf(const struct imp__microfacet *f, const imp_v3 *m, double D);
/* Inverse error function, to 1e-13. */
double imp__erf_inverse(double y);

#endif
