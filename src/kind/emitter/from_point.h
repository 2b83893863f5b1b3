/* SPDX-License-Identifier: Apache-2.0
 *
 * What the lights that are points share: one direction to them, which no ray meets by
 * chance, and their placement. */
#ifndef IMP_KIND_EMITTER_FROM_POINT_H
#define IMP_KIND_EMITTER_FROM_POINT_H

#include "kind/build.h"

/* From ref to the light; false where 1/r^2 is not a number. */
bool imp__point_light_sample(imp_v3 light, imp_v3 ref, struct imp_light_sample *out);
/* 0: imp_emitter_ops.pdf. */
double imp__point_light_pdf(const struct imp_emitter *e, const imp_v3 *ref,
                            const imp_v3 *wi, const struct imp_hit *hit,
                            const struct imp_surface *at);

/* Position and orientation of a light: columns of to_world, the first three unit and
 * orthogonal. */
struct imp__light_frame {
    imp_v3 axis[3], origin;
};
/* Reads to_world; an error if it scales or shears (tolerance 1e-3, as for cameras). */
enum imp_status imp__light_frame_read(const struct imp_build *b,
                                      struct imp__light_frame *out);
/* Direction d of the world in the light's frame. */
imp_v3 imp__light_frame_local(const struct imp__light_frame *f, const imp_v3 *d);

/* Is the input a texture without `slope`? What moves the lookup has no derivative then. */
bool imp__input_jumps(const struct imp_input *input);

#endif
