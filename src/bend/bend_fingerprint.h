/* SPDX-License-Identifier: Apache-2.0
 *
 * Hash of a problem of bent rays, by which a checkpoint is matched to it. */
#ifndef IMP_BEND_FINGERPRINT_H
#define IMP_BEND_FINGERPRINT_H

#include "bend_problem.h"
#include "search/checkpoint.h"

/* Hash of the problem that a checkpoint was made for: rays, options of tracing, targets,
 * rules, size of the field, held [n_theta], how it is searched. The field's numbers are left out, since the
 * search changes them. */
void imp__bend_fingerprint(const imp_bend *b, const uint8_t *held,
                           enum imp_optimizer optimizer, double smooth_length, int level,
                           struct imp__fingerprint *out);

#endif
