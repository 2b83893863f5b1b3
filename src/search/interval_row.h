/* SPDX-License-Identifier: Apache-2.0
 *
 * The interval of one variable of a fit. */
#ifndef IMP_SEARCH_INTERVAL_ROW_H
#define IMP_SEARCH_INTERVAL_ROW_H

#include "directions.h"

/* Standard error of variable k from the two covariances [n][n]; NAN: nothing determines
 * it. */
double imp__interval_se(const struct imp__directions *a, size_t n, size_t k,
                        const double *measurement, const double *monte_carlo);
/* Sets se, lo95, hi95; se NAN: there is no interval. */
void imp__interval_free(const struct imp__goal *goal, size_t k, double se,
                        struct imp_fit_variable *v);
/* At a bound the interval is one-sided: from the bound to the 95 % limit about `u`, the
 * Newton point without bounds. */
void imp__interval_bound(const struct imp__goal *goal, size_t k, double u, double se,
                         struct imp_fit_variable *v);

/* Mean square of what of N(t, 1) is beyond 0: 1 + t^2 + t phi(t)/Phi(t). */
double imp__beyond_square(double t);

#endif
