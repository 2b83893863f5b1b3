/* SPDX-License-Identifier: Apache-2.0
 *
 * Coordinates for methods that treat each coordinate separately: the eigenvectors of the
 * Gauss-Newton matrix in units of the scales. In them the objective has no valleys that
 * run diagonally to the axes. */
#ifndef IMP_SEARCH_BASIS_H
#define IMP_SEARCH_BASIS_H

#include "optimize.h"

#define IMP_BASIS_MAX 64 /* variables: J^T J costs n^2 a walk */

/* A [n][n] = D H D, H = J^T J at x from the random numbers of `seed`, D the scales.
 * *known false: there is none. */
enum imp_status imp__basis_matrix(const struct imp__goal *goal, const double *x,
                                  uint64_t seed, double *A, bool *known);

/* V [n][n], orthonormal rows, from A: row k is direction k. Variables that are `aligned`
 * (not 0), and those without any effect, keep axes of their own: row k is e_k. R [n][n] =
 * V V_old^T: which converts components along the old directions into the new ones. */
enum imp_status imp__basis_turn(imp_context *ctx, size_t n, const double *A,
                                const double *aligned, double *V, double *R);

/* Numbers of the variables along the directions, out = V in, and back, out = V^T in; V NULL:
 * the directions are the variables. */
void imp__basis_along(size_t n, const double *V, const double *in, double *out);
void imp__basis_back(size_t n, const double *V, const double *in, double *out);

#endif
