/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal equations of many variables, by products with their matrix. */
#ifndef IMP_SEARCH_SPARSE_NORMAL_H
#define IMP_SEARCH_SPARSE_NORMAL_H

#include "base/context.h"

#define IMP_SPARSE_MAX 262144 /* variables */

enum { IMP_SPARSE_WIDTH = 8 }; /* vectors that are multiplied at once */

/* Covariances that vectors are drawn from. */
enum imp__draw {
    IMP_DRAW_GRADIENT,   /* of g by Monte Carlo, too large by */
    IMP_DRAW_EXCESS,     /* this (imp__normal.cov_excess) */
    IMP_DRAW_MEASUREMENT /* of g by noise of the data, with the walks as they are */
};

struct imp__sparse_normal {
    size_t n;
    double *g;        /* [n] gradient */
    double *same;     /* [n] diagonal of the same-sample matrix: damps */
    double *diagonal; /* [n] of the data's part of H: unbiased, */
    double *spread;   /* [n] with this variance */
    struct imp_estimate f;
    double n_residuals;
    double *prior;    /* [n] diagonal of the part of H that is not from data */
    bool noise_known; /* every target has its standard errors */
    /* y = H v, of `width` vectors (1 or IMP_SPARSE_WIDTH), [n][width]. */
    enum imp_status (*product)(const struct imp__sparse_normal *eq, int width,
                               const double *v, double *y);
    /* z [n][IMP_SPARSE_WIDTH]: vectors of mean 0 with this covariance. */
    enum imp_status (*draw)(const struct imp__sparse_normal *eq, enum imp__draw what,
                            uint64_t seed, double *z);
    void (*destroy)(struct imp__sparse_normal *eq);
    void *of; /* the goal's */
};

static inline void imp__sparse_normal_destroy(struct imp__sparse_normal *eq)
{
    if (eq->destroy) eq->destroy(eq);
    *eq = (struct imp__sparse_normal){0};
}

#endif
