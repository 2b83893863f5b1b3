/* SPDX-License-Identifier: Apache-2.0
 *
 * Clipped numbers of targets as censored data (importon/clip.h, docs/estimators.md 20). */
#ifndef IMP_INVERSE_CENSOR_H
#define IMP_INVERSE_CENSOR_H

#include "inverse/problem/target_levels.h"
#include <importon/clip.h>

/* Has the problem targets with levels? */
bool imp__problem_clips(const struct imp_problem *p);
/* Back to the weights without a picture: clipped values have none. */
void imp__clip_reset(struct imp_problem *p);
/* imp_problem_censor; sums up how many weights changed, and how many values there are. */
enum imp_status imp__censor(struct imp_problem *p, const struct imp_run *run,
                            size_t *changed, size_t *numbers);

#endif
