/* SPDX-License-Identifier: Apache-2.0
 *
 * Skies whose sun moves (IMP_MOVE_SUN) or grows (IMP_MOVE_DISC): what they have around it changes along
 * directions at rest, what its disc sends goes with it, and changes with the height of the sun, or of a
 * place in it, and with its width. By differences: copies of the sky have the sun on both sides of its
 * place, in two directions across, or a disc that is smaller and one that is larger. */
#ifndef IMP_MOVE_SUNS_H
#define IMP_MOVE_SUNS_H

#include "kind/emitter/sky_sun.h"
#include "moves.h"

/* So far beside it, radians: a sky is smooth there but for its horizon, which stays. */
#define IMP_SUNS_BESIDE 1e-5
/* So much of its radius: the border is a cosine, which is rounded. */
#define IMP_SUNS_WIDER 1e-4

/* Ways of the sun: across, in two directions, and of its width. */
enum { IMP_SUNS_WIDTH = 2, IMP_SUNS_WAYS };

struct imp__suns {
    imp_v3 towards, across[2];
    double radius;
    struct imp_emitter beside[IMP_SUNS_WAYS]
                             [2]; /* [way][its two signs]; of those of its kind */
};

/* Those of this kind; released as a whole. IMP_E_NOMEM; IMP_E_NUMERIC where the sky cannot be beside. */
enum imp_status imp__suns_make(imp_context *ctx, const struct imp_emitter *e,
                               enum imp__move_kind kind, struct imp__suns **out);
/* The movers of this kind of a light: the first, or NULL. */
const struct imp__mover *imp__sun_mover(const struct imp__moves *moves, int emitter,
                                        enum imp__move_kind kind);
/* The direction w turned as the sun is turned to its place i, j; of its width, of the disc that is so
 * wide, where sin(g/2)/sin(r/2) stays of the angle g to its middle. */
imp_v3 imp__suns_turned(const struct imp__suns *s, int i, int j, imp_v3 w);

#endif
