/* SPDX-License-Identifier: Apache-2.0
 *
 * Gauss-Legendre quadrature. */
#ifndef IMP_MATH_QUADRATURE_H
#define IMP_MATH_QUADRATURE_H

#include <stddef.h>

/* Nodes (ascending) and weights of n points on [lo, hi]: exact for degree 2n - 1. */
void imp__gauss_legendre(size_t n, double lo, double hi, double *x, double *w);

#endif
