/* SPDX-License-Identifier: Apache-2.0
 *
 * Distributions that tests and intervals need. */
#ifndef IMP_MATH_STAT_H
#define IMP_MATH_STAT_H

/* Standard normal: P(X <= x), and its inverse (p in (0,1); +-inf at the ends). */
double imp__normal_cdf(double x);
double imp__normal_quantile(double p);
/* Regularised upper incomplete gamma function Q(a, x), a > 0, x >= 0. */
double imp__gamma_q(double a, double x);
/* P(X >= x) for chi-square with k degrees of freedom. */
double imp__chi2_tail(double x, double k);
/* Level for each of n tests, so that all together err with probability alpha (Sidak
 * 1967). */
double imp__sidak(double alpha, double n);

#endif
