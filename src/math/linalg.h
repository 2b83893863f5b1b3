/* SPDX-License-Identifier: Apache-2.0
 *
 * Small dense symmetric matrices, row-major [n][n]: Cholesky and eigenvalues. */
#ifndef IMP_MATH_LINALG_H
#define IMP_MATH_LINALG_H

#include <stdbool.h>
#include <stddef.h>

/* A = L L^T in place: L in the lower triangle, zeros above. Reads the lower triangle
 * only. False (contents undefined): A is not positive definite to working precision. */
bool imp__cholesky(size_t n, double *a);
/* x = A^-1 b in place, from the factor. */
void imp__cholesky_solve(size_t n, const double *l, double *b);
/* inverse [n][n] of A, from the factor; not in place. */
void imp__cholesky_inverse(size_t n, const double *l, double *inverse);

/* Eigenvalues, ascending, and orthonormal eigenvectors: row k of `vectors` [n][n] belongs
 * to values[k]. Cyclic Jacobi: accurate to rounding for small eigenvalues of scaled
 * matrices too. `a` [n][n], symmetric, is destroyed. False: did not converge (a NaN was
 * inside). */
bool imp__eigen_symmetric(size_t n, double *a, double *values, double *vectors);

#endif
