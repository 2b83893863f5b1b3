/* SPDX-License-Identifier: Apache-2.0
 *
 * Single steps of plain Adam and of gradient descent with momentum, for hosts with loops
 * of their own. adam.c is the search of imp_fit, which adapts its rate. */
#include "base/arguments.h"
#include <math.h>
#include <stdbool.h>

static double bounded(const double *lo, const double *hi, size_t k, double x)
{
    if (lo && x < lo[k]) return lo[k];
    return hi && x > hi[k] ? hi[k] : x;
}

/* Kingma and Ba 2015, Algorithm 1, with t the number of this step:
 *
 *     m <- b1 m + (1 - b1) g,     v <- b2 v + (1 - b2) g^2,
 *     x <- x - a (m / (1 - b1^t)) / (sqrt(v / (1 - b2^t)) + eps)
 */
static void adam(const struct imp_optimizer_rule *r, size_t n, const double *g,
                 const double *lo, const double *hi, double *state, double *x)
{
    const double t = ++state[0], c1 = 1 - pow(r->beta1, t), c2 = 1 - pow(r->beta2, t);
    double *m = state + 1, *v = state + 1 + n;
    for (size_t k = 0; k < n; k++) {
        m[k] = r->beta1 * m[k] + (1 - r->beta1) * g[k];
        v[k] = r->beta2 * v[k] + (1 - r->beta2) * g[k] * g[k];
        const double direction = (m[k] / c1) / (sqrt(v[k] / c2) + r->epsilon);
        x[k] = bounded(lo, hi, k, x[k] - r->learning_rate * direction);
    }
}

/* v <- momentum v + g,     x <- x - a v */
static void descent(const struct imp_optimizer_rule *r, size_t n, const double *g,
                    const double *lo, const double *hi, double *state, double *x)
{
    double *v = state + 1;
    state[0]++;
    for (size_t k = 0; k < n; k++) {
        v[k] = r->momentum * v[k] + g[k];
        x[k] = bounded(lo, hi, k, x[k] - r->learning_rate * v[k]);
    }
}

static bool is_decay(double d) { return d >= 0 && d < 1; }

static enum imp_status rule_check(const struct imp_optimizer_rule *r)
{
    if (r->kind != IMP_RULE_ADAM && r->kind != IMP_RULE_SGD)
        return imp__error(NULL, IMP_E_ARG, "imp_optimizer_step: kind = %d is unknown",
                          (int)r->kind);
    if (!(r->learning_rate > 0))
        return imp__error(NULL, IMP_E_ARG,
                          "imp_optimizer_step: learning_rate = %g is not positive",
                          r->learning_rate);
    const struct {
        const char *name;
        double value;
    } decays[] = {{"beta1", r->beta1}, {"beta2", r->beta2}, {"momentum", r->momentum}};
    for (size_t k = 0; k < sizeof decays / sizeof *decays; k++)
        if (!is_decay(decays[k].value))
            return imp__error(NULL, IMP_E_ARG,
                              "imp_optimizer_step: %s = %g is outside [0, 1)",
                              decays[k].name, decays[k].value);
    if (!(r->epsilon > 0) || !isfinite(r->epsilon))
        return imp__error(NULL, IMP_E_ARG,
                          "imp_optimizer_step: epsilon = %g is not positive and finite",
                          r->epsilon);
    return IMP_OK;
}

enum imp_status imp_optimizer_step(const struct imp_optimizer_rule *rule, size_t n,
                                   const double *gradient, const double *lo,
                                   const double *hi, double *state, double *x)
{
    struct imp_optimizer_rule own = IMP_OPTIMIZER_RULE_INIT;
    IMP_REQUIRE(NULL, gradient, "gradient");
    IMP_REQUIRE(NULL, state, "state");
    IMP_REQUIRE(NULL, x, "x");
    IMP_OPTIONS(NULL, own, rule, "rule");
    IMP_FINITE(NULL, own.learning_rate, "learning_rate");
    IMP_CHECKED(rule_check(&own));
    IMP_FINITE_ALL(NULL, gradient, n, "gradient");
    for (size_t k = 0; k < n; k++) /* no bound: lo = -inf, hi = +inf only */
        if ((lo && !(lo[k] < INFINITY)) || (hi && !(hi[k] > -INFINITY)))
            return imp__error(NULL, IMP_E_ARG, "imp_optimizer_step: %s[%zu] is no bound",
                              lo && !(lo[k] < INFINITY) ? "lo" : "hi", k);
    (own.kind == IMP_RULE_ADAM ? adam : descent)(&own, n, gradient, lo, hi, state, x);
    return IMP_OK;
}
