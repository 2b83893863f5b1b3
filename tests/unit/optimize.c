/* SPDX-License-Identifier: Apache-2.0
 *
 * Every optimiser on a linear model with a known answer: without noise, with noise, with
 * bounds, cancelled, and continued from a copy of its state. */
#include "imp_tap.h"
#include "toy_goal.h"

static imp_context *ctx;
static const char *const name[] = {"Adam", "LM", "L-BFGS", "MMA", "SLSQP"};

static struct imp__opt_options options_of(enum imp_optimizer kind)
{
    return (struct imp__opt_options){kind == IMP_ADAM ? 600 : 60, 0.05, 1e-6, 0, false};
}

/* Distance from `ref` in units of the scale, worst variable. */
static double distance(const struct toy *t, const double *x, const double *ref)
{
    double worst = 0;
    for (int k = 0; k < TOY_N; k++)
        worst = fmax(worst, fabs(x[k] - ref[k]) / t->scale[k]);
    return worst;
}

static struct imp__search *solve(struct toy *t, enum imp_optimizer kind,
                                 enum imp_status *st)
{
    const struct imp__opt_options o = options_of(kind);
    struct imp__search *s = NULL;
    double x0[TOY_N];
    for (int k = 0; k < TOY_N; k++) x0[k] = 0.5 * t->truth[k];
    *st = imp__search_create(&t->goal, kind, &o, x0, &s);
    if (*st == IMP_OK) *st = imp__optimize(&t->goal, &o, s);
    return s;
}

static void answers(enum imp_optimizer kind)
{
    struct toy t;
    enum imp_status st;
    double ls[TOY_N], inv[TOY_N * TOY_N];

    toy_make(&t, ctx, 4, 0.1, 0);
    toy_least_squares(&t, ls, inv);
    struct imp__search *s = solve(&t, kind, &st);
    tap_ok(st == IMP_OK && distance(&t, s->x, ls) < (kind == IMP_ADAM ? 1e-3 : 1e-5),
           "%s, no noise # distance %.1e after %d iterations: %s", name[kind],
           distance(&t, s->x, ls), s->iteration, s->reason);
    double off = s->history_x ? 0 : INFINITY;
    for (size_t i = 0; s->history_x && i < s->n_history; i++) {
        struct imp_estimate at;
        t.goal.eval(s->history_x + i * TOY_N, 0, &at, NULL, NULL, &t);
        off = fmax(off, fabs(at.value - s->history[i]));
    }
    tap_ok(off <= 1e-12 * s->history[0],
           "%s: where it was at each iteration has the loss of that iteration # %.1e",
           name[kind], off);
    imp__search_destroy(s);

    /* With noise: within 5 standard errors of what one evaluation could tell. */
    toy_make(&t, ctx, 4, 0.1, 0.3);
    toy_least_squares(&t, ls, inv);
    s = solve(&t, kind, &st);
    double worst = 0;
    for (int k = 0; k < TOY_N; k++)
        worst = fmax(worst, fabs(s->x[k] - ls[k]) / (t.mc * sqrt(inv[k * TOY_N + k])));
    tap_ok(st == IMP_OK && worst < 4, "%s, noise # %.2f sd after %d iterations: %s",
           name[kind], worst, s->iteration, s->reason);
    tap_ok(s->n_history == (size_t)s->iteration && s->history_se[0] > 0,
           "%s: a loss and its error for every iteration", name[kind]);
    imp__search_destroy(s);

    /* The answer is outside: x[0] <= 0.8 of what it wants, the others follow. */
    toy_make(&t, ctx, 4, 0, 0);
    t.hi[0] = 0.8 * t.truth[0];
    t.lo[2] = 0;
    s = solve(&t, kind, &st);
    double g[TOY_N];
    struct imp_estimate f;
    t.goal.eval(s->x, 0, &f, g, NULL, &t);
    double others = 0; /* the free gradient, in units of the blocked one */
    for (int k = 1; k < TOY_N; k++)
        others = fmax(others, fabs(g[k] * t.scale[k]) / fabs(g[0] * t.scale[0]));
    tap_ok(st == IMP_OK && fabs(s->x[0] - t.hi[0]) <= 1e-12 && g[0] < 0 && others < 0.02,
           "%s, at a bound # free gradient %.1e of the blocked one: %s", name[kind],
           others, s->reason);
    imp__search_destroy(s);
}

/* Stop inside evaluation 7, continue the same state: the same bits as never stopped. */
static void resume(enum imp_optimizer kind)
{
    struct toy t;
    enum imp_status st;
    toy_make(&t, ctx, 9, 0.1, 0.2);
    struct imp__search *whole = solve(&t, kind, &st);

    toy_make(&t, ctx, 9, 0.1, 0.2);
    t.stop_after = 5;
    struct imp__search *part = solve(&t, kind, &st);
    tap_ok(st == IMP_CANCELLED && part->iteration >= 2 && part->iteration < 7,
           "%s: cancelled in evaluation 5, %d iterations done", name[kind],
           part->iteration);
    t.stop_after = 0;
    const struct imp__opt_options o = options_of(kind);
    st = imp__optimize(&t.goal, &o, part);
    const int same =
        st == IMP_OK && part->iteration == whole->iteration &&
        part->n_history == whole->n_history &&
        !memcmp(part->x, whole->x, sizeof(double) * TOY_N) &&
        !memcmp(part->history, whole->history, sizeof(double) * whole->n_history);
    tap_ok(same, "%s: continued, the same bits", name[kind]);
    imp__search_destroy(whole);
    imp__search_destroy(part);

    toy_make(&t, ctx, 9, 0.1, 0.2);
    t.stop_iteration = 3;
    part = solve(&t, kind, &st);
    tap_ok(st == IMP_CANCELLED && part->iteration == 3,
           "%s: cancelled between iterations", name[kind]);
    imp__search_destroy(part);
}

/* A valley across the axes: two columns that nearly say the same. What only looks at one
 * coordinate at a time creeps along it; with our noise, and at a bound, too. */
static void valley(void)
{
    for (int c = 0; c < 3; c++) {
        struct toy t;
        enum imp_status st;
        double ls[TOY_N], inv[TOY_N * TOY_N];
        toy_make(&t, ctx, 4, 0.01, c == 1 ? 0.02 : 0);
        t.H_noise = 1e-5;
        for (int p = 0; p < TOY_M; p++) {
            t.T[p] -= t.A[p][1] * t.truth[1];
            t.A[p][1] = t.scale[0] / t.scale[1] * (t.A[p][0] + 0.01 * t.A[p][1]);
            t.T[p] += t.A[p][1] * t.truth[1];
        }
        toy_least_squares(&t, ls, inv);
        if (c == 2) { /* the others' best with x[3] at its bound */
            t.hi[3] = 0.9995 * ls[3];
            const double by = (t.hi[3] - ls[3]) / inv[15];
            for (int k = 0; k < TOY_N; k++) ls[k] += inv[k * TOY_N + 3] * by;
        }
        struct imp__search *s = solve(&t, IMP_ADAM, &st);
        double worst = 0;
        for (int k = 0; k < TOY_N; k++)
            worst = fmax(worst, fabs(s->x[k] - ls[k]) / sqrt(inv[k * TOY_N + k]));
        static const char *const name_of[] = {"no noise", "noise", "at a bound"};
        tap_ok(st == IMP_OK && worst < 0.002, /* of the error that noise 1 would make */
               "Adam in a valley, %s # %.1e: %s", name_of[c], worst, s->reason);
        imp__search_destroy(s);
    }
}

/* A lobe of roughness a and a lamp of power p, seen at angles of 0.05 and more:
 * I = p (a^2/(theta^2 + a^2)^2 + 1/4). From afar, Newton's step for a lands
 * beyond the bound 1e-4, where the lobe is out of everybody's sight and lowers the
 * objective all the same, and where noise of its gradient, of 0.3/a, ends the search. */
static enum imp_status lobe_normal(const double *x, uint64_t seed, int rounds,
                                   struct imp__normal *out, void *payload)
{
    const double truth[2] = {0.2, 10};
    const double a2 = x[0] * x[0], *lamp = &x[1];
    double value = 0, g[2] = {0}, h[4] = {0};
    (void)payload;
    (void)rounds;
    for (int p = 0; p < 20; p++) {
        const double t = 0.05 * (p + 1), t2 = t * t, q = t2 + a2;
        const double s = t2 + truth[0] * truth[0];
        const double lobe = a2 / (q * q) + 0.25;
        const double r = *lamp * lobe + 0.05 * toy_gauss(seed, (uint64_t)p) -
                         truth[1] * (truth[0] * truth[0] / (s * s) + 0.25);
        const double J[2] = {*lamp * 2 * x[0] * (t2 - a2) / (q * q * q), lobe};
        value += 0.5 * r * r;
        for (int k = 0; k < 2; k++) {
            g[k] += J[k] * r;
            for (int l = 0; l < 2; l++) h[2 * k + l] += J[k] * J[l];
        }
    }
    out->f = (struct imp_estimate){.value = value, .se = 0.1};
    memcpy(out->g, g, sizeof g);
    for (int k = 0; k < 4; k++) {
        out->H[k] = out->H_same[k] = h[k];
        out->H_prior[k] = out->H_meas[k] = 0;
        out->cov_g[k] = 0.05 * 0.05 * h[k];
    }
    const double noise = 0.3 / x[0];
    out->g[0] += noise * toy_gauss(seed, 100);
    out->cov_g[0] += noise * noise;
    out->H_same[0] += 20 * noise * noise;
    return IMP_OK;
}
static enum imp_status lobe_eval(const double *x, uint64_t seed, struct imp_estimate *f,
                                 double *g, double *g_se, void *payload)
{
    double none[4][4];
    struct imp__normal eq = {.H = none[0],
                             .H_same = none[1],
                             .H_prior = none[2],
                             .H_meas = none[2],
                             .cov_g = none[2],
                             .g = none[3]};
    (void)g_se;
    lobe_normal(x, seed, 1, &eq, payload);
    if (g) memcpy(g, eq.g, 2 * sizeof *g);
    *f = eq.f;
    return IMP_OK;
}
static void bound_is_no_trap(void)
{
    const double lo[2] = {1e-4, 0}, hi[2] = {INFINITY, INFINITY};
    const double begin[][2] = {{0.4, 5}, {0.7, 1}, {1, 3}, {2, 1}, {2, 15}};
    const struct imp__opt_options o = options_of(IMP_LM);
    for (int i = 0; i < 5; i++) {
        struct imp__search *s = NULL;
        const struct imp__goal goal = {.ctx = ctx,
                                       .n = 2,
                                       .lo = lo,
                                       .hi = hi,
                                       .scale = begin[i],
                                       .seed = 1,
                                       .eval = lobe_eval,
                                       .normal = lobe_normal};
        const int ok = imp__search_create(&goal, IMP_LM, &o, begin[i], &s) == IMP_OK &&
                       imp__optimize(&goal, &o, s) == IMP_OK;
        tap_ok(ok && fabs(s->x[0] - 0.2) < 0.002 && fabs(s->x[1] - 10) < 0.1,
               "LM from %g, %g past a bound where a variable is lost # %g, %g after %d "
               "iterations: %s",
               begin[i][0], begin[i][1], s->x[0], s->x[1], s->iteration, s->reason);
        imp__search_destroy(s);
    }
}

/* Where the search begins at a bound that the answer is not on, it leaves it. */
static void leaves_bounds(enum imp_optimizer kind)
{
    struct toy t;
    enum imp_status st;
    double ls[TOY_N], inv[TOY_N * TOY_N];
    toy_make(&t, ctx, 4, 0.1, 0);
    toy_least_squares(&t, ls, inv);
    for (int k = 0; k < TOY_N; k++) {
        t.lo[k] = k % 2 ? -INFINITY : 0.5 * t.truth[k];
        t.hi[k] = k % 2 ? 2 * t.truth[k] : INFINITY;
    }
    struct imp__search *s = solve(&t, kind, &st);
    tap_ok(st == IMP_OK && distance(&t, s->x, ls) < (kind == IMP_ADAM ? 1e-3 : 1e-5),
           "%s leaves a bound # distance %.1e after %d iterations", name[kind],
           distance(&t, s->x, ls), s->iteration);
    imp__search_destroy(s);
}

/* The first steps of Adam along the axes, by Kingma and Ba's Algorithm 1 in units of the
 * scales: moments with their bias taken off. */
static void adam_by_the_book(void)
{
    struct toy t;
    struct imp__search *s = NULL;
    double x[TOY_N], m[TOY_N] = {0}, v[TOY_N] = {0}, g[TOY_N];
    const struct imp__opt_options o = {6, 0.05, 1e-6, 0, false};
    toy_make(&t, ctx, 4, 0.1, 0);
    t.goal.normal = NULL; /* no directions but the axes */
    for (int k = 0; k < TOY_N; k++) x[k] = 0.5 * t.truth[k];
    const enum imp_status made = imp__search_create(&t.goal, IMP_ADAM, &o, x, &s);
    const enum imp_status st = made == IMP_OK ? imp__optimize(&t.goal, &o, s) : made;
    for (int i = 1; i <= o.max_iterations; i++) {
        struct imp_estimate f;
        if (toy_eval(x, 0, &f, g, NULL, &t) != IMP_OK) break;
        for (int k = 0; k < TOY_N; k++) {
            const double d = g[k] * t.scale[k];
            m[k] = 0.9 * m[k] + 0.1 * d;
            v[k] = 0.99 * v[k] + 0.01 * d * d;
            x[k] -= 0.05 * t.scale[k] * m[k] / (1 - pow(0.9, i)) /
                    sqrt(v[k] / (1 - pow(0.99, i)));
        }
    }
    tap_ok(st == IMP_OK && distance(&t, s->x, x) < 1e-6,
           "six steps of Adam by the book # %.1e", distance(&t, s->x, x));
    imp__search_destroy(s);
}

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    for (int kind = IMP_ADAM; kind <= IMP_SLSQP; kind++) leaves_bounds(kind);
    adam_by_the_book();
    for (int kind = IMP_ADAM; kind <= IMP_SLSQP; kind++) {
        answers(kind);
        resume(kind);
    }
    valley();
    bound_is_no_trap();
    /* A variable nothing depends on stays where it was. */
    struct toy t;
    enum imp_status st;
    for (int kind = IMP_ADAM; kind <= IMP_SLSQP; kind++) {
        toy_make(&t, ctx, 4, 0.1, 0.1);
        for (int p = 0; p < TOY_M; p++) t.A[p][1] = 0;
        struct imp__search *s = solve(&t, kind, &st);
        tap_ok(st == IMP_OK && s->x[1] == 0.5 * t.truth[1],
               "%s: without effect, without motion", name[kind]);
        imp__search_destroy(s);
    }
    struct imp__search *s = NULL;
    const struct imp__opt_options o = {10, 0.05, 1e-4, 0, false};
    toy_make(&t, ctx, 4, 0.1, 0.1);
    tap_ok(imp__search_create(&t.goal, 99, &o, t.truth, &s) == IMP_E_ARG && !s,
           "an optimiser that does not exist");
    static double many[IMP_DENSE_MAX + 1];
    t.goal.n = IMP_DENSE_MAX + 1;
    t.goal.lo = t.goal.hi = t.goal.scale = many;
    tap_ok(imp__search_create(&t.goal, IMP_LM, &o, many, &s) != IMP_OK && !s,
           "LM refuses many variables # %s", imp_last_error(ctx));
    imp_context_destroy(ctx);
    return tap_done();
}
