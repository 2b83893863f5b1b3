/* SPDX-License-Identifier: Apache-2.0
 *
 * The answer of a fit: a Newton step from where its search ended, by samples that the search
 * did not see. */
#ifndef IMP_SEARCH_ANSWER_H
#define IMP_SEARCH_ANSWER_H

#include "covariance.h"
#include "directions.h"
#include "sampled.h"

struct imp__answer {
    struct imp__directions every, free; /* of all variables; of those that may move */
    double *wish;                       /* [n] Newton's point without bounds */
    double *measurement, *monte_carlo;  /* [n][n] of `every`; u has those of `free` */
    double *noise;                      /* [n][n] of the pictures, as a covariance of g */
    double *from; /* [n] where the samples count; set by the caller */
    double *step; /* [n] the way from the answer to the Newton point, where it is left */
    double part;  /* of the step, in the answer */
    bool *fixed;  /* [n] at a bound */
    double kappa;
};

/* Release with imp__answer_destroy, also after a failure. */
enum imp_status imp__answer_create(imp_context *ctx, size_t n, struct imp__answer *a);
void imp__answer_destroy(imp_context *ctx, struct imp__answer *a);

/* Samples at x = a->from, and the answer u->x that they give: the Newton point, or the part of
 * the way that they have in all that is behind it. Where the model fails on that way, x moves
 * as far as it holds, and samples there take the place of these. u->found: see imp__covariance.
 * */
enum imp_status imp__answer_here(const struct imp__goal *goal,
                                 const struct imp__rounds *rounds, struct imp__sampled *s,
                                 struct imp__answer *a, struct imp__uncertainty *u);

#endif
