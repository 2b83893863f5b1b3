/* SPDX-License-Identifier: Apache-2.0
 *
 * Functions shared by lights that are surfaces: they belong to a shape with an area, and
 * their points are drawn by the shape's own sampling. */
#ifndef IMP_KIND_EMITTER_SURFACE_H
#define IMP_KIND_EMITTER_SURFACE_H

#include "kind/build.h"

enum imp_status imp__surface_light_check(const struct imp_build *b,
                                         const struct imp_emitter *e);
bool imp__surface_light_sample(const struct imp_emitter *e, const imp_v3 *ref,
                               const double u[2], struct imp_light_sample *out);
double imp__surface_light_pdf(const struct imp_emitter *e, const imp_v3 *ref,
                              const imp_v3 *wi, const struct imp_hit *hit,
                              const struct imp_surface *at);

#endif
