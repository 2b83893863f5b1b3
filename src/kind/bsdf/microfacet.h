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
};

/* D, in 1/sr; 0 for m below the surface. d_log (may be NULL): d ln D / d(au, av). */
double imp__microfacet_d(const struct imp__microfacet *f, const imp_v3 *m,
                         double d_log[2]);
/* Derivative of ln D(m) where m turns by dm. */
double imp__microfacet_d_turned(const struct imp__microfacet *f, const imp_v3 *m,
                                const imp_v3 *dm);
/* G1(v) on the side of m (v.m > 0 is the caller's business); d (may be NULL): dG1/d(au,
 * av). */
double imp__microfacet_g1(const struct imp__microfacet *f, const imp_v3 *v, double d[2]);
/* A normal for direction v (v.z > 0), and its density per steradian of normals. */
imp_v3 imp__microfacet_sample(const struct imp__microfacet *f, const imp_v3 *v,
                              const double u[2]);
double imp__microfacet_pdf(const struct imp__microfacet *f, const imp_v3 *v,
                           const imp_v3 *m);
/* The same where D of m, and G1 of v, are known. */
double imp__microfacet_pdf_of(const struct imp__microfacet *f, const imp_v3 *v,
                              const imp_v3 *m, double D, double G1);

#endif
