/* SPDX-License-Identifier: Apache-2.0
 *
 * A BSDF as the other transports need it. `eval` is the kernel of radiance, followed from
 * the sensor: the BSDF f times |cos(theta_i)|, with wi drawn. Followed from the lights, wo
 * is drawn, and the same f is multiplied by |cos(theta_o)| (Veach 1997, 3.7):
 *
 *     kernel of radiance     K (wo, wi) = f(wo, wi) |cos(theta_i)|   per steradian of wi
 *     transposed kernel      K*(wo, wi) = f(wo, wi) |cos(theta_o)|   per steradian of wo
 *
 * A delta lobe is a density in the direction that is drawn. Snell's law maps solid angles
 * by n_i^2 |cos(theta_i)| dwi = n_o^2 |cos(theta_o)| dwo, so its transposed coefficient is
 * the coefficient times (n_i/n_o)^2: power passes a refraction undivided, while radiance
 * carries (n_o/n_i)^2. No kind needs to be reciprocal for this. */
#ifndef IMP_KIND_BSDF_TRANSPORT_H
#define IMP_KIND_BSDF_TRANSPORT_H

#include <importon/kinds.h>

/* f alone, per steradian, of smooth lobes: the value without its cosine. 0 where wi is in
 * the surface's plane. */
void imp__bsdf_value(const struct imp_bsdf *b, const imp_spec *in,
                     const struct imp_dirs *d, imp_spec *f);
/* K*, or the coefficient of a delta lobe. */
void imp__bsdf_transposed(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d, imp_spec *f);
/* K* over K: what the transposed kernel has more, where the cosines that light is measured
 * with are those at the geometric normal, cos_o and cos_i,
 *
 *     |cos_o|/|cos_i|                                       of a density
 *     (n_i/n_o)^2 |cos_o| |cos_i^s| / (|cos_i| |cos_o^s|)   of a delta lobe, ^s: shading
 *
 * (Veach 1997, 5.3.2). K bears |cos_i^s|: K* is eval times this, with shading normals too. */
double imp__bsdf_exchange(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d, double cos_o, double cos_i);
/* Draw d->wo and d->lobe for d->wi, by the kind's sampling with the directions exchanged:
 * it is where f is large, since f hardly changes when they are. False: no sample. */
bool imp__bsdf_transposed_sample(const struct imp_bsdf *b, const imp_spec *in,
                                 const double u[3], struct imp_dirs *d);
/* Its density, per steradian of wo; the probability of choosing a delta lobe. */
double imp__bsdf_transposed_pdf(const struct imp_bsdf *b, const imp_spec *in,
                                const struct imp_dirs *d);

#endif
