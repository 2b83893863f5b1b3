/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IMP_BEND_FINGERPRINT_H
#define IMP_BEND_FINGERPRINT_H

#include "bend_problem.h"
#include "search/checkpoint.h"

/* What a checkpoint belongs to: rays, how they are traced, targets, the rules and the
 * size of the field, held [n_theta]; not the field's numbers, which the search has
 * changed. */
void imp__bend_fingerprint(const imp_bend *b, const uint8_t *held,
                           enum imp_optimizer optimizer, int level,
                           struct imp__fingerprint *out);

#endif
