/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IMP_CURVED_LBFGS_H
#define IMP_CURVED_LBFGS_H

#include "inverse/optimize.h"

/* As imp__optimize, for objectives without noise; `s` was created for IMP_LBFGS. */
enum imp_status imp__lbfgs(const struct imp__goal *goal,
                           const struct imp__opt_options *options, struct imp__search *s);

#endif
