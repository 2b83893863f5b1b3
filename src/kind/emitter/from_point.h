/* SPDX-License-Identifier: Apache-2.0
 *
 * What the lights that are points share: one direction to them, which no ray meets by
 * chance, and their placement. */
#ifndef IMP_KIND_EMITTER_FROM_POINT_H
#define IMP_KIND_EMITTER_FROM_POINT_H

#include "kind/build.h"
#include "math/vec.h"

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
/* That of a spot or projector; NULL: another light. */
struct imp__light_frame *imp__light_frame_of(const struct imp_emitter *e);
/* Reads to_world; an error if it scales or shears (tolerance 1e-3, as for cameras). */
enum imp_status imp__light_frame_read(const struct imp_build *b,
                                      struct imp__light_frame *out);
/* Direction d of the world in the light's frame. */
imp_v3 imp__light_frame_local(const struct imp__light_frame *f, const imp_v3 *d);

/* Is the input a texture without `slope`? What moves the lookup has no derivative then. */
bool imp__input_jumps(const struct imp_input *input);

/* The frame `from`, turned as little as possible until its z is along `to`. */
static inline void imp__light_frame_turn(struct imp__light_frame *f,
                                         const struct imp__light_frame *from, imp_v3 to)
{
    const imp_v3 a = from->axis[2], b = imp__normalize(to);
    const double cosine = imp__dot(a, b);
    const imp_v3 turn = imp__cross(a, b);
    /* Backwards: half a turn about x. Rodrigues: v + turn x v + turn x (turn x v)/(1 + cos). */
    if (!(1 + cosine > 1e-12)) {
        f->axis[0] = from->axis[0];
        f->axis[1] = -from->axis[1];
        f->axis[2] = b;
        return;
    }
    for (int k = 0; k < 3; k++) {
        const imp_v3 v = from->axis[k], once = imp__cross(turn, v);
        f->axis[k] = v + once + imp__cross(turn, once) * (1 / (1 + cosine));
    }
}

#endif
