/* SPDX-License-Identifier: Apache-2.0
 *
 * A baseline of the light that flights bring, for derivatives with respect to an extinction
 * (docs/media.md 4). The derivative of a fixed collision (tracking.h) is L d log p, with p the
 * density of the flight and L what arrives from beyond. The density is normalised, so that for
 * any b which does not depend on the flight
 *
 *     E[d log p] = 0,    E[(L - b) d log p] = E[L d log p]
 *
 * and a b near L takes most of the variance away. The least variance of one flight has
 *
 *     b = E[x^2 L]/E[x^2],    x = P d log p,    P the throughput of the flight
 *
 * It is estimated from a few walks with random numbers of their own. */
#ifndef IMP_WALK_BASELINE_H
#define IMP_WALK_BASELINE_H

#include "walk/core/walk.h"

/* Sets the tracer's baseline for a run of so many walks; 0 where it has no fixed collision or
 * the run is too short. IMP_E_NOMEM. */
enum imp_status imp__baseline_set(struct imp_tracer *tracer, int64_t walks);

#endif
