/* SPDX-License-Identifier: Apache-2.0
 *
 * Standard errors of many variables, whose covariance matrix is too large to be made. With
 * vectors z drawn with the covariance of the gradient, by noise of the data and of the walks,
 * u = G z has that of the answer, so that
 *
 *     se_k^2 ~ mean over draws of u_k^2
 *
 * which of normal u has the distribution of chi^2 over its D degrees of freedom, D the draws:
 * Student's t of as many makes intervals from it (docs/estimators.md 15). */
#ifndef IMP_SEARCH_SPARSE_ERRORS_H
#define IMP_SEARCH_SPARSE_ERRORS_H

#include "optimize.h"

enum { IMP_ERROR_DRAWS = 4 * IMP_SPARSE_WIDTH };
#define IMP_ERROR_T 2.036933 /* 97.5 % of Student's t with so many degrees of freedom */

struct imp__sparse_errors {
    double *x; /* [n] a last Newton step from the x handed in, made with random numbers of
                  its own: its error is se; NULL: there are none, and */
    const char *why; /* is the reason, a constant string */
    double *se;      /* [n] NAN at a bound, and of variables that are not determined */
    size_t n_bound;  /* variables that press against a bound */
    size_t n_loose;  /* not determined: H_kk is below two of its standard errors */
};

/* Normal equations at x with fresh random numbers, twice the samples of an evaluation. */
enum imp_status imp__sparse_errors_find(const struct imp__goal *goal, const double *x,
                                        int look, struct imp__sparse_errors *out);
void imp__sparse_errors_destroy(imp_context *ctx, struct imp__sparse_errors *errors);

#endif
