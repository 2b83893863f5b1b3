/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses and their derivatives, and the scalar test of docs/estimators.md 5.1: L_i =
 * theta X_i, x_i = X_i, X ~ Exp(1), theta = 1.3, T = 1. The gradient of 1/2 (I - T)^2 is
 * 0.3; estimators that use a sample against itself give something else, and leave-one-out
 * does not. */
#include "inverse/problem/loss.h"
#include "imp_tap.h"
#include "math/rng.h"

static double value_of(enum imp_loss loss, double I, double T)
{
    struct imp__loss_at at;
    imp__loss_eval(loss, 1.7, 0.01, I, T, &at);
    return at.value;
}

static void derivatives(enum imp_loss loss, const char *name)
{
    static const double at[][2] = {
        {0.3, 0.5}, {0.8, 0.2}, {0.02, 0.7}, {3, 2.5}, {0.4, 0}};
    double worst[3] = {0};
    for (int i = 0; i < 5; i++) {
        const double I = at[i][0], T = at[i][1], h = 1e-4 * I;
        struct imp__loss_at a, p, m;
        imp__loss_eval(loss, 1.7, 0.01, I, T, &a);
        imp__loss_eval(loss, 1.7, 0.01, I + h, T, &p);
        imp__loss_eval(loss, 1.7, 0.01, I - h, T, &m);
        const double d[3] = {(p.value - m.value) / (2 * h), (p.d1 - m.d1) / (2 * h),
                             (p.d2 - m.d2) / (2 * h)};
        const double e[3] = {a.d1, a.d2, a.d3};
        for (int k = 0; k < 3; k++)
            worst[k] = fmax(worst[k], fabs(d[k] - e[k]) / (fabs(e[k]) + 1));
    }
    tap_ok(worst[0] < 1e-6 && worst[1] < 1e-6 && worst[2] < 1e-6,
           "%s: three derivatives # %.1e %.1e %.1e", name, worst[0], worst[1], worst[2]);
}

/* One pixel of N samples: printed, same-sample, leave-one-out gradients and the value. */
static void pixel(int N, uint64_t rep, struct tap_stat s[4])
{
    const double theta = 1.3, T = 1;
    double sum = 0, sum_sq = 0, sum_x = 0, loo = 0, printed = 0, X[256];
    for (int i = 0; i < N; i++) {
        X[i] = -log(1 - imp__u01(imp__key(11, rep, (uint64_t)i), (uint32_t)N));
        sum += theta * X[i];
        sum_sq += theta * X[i] * theta * X[i];
        sum_x += X[i];
    }
    for (int i = 0; i < N; i++) {
        loo += imp__loss_loo(1, T, N, sum, theta * X[i]) * X[i] / N;
        printed += (theta * X[i] / N - T) * X[i] / N;
    }
    tap_add(&s[0], loo);
    tap_add(&s[1], (sum / N - T) * sum_x / N);
    tap_add(&s[2], printed);
    tap_add(&s[3], imp__loss_unbiased(1, T, N, sum, sum_sq));
}

int main(void)
{
    derivatives(IMP_LOSS_L2, "L2");
    derivatives(IMP_LOSS_RELATIVE_L2, "relative L2");
    derivatives(IMP_LOSS_LOG, "log");
    derivatives(IMP_LOSS_L1, "L1");
    tap_near(value_of(IMP_LOSS_L2, 0.3, 0.5), 0.5 * 1.7 * 0.04, 1e-15, 0, "L2");
    tap_near(value_of(IMP_LOSS_RELATIVE_L2, 0.3, 0.5), 0.5 * 1.7 * 0.04 / 0.26, 1e-15, 0,
             "relative L2");
    tap_near(value_of(IMP_LOSS_L1, 0.3, 0.5), 1.7 * 0.2, 1e-15, 0, "L1");
    tap_near(value_of(IMP_LOSS_LOG, 0.3, 0.5), 0.85 * pow(log(0.31 / 0.51), 2), 1e-14, 0,
             "log");
    struct imp__loss_at black;
    imp__loss_eval(IMP_LOSS_LOG, 1, 0.01, -1, -2, &black);
    tap_ok(black.value == 0 && isfinite(black.d1), "log: negative noise counts as black");

    static const int N[3] = {4, 16, 256};
    static const double printed[3] = {-0.35, -0.8375, -0.98984375};
    static const double sd[3] = {0.960, 0.417, 0.1003};
    for (int i = 0; i < 3; i++) {
        struct tap_stat s[4] = {0};
        char what[80];
        const int reps = 400000 / N[i];
        for (int r = 0; r < reps; r++) pixel(N[i], (uint64_t)r, s);
        snprintf(what, sizeof what, "leave-one-out, N = %d", N[i]);
        tap_z(&s[0], 0.3, 0.004, what);
        snprintf(what, sizeof what, "same samples, N = %d: biased by 1.3/N", N[i]);
        tap_z(&s[1], 0.3 + 1.3 / N[i], 0.006, what);
        snprintf(what, sizeof what, "as printed by Stam, N = %d", N[i]);
        tap_z(&s[2], printed[i], 0.006, what);
        snprintf(what, sizeof what, "value without bias, N = %d", N[i]);
        tap_z(&s[3], 0.045, 0.006, what);
        tap_near(sqrt(s[0].m2 / (s[0].n - 1)), sd[i], 0.04, 0, "spread of leave-one-out");
    }
    tap_ok(imp__loss_quadratic(IMP_LOSS_L2) &&
               imp__loss_quadratic(IMP_LOSS_RELATIVE_L2) &&
               !imp__loss_quadratic(IMP_LOSS_L1) && !imp__loss_quadratic(IMP_LOSS_LOG) &&
               imp__loss_bias_order(IMP_LOSS_L2) == 0 &&
               imp__loss_bias_order(IMP_LOSS_L1) == 1 &&
               imp__loss_bias_order(IMP_LOSS_LOG) == 2,
           "which are unbiased");
    return tap_done();
}
