/* SPDX-License-Identifier: Apache-2.0
 *
 * Skies whose sun moves (IMP_MOVE_SUN): what they have around it changes along directions at rest, what
 * its disc sends goes with it, and changes with the sun's height. By differences: copies of the sky have
 * the sun on both sides of its place, in two directions across. */
#ifndef IMP_MOVE_SUNS_H
#define IMP_MOVE_SUNS_H

#include "kind/emitter/sky_sun.h"
#include "moves.h"

/* So far beside it, radians: a sky is smooth there but for its horizon, which stays. */
#define IMP_SUNS_BESIDE 1e-5

struct imp__suns {
    imp_v3 towards, across[2];
    struct imp_emitter beside[2][2]; /* [across][its two signs] */
};

/* Released as a whole. IMP_E_NOMEM. */
enum imp_status imp__suns_make(imp_context *ctx, const struct imp_emitter *e,
                               struct imp__suns **out);
/* The movers of this kind of a light: the first, or NULL. */
const struct imp__mover *imp__sun_mover(const struct imp__moves *moves, int emitter,
                                        enum imp__move_kind kind);
/* The direction w turned as the sun is turned to its place i, j. */
imp_v3 imp__suns_turned(const struct imp__suns *s, int i, int j, imp_v3 w);

#endif
