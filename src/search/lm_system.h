/* SPDX-License-Identifier: Apache-2.0
 *
 * The linear systems of Levenberg and Marquardt's iterations, as lm.c sees them: with
 * matrices for few variables, by products with them for many. */
#ifndef IMP_SEARCH_LM_SYSTEM_H
#define IMP_SEARCH_LM_SYSTEM_H

#include "optimize.h"

#define IMP_LM_MU_MIN 1e-7
#define IMP_LM_MU_MAX 1e8

struct imp__lm_system {
    const struct imp__lm_kind *kind;
    const struct imp__goal *goal;
    const double *g; /* [n] gradient */
    struct imp_estimate f;
    bool after_step; /* x is itself the Newton point of as many walks; set by lm.c */
    /* Variables that neither press against a bound nor are without effect. */
    size_t n_free;
};

/* What lm.c makes a system of, and ends it by: it is zeroed memory of this size before `begin`
 * and released after `end`, which is called also where `begin` has failed. */
struct imp__lm_kind {
    size_t size;
    enum imp_status (*begin)(struct imp__lm_system *s);
    void (*end)(struct imp__lm_system *s);
    /* The equations at x. */
    enum imp_status (*take)(struct imp__lm_system *s, const double *x, uint64_t seed);
    /* delta = (H + mu diag H_same)^-1 g over the variables that are free, 0 elsewhere, for
     * the smallest mu >= *mu at which the matrix is positive definite; *found false: none. */
    enum imp_status (*newton)(struct imp__lm_system *s, double *mu, double *delta,
                              bool *found);
    /* out = H v, [n]. */
    enum imp_status (*product)(struct imp__lm_system *s, const double *v, double *out);
    /* Is q = g^T A^-1 g no more than Monte Carlo noise alone makes it? Under a zero gradient
     * its mean is tr(A^-1 C) and its variance 2 tr((A^-1 C)^2), C the covariance of g. */
    enum imp_status (*within_noise)(struct imp__lm_system *s, bool *within);
};

/* Systems from goal->normal (lm_dense.c) and from goal->sparse (lm_sparse.c). */
extern const struct imp__lm_kind imp__lm_dense, imp__lm_sparse;

/* lm.c */
enum imp_status imp__lm_system_create(const struct imp__goal *goal,
                                      const struct imp__lm_kind *kind,
                                      struct imp__lm_system **out);
void imp__lm_system_destroy(struct imp__lm_system *system);

#endif
