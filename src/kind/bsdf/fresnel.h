/* SPDX-License-Identifier: Apache-2.0
 *
 * Fresnel reflectance of unpolarised light at a smooth interface
 * (docs/scene-format.md 5.1). */
#ifndef IMP_KIND_BSDF_FRESNEL_H
#define IMP_KIND_BSDF_FRESNEL_H

#include "math/vec.h"

/* Dielectric, as dielectric_text.h has it for one number. */
double imp__fresnel_dielectric(double c, double eta, double *cos_t, double *eta_t);

/* F for c > 0 and index e = far/near, with its derivatives: 0 under total reflection. */
double imp__fresnel_dielectric_d(double c, double e, double *d_c, double *d_e);

/* Mean reflectance of a smooth boundary for light that is diffuse on the near side, e =
 * far/near, with its derivative: int_0^1 2 c F(c, e) dc in closed form. */
double imp__fresnel_diffuse(double e, double *d_e);

/* Conductor in vacuum, c = cosine of incidence, lane by lane. */
void imp__fresnel_conductor(double c, const imp_spec *eta, const imp_spec *k,
                            imp_spec *f);
/* With derivatives. At eta = 0 or k = 0 they are the one-sided ones: F depends on eta k
 * where the root vanishes, so a mirror (eta = 0, k = 1) has a derivative towards
 * absorption.
 */
void imp__fresnel_conductor_d(double c, const imp_spec *eta, const imp_spec *k,
                              imp_spec *f, imp_spec *df_deta, imp_spec *df_dk);
/* With the derivative by c. */
void imp__fresnel_conductor_turned(double c, const imp_spec *eta, const imp_spec *k,
                                   imp_spec *f, imp_spec *df_dc);

#endif
