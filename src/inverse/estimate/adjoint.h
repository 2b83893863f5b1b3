/* SPDX-License-Identifier: Apache-2.0
 *
 * From the radiances of a pixel's walks to their adjoints. */
#ifndef IMP_INVERSE_ADJOINT_H
#define IMP_INVERSE_ADJOINT_H

#include "inverse/problem/problem.h"

#define IMP_REPLICATE_MAX 256 /* walks of a pixel that are kept at once */

/* Adjoints of the 2 <= n <= IMP_REPLICATE_MAX walks of one replicate of a pixel, from
 * their radiances L [n]: the gradient of the pixel's loss is estimated by
 *
 *     sum_i P_i dL_i
 *
 * Residuals are those of M [n], which is L but with a control variate of a quadratic loss.
 * Returns the estimate of the loss, of L alone. */
double imp__replicate_adjoints(const struct imp__target *target, int channels,
                               size_t pixel, int n, const imp_spec *L, const imp_spec *M,
                               imp_spec *P);

/* From two independent sets, with their means L and the adjoints P of the above: the variance
 * of the loss, and adjoints E of a number of mean 0, whose square is the variance of the
 * gradient (docs/estimators.md 14):
 *
 *     sum_i E_i dL_i
 */
double imp__replicate_errors(const struct imp__target *target, int channels, size_t pixel,
                             const imp_spec L[2], const imp_spec P[2], imp_spec E[2]);

#endif
