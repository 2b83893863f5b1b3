/* SPDX-License-Identifier: Apache-2.0
 *
 * L-BFGS with bounds for exact objectives (fixed rays): two-loop recursion over the
 * variables that are free, steps projected onto the bounds, backtracking by quadratic
 * interpolation (Bertsekas 1982 for the active set). NLopt's L-BFGS fails on these
 * problems: curvature is negative in many directions, and its line search returns to the
 * same few points. The state is a search of src/search, so checkpoints are shared. */
#include "lbfgs.h"
#include <math.h>
#include <string.h>

#define MEMORY 12
#define ARMIJO 1e-4
#define TRIES  25

enum { S, Y, X, G, WORK }; /* arrays: [MEMORY][n], [MEMORY][n], [n], .. */
/* Scalars. HAVE is 1 where VALUE and G are those of X, -1 where only pairs are there,
 * carried from a coarser level, and 0 at the start. */
enum { PAIRS, VALUE, HAVE };

struct run {
    const struct imp__goal *goal;
    const struct imp__lbfgs_metric *metric; /* or NULL */
    struct imp__search *s;
    size_t n;
    double *d, *trial, *g_trial;
};

static double dot(size_t n, const double *a, const double *b)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

/* Is variable k at a bound, with the descent direction pointing outside? */
static bool pinned(const struct imp__goal *goal, const double *x, const double *g,
                   size_t k)
{
    return (x[k] <= goal->lo[k] && g[k] > 0) || (x[k] >= goal->hi[k] && g[k] < 0);
}

/* d = gamma M d with the newest pair's gamma = s.y / y.M y; without pairs d = M d. */
static void initial(struct run *r)
{
    const struct imp__search *s = r->s;
    const struct imp__lbfgs_metric *metric = r->metric;
    const size_t n = r->n;
    const int m = (int)s->scalar[PAIRS];
    if (m > 0) {
        const double *sl = s->array[S] + (size_t)(m - 1) * n,
                     *yl = s->array[Y] + (size_t)(m - 1) * n;
        memcpy(r->trial, yl, n * sizeof *yl);
        if (metric) metric->apply(r->trial, metric->payload);
        const double gamma = dot(n, sl, yl) / dot(n, yl, r->trial);
        for (size_t k = 0; k < n; k++) r->d[k] *= gamma;
    }
    if (metric) metric->apply(r->d, metric->payload);
}

/* d = -H g on the free variables (Nocedal, Wright 2006, algorithm 7.4); pairs newest
 * last. */
static void direction(struct run *r)
{
    struct imp__search *s = r->s;
    const size_t n = r->n;
    const int m = (int)s->scalar[PAIRS];
    const double *x = s->array[X], *g = s->array[G];
    double alpha[MEMORY], rho[MEMORY];
    for (size_t k = 0; k < n; k++) r->d[k] = pinned(r->goal, x, g, k) ? 0 : -g[k];
    for (int i = m - 1; i >= 0; i--) {
        const double *si = s->array[S] + (size_t)i * n, *yi = s->array[Y] + (size_t)i * n;
        rho[i] = 1 / dot(n, si, yi);
        alpha[i] = rho[i] * dot(n, si, r->d);
        for (size_t k = 0; k < n; k++) r->d[k] -= alpha[i] * yi[k];
    }
    initial(r);
    for (int i = 0; i < m; i++) {
        const double *si = s->array[S] + (size_t)i * n, *yi = s->array[Y] + (size_t)i * n;
        const double beta = rho[i] * dot(n, yi, r->d);
        for (size_t k = 0; k < n; k++) r->d[k] += (alpha[i] - beta) * si[k];
    }
    for (size_t k = 0; k < n; k++)
        if (pinned(r->goal, x, g, k)) r->d[k] = 0;
}

static void remember(struct run *r, const double *x1, const double *g1)
{
    struct imp__search *s = r->s;
    const size_t n = r->n;
    int m = (int)s->scalar[PAIRS];
    if (m == MEMORY) {
        memmove(s->array[S], s->array[S] + n, (MEMORY - 1) * n * sizeof(double));
        memmove(s->array[Y], s->array[Y] + n, (MEMORY - 1) * n * sizeof(double));
        m--;
    }
    double *si = s->array[S] + (size_t)m * n, *yi = s->array[Y] + (size_t)m * n;
    for (size_t k = 0; k < n; k++) {
        si[k] = x1[k] - s->array[X][k];
        yi[k] = g1[k] - s->array[G][k];
    }
    /* Only pairs of positive curvature: H stays positive definite. */
    const double sy = dot(n, si, yi);
    if (sy > 1e-10 * sqrt(dot(n, si, si) * dot(n, yi, yi))) m++;
    s->scalar[PAIRS] = m;
}

/* Backtracking line search along d. *found false: no step lowers the objective. */
static enum imp_status line(struct run *r, bool *found)
{
    struct imp__search *s = r->s;
    const struct imp__goal *goal = r->goal;
    const size_t n = r->n;
    const double *x = s->array[X], *g = s->array[G];
    double step = 1, f0 = s->scalar[VALUE], longest = 0, scale = goal->scale[0];
    for (size_t k = 0; k < n; k++) { /* the longest component in units of its scale */
        const double a = fabs(r->d[k]) * scale, b = longest * goal->scale[k];
        if (a > b || (a == b && fabs(r->d[k]) > longest))
            longest = fabs(r->d[k]), scale = goal->scale[k];
    }
    if (s->scalar[PAIRS] == 0) step = 0.1 * scale / fmax(longest, 1e-300);
    else if (step * longest > 5 * scale) step = 5 * scale / longest;
    *found = false;
    for (int i = 0; i < TRIES; i++) {
        struct imp_estimate e;
        double slope = 0; /* along the step after projection onto the bounds */
        for (size_t k = 0; k < n; k++) {
            r->trial[k] = imp__into_bounds(goal, k, x[k] + step * r->d[k]);
            slope += g[k] * (r->trial[k] - x[k]);
        }
        const enum imp_status st =
            goal->eval(r->trial, 0, &e, r->g_trial, NULL, goal->payload);
        if (st != IMP_OK) return st;
        if (isfinite(e.value) && e.value <= f0 + ARMIJO * slope && slope < 0) {
            remember(r, r->trial, r->g_trial);
            memcpy(s->array[X], r->trial, n * sizeof(double));
            memcpy(s->array[G], r->g_trial, n * sizeof(double));
            s->scalar[VALUE] = e.value;
            *found = true;
            return IMP_OK;
        }
        /* Shorten the step to the minimum of the parabola that has value f0 and the slope
         * at its start and e.value at its end, by a factor of 0.1 to 0.5. */
        const double curve = e.value - f0 - slope;
        double q = isfinite(curve) && curve > 0 ? -slope / (2 * curve) : 0.5;
        step *= imp_clamp(q, 0.1, 0.5);
        if (step * longest < 1e-14 * scale) break;
    }
    return IMP_OK;
}

enum imp_status imp__lbfgs(const struct imp__goal *goal,
                           const struct imp__opt_options *options,
                           const struct imp__lbfgs_metric *metric, struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    const size_t n = goal->n;
    struct run r = {.goal = goal, .metric = metric, .s = s, .n = n};
    IMP_TRY(imp__search_array(s, S, MEMORY * n));
    IMP_TRY(imp__search_array(s, Y, MEMORY * n));
    IMP_TRY(imp__search_array(s, X, n));
    IMP_TRY(imp__search_array(s, G, n));
    IMP_TRY(imp__search_array(s, WORK, 3 * n));
    r.d = s->array[WORK], r.trial = r.d + n, r.g_trial = r.trial + n;
    if (!(s->scalar[HAVE] > 0)) {
        struct imp_estimate e;
        memcpy(s->array[X], s->x, n * sizeof(double));
        IMP_TRY(goal->eval(s->array[X], 0, &e, s->array[G], NULL, goal->payload));
        s->scalar[VALUE] = e.value;
        if (s->scalar[HAVE] == 0) s->scalar[PAIRS] = 0;
        s->scalar[HAVE] = 1;
        IMP_TRY(imp__search_log(s, e, s->x));
    }
    while (!s->finished && s->iteration < options->max_iterations) {
        bool found;
        direction(&r);
        double down = dot(n, r.d, s->array[G]), moved = 0;
        if (!(down < 0)) { /* not a descent direction: drop the pairs */
            s->scalar[PAIRS] = 0;
            direction(&r);
            down = dot(n, r.d, s->array[G]);
        }
        memcpy(s->x, s->array[X], n * sizeof(double));
        if (down < 0) IMP_TRY(line(&r, &found));
        else found = false;
        if (!found && s->scalar[PAIRS] > 0 && down < 0) {
            s->scalar[PAIRS] = 0;
            direction(&r);
            IMP_TRY(line(&r, &found));
        }
        if (!found) {
            imp__search_finish(s, IMP_FINISH_LOWEST);
            break;
        }
        for (size_t k = 0; k < n; k++)
            moved = fmax(moved, fabs(s->array[X][k] - s->x[k]) / goal->scale[k]);
        memcpy(s->x, s->array[X], n * sizeof(double));
        IMP_TRY(imp__search_log(
            s, (struct imp_estimate){.value = s->scalar[VALUE], .se = 0}, s->x));
        if (moved < options->tolerance) {
            imp__search_finish(s, IMP_FINISH_STEPS);
        }
        IMP_TRY(imp__search_iterated(goal, s));
    }
    if (!s->finished) s->reason = "iteration limit reached";
out:
    return st;
}

enum imp_status imp__lbfgs_carry(const struct imp__search *old,
                                 const struct imp__carry *c, struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    const size_t n = s->n;
    int m = 0;
    IMP_TRY(imp__search_array(s, S, MEMORY * n));
    IMP_TRY(imp__search_array(s, Y, MEMORY * n));
    for (int i = 0; i < (int)old->scalar[PAIRS]; i++) {
        const double *so = old->array[S] + (size_t)i * old->n,
                     *yo = old->array[Y] + (size_t)i * old->n;
        double *sn = s->array[S] + (size_t)m * n, *yn = s->array[Y] + (size_t)m * n;
        IMP_TRY(c->map(so, sn, c->payload));
        IMP_TRY(c->map(yo, yn, c->payload));
        const double is = dot(n, sn, yn);
        if (!(is > 1e-10 * sqrt(dot(n, sn, sn) * dot(n, yn, yn)))) continue;
        const double scale = dot(old->n, so, yo) / is;
        for (size_t k = 0; k < n; k++) yn[k] *= scale;
        m++;
    }
    s->scalar[PAIRS] = m;
    s->scalar[HAVE] = -1;
out:
    return st;
}
