/* SPDX-License-Identifier: Apache-2.0
 *
 * A sequence of looks at growing numbers of samples, which ends when an error is small
 * enough, and keeps its promise at any end (docs/estimators.md 19). */
#ifndef IMP_WALK_LOOKS_H
#define IMP_WALK_LOOKS_H

#include "run.h"
#include <importon/until.h>

struct imp__looks {
    struct imp_until_options options; /* defaults filled in */
    struct imp_run run;               /* of the next look */
    const struct imp_run *outer;      /* the caller's */
    double start_s;
    double before; /* samples per pixel of all looks but the last */
    struct imp_until_end end;
};

/* run: checked. */
enum imp_status imp__looks_begin(imp_context *ctx, const char *function,
                                 const struct imp_run *run,
                                 const struct imp_until_options *options,
                                 struct imp__looks *looks);
/* Is there another look? Its samples and numbers are then looks->run's. */
bool imp__looks_next(struct imp__looks *looks);
/* What the last look weighs in the mean over all. */
double imp__looks_weight(const struct imp__looks *looks);
/* Significance level of the last look. */
double imp__looks_risk(const struct imp__looks *looks);
/* Standard errors that a normal number exceeds, on either side, with that probability. */
double imp__looks_z(const struct imp__looks *looks);
/* The last look bounds the error by `relative`. */
void imp__looks_bound(struct imp__looks *looks, double relative);

#endif
