/* SPDX-License-Identifier: Apache-2.0
 *
 * Levels between which the numbers of a target are known: beyond them they are clipped, and
 * fits take them as censored data (inverse/fit/censor.h). */
#ifndef IMP_INVERSE_TARGET_LEVELS_H
#define IMP_INVERSE_TARGET_LEVELS_H

#include "problem.h"

struct imp__clip {
    float low, high; /* as precise as what is compared */
    float *measured; /* [height][width][channels] of the target, as it came */
    float *base;     /* of a photograph: what its powers are taken of; else NULL */
    uint8_t *silent; /* [height][width][channels]: has no weight */
    size_t changed;  /* values whose weight the last decision changed */
};
void imp__clip_free(imp_context *ctx, struct imp__clip *clip);

#endif
