/* SPDX-License-Identifier: Apache-2.0
 *
 * Subtraction of one covariance from another, both of them estimates, with a result that is
 * positive. */
#ifndef IMP_SEARCH_EXCESS_H
#define IMP_SEARCH_EXCESS_H

#include "base/context.h"

/* covariance [n][n] -= excess [n][n], both estimates, the excess with noise of its own: in
 * no combination of variables less than nothing or more than 2/3 of the covariance, which
 * is the most that there can be (inverse/pair_noise.h). */
enum imp_status imp__excess_take(imp_context *ctx, size_t n, double *covariance,
                                 const double *excess);

#endif
