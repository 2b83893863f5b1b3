/* SPDX-License-Identifier: Apache-2.0
 *
 * What kinds of lights share. Light walks begin at a surface with the cosine of its shading
 * normal, at a point in any direction, or on a disk before the scene, across a direction in
 * which the sky is drawn. */
#ifndef IMP_KIND_EMITTER_EMISSION_H
#define IMP_KIND_EMITTER_EMISSION_H

#include "kind/build.h"

/* imp_emitter_ops.eval and eval_d where Le is the first input, whatever the direction. */
void imp__even_eval(const struct imp_emitter *e, const imp_spec *in,
                    const struct imp_emission *x, imp_spec *le);
void imp__even_eval_d(const struct imp_emitter *e, const imp_spec *in,
                      const struct imp_emission *x, imp_spec *dle);

/* imp_emitter_ops.sample_emission and pdf_emission of lights that are surfaces. */
bool imp__surface_emission_sample(const struct imp_emitter *e,
                                  const struct imp_ball *scene, const double u[4],
                                  struct imp_emission_sample *out);
double imp__surface_emission_pdf(const struct imp_emitter *e,
                                 const struct imp_emission *x);

/* Emission of a light at one point. */
void imp__point_emission_sample(imp_v3 position, const double u[4],
                                struct imp_emission_sample *out);
double imp__point_emission_pdf(const struct imp_emitter *e, const struct imp_emission *x);

/* Density of emission along one direction: 1. */
double imp__along_emission_pdf(const struct imp_emitter *e, const struct imp_emission *x);

/* The axes of an environment in the world, unit, from its to_world, which can turn and mirror
 * it only. */
enum imp_status imp__sky_axes(const struct imp_build *b, imp_v3 axis[3]);

/* The same axes after imp_emitter_ops.move. */
void imp__sky_axes_turn(imp_v3 axis[3], const double to_world[12]);

/* Whither light from infinitely far travels, unit: reads `direction`, or to_world, whose +z
 * it is. */
enum imp_status imp__travel_read(const struct imp_build *b, imp_v3 *along);

/* Emission of an environment, whose `sample` and `pdf` do not depend on the receiver. */
bool imp__sky_emission_sample(const struct imp_emitter *e, const struct imp_ball *scene,
                              const double u[4], struct imp_emission_sample *out);
double imp__sky_emission_pdf(const struct imp_emitter *e, const struct imp_emission *x);
/* imp_emitter_ops.jumps of an environment that is continuous: none. */
int imp__sky_without_jumps(const struct imp_emitter *e,
                           struct imp_sky_circle out[IMP_SKY_CIRCLES]);

#endif
