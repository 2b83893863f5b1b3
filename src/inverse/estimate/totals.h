/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums over the targets of a problem: the objective, and its gradient with variances, in
 * doubles for few values, in fixed point for many (base/fixed_sum.h). */
#ifndef IMP_INVERSE_TOTALS_H
#define IMP_INVERSE_TOTALS_H

#include "base/fixed_sum.h"
#include "inverse/problem/problem.h"

struct imp__totals {
    double objective, variance;
    double *gradient, *gradient_variance; /* [n] of few values */
    /* For many values: fixed point, in place of the caller's arrays. */
    bool many, unit_known;
    bool wants_errors; /* of the gradient */
    struct imp_fixed_sum mean, spread;
    double *own; /* sums that are not in the caller's arrays */
};

/* gradient, gradient_se: where the results go, either may be NULL. For many values they
 * hold the sums in the meantime, unless they are to keep their contents on failure. */
enum imp_status imp__totals_begin(struct imp_problem *p, bool in_place, double *gradient,
                                  double *gradient_se, struct imp__totals *t);
/* Sums in fixed point are complete when the other ranks' are added (base/team.h). */
enum imp_status imp__totals_share(struct imp_problem *p, struct imp__totals *t);
/* *again: terms were too large for the unit and were left out. All is then to be added
 * once more, with the unit that the largest needs. */
enum imp_status imp__totals_again(struct imp_problem *p, struct imp__totals *t,
                                  bool *again);
void imp__totals_end(struct imp_problem *p, struct imp__totals *t, double *gradient,
                     double *gradient_se);
void imp__totals_free(struct imp_problem *p, struct imp__totals *t);

#endif
