/* SPDX-License-Identifier: Apache-2.0
 *
 * The border of a projector's picture. */
#ifndef IMP_KIND_EMITTER_PROJECTOR_H
#define IMP_KIND_EMITTER_PROJECTOR_H

#include "kind/build.h"
#include "math/vec.h"

/* The horizontal field of view, in degrees, and the derivative of the logarithm of the screen's width by
 * it. */
double imp__projector_fov(const struct imp_emitter *e, double *rate);
void imp__projector_fov_set(struct imp_emitter *e, double degrees);
/* The point of the border by u in [0, 1), of the screen at distance 1, from the light, world; its
 * derivative by u, and the unit direction across it into the picture. */
void imp__projector_border(const struct imp_emitter *e, double u, imp_v3 *at,
                           imp_v3 *along, imp_v3 *inside);

#endif
