/* SPDX-License-Identifier: Apache-2.0
 *
 * How what a light sends changes with the direction in which it does. */
#ifndef IMP_WALK_MOVED_SENT_H
#define IMP_WALK_MOVED_SENT_H

#include "move/moves.h"
#include "scene/scene.h"

/* Derivative of the logarithm of what a light at a point sends along d, by d across itself: by
 * differences, whose kinks at the borders of a spot's beam are so wide. */
imp_v3 imp__sent_slope(const struct imp_emitter *e, imp_v3 d, int lanes,
                       const struct imp_carried *carried);

/* Has it a picture, or a border across which its light ends? */
bool imp__has_picture(const struct imp_emitter *e);
/* The same of a light with a picture, times an adjoint of the logarithm by lanes, of which each has its own
 * slope; where the picture ends it is an edge's. */
imp_v3 imp__picture_slope(const struct imp_emitter *e, imp_v3 d, imp_spec bar, int lanes,
                          const struct imp_carried *carried);

/* The light at y along the unit direction d has this adjoint of its logarithm: of a turn of its shape, to
 * theta_bar, where its radiance depends on directions in a frame that turns with it. Returns the
 * adjoint of d. */
imp_v3 imp__table_bar(const struct imp__moves *moves, const struct imp_emitter *e,
                      const struct imp__glued *y, imp_v3 d, double bar, int lanes,
                      const struct imp_carried *carried, double *theta_bar);

#endif
