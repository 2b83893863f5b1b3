/* SPDX-License-Identifier: Apache-2.0
 *
 * Standard error of one variable from two covariances, its interval, and the one-sided interval
 * at a bound. */
#include "interval_row.h"
#include "math/vec.h"
#include <math.h>

#define Z_TWO_SIDED 1.959963984540054
#define Z_ONE_SIDED 1.6448536269514722

double imp__interval_se(const struct imp__directions *a, size_t n, size_t k,
                        const double *measurement, const double *monte_carlo)
{
    const size_t d = k * n + k;
    if (imp__is_loose(a, k) && !a->held) return NAN;
    return sqrt(fmax(measurement[d], 0) + fmax(monte_carlo[d], 0));
}

void imp__interval_free(const struct imp__goal *goal, size_t k, double se,
                        struct imp_fit_variable *v)
{
    const bool open = isnan(se);
    v->se = se;
    v->lo95 = open ? NAN : imp__into_bounds(goal, k, v->value - Z_TWO_SIDED * se);
    v->hi95 = open ? NAN : imp__into_bounds(goal, k, v->value + Z_TWO_SIDED * se);
}

void imp__interval_bound(const struct imp__goal *goal, size_t k, double u, double se,
                         struct imp_fit_variable *v)
{
    imp__interval_free(goal, k, se, v);
    if (isnan(se)) return;
    if (v->at_bound < 0) {
        v->lo95 = goal->lo[k];
        v->hi95 = imp__into_bounds(goal, k, fmax(u, goal->lo[k]) + Z_ONE_SIDED * se);
    } else {
        v->hi95 = goal->hi[k];
        v->lo95 = imp__into_bounds(goal, k, fmin(u, goal->hi[k]) - Z_ONE_SIDED * se);
    }
}

double imp__beyond_square(double t)
{
    if (t < -20) return 2 / (t * t); /* 1 % off, where the sum cancels */
    const double density = exp(-0.5 * t * t) / sqrt(IMP_2PI);
    return 1 + t * t + t * density / (0.5 * erfc(-t / sqrt(2)));
}
