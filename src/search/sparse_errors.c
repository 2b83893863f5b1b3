/* SPDX-License-Identifier: Apache-2.0
 *
 * Draws G z of a fit with many variables, and their mean squares as standard errors. */
#include "sparse_errors.h"
#include "base/arguments.h"
#include "conjugate.h"
#include "math/vec.h"
#include <math.h>
#include <string.h>

#define SEED_BASE  0x20000000 /* of iterations that no search has */
#define ROUNDS     2
#define LOOSE      2    /* standard errors */
#define TOLERANCE  1e-3 /* of an error that is known to 1/8 */
#define ITERATIONS 2000
#define TURNS      20 /* of values that a step pushes over their bounds */

enum { WIDTH = IMP_SPARSE_WIDTH, DRAWS = IMP_ERROR_DRAWS };

struct work {
    const struct imp__goal *goal;
    struct imp__sparse_normal eq;
    bool *fixed, *loose;  /* [n] */
    double *step, *b, *u; /* [n], [n][WIDTH] twice */
    struct imp__sparse_errors *out;
    int base; /* of seeds */
};

/* Which variables may move, and which of them the data determine. A prior holds those that
 * they do not. */
static void choose(struct work *w, const double *x)
{
    for (size_t k = 0; k < w->eq.n; k++) {
        const int wall = imp__at_bound(w->goal, x, k);
        const double g = w->eq.g[k];
        w->loose[k] = !(w->eq.diagonal[k] > LOOSE * sqrt(w->eq.spread[k]));
        w->fixed[k] = !(w->eq.same[k] > 0) || (w->loose[k] && !(w->eq.prior[k] > 0)) ||
                      (wall < 0 && g >= 0) || (wall > 0 && g <= 0);
    }
}

/* G b; *why: the reason where there is none. */
static enum imp_status solve(struct work *w, int width, const double *b, double *u,
                             const char **why)
{
    struct imp__conjugate c = {
        .eq = &w->eq, .fixed = w->fixed, .tolerance = TOLERANCE, .most = ITERATIONS};
    const enum imp_status st = imp__conjugate_solve(w->goal->ctx, &c, 0, width, b, u);
    if (st != IMP_OK || c.converged) return st;
    *why = c.positive
               ? "the equations of the last step are too ill-conditioned to solve: "
                 "the pictures leave combinations of the numbers open"
               : "the samples do not determine every combination of the numbers: "
                 "more samples, or a prior, may";
    return st;
}

/* Newton's point, inside the bounds. */
static enum imp_status step(struct work *w, const double *x)
{
    const struct imp__goal *goal = w->goal;
    bool more = true;
    for (int turn = 0; more && turn < TURNS && !w->out->why; turn++) {
        IMP_CHECKED(solve(w, 1, w->eq.g, w->step, &w->out->why));
        more = false;
        for (size_t k = 0; k < goal->n; k++) {
            const double to = x[k] - w->step[k];
            if (w->fixed[k] || !imp__at_bound(goal, x, k) ||
                imp__into_bounds(goal, k, to) == to)
                continue;
            w->fixed[k] = more = true;
        }
    }
    for (size_t k = 0; k < goal->n; k++)
        w->out->x[k] = imp__into_bounds(goal, k, x[k] - w->step[k]);
    return IMP_OK;
}

/* A model that fails at x must not throw away what the search found. */
static enum imp_status accept(struct work *w, const double *x)
{
    const struct imp__goal *goal = w->goal;
    const uint64_t seed = imp__search_seed(goal, w->base, 2);
    struct imp_estimate old, new;
    IMP_CHECKED(goal->eval(x, seed, &old, NULL, NULL, goal->payload));
    IMP_CHECKED(goal->eval(w->out->x, seed, &new, NULL, NULL, goal->payload));
    if (!(new.value <= old.value + 2 * sqrt(old.se * old.se + new.se *new.se)))
        w->out->why = "the last Newton step does not lower the loss: the search has not "
                      "arrived";
    return IMP_OK;
}

static enum imp_status draws(struct work *w)
{
    double *se = w->out->se;
    const size_t n = w->eq.n;
    for (int k = 0; k < DRAWS / WIDTH && !w->out->why; k++) {
        const uint64_t seed = imp__search_seed(w->goal, w->base, 3 + k);
        IMP_CHECKED(w->eq.draw(&w->eq, IMP_DRAW_GRADIENT, seed, w->b));
        IMP_CHECKED(w->eq.draw(&w->eq, IMP_DRAW_MEASUREMENT, ~seed, w->u));
        for (size_t i = 0; i < n * WIDTH; i++) w->b[i] += w->u[i];
        IMP_CHECKED(solve(w, WIDTH, w->b, w->u, &w->out->why));
        for (size_t i = 0; i < n * WIDTH; i++) se[i / WIDTH] += w->u[i] * w->u[i] / DRAWS;
    }
    return IMP_OK;
}

/* Errors from variances, and none of what has none. */
static void finish(struct work *w)
{
    struct imp__sparse_errors *out = w->out;
    for (size_t k = 0; k < w->eq.n; k++) {
        const bool bound = imp__at_bound(w->goal, out->x, k) != 0;
        out->n_loose += w->loose[k] && !bound;
        out->n_bound += bound && !imp__goal_held(w->goal, k);
        out->se[k] = w->fixed[k] || w->loose[k] || bound ? NAN : sqrt(out->se[k]);
    }
}

void imp__sparse_errors_destroy(imp_context *ctx, struct imp__sparse_errors *e)
{
    imp__release(ctx, e->x);
    *e = (struct imp__sparse_errors){0};
}

enum imp_status imp__sparse_errors_find(const struct imp__goal *goal, const double *x,
                                        int look, struct imp__sparse_errors *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = goal->ctx;
    const size_t n = goal->n;
    struct imp__sparse_errors made = {.x = imp__alloc(ctx, 2 * n, sizeof *made.x)};
    struct work w = {.goal = goal, .out = &made, .base = SEED_BASE + look};
    *out = (struct imp__sparse_errors){0};
    w.fixed = imp__alloc(ctx, 2 * n, sizeof *w.fixed);
    w.step = imp__alloc(ctx, (1 + 2 * WIDTH) * n, sizeof *w.step);
    if (!made.x || !w.fixed || !w.step)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu standard errors", n));
    made.se = made.x + n;
    w.loose = w.fixed + n;
    w.b = w.step + n;
    w.u = w.b + WIDTH * n;
    st = goal->sparse(x, imp__search_seed(goal, w.base, 0), ROUNDS, &w.eq, goal->payload);
    if (st == IMP_E_NOMEM) { /* all ranks alike */
        out->why = "the equations of their walks do not fit into memory";
        st = IMP_OK;
        goto out;
    }
    if (st != IMP_OK) goto out;
    if (!w.eq.noise_known && w.eq.n_residuals <= (double)n)
        made.why =
            "the targets' noise is not known, and there are no more residuals than "
            "numbers";
    if (!made.why) {
        choose(&w, x);
        IMP_TRY(step(&w, x));
    }
    if (!made.why) IMP_TRY(accept(&w, x));
    if (!made.why) IMP_TRY(draws(&w));
    if (!made.why) {
        finish(&w);
        *out = made;
        made.x = NULL;
    } else {
        out->why = made.why;
    }
out:
    imp__sparse_normal_destroy(&w.eq);
    imp__release(ctx, w.fixed);
    imp__release(ctx, w.step);
    imp__release(ctx, made.x);
    return st;
}
