/* SPDX-License-Identifier: Apache-2.0
 *
 * Intervals are right when they hold the truth as often as they say: 100 data sets, each
 * with its own noise, fitted with Monte Carlo noise of about the same size. And they must
 * say nothing about what the data do not determine. */
#include "imp_tap.h"
#include "search/covariance.h"
#include "toy_goal.h"

static imp_context *ctx;

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    enum { SEEDS = 100, REPLICATES = 6 };
    struct toy t;
    struct imp_fit_variable v[TOY_N];
    struct imp__uncertainty u;
    int covered[TOY_N] = {0}, failed = 0;
    struct tap_stat sigma = {0}, ratio = {0};

    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const struct imp__opt_options o = {30, 0.05, 1e-6};
        struct imp__search *s = NULL;
        double x0[TOY_N];
        toy_make(&t, ctx, 1000 + 7 * seed, 0.2, 0.3);
        for (int k = 0; k < TOY_N; k++) x0[k] = 0.7 * t.truth[k];
        enum imp_status st = imp__search_create(&t.goal, IMP_LM, &o, x0, &s);
        if (st == IMP_OK) st = imp__optimize(&t.goal, &o, s);
        if (st == IMP_OK) st = imp__covariance(&t.goal, s->x, REPLICATES, 1, v, &u);
        if (st != IMP_OK) {
            failed++;
            imp__search_destroy(s);
            continue;
        }
        double ls[TOY_N], inv[TOY_N * TOY_N];
        toy_least_squares(&t, ls, inv);
        for (int k = 0; k < TOY_N; k++) {
            covered[k] += v[k].lo95 <= t.truth[k] && t.truth[k] <= v[k].hi95;
            tap_add(&ratio,
                    v[k].se * v[k].se /
                        (inv[k * TOY_N + k] * (0.2 * 0.2 + 0.3 * 0.3 / REPLICATES)));
        }
        tap_add(&sigma, u.noise_scale);
        imp__uncertainty_destroy(ctx, &u);
        imp__search_destroy(s);
    }
    tap_ok(failed == 0, "every fit gives intervals");
    for (int k = 0; k < TOY_N; k++)
        tap_ok(covered[k] >= 88 && covered[k] <= 100,
               "95 %% interval of variable %d # covers %d of %d", k, covered[k], SEEDS);
    const int all = covered[0] + covered[1] + covered[2] + covered[3];
    tap_ok(all >= 360 && all <= 396, "95 %% intervals # cover %.1f %%", all / 4.0);
    tap_z(&sigma, 0.04, 2e-3, "variance of the data, estimated from residuals");
    tap_ok(fabs(ratio.mean - 1) < 0.03, "variance / what theory says # %.4f", ratio.mean);

    /* Two columns that are the same: only their sum is seen. */
    toy_make(&t, ctx, 5, 0.1, 0.1);
    for (int p = 0; p < TOY_M; p++) {
        t.T[p] += (t.A[p][0] * t.scale[0] / t.scale[3] - t.A[p][3]) * t.truth[3];
        t.A[p][3] = t.A[p][0] * t.scale[0] / t.scale[3];
    }
    for (int k = 0; k < TOY_N; k++) t.scale[k] = fabs(t.truth[k]);
    enum imp_status st = imp__covariance(&t.goal, t.truth, REPLICATES, 1, v, &u);
    tap_ok(st == IMP_OK && !v[0].determined && !v[3].determined && v[1].determined &&
               v[2].determined && isnan(v[0].lo95) && isnan(v[3].hi95) && u.n_loose == 1,
           "an ill-posed pair is found # loosest (%.2f %.2f %.2f %.2f), condition %g",
           u.loosest[0], u.loosest[1], u.loosest[2], u.loosest[3], u.condition);
    tap_ok(fabs(u.x[0] - t.truth[0]) < 0.5 && v[1].se > 0,
           "and the rest is still fitted");
    imp__uncertainty_destroy(ctx, &u);

    /* The truth sits at a bound: one-sided interval. */
    toy_make(&t, ctx, 6, 0.1, 0.1);
    for (int p = 0; p < TOY_M; p++) t.T[p] -= t.A[p][2] * t.truth[2];
    t.truth[2] = 0;
    t.lo[2] = 0.1 * t.scale[2];
    double x[TOY_N];
    memcpy(x, t.truth, sizeof x);
    x[2] = t.lo[2];
    st = imp__covariance(&t.goal, x, REPLICATES, 1, v, &u);
    tap_ok(st == IMP_OK && v[2].at_bound == -1 && v[2].lo95 == t.lo[2] &&
               v[2].hi95 > v[2].lo95 && v[2].determined,
           "at a bound # [%g, %g]", v[2].lo95, v[2].hi95);
    imp__uncertainty_destroy(ctx, &u);
    imp_context_destroy(ctx);
    return tap_done();
}
