/* SPDX-License-Identifier: Apache-2.0
 *
 * What the lights that are points share: one direction to them, which no ray meets by
 * chance. */
#ifndef IMP_KIND_EMITTER_FROM_POINT_H
#define IMP_KIND_EMITTER_FROM_POINT_H

#include "kind/build.h"

/* From ref to the light; false where 1/r^2 is not a number. */
bool imp__point_light_sample(imp_v3 light, imp_v3 ref, struct imp_light_sample *out);
/* 0: imp_emitter_ops.pdf. */
double imp__point_light_pdf(const struct imp_emitter *e, const imp_v3 *ref,
                            const imp_v3 *wi, const struct imp_hit *hit,
                            const struct imp_surface *at);

#endif
