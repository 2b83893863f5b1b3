/* SPDX-License-Identifier: Apache-2.0
 *
 * Distributions that tests and intervals need, and means of what is drawn. */
#ifndef IMP_MATH_STAT_H
#define IMP_MATH_STAT_H

/* Standard normal: P(X <= x), and its inverse (p in (0,1); +-inf at the ends). */
double imp__normal_cdf(double x);
double imp__normal_quantile(double p);
/* Standard normal with the probability of t in Student's distribution with k > 0 degrees of
 * freedom (Wallace 1959, Ann. Math. Statist. 30, 1124): to 2 %
 * for k >= 3. */
double imp__normal_of_student(double t, double k);
/* Its inverse. */
double imp__student_of_normal(double z, double k);
/* Regularised upper incomplete gamma function Q(a, x), a > 0, x >= 0. */
double imp__gamma_q(double a, double x);
/* P(X >= x) for chi-square with k degrees of freedom. */
double imp__chi2_tail(double x, double k);
/* The same with the noncentrality lambda: a Poisson mixture of chi-squares with k + 2 j degrees. */
double imp__chi2_tail_off(double x, double k, double lambda);
/* The noncentrality that a chi-square test of this level finds with this probability; n draws
 * whose density is off by the relative error d have n times the mean of d^2. */
double imp__chi2_seen(double level, double k, double power);
/* Level for each of n tests, so that all together err with probability alpha (Sidak
 * 1967). */
double imp__sidak(double alpha, double n);

/* Mean and sum of squared deviations while numbers arrive (Welford 1962). */
struct imp__mean {
    double n, mean, m2;
};
static inline void imp__mean_add(struct imp__mean *s, double x)
{
    const double d = x - s->mean;
    s->n += 1;
    s->mean += d / s->n;
    s->m2 += d * (x - s->mean);
}
/* Squared standard error of the mean. */
static inline double imp__mean_variance(const struct imp__mean *s)
{
    return s->m2 / (s->n - 1) / s->n;
}

#endif
