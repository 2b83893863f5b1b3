/* SPDX-License-Identifier: Apache-2.0
 *
 * Preconditioned conjugate gradients (Hestenes and Stiefel, J. Res. NBS 49, 1952) for
 *
 *     (H + mu D) x = b,      D = diag H_same,
 *
 * over the variables that may move, of several b at once. D preconditions. H may be
 * indefinite; a direction p with p^T (H + mu D) p <= 0 is reported, and how large mu has to be
 * for it. */
#ifndef IMP_SEARCH_CONJUGATE_H
#define IMP_SEARCH_CONJUGATE_H

#include "sparse_normal.h"

struct imp__conjugate {
    const struct imp__sparse_normal *eq;
    const bool *fixed; /* [n] these are 0 in x, and no equations */
    double tolerance;  /* of the residual, over that of x = 0, in the norm of D^-1 */
    int most;          /* iterations */
    /* Set. */
    bool positive;  /* no such p was met; else x is not a solution, */
    double needed;  /* and mu has to be above this */
    bool converged; /* all residuals are below the tolerance */
    int iterations;
};

/* b and x [n][width], width 1 or IMP_SPARSE_WIDTH; b is not read where fixed. */
enum imp_status imp__conjugate_solve(imp_context *ctx, struct imp__conjugate *of,
                                     double mu, int width, const double *b, double *x);
/* ... for the smallest mu >= *mu, in steps of at least 4, at which no such p is met. *found
 * false: none up to `mu_most`. */
enum imp_status imp__conjugate_up(imp_context *ctx, struct imp__conjugate *of,
                                  double mu_most, double *mu, int width, const double *b,
                                  double *x, bool *found);

#endif
