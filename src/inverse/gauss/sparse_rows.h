/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal equations of many values, whose matrix is never formed: the derivatives of each
 * pixel's walks with respect to the few values that they met are stored as rows, and
 * multiplied with vectors. With X_a the derivatives of unit a of a pixel's samples
 * (gauss_newton.c), that of a vector v is
 *
 *     H v = sum over pixels  w sum_a X_a (D - d_a) / (M (M - 1)),    d_a = X_a . v,   D = sum d_a
 *
 * the product with the same unbiased matrix as for few values: only pairs of different
 * units count. */
#ifndef IMP_INVERSE_SPARSE_ROWS_H
#define IMP_INVERSE_SPARSE_ROWS_H

#include "inverse/problem/problem.h"
#include "search/sparse_normal.h"

struct imp__row_pixel {
    uint64_t key;      /* of target and pixel: random signs of its noise */
    uint64_t own;      /* and of these samples */
    uint32_t row;      /* its first, of [units][channels] */
    int units;         /* at least 4 */
    double share;      /* of the samples of the pixel that these are */
    double weight[3];  /* Gauss and Newton's w */
    float noise_se[3]; /* of the target; below 0: not known */
};

/* Rows of a part of the samples of a tile. A row is one channel of one unit. */
struct imp__row_block {
    void *memory; /* of all that follows */
    int channels;
    double noise_share; /* of squared residuals of pixels, what is not the walks' noise */
    size_t n_pixels, n_rows, n_entries;
    struct imp__row_pixel *pixel;
    double *r;        /* [n_rows] residual */
    double *push;     /* [n_rows] what the gradient multiplies the row with */
    uint32_t *end;    /* [n_rows] of its entries, which begin where the row before ends */
    uint32_t *number; /* [n_entries] */
    float *value;     /* [n_entries] derivative of the unit's mean */
};

struct imp__rows {
    imp_context *ctx;
    size_t n; /* values */
    size_t n_blocks;
    struct imp__row_block *block;
    double n_residuals;
    /* Where channels of a pixel share their noise: pixels that count. 0: there are too few of them for
     * so many values, and channels are independent. */
    double n_pixels;
    /* Where sigmas are given, channel c has the noise sigma_c sum_k mix[c][k] xi_k, k <= c, with
     * independent xi of variance 1. */
    double mix[3][3];
    struct imp_estimate objective; /* of the data, as an evaluation with the same walks */
    double *sums; /* [IMP_ROW_GROUPS][n][IMP_SPARSE_WIDTH]: sums of groups of blocks */
};
/* Blocks are added up in groups, whose number is that of no threads: same bits. */
enum { IMP_ROW_GROUPS = 8 };

/* Rows at x (NULL: at the scene's values) from `rounds` times the samples of an
 * evaluation, for sensors whose pixels share no walks. look: first some tiles are
 * sampled, by whose rows the memory of all is estimated. IMP_E_NOMEM: more than there is;
 * IMP_E_UNSUPPORTED: pixels share walks. */
enum imp_status imp__rows_take(struct imp_problem *p, const double *x,
                               const struct imp_run *run, int rounds, bool look,
                               struct imp__rows *out);
void imp__rows_destroy(struct imp__rows *rows);

/* ---- sparse_products.c ----------------------------------------------------------- */

/* y = H v, of `width` vectors (1 or IMP_SPARSE_WIDTH), [n][width]. */
enum imp_status imp__rows_product(const struct imp__rows *rows, int width,
                                  const double *v, double *y);
/* g = J^T W r, [n]. */
enum imp_status imp__rows_gradient(const struct imp__rows *rows, double *g);
/* z [n][IMP_SPARSE_WIDTH]: vectors of mean 0 with the given covariance. */
enum imp_status imp__rows_draw(const struct imp__rows *rows, enum imp__draw what,
                               uint64_t seed, double *z);

/* ---- sparse_channels.c ----------------------------------------------------------- */

/* Finds n_pixels and mix, of rows that are there. */
void imp__rows_share_noise(struct imp__rows *rows, const struct imp_problem *p);

/* ---- sparse_diagonal.c ----------------------------------------------------------- */

/* The diagonal of H, and the variance of that; the diagonal of the same-sample matrix.
 * [n] each. */
enum imp_status imp__rows_diagonal(const struct imp__rows *rows, double *diagonal,
                                   double *spread, double *same);

#endif
