/* SPDX-License-Identifier: Apache-2.0
 *
 * Intervals are right when they hold the truth as often as they say: 100 data sets, each
 * with its own noise, fitted with Monte Carlo noise of about the same size. And they must
 * say nothing about what the data do not determine. */
#include "imp_tap.h"
#include "search/covariance.h"
#include "search/interval_row.h"
#include "toy_goal.h"
#include <stdlib.h>

static imp_context *ctx;

/* ---- Searches with fewer samples -------------------------------------------------- */

/* The toy in other variables, y = x + bend (x - truth)^2/|truth|; bend 0: linear. */
struct curved {
    struct toy toy;
    struct imp__goal goal;
    double bend;
    bool fewer;
};

static void unbend(const struct curved *c, const double *x, double *y, double *slope)
{
    for (int k = 0; k < TOY_N; k++) {
        const double truth = c->toy.truth[k], d = x[k] - truth;
        y[k] = x[k] + c->bend * d * d / fabs(truth);
        slope[k] = 1 + 2 * c->bend * d / fabs(truth);
    }
}

static enum imp_status curved_eval(const double *x, uint64_t seed, struct imp_estimate *f,
                                   double *g, double *g_se, void *payload)
{
    struct curved *c = payload;
    double y[TOY_N], slope[TOY_N];
    unbend(c, x, y, slope);
    const enum imp_status st = toy_eval(y, seed, f, g, g_se, &c->toy);
    for (int k = 0; g && k < TOY_N; k++) g[k] *= slope[k];
    return st;
}

static enum imp_status curved_normal(const double *x, uint64_t seed, int rounds,
                                     struct imp__normal *out, void *payload)
{
    struct curved *c = payload;
    double y[TOY_N], slope[TOY_N];
    unbend(c, x, y, slope);
    const enum imp_status st = toy_normal(y, seed, rounds, out, &c->toy);
    for (size_t k = 0; k < TOY_N; k++) {
        out->g[k] *= slope[k];
        for (size_t l = 0; l < TOY_N; l++) {
            const double both = slope[k] * slope[l];
            double *const each[] = {out->H, out->H_same, out->cov_g};
            for (int i = 0; i < 3; i++) each[i][k * TOY_N + l] *= both;
            for (size_t d = 0; out->deviations && d < IMP_DEVIATIONS; d++)
                out->deviations[(d * TOY_N + k) * TOY_N + l] *= both;
        }
    }
    return st;
}

static void fewer(bool yes, void *payload)
{
    struct curved *c = payload;
    c->fewer = yes;
    c->toy.mc = yes ? 0.6 : 0.3;
}

static void curved_make(struct curved *c, uint64_t seed, double bend)
{
    toy_make(&c->toy, ctx, seed, 0.2, 0.3);
    c->goal = c->toy.goal;
    c->goal.eval = curved_eval;
    c->goal.normal = curved_normal;
    c->goal.coarsen = fewer;
    c->goal.payload = c;
    c->bend = bend;
    c->fewer = false;
}

/* From far away, where samples are taken at a Newton point: intervals hold the truth as often as
 * they say, of a linear model, whose samples count wherever they are taken, and of a curved one,
 * where those at the Newton point count. */
static void at_newton(double bend, double start, double least_found)
{
    enum { SEEDS = 200 };
    const struct imp__rounds rounds = {.most = 6, .at_newton = true};
    int found = 0, held = 0;
    struct tap_stat loss_z = {0};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        struct curved c;
        struct imp_fit_variable v[TOY_N];
        struct imp__uncertainty u;
        double x[TOY_N], y[TOY_N], slope[TOY_N];
        curved_make(&c, 5000 + 7 * seed, bend);
        for (int k = 0; k < TOY_N; k++) x[k] = start * c.toy.truth[k];
        if (imp__covariance(&c.goal, x, &rounds, v, &u) != IMP_OK) exit(99);
        found += u.found;
        for (int k = 0; u.found && k < TOY_N; k++)
            held += v[k].lo95 <= c.toy.truth[k] && c.toy.truth[k] <= v[k].hi95;
        if (u.found) {
            struct imp_estimate exact;
            c.toy.mc = 0;
            unbend(&c, u.x, y, slope);
            if (toy_eval(y, 1, &exact, NULL, NULL, &c.toy) != IMP_OK) exit(99);
            tap_add(&loss_z, (u.loss.value - exact.value) / u.loss.se);
        }
        imp__uncertainty_destroy(ctx, &u);
    }
    tap_ok(found >= least_found * SEEDS, "bend %g from %g: an answer # %d of %d", bend,
           start, found, SEEDS);
    const double share = (double)held / (TOY_N * found);
    tap_ok(share >= 0.92 && share <= 0.98, "its 95 %% intervals # cover %.1f %%",
           100 * share);
    const double spread = sqrt(loss_z.m2 / (loss_z.n - 1));
    tap_ok(fabs(loss_z.mean) < 4 * spread / sqrt(loss_z.n) && spread < 1.2,
           "the loss at the answer, by the same samples # mean z %.2f, spread %.2f",
           loss_z.mean, spread);
}

static void refined(void)
{
    const struct imp__opt_options o = {40, 0.05, 1e-6, 0, false};
    struct imp__search *s = NULL;
    struct curved c;
    double x0[TOY_N];
    curved_make(&c, 77, 0);
    for (int k = 0; k < TOY_N; k++) x0[k] = 0.7 * c.toy.truth[k];
    if (imp__search_create(&c.goal, IMP_LM, &o, x0, &s) != IMP_OK) exit(99);
    enum imp_status st = imp__optimize(&c.goal, &o, s);
    const int before = s->iteration;
    tap_ok(st == IMP_OK && s->finished == IMP_FINISH_NOISE && imp__search_is_coarse(s) &&
               !c.fewer,
           "a search with fewer samples ends within their noise # %d iterations", before);
    imp__search_refine(s);
    st = imp__optimize(&c.goal, &o, s);
    tap_ok(st == IMP_OK && s->finished && !imp__search_is_coarse(s) &&
               s->iteration > before && !c.fewer,
           "and goes on with all # %d", s->iteration - before);
    imp__search_destroy(s);
}

/* From where the Newton point of a curved model is far beyond the truth, and its loss higher:
 * the way is gone as far as the loss falls, with samples from there. */
static void overshot(void)
{
    enum { SEEDS = 200 };
    const struct imp__rounds rounds = {.most = 6};
    int held = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        struct curved c;
        struct imp_fit_variable v[TOY_N];
        struct imp__uncertainty u;
        double x[TOY_N];
        curved_make(&c, 9000 + 7 * seed, 0.6);
        for (int k = 0; k < TOY_N; k++) x[k] = 0.35 * c.toy.truth[k];
        if (imp__covariance(&c.goal, x, &rounds, v, &u) != IMP_OK) exit(99);
        for (int k = 0; k < TOY_N; k++)
            held += v[k].lo95 <= c.toy.truth[k] && c.toy.truth[k] <= v[k].hi95;
        imp__uncertainty_destroy(ctx, &u);
    }
    const double share = (double)held / (TOY_N * SEEDS);
    tap_ok(share >= 0.92, "from where Newton's step overshoots # cover %.1f %%",
           100 * share);
}

/* One column is nearly another, and the truth is half a standard error inside of its bound. Where
 * the fit ends at the bound, the others' errors are those of a variable that may be inside. */
static void beside_a_bound(void)
{
    enum { SEEDS = 400 };
    const struct imp__rounds rounds = {.most = 6};
    int held = 0, held_there = 0, there = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const struct imp__opt_options o = {30, 0.05, 1e-6, 0, false};
        struct imp__search *s = NULL;
        struct imp_fit_variable v[TOY_N];
        struct imp__uncertainty u;
        double x0[TOY_N], ls[TOY_N], inv[TOY_N * TOY_N];
        struct toy t;
        toy_make(&t, ctx, 20000 + 7 * seed, 0.2, 0.3);
        for (int p = 0; p < TOY_M; p++) {
            const double old = t.A[p][2];
            t.A[p][2] = t.A[p][0] * t.scale[0] / t.scale[2] + 0.3 * old;
            t.T[p] += (t.A[p][2] - old) * t.truth[2];
        }
        toy_least_squares(&t, ls, inv);
        t.lo[2] = t.truth[2] - 0.5 * sqrt(inv[2 * TOY_N + 2] * (0.04 + 0.09 / 6));
        for (int k = 0; k < TOY_N; k++)
            x0[k] = fmax(t.truth[k] + 0.1 * t.scale[k], t.lo[k]);
        if (imp__search_create(&t.goal, IMP_LM, &o, x0, &s) != IMP_OK) exit(99);
        enum imp_status st = imp__optimize(&t.goal, &o, s);
        if (st == IMP_OK) st = imp__covariance(&t.goal, s->x, &rounds, v, &u);
        if (st != IMP_OK) exit(99);
        const bool holds = v[0].lo95 <= t.truth[0] && t.truth[0] <= v[0].hi95;
        there += v[2].at_bound < 0;
        held_there += v[2].at_bound < 0 && holds;
        held += holds;
        imp__uncertainty_destroy(ctx, &u);
        imp__search_destroy(s);
    }
    const double sd = sqrt(.95 * .05 / there);
    tap_ok(there > SEEDS / 8 && held_there >= there * (.95 - 3 * sd) &&
               held >= SEEDS * .92,
           "beside a variable at its bound # %d of %d there, cover %.1f %%; all %.1f %%",
           there, SEEDS, 100. * held_there / there, 100. * held / SEEDS);

    /* Simpson's rule. */
    for (int i = 0; i < 5; i++) {
        static const double at[] = {-25, -4, -.5, 0, 3};
        const double t = at[i], to = fmax(t, 0) + 12, h = to / 20000;
        double mass = 0, square = 0;
        for (int k = 0; k <= 20000; k++) {
            const double y = k * h,
                         w = k == 0 || k == 20000 ? 1
                             : k % 2              ? 4
                                                  : 2,
                         e = w * exp(t * y - 0.5 * y * y);
            mass += e;
            square += e * y * y;
        }
        const double off = imp__beyond_square(t) * mass / square - 1;
        tap_ok(fabs(off) < (t < -20 ? 0.02 : 1e-8),
               "mean square of N(%g, 1) beyond 0 # off by %.1g", t, off);
    }
}

/* Two columns differ by a part of a third only, so that one direction is not determined: where the search
 * began along it is an error of the third variable, too. */
static void beside_undetermined(void)
{
    enum { SEEDS = 400 };
    const struct imp__rounds rounds = {.most = 6};
    int held = 0, alone = 0, met = 0;
    struct tap_stat width = {0};
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        struct imp_fit_variable v[TOY_N];
        struct imp__uncertainty u;
        double x[TOY_N], column = 0;
        struct toy t;
        toy_make(&t, ctx, 40000 + 7 * seed, 0.2, 0.3);
        for (int k = 0; k < TOY_N; k++) t.scale[k] = 2 * fabs(t.truth[k]);
        for (int p = 0; p < TOY_M; p++) {
            const double old = t.A[p][3];
            t.A[p][3] =
                (t.A[p][0] * t.scale[0] + 0.1 * t.A[p][1] * t.scale[1]) / t.scale[3];
            t.T[p] += (t.A[p][3] - old) * t.truth[3];
            column += pow(t.A[p][1], 2);
        }
        const double off = toy_gauss(seed, 99) / sqrt(2.01);
        memcpy(x, t.truth, sizeof x);
        x[0] += off * t.scale[0];
        x[1] += 0.1 * off * t.scale[1];
        x[3] -= off * t.scale[3];
        if (imp__covariance(&t.goal, x, &rounds, v, &u) != IMP_OK) exit(99);
        if (u.found && !v[0].determined && !v[3].determined && v[1].determined) {
            met++;
            tap_add(&width, v[1].se / (0.1 / sqrt(2.01) * t.scale[1]));
            held += v[1].lo95 <= t.truth[1] && t.truth[1] <= v[1].hi95;
            alone +=
                fabs(v[1].value - t.truth[1]) < 1.96 * sqrt((0.04 + 0.09 / 6) / column);
        }
        imp__uncertainty_destroy(ctx, &u);
    }
    tap_ok(
        met > SEEDS / 2 && held > 0.94 * met && alone < met / 2,
        "beside what is not determined # %d of %d, cover %.1f %%; as if that were known, "
        "%.1f %%",
        met, SEEDS, 100. * held / met, 100. * alone / met);
    tap_ok(width.mean > 0.9 && width.mean < 1.3, "its part of a size of these # %.3f",
           width.mean);
}

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    enum { SEEDS = 100, ROUNDS = 6 };
    const struct imp__rounds rounds = {.most = ROUNDS};
    struct toy t;
    struct imp_fit_variable v[TOY_N];
    struct imp__uncertainty u;
    int covered[TOY_N] = {0}, failed = 0;
    struct tap_stat sigma = {0}, ratio = {0};

    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        const struct imp__opt_options o = {30, 0.05, 1e-6, 0, false};
        struct imp__search *s = NULL;
        double x0[TOY_N];
        toy_make(&t, ctx, 1000 + 7 * seed, 0.2, 0.3);
        for (int k = 0; k < TOY_N; k++) x0[k] = 0.7 * t.truth[k];
        enum imp_status st = imp__search_create(&t.goal, IMP_LM, &o, x0, &s);
        if (st == IMP_OK) st = imp__optimize(&t.goal, &o, s);
        if (st == IMP_OK) st = imp__covariance(&t.goal, s->x, &rounds, v, &u);
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
                        (inv[k * TOY_N + k] * (u.noise_scale + 0.3 * 0.3 / u.rounds)));
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
    enum imp_status st = imp__covariance(&t.goal, t.truth, &rounds, v, &u);
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
    st = imp__covariance(&t.goal, x, &rounds, v, &u);
    tap_ok(st == IMP_OK && v[2].at_bound == -1 && v[2].lo95 == t.lo[2] &&
               v[2].hi95 > v[2].lo95 && v[2].determined,
           "at a bound # [%g, %g]", v[2].lo95, v[2].hi95);
    imp__uncertainty_destroy(ctx, &u);

    at_newton(0, 0.5, 1);
    at_newton(0.6, 0.5, 1);
    at_newton(0.6, 0.35, 1);
    overshot();
    beside_a_bound();
    beside_undetermined();
    refined();
    imp_context_destroy(ctx);
    return tap_done();
}
