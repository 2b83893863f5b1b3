/* SPDX-License-Identifier: Apache-2.0
 *
 * L-BFGS with bounds for objectives without noise, as fits of bent rays are. */
#ifndef IMP_BEND_LBFGS_H
#define IMP_BEND_LBFGS_H

#include "search/optimize.h"

/* As imp__optimize, for objectives without noise; `s` was created for IMP_LBFGS. */
enum imp_status imp__lbfgs(const struct imp__goal *goal,
                           const struct imp__opt_options *options, struct imp__search *s);

/* A search that has not begun takes over the pairs of `old`; y is scaled so that the
 * curvature s.y along s does not change. */
enum imp_status imp__lbfgs_carry(const struct imp__search *old,
                                 const struct imp__carry *carry, struct imp__search *s);

#endif
