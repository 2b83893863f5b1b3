/* SPDX-License-Identifier: Apache-2.0
 *
 * Levenberg-Marquardt with an unbiased Gauss-Newton matrix: the U-statistic H need not be
 * positive definite, the same-sample matrix is, and damps it (docs/estimators.md 15):
 *
 *     (H + mu diag H_same) delta = -g
 *
 * Every iteration has its own random numbers; the trial steps of one iteration share
 * them, so that the gain is not drowned. The search ends when g^T H^-1 g is what noise in
 * g alone would give, twice in a row; the estimate is the average of the two Newton
 * points. A goal may offer fewer samples for all of this; only that end counts then, and
 * any other is where the search goes on with those asked for. */
#include "excess.h"
#include "math/linalg.h"
#include "optimize.h"
#include <math.h>
#include <string.h>

#define MU_START 1e-2
#define MU_MIN   1e-7
#define MU_MAX   1e8
#define TRIALS   8
#define NEARER   0.8  /* a step goes this part of the way to a bound, */
#define TOUCH    1e-3 /* and all of it from this near, in scales */

enum { FIRST }; /* arrays: [n] the first Newton point within noise */
enum {
    MU,
    WITHIN,
    COARSE
}; /* scalars; WITHIN: iterations within noise, in a row;
                                COARSE: with fewer samples than were asked for */

struct work {
    struct imp__normal eq;
    double *a;                 /* [n_free][n_free] Cholesky factor of the damped system */
    double *p;                 /* [n][n] */
    double *delta, *trial, *d; /* [n]; d: (diag H_same)^-1/2 */
    size_t *free;              /* [n_free] variables that may move */
    size_t n_free;
};

static enum imp_status init(const struct imp__goal *goal,
                            const struct imp__opt_options *options, struct imp__search *s)
{
    (void)options;
    if (goal->n > IMP_DENSE_MAX || !goal->normal)
        return imp__error(
            goal->ctx, IMP_E_ARG,
            "Levenberg-Marquardt is for at most %d variables, here are %zu: use "
            "Adam",
            IMP_DENSE_MAX, goal->n);
    s->scalar[MU] = MU_START;
    s->scalar[COARSE] = goal->coarsen != NULL;
    return imp__search_array(s, FIRST, goal->n);
}

static void work_destroy(imp_context *ctx, struct work *w)
{
    imp__normal_destroy(ctx, &w->eq);
    imp__release(ctx, w->a);
    imp__release(ctx, w->p);
    imp__release(ctx, w->delta);
    imp__release(ctx, w->free);
}

static enum imp_status work_create(imp_context *ctx, size_t n, struct work *w)
{
    const enum imp_status st = imp__normal_create(ctx, n, false, &w->eq);
    if (st != IMP_OK) return st;
    w->a = imp__alloc(ctx, n * n, sizeof *w->a);
    w->p = imp__alloc(ctx, n * n, sizeof *w->p);
    w->delta = imp__alloc(ctx, 3 * n, sizeof *w->delta);
    w->free = imp__alloc(ctx, n, sizeof *w->free);
    if (!w->a || !w->p || !w->delta || !w->free)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu x %zu matrices", n, n);
    w->trial = w->delta + n;
    w->d = w->delta + 2 * n;
    return IMP_OK;
}

/* Variables that neither press against a bound nor are without any effect. */
static void free_set(const struct imp__goal *goal, const double *x, struct work *w)
{
    w->n_free = 0;
    for (size_t k = 0; k < goal->n; k++) {
        const int wall = imp__at_bound(goal, x, k);
        const double h = w->eq.H_same[k * goal->n + k];
        w->d[k] = h > 0 ? 1 / sqrt(h) : 0;
        if (!(h > 0) || (wall < 0 && w->eq.g[k] >= 0) || (wall > 0 && w->eq.g[k] <= 0))
            continue;
        w->free[w->n_free++] = k;
    }
}

/* Factor of D (H + mu diag H_same) D over the free variables, D = (diag H_same)^-1/2. */
static bool factor(size_t n, struct work *w, double mu)
{
    const size_t m = w->n_free;
    for (size_t i = 0; i < m; i++)
        for (size_t j = 0; j < m; j++) {
            const size_t k = w->free[i], l = w->free[j];
            w->a[i * m + j] = w->d[k] * w->eq.H[k * n + l] * w->d[l] + (i == j ? mu : 0);
        }
    return imp__cholesky(m, w->a);
}

/* Smallest mu >= the given one whose system is positive definite. */
static bool factor_up(size_t n, struct work *w, double *mu)
{
    while (!factor(n, w, *mu)) {
        *mu = fmax(4 * *mu, 1e-6);
        if (*mu > MU_MAX) return false;
    }
    return true;
}

/* out = A^-1 b over the free variables, 0 elsewhere. */
static void solve(size_t n, struct work *w, const double *b, double *out)
{
    const size_t m = w->n_free;
    double *c = w->trial; /* free here */
    for (size_t i = 0; i < m; i++) c[i] = w->d[w->free[i]] * b[w->free[i]];
    imp__cholesky_solve(m, w->a, c);
    memset(out, 0, n * sizeof *out);
    for (size_t i = 0; i < m; i++) out[w->free[i]] = w->d[w->free[i]] * c[i];
}

/* Is q = g^T A^-1 g no more than Monte Carlo noise alone makes it? Under a zero gradient
 * its mean is tr(A^-1 C) and its variance 2 tr((A^-1 C)^2), C the covariance of g. */
static bool within_noise(size_t n, struct work *w)
{
    double q = 0, mean = 0, half_var = 0;
    solve(n, w, w->eq.g, w->delta);
    for (size_t k = 0; k < n; k++) q += w->eq.g[k] * w->delta[k];
    for (size_t k = 0; k < n; k++) { /* row k of p is column k of A^-1 C, as C = C^T */
        solve(n, w, w->eq.cov_g + k * n, w->p + k * n);
        mean += w->p[k * n + k];
    }
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) half_var += w->p[k * n + l] * w->p[l * n + k];
    return q <= mean + 2 * sqrt(2 * half_var);
}

/* Newton's point for a variable, cut off on its way to a bound. A step from far away may
 * promise the bound itself, and some bounds are traps: a lobe as narrow as a mirror's
 * says next to nothing of its roughness, and the search would end there. */
static double toward(const struct imp__goal *goal, size_t k, double x, double to)
{
    const double lo = goal->lo[k], hi = goal->hi[k], touch = TOUCH * goal->scale[k];
    if (isfinite(lo) && x - lo > touch) to = fmax(to, x - NEARER * (x - lo));
    if (isfinite(hi) && hi - x > touch) to = fmin(to, x + NEARER * (hi - x));
    return imp__into_bounds(goal, k, to);
}

/* delta, cut off at the bounds; returns the decrease the model promises. */
static double propose(const struct imp__goal *goal, const double *x, struct work *w)
{
    const size_t n = goal->n;
    double gain = 0;
    solve(n, w, w->eq.g, w->delta);
    for (size_t k = 0; k < n; k++) {
        w->trial[k] = toward(goal, k, x[k], x[k] - w->delta[k]);
        w->delta[k] = w->trial[k] - x[k];
    }
    for (size_t k = 0; k < n; k++) {
        double h = 0;
        for (size_t l = 0; l < n; l++) h += w->eq.H[k * n + l] * w->delta[l];
        gain -= w->delta[k] * (w->eq.g[k] + 0.5 * h);
    }
    return gain;
}

static double largest_step(const struct imp__goal *goal, const double *delta)
{
    double largest = 0;
    for (size_t k = 0; k < goal->n; k++)
        largest = fmax(largest, fabs(delta[k]) / goal->scale[k]);
    return largest;
}

/* One iteration: x moves, or the search is finished. */
static enum imp_status iterate(const struct imp__goal *goal,
                               const struct imp__opt_options *options,
                               struct imp__search *s, struct work *w)
{
    enum imp_status st = IMP_OK;
    const size_t n = goal->n;
    const uint64_t seed = imp__search_seed(goal, s->iteration, 0);
    double mu = s->scalar[MU];
    bool moved = false, quiet;

    IMP_TRY(goal->normal(s->x, seed, 1, &w->eq, goal->payload));
    IMP_TRY(imp__excess_take(goal->ctx, n, w->eq.cov_g, w->eq.cov_excess));
    const double f0 = w->eq.f.value;
    free_set(goal, s->x, w);
    if (w->n_free == 0) {
        IMP_TRY(imp__search_log(s, w->eq.f, s->x));
        imp__search_finish(s, IMP_FINISH_BOUNDED);
        goto out;
    }
    double mu_quiet = MU_MIN;
    quiet = factor_up(n, w, &mu_quiet) && within_noise(n, w);

    for (int trial = 0; trial < TRIALS && !moved && factor_up(n, w, &mu); trial++) {
        struct imp_estimate f1;
        const double promised = propose(goal, s->x, w);
        if (promised > 0 && largest_step(goal, w->delta) < options->tolerance && !quiet) {
            imp__search_finish(s, IMP_FINISH_STEPS);
            break;
        }
        IMP_TRY(goal->eval(w->trial, seed, &f1, NULL, NULL, goal->payload));
        const double ratio = promised > 0 ? (f0 - f1.value) / promised : -1;
        moved = isfinite(ratio) && ratio > 1e-3;
        if (ratio > 0.75) mu = fmax(mu / 10, MU_MIN);
        else if (!(ratio > 0.25)) mu = fmin(fmax(mu, 1e-4) * 5, MU_MAX);
    }
    IMP_TRY(imp__search_log(s, w->eq.f, s->x));
    s->scalar[MU] = mu;
    if (moved) memcpy(s->x, w->trial, n * sizeof *s->x);
    if (s->finished) goto out;
    s->scalar[WITHIN] = quiet ? s->scalar[WITHIN] + 1 : 0;
    if (s->scalar[WITHIN] == 1) {
        memcpy(s->array[FIRST], s->x, n * sizeof *s->x);
    } else if (s->scalar[WITHIN] == 2) {
        for (size_t k = 0; k < n; k++)
            s->x[k] = imp__into_bounds(goal, k, 0.5 * (s->x[k] + s->array[FIRST][k]));
        imp__search_finish(s, IMP_FINISH_NOISE);
    } else if (!moved && !quiet) {
        imp__search_finish(s, IMP_FINISH_LOWEST);
    }
out:
    return st;
}

bool imp__search_is_coarse(const struct imp__search *s)
{
    return s->kind == IMP_LM && s->scalar[COARSE] != 0;
}

void imp__search_refine(struct imp__search *s)
{
    s->scalar[COARSE] = s->scalar[WITHIN] = 0;
    s->finished = IMP_FINISH_NOT;
    s->reason = NULL;
}

static enum imp_status run(const struct imp__goal *goal,
                           const struct imp__opt_options *options, struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    struct work w = {0};
    IMP_TRY(work_create(goal->ctx, goal->n, &w));
    while (!s->finished && s->iteration < options->max_iterations) {
        if (goal->coarsen) goal->coarsen(s->scalar[COARSE] != 0, goal->payload);
        IMP_TRY(iterate(goal, options, s, &w));
        if (s->finished && s->finished != IMP_FINISH_NOISE && s->scalar[COARSE] != 0)
            imp__search_refine(s);
        IMP_TRY(imp__search_iterated(goal, s));
    }
out:
    if (goal->coarsen) goal->coarsen(false, goal->payload);
    work_destroy(goal->ctx, &w);
    return st;
}

const struct imp__opt_kind imp__opt_lm = {init, run, NULL};
