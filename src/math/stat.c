/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal and gamma distributions, and the Sidak correction for many tests. */
#include "stat.h"
#include <math.h>

double imp__normal_cdf(double x) { return 0.5 * erfc(-x * 0.70710678118654752440); }

/* Start from the tail's leading term or a straight line, then Halley's steps on the cdf;
 * the lower tail is solved and mirrored, where the cdf has full relative accuracy. */
double imp__normal_quantile(double p)
{
    if (isnan(p)) return p;
    if (p <= 0) return -INFINITY;
    if (p >= 1) return INFINITY;
    if (p > 0.5) return -imp__normal_quantile(1 - p);
    const double t = sqrt(-2 * log(p));
    double x = p < 0.1 ? -(t - log(t * 2.5066282746310002) / t) : (p - 0.5) * 2.5;
    for (int i = 0; i < 30; i++) {
        const double density = 0.39894228040143267794 * exp(-0.5 * x * x);
        const double r = (imp__normal_cdf(x) - p) / density;
        const double step = r / (1 + 0.5 * x * r);
        x -= step;
        if (fabs(step) <= 1e-15 * fabs(x)) break;
    }
    return x;
}

/* Series for P below the mean, Lentz's continued fraction for Q above (Abramowitz and
 * Stegun 6.5.29, 6.5.31). Both need about sqrt(a) terms near x = a. */
double imp__gamma_q(double a, double x)
{
    if (!(a > 0) || !(x >= 0)) return NAN;
    if (x == 0) return 1;
    if (isinf(x)) return 0;
    int sign;
    const double front = exp(a * log(x) - x - lgamma_r(a, &sign));
    const int limit = 1000 + (int)fmin(1e6, 50 * sqrt(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (int n = 1; n < limit && term > 1e-17 * sum; n++) {
            term *= x / (a + n);
            sum += term;
        }
        return fmax(0, 1 - front * sum);
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int n = 1; n < limit; n++) {
        const double an = -n * (n - a);
        b += 2;
        d = an * d + b;
        if (fabs(d) < 1e-300) d = 1e-300;
        c = b + an / c;
        if (fabs(c) < 1e-300) c = 1e-300;
        d = 1 / d;
        h *= d * c;
        if (fabs(d * c - 1) < 1e-15) break;
    }
    return front * h;
}

double imp__chi2_tail(double x, double k)
{
    return x <= 0 ? 1 : imp__gamma_q(k / 2, x / 2);
}

double imp__chi2_tail_off(double x, double k, double lambda)
{
    const double mean = lambda / 2, reach = 12 * sqrt(mean) + 40;
    double sum = 0;
    for (double j = fmax(0, floor(mean - reach)); j < mean + reach; j++) {
        const double weight =
            mean > 0 ? exp(j * log(mean) - mean - lgamma(j + 1)) : j == 0;
        sum += weight * imp__chi2_tail(x, k + 2 * j);
    }
    return sum;
}

double imp__chi2_seen(double level, double k, double power)
{
    double below = 0, above = k + 20 * sqrt(2 * k) + 200; /* the limit of the test */
    for (int i = 0; i < 60; i++) {
        const double x = (below + above) / 2;
        *(imp__chi2_tail(x, k) > level ? &below : &above) = x;
    }
    const double limit = above;
    below = 0, above = limit + 200;
    for (int i = 0; i < 40; i++) {
        const double x = (below + above) / 2;
        *(imp__chi2_tail_off(limit, k, x) < power ? &below : &above) = x;
    }
    return above;
}

double imp__sidak(double alpha, double n) { return -expm1(log1p(-alpha) / n); }

double imp__normal_of_student(double t, double k)
{
    if (isinf(k) || t == 0 || isinf(t)) return t;
    const double z = (8 * k + 1) / (8 * k + 3) * sqrt(k * log1p(t * t / k));
    return copysign(z, t);
}

double imp__student_of_normal(double z, double k)
{
    if (isinf(k) || z == 0 || isinf(z)) return z;
    const double s = z * (8 * k + 3) / (8 * k + 1);
    return copysign(sqrt(k * expm1(s * s / k)), z);
}
