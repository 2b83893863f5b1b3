/* SPDX-License-Identifier: Apache-2.0
 *
 * Average, extremes and uniformities of a grid, with intervals (importon/rooms.h has their
 * derivation). */
#include "base/arguments.h"
#include "grid_film.h"
#include "math/stat.h"
#include "math/vec.h"
#include <importon/rooms.h>
#include <math.h>

/* z(1 - risk) of errors that have k degrees of freedom; below 1: of exact ones. */
static double quantile(double risk, double k)
{
    const double z = -imp__normal_quantile(risk);
    if (k < 1 || k > 1e5) return z;
    double lo = z, hi = z + 1;
    while (imp__normal_of_student(hi, k) < z && hi < 1e9) hi *= 2;
    for (int i = 0; i < 80; i++) {
        const double t = 0.5 * (lo + hi);
        if (imp__normal_of_student(t, k) < z) lo = t;
        else hi = t;
    }
    return hi;
}

struct grid {
    size_t n;
    const double *value, *se;
    double freedom, together; /* of the error of a point, of that of the average */
};

/* Degrees of freedom of a sum of independent variances s^2, each estimated with k (Satterthwaite
 * 1946; E[s^4] = (1 + 2/k) sigma^4). */
double imp__grid_freedom(size_t n, const double *se, double k)
{
    double sum = 0, square = 0;
    for (size_t i = 0; i < n; i++) {
        sum += se[i] * se[i];
        square += imp__sqr(se[i] * se[i]);
    }
    return square > 0 ? fmax(k, (k + 2) * sum * sum / square) : k;
}

/* Chance of an error beyond t, with k degrees of freedom. */
static double tail(double t, double k)
{
    return imp__normal_cdf(-(k < 1 || k > 1e5 ? t : imp__normal_of_student(t, k)));
}

/* How many standard errors are added for the upper bound: with u such that
 *
 *     sum_i tail(u + d_i) = risk,   d_i = max(0, (x_i - m)/s_i - CERTAIN),
 *     m = min_j (x_j + CERTAIN s_j)
 *
 * a point counts less, the farther it is sure to lie above the least one. */
static double upper(const struct grid *g, double sign, double risk, double one,
                    double all)
{
    enum { HALVINGS = 40 };
    const double CERTAIN = 1.75, far = 12;
    double m = INFINITY, lo = one, hi = all;
    for (size_t i = 0; i < g->n; i++)
        m = fmin(m, sign * g->value[i] + CERTAIN * g->se[i]);
    for (int k = 0; k < HALVINGS && hi - lo > 1e-4 * hi; k++) {
        const double u = 0.5 * (lo + hi);
        double sum = 0;
        for (size_t i = 0; i < g->n && sum <= risk; i++) {
            const double above = sign * g->value[i] - m;
            if (above > (CERTAIN + far) * g->se[i] && g->freedom > 1e5) continue;
            sum += tail(u + fmax(0, g->se[i] > 0 ? above / g->se[i] - CERTAIN
                                                 : (above > 0 ? INFINITY : 0)),
                        g->freedom);
        }
        if (sum > risk) lo = u;
        else hi = u;
    }
    return hi;
}

/* Bounds of the true minimum, each missed with probability `risk` at most where few points are near
 * it; where many are, the lower one is hardly ever missed, and the upper one by up to twice that.
 * sign -1: of the minimum of the negated values. */
static struct imp_interval_estimate least(const struct grid *g, double sign, double risk,
                                          size_t *at)
{
    const double one = quantile(risk, g->freedom),
                 all = quantile(risk / (double)g->n, g->freedom);
    const double above = g->n > 1 ? upper(g, sign, risk, one, all) : one;
    struct imp_interval_estimate m = {INFINITY, INFINITY, INFINITY};
    for (size_t i = 0; i < g->n; i++) {
        const double x = sign * g->value[i];
        if (x < m.value) m.value = x, *at = i;
        m.lo = fmin(m.lo, x - one * g->se[i]);
        m.hi = fmin(m.hi, x + above * g->se[i]);
    }
    return m;
}

static struct imp_interval_estimate minimum(const struct grid *g, double risk, size_t *at)
{
    struct imp_interval_estimate m = least(g, 1, risk, at);
    m.lo = fmax(m.lo, 0); /* light is not negative */
    m.hi = fmax(m.hi, m.lo);
    return m;
}
static struct imp_interval_estimate maximum(const struct grid *g, double risk, size_t *at)
{
    const struct imp_interval_estimate m = least(g, -1, risk, at);
    return (struct imp_interval_estimate){-m.value, fmax(-m.hi, 0), -m.lo};
}
static struct imp_interval_estimate mean(const struct grid *g,
                                         const struct imp_estimate *average, double risk)
{
    const double z = quantile(risk, g->together);
    return (struct imp_interval_estimate){average->value,
                                          fmax(average->value - z * average->se, 0),
                                          average->value + z * average->se};
}

static struct imp_interval_estimate ratio(struct imp_interval_estimate a,
                                          struct imp_interval_estimate b)
{
    return (struct imp_interval_estimate){b.value > 0 ? a.value / b.value : 0,
                                          b.hi > 0 ? fmin(a.lo / b.hi, 1) : 0,
                                          b.lo > 0 ? fmin(a.hi / b.lo, 1) : 1};
}

enum imp_status imp_grid_summarise(imp_context *context, size_t n, const double *value,
                                   const double *se, const struct imp_estimate *average,
                                   int64_t sets, double confidence,
                                   struct imp_grid_summary *out)
{
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, value, "value");
    IMP_REQUIRE(context, se, "se");
    IMP_REQUIRE(context, out, "out");
    IMP_FINITE(context, confidence, "confidence");
    if (n == 0) return imp__error(context, IMP_E_ARG, "a grid of no points");
    IMP_FINITE_ALL(context, value, n, "value");
    IMP_FINITE_ALL(context, se, n, "se");
    struct imp_estimate all = {0};
    for (size_t i = 0; i < n; i++) {
        if (se[i] < 0)
            return imp__error(context, IMP_E_ARG, "se[%zu] = %g is negative", i, se[i]);
        all.value += value[i] / (double)n;
        all.se += se[i] * se[i];
    }
    all.se = sqrt(all.se) / (double)n;
    const double k = (double)sets - 1;
    const bool apart = !average || fabs(average->se - all.se) <= 1e-9 * all.se;
    if (average) all = *average;
    IMP_FINITE(context, all.value, "average.value");
    IMP_FINITE(context, all.se, "average.se");
    if (confidence == 0) confidence = 0.95;
    if (!(confidence > 0 && confidence < 1))
        return imp__error(context, IMP_E_ARG, "confidence = %g is not in (0, 1)",
                          confidence);
    const struct grid g = {n, value, se, k,
                           average && average->freedom > 0 ? average->freedom
                           : k >= 1 && apart               ? imp__grid_freedom(n, se, k)
                                                           : k};
    struct imp_grid_summary s = {.size = sizeof s, .n = n, .confidence = confidence};
    const double side = (1 - confidence) / 2;
    size_t at;
    s.average = mean(&g, &all, side);
    s.minimum = minimum(&g, side, &s.at_minimum);
    s.maximum = maximum(&g, side, &s.at_maximum);
    /* The average is known so much better that a fifth of the risk hardly widens it. */
    s.uniformity = ratio(minimum(&g, 0.8 * side, &at), mean(&g, &all, 0.2 * side));
    s.diversity = ratio(minimum(&g, 0.5 * side, &at), maximum(&g, 0.5 * side, &at));
    IMP_GIVE(context, out, s, "out");
    return IMP_OK;
}
