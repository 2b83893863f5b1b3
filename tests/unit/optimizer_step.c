/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_optimizer_step against closed forms: Adam under a constant gradient and after two
 * different ones, momentum as a geometric series; bounds; refusals change nothing. */
#include "imp_tap.h"
#include <importon/importon.h>

enum { N = 3 };
static const double g[N] = {2, -0.5, 1e-6};

static struct imp_optimizer_rule rule_of(enum imp_rule kind, double rate)
{
    struct imp_optimizer_rule r = IMP_OPTIMIZER_RULE_INIT;
    r.kind = kind;
    r.learning_rate = rate;
    return r;
}

static double worst(const double *x, const double *truth)
{
    double most = 0;
    for (int k = 0; k < N; k++) most = fmax(most, fabs(x[k] - truth[k]));
    return most;
}

/* The corrected moments of a constant gradient are g and g^2 at every step, so
 *     x_t = x_0 - t a g / (|g| + eps). */
static void constant_gradient(void)
{
    const struct imp_optimizer_rule r = rule_of(IMP_RULE_ADAM, 0.01);
    double x[N] = {1, 2, 3}, truth[N], state[IMP_OPTIMIZER_STATE(N)] = {0};
    int fine = 1;
    for (int t = 0; t < 50; t++)
        fine &= imp_optimizer_step(&r, N, g, NULL, NULL, state, x) == IMP_OK;
    for (int k = 0; k < N; k++)
        truth[k] = k + 1 - 50 * 0.01 * g[k] / (fabs(g[k]) + r.epsilon);
    tap_ok(fine && state[0] == 50 && worst(x, truth) < 1e-12,
           "Adam, constant gradient # off %.2g", worst(x, truth));
}

/* After gradients g and h,
 *     m = (1 - b1) (b1 g + h),  v = (1 - b2) (b2 g^2 + h^2),  each over 1 - b^2. */
static void two_gradients(void)
{
    struct imp_optimizer_rule r = rule_of(IMP_RULE_ADAM, 0.1);
    const double h[N] = {-3, 0.25, 0};
    double x[N] = {0}, truth[N], state[IMP_OPTIMIZER_STATE(N)] = {0};
    r.beta1 = 0.7, r.beta2 = 0.8, r.epsilon = 1e-3;
    int fine = imp_optimizer_step(&r, N, g, NULL, NULL, state, x) == IMP_OK;
    fine &= imp_optimizer_step(&r, N, h, NULL, NULL, state, x) == IMP_OK;
    for (int k = 0; k < N; k++) {
        const double m = 0.3 * (0.7 * g[k] + h[k]) / (1 - 0.49);
        const double v = 0.2 * (0.8 * g[k] * g[k] + h[k] * h[k]) / (1 - 0.64);
        truth[k] = -0.1 * g[k] / (fabs(g[k]) + 1e-3) - 0.1 * m / (sqrt(v) + 1e-3);
    }
    tap_ok(fine && worst(x, truth) < 1e-14, "Adam, two gradients # off %.2g",
           worst(x, truth));
}

/* v_t = g (1 - mu^t) / (1 - mu),  x_t = x_0 - a sum v. */
static void momentum(void)
{
    struct imp_optimizer_rule r = rule_of(IMP_RULE_SGD, 0.1);
    double x[N] = {0}, truth[N], state[IMP_OPTIMIZER_STATE(N)] = {0}, sum = 0;
    int fine = 1;
    r.momentum = 0.6;
    for (int t = 1; t <= 20; t++) {
        fine &= imp_optimizer_step(&r, N, g, NULL, NULL, state, x) == IMP_OK;
        sum += (1 - pow(0.6, t)) / (1 - 0.6);
    }
    for (int k = 0; k < N; k++) truth[k] = -0.1 * g[k] * sum;
    tap_ok(fine && worst(x, truth) < 1e-12, "momentum is a geometric series # off %.2g",
           worst(x, truth));
}

/* J = 1/2 (x - c)^2 with c outside the bounds of the first two. */
static void bounds(void)
{
    const struct imp_optimizer_rule r = rule_of(IMP_RULE_ADAM, 0.02);
    const double c[N] = {2, -1, 0.5}, lo[N] = {0, 0, 0}, hi[N] = {1, 1, 1};
    const double truth[N] = {1, 0, 0.5};
    double x[N] = {0.5, 0.5, 0.1}, grad[N], state[IMP_OPTIMIZER_STATE(N)] = {0};
    int inside = 1;
    for (int t = 0; t < 2000; t++) {
        for (int k = 0; k < N; k++) grad[k] = x[k] - c[k];
        inside &= imp_optimizer_step(&r, N, grad, lo, hi, state, x) == IMP_OK;
        for (int k = 0; k < N; k++) inside &= x[k] >= 0 && x[k] <= 1;
    }
    tap_ok(inside && worst(x, truth) < 1e-3, "inside bounds, to the minimum # off %.2g",
           worst(x, truth));
}

static void refuses(const char *what, struct imp_optimizer_rule r, const double *grad)
{
    double x[N] = {1, 2, 3}, state[IMP_OPTIMIZER_STATE(N)] = {4, 1, 1, 1, 1, 1, 1};
    const double x0[N] = {1, 2, 3};
    const double state0[IMP_OPTIMIZER_STATE(N)] = {4, 1, 1, 1, 1, 1, 1};
    const enum imp_status st = imp_optimizer_step(&r, N, grad, NULL, NULL, state, x);
    tap_ok(st == IMP_E_ARG && strstr(imp_last_error(NULL), what) &&
               !memcmp(x, x0, sizeof x) && !memcmp(state, state0, sizeof state),
           "%s is refused # %s", what, imp_last_error(NULL));
}

static void refusals(void)
{
    const double bad[N] = {1, NAN, 1};
    struct imp_optimizer_rule r = IMP_OPTIMIZER_RULE_INIT;
    refuses("gradient", r, bad);
    refuses("learning_rate", rule_of(IMP_RULE_ADAM, 0), g);
    refuses("kind", rule_of((enum imp_rule)7, 1), g);
    r.beta1 = 1;
    refuses("beta1", r, g);
    r = rule_of(IMP_RULE_ADAM, 1), r.beta2 = -0.1;
    refuses("beta2", r, g);
    r = rule_of(IMP_RULE_ADAM, 1), r.epsilon = 0;
    refuses("epsilon", r, g);
    r = rule_of(IMP_RULE_SGD, 1), r.momentum = NAN;
    refuses("momentum", r, g);
}

int main(void)
{
    constant_gradient();
    two_gradients();
    momentum();
    bounds();
    refusals();
    return tap_done();
}
