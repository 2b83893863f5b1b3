/* SPDX-License-Identifier: Apache-2.0
 *
 * Clipped numbers of targets as censored data (importon/clip.h, docs/estimators.md 20). */
#ifndef IMP_INVERSE_CLIP_H
#define IMP_INVERSE_CLIP_H

#include "problem.h"
#include <importon/clip.h>

struct imp__clip {
    float low, high; /* as precise as what is compared */
    float *measured; /* [height][width][channels] of the target, as it came */
    float *base;     /* of a photograph: what its powers are taken of; else NULL */
    uint8_t *silent; /* [height][width][channels]: has no weight */
    size_t changed;  /* numbers whose weight the last decision changed */
};
void imp__clip_free(imp_context *ctx, struct imp__clip *clip);
/* Has the problem targets with levels? */
bool imp__problem_clips(const struct imp_problem *p);
/* Back to what is known without a picture: clipped numbers have no weight. */
void imp__clip_reset(struct imp_problem *p);
/* imp_problem_censor; sums up how many weights changed, and how many numbers there are. */
enum imp_status imp__censor(struct imp_problem *p, const struct imp_run *run,
                            size_t *changed, size_t *numbers);

#endif
