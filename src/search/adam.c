/* SPDX-License-Identifier: Apache-2.0
 *
 * Adam (Kingma and Ba 2015) with bounds, for objectives that are only known with noise:
 * fresh random numbers every iteration, steps in units of each variable's scale,
 * projection on the bounds.
 *
 * Adam divides each coordinate by the size of its gradient, so it is slow where the
 * objective depends on products of coordinates (a lamp and a reflectance). With few
 * variables its coordinates are therefore the eigenvectors of the Gauss-Newton matrix
 * (basis.h). A variable at a bound becomes a direction by itself: a projected step that
 * is not along the axes need not end in a minimum (Bertsekas, SIAM J. Control Optim. 20,
 * 1982).
 *
 * A direction without net motion over a window of iterations has met only noise, or
 * oscillates: it continues from the average of the window with a smaller rate. Once all
 * directions do so, the answer is a weighted average of the iterates, later ones with
 * larger weight; its noise falls with their number (Polyak and Juditsky 1992; Shamir and
 * Zhang 2013). */
#include "adam_many.h"
#include "adam_noise.h"
#include "basis.h"
#include <math.h>
#include <string.h>

#define HALVES  IMP_ADAM_HALVES
#define BETA2   IMP_ADAM_BETA2
#define WINDOW  IMP_ADAM_WINDOW
#define STALLED IMP_ADAM_STALLED /* net motion over path length: below, no progress */
#define STEADY  0.8              /* above, it made progress and the rate may grow again */
#define COOLING IMP_ADAM_COOLING /* rate ~ (1 + windows wandered)^-COOLING */
#define FLAT    1e-6             /* least second moment of a direction, over their mean */
#define FELL    IMP_ADAM_FELL /* standard errors, by which a loss is lower than before */
#define FAR     IMP_ADAM_FAR  /* by which it is so low that older iterates do not count */

/* Arrays of length n, except V (eigenvectors) and A (matrix): n x n, and empty if the
 * coordinates are the variables. FIRST, SECOND, NET, WAY (path length) and PACE (rate)
 * are in the coordinates of the rows of V. AVERAGE is that of the iterates. */
enum { FIRST, SECOND, HERE, SUM, AVERAGE, ALIGNED, NET, WAY, PACE, V, A };
enum {
    COUNT,
    LARGEST,
    LOSS,
    LOSS_VAR,
    OLD_LOSS,
    OLD_VAR,
    AGE,                           /* steps in FIRST and SECOND */
    TURN,                          /* iteration at which the directions are found anew */
    AVERAGED = IMP_SEARCH_AVERAGED /* 0: the search has not wandered yet */
};                                 /* scalars */

static bool turned(const struct imp__search *s) { return s->array_n[V] > 0; }

static void window_begin(struct imp__search *s)
{
    for (size_t k = 0; k < s->n; k++) {
        s->array[SUM][k] = s->array[HERE][k];
        s->array[NET][k] = s->array[WAY][k] = 0;
    }
    s->scalar[COUNT] = s->scalar[LARGEST] = 0;
    s->scalar[LOSS] = s->scalar[LOSS_VAR] = 0;
}

static enum imp_status init(const struct imp__goal *goal,
                            const struct imp__opt_options *options, struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    (void)options;
    if (imp__adam_is_many(goal)) return imp__adam_many_init(s);
    for (int k = 0; k <= PACE; k++) IMP_TRY(imp__search_array(s, k, goal->n));
    for (size_t k = 0; k < goal->n; k++) s->array[HERE][k] = s->x[k];
    s->scalar[OLD_LOSS] = INFINITY;
    window_begin(s);
out:
    return st;
}

void imp__adam_moved(struct imp__search *s)
{
    for (size_t k = 0; k < s->n; k++) s->array[HERE][k] = s->x[k];
    window_begin(s);
}

/* ---- Directions ---------------------------------------------------------------- */

/* The rows of V; NULL: the axes. */
static const double *rows(const struct imp__search *s)
{
    return turned(s) ? s->array[V] : NULL;
}

/* Directions from A and ALIGNED. What is known along the old ones is turned with them;
 * with R the rotation, a gradient of mean m and variances v has R m and sum R^2 v. */
static enum imp_status turn(struct imp__search *s)
{
    static const int signed_one[] = {FIRST, NET}, positive[] = {SECOND, WAY, PACE};
    enum imp_status st = IMP_OK;
    const size_t n = s->n;
    double *R = imp__alloc(s->ctx, n * n + n, sizeof *R);
    if (!R) return imp__error(s->ctx, IMP_E_NOMEM, "no memory for %zu directions", n);
    double *old = R + n * n;
    IMP_TRY(imp__basis_turn(s->ctx, n, s->array[A], s->array[ALIGNED], s->array[V], R));
    for (int i = 0; i < 5; i++) {
        double *a = s->array[i < 2 ? signed_one[i] : positive[i - 2]];
        memcpy(old, a, n * sizeof *old);
        for (size_t j = 0; j < n; j++) {
            a[j] = 0;
            for (size_t k = 0; k < n; k++)
                a[j] += R[j * n + k] * (i < 2 ? 1 : R[j * n + k]) * old[k];
        }
    }
out:
    imp__release(s->ctx, R);
    return st;
}

/* Look for the directions: at the start, and after 20, 40, 80, ... iterations. */
static enum imp_status look_round(const struct imp__goal *goal, struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    const size_t n = s->n;
    bool known = false;
    if (n < 2 || n > IMP_BASIS_MAX || !goal->normal) {
        s->scalar[TURN] = INFINITY;
        return IMP_OK;
    }
    double *a = imp__alloc(s->ctx, n * n, sizeof *a);
    if (!a) IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM, "no memory for %zu directions", n));
    IMP_TRY(imp__basis_matrix(goal, s->array[HERE],
                              imp__search_seed(goal, s->iteration, 1), a, &known));
    s->scalar[TURN] = known ? fmax(WINDOW, 2 * s->iteration) : INFINITY;
    if (!known) goto out;
    if (!turned(s)) {
        IMP_TRY(imp__search_array(s, A, n * n));
        IMP_TRY(imp__search_array(s, V, n * n));
        for (size_t k = 0; k < n; k++) s->array[V][k * n + k] = 1;
    }
    memcpy(s->array[A], a, n * n * sizeof *a);
    IMP_TRY(turn(s));
    /* Gradients of steep old directions would slow down flat new ones for long. */
    memset(s->array[FIRST], 0, n * sizeof(double));
    memset(s->array[SECOND], 0, n * sizeof(double));
    s->scalar[AGE] = 0;
out:
    imp__release(s->ctx, a);
    return st;
}

/* Variables at a bound become directions by themselves; with `leave`, those that left it
 * join the others again. */
static enum imp_status align(const struct imp__goal *goal, struct imp__search *s,
                             bool leave)
{
    bool changed = false;
    for (size_t k = 0; k < s->n; k++) {
        const double wall = imp__at_bound(goal, s->array[HERE], k) != 0;
        if (wall == s->array[ALIGNED][k] || (!wall && !leave)) continue;
        s->array[ALIGNED][k] = wall;
        changed = true;
    }
    return changed && turned(s) ? turn(s) : IMP_OK;
}

/* ---- Steps --------------------------------------------------------------------- */

/* Only variables do, not directions of several. */
static bool settles(const struct imp__goal *goal, const struct imp__opt_options *options,
                    const struct imp__search *s, size_t j)
{
    return !turned(s) && options->quiet && goal->settles && goal->settles[j];
}

static bool is_possible(const struct imp__goal *goal, const double *x)
{
    return !goal->possible || goal->possible(x, goal->payload);
}

/* A step g, in scales, that has led to x: halved while the objective cannot be evaluated there, and
 * taken back at last. */
static void step_back(const struct imp__goal *goal, const struct imp__search *s,
                      double *x, double *g)
{
    for (int i = 0; goal->possible && i <= HALVES; i++) {
        if (goal->possible(x, goal->payload)) return;
        const double back = i < HALVES ? 0.5 : 1;
        for (size_t k = 0; k < s->n; k++) {
            x[k] -= back * goal->scale[k] * g[k];
            g[k] *= 1 - back;
        }
    }
}

/* One step from HERE. g: the gradient; it and work [n] are destroyed. */
static enum imp_status step(const struct imp__goal *goal,
                            const struct imp__opt_options *options, struct imp__search *s,
                            double *g, double *work)
{
    double *m = s->array[FIRST], *v = s->array[SECOND], *x = s->array[HERE];
    const double age = ++s->scalar[AGE];
    const double learning_rate = options->learning_rate, c2 = 1 - pow(BETA2, age);
    double mean_v = 0;
    for (size_t k = 0; k < s->n; k++) g[k] *= goal->scale[k];
    imp__basis_along(s->n, rows(s), g, work);
    for (size_t j = 0; j < s->n; j++) {
        const double b1 = imp__adam_momentum(options, settles(goal, options, s, j));
        m[j] = b1 * m[j] + (1 - b1) * work[j];
        v[j] = BETA2 * v[j] + (1 - BETA2) * work[j] * work[j];
        mean_v += v[j] / (double)s->n;
    }
    /* Relative to the mean of v, whatever the objective's unit: variables that never had
     * a gradient stay at rest. */
    const double tiny = 1e-8 * sqrt(mean_v / c2) + 1e-300;
    double pace = 0, rate = learning_rate; /* of many variables, all the same */
    for (size_t j = 0; j < s->n; j++) {
        if (s->array[PACE][j] != pace) {
            pace = s->array[PACE][j];
            rate = learning_rate * pow(1 + pace, -COOLING);
        }
        const bool slow = settles(goal, options, s, j);
        const double c1 = 1 - pow(imp__adam_momentum(options, slow), age);
        work[j] = rate * imp__adam_fall(s->iteration, slow) * (m[j] / c1) /
                  (sqrt(v[j] / c2) + tiny);
    }
    imp__basis_back(s->n, rows(s), work, g);
    for (size_t k = 0; k < s->n; k++) {
        const double old = x[k];
        x[k] = imp__into_bounds(goal, k, old - goal->scale[k] * g[k]);
        g[k] = (x[k] - old) / goal->scale[k];
    }
    step_back(goal, s, x, g);
    for (size_t k = 0; k < s->n; k++) {
        s->scalar[LARGEST] = fmax(s->scalar[LARGEST], fabs(g[k]));
        s->array[SUM][k] += x[k];
    }
    imp__basis_along(s->n, rows(s), g, work);
    for (size_t j = 0; j < s->n; j++) {
        s->array[NET][j] += work[j];
        s->array[WAY][j] += fabs(work[j]);
    }
    s->scalar[COUNT]++;
    const enum imp_status st = align(goal, s, false);
    for (size_t k = 0; k < s->n; k++) { /* momentum into a bound would delay leaving it */
        const int wall = imp__at_bound(goal, x, k);
        if ((wall < 0 && m[k] > 0) || (wall > 0 && m[k] < 0)) m[k] = 0;
    }
    return st;
}

/* Directions without net motion continue from the window's mean, with a smaller rate.
 * With many variables, where the path of a single one shows little, all do or none. work:
 * [2 n]. */
static void cool(const struct imp__goal *goal, struct imp__search *s, bool all, bool fell,
                 double *work)
{
    const size_t n = s->n;
    double *mean = work, *move = work + n, *pace = s->array[PACE];
    for (size_t k = 0; k < n; k++)
        move[k] = (s->array[SUM][k] / (WINDOW + 1) - s->array[HERE][k]) / goal->scale[k];
    imp__basis_along(s->n, rows(s), move, mean);
    for (size_t j = 0; j < n; j++) {
        const double net = fabs(s->array[NET][j]), way = s->array[WAY][j];
        if (turned(s) ? net <= STALLED * way : all && !fell) {
            /* Many variables have no average in many dimensions to go by: halve. */
            pace[j] = turned(s) ? pace[j] + 1 : pow(2, 1 / COOLING) * (1 + pace[j]) - 1;
            continue;
        }
        mean[j] = 0;
        if (turned(s) && net >= STEADY * way) pace[j] = fmax(pace[j] - 1, 0);
    }
    imp__basis_back(s->n, rows(s), mean, move);
    for (size_t k = 0; k < n; k++) {
        const double old = s->array[HERE][k];
        s->array[HERE][k] = imp__into_bounds(goal, k, old + goal->scale[k] * move[k]);
        move[k] = old;
    }
    if (!is_possible(goal, s->array[HERE]))
        memcpy(s->array[HERE], move, n * sizeof *move);
}

static enum imp_status window_end(const struct imp__goal *goal,
                                  const struct imp__opt_options *options,
                                  struct imp__search *s, double *work)
{
    double net = 0, way = 0;
    for (size_t j = 0; j < s->n; j++) {
        net += fabs(s->array[NET][j]);
        way += s->array[WAY][j];
    }
    const double loss = s->scalar[LOSS] / WINDOW;
    const double var = s->scalar[LOSS_VAR] / (WINDOW * WINDOW);
    const double fall = s->scalar[OLD_LOSS] - loss, se = sqrt(var + s->scalar[OLD_VAR]);
    const bool fell = fall > FELL * se, wandered = net <= STALLED * way;

    if (s->scalar[LARGEST] < options->tolerance) {
        imp__search_finish(s, IMP_FINISH_STEPS);
    }
    cool(goal, s, wandered, fell, work);
    if (fall > FAR * se) s->scalar[AVERAGED] = 0;
    if (wandered && !fell && s->scalar[AVERAGED] == 0) {
        memcpy(s->array[AVERAGE], s->array[HERE], s->n * sizeof(double));
        s->scalar[AVERAGED] = 1;
    }
    s->scalar[OLD_LOSS] = loss;
    s->scalar[OLD_VAR] = var;
    window_begin(s);
    return align(goal, s, true);
}

/* x: the iterate, or once the search wanders the average with weights 1, 2, 3, ..., where that can be
 * evaluated. */
static void answer(const struct imp__goal *goal, struct imp__search *s)
{
    const double n = s->scalar[AVERAGED];
    if (n > 0) s->scalar[AVERAGED]++;
    for (size_t k = 0; k < s->n; k++) {
        double *mean = &s->array[AVERAGE][k];
        *mean =
            n > 0 ? *mean + (s->array[HERE][k] - *mean) * 2 / (n + 1) : s->array[HERE][k];
        s->x[k] = imp__into_bounds(goal, k, *mean);
    }
    if (!is_possible(goal, s->x)) memcpy(s->x, s->array[HERE], s->n * sizeof(double));
}

static enum imp_status run(const struct imp__goal *goal,
                           const struct imp__opt_options *options, struct imp__search *s)
{
    if (imp__adam_is_many(goal)) return imp__adam_many_run(goal, options, s);
    enum imp_status st = IMP_OK;
    const size_t n = goal->n;
    double *g = imp__alloc(goal->ctx, (2 + IMP_PROBES_MOST) * n + 1, sizeof *g);
    if (!g) IMP_TRY(imp__error(goal->ctx, IMP_E_NOMEM, "no memory for a gradient"));
    struct imp__adam_noise noise;

    while (!s->finished && s->iteration < options->max_iterations) {
        struct imp_estimate f;
        if (s->iteration >= s->scalar[TURN]) IMP_TRY(look_round(goal, s));
        if (s->scalar[AGE] >= IMP_ADAM_KNOWN) {
            noise = (struct imp__adam_noise){.goal = goal,
                                             .iteration = s->iteration,
                                             .second = s->array[SECOND],
                                             .rows = rows(s)};
            imp__adam_noise_measure(&noise, turned(s) ? FLAT : IMP_ADAM_LEAST, g,
                                    g + 2 * n);
        }
        IMP_TRY(goal->eval(s->array[HERE], imp__search_seed(goal, s->iteration, 0), &f, g,
                           NULL, goal->payload));
        IMP_TRY(imp__search_log(s, f, s->array[HERE]));
        s->scalar[LOSS] += f.value;
        s->scalar[LOSS_VAR] += f.se * f.se;
        IMP_TRY(step(goal, options, s, g, g + n));
        if (s->scalar[COUNT] == WINDOW) IMP_TRY(window_end(goal, options, s, g));
        answer(goal, s);
        IMP_TRY(imp__search_iterated(goal, s));
    }
out:
    imp__release(goal->ctx, g);
    return st;
}

/* m and sqrt(v) are mapped as gradients are, so that their quotient, the step, stays that
 * of the old variables. Only moments along the axes are carried: other directions are
 * found anew. */
static enum imp_status carry(const struct imp__search *old, const struct imp__carry *c,
                             struct imp__search *s)
{
    enum imp_status st = IMP_OK;
    double *root = NULL;
    if (turned(old)) return IMP_OK;
    root = imp__alloc(s->ctx, old->n + 1, sizeof *root);
    if (!root) IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM, "no memory for moments"));
    for (size_t k = 0; k < old->n; k++) root[k] = sqrt(old->array[SECOND][k]);
    IMP_TRY(c->map(old->array[FIRST], s->array[FIRST], c->payload));
    IMP_TRY(c->map(root, s->array[SECOND], c->payload));
    for (size_t k = 0; k < s->n; k++) {
        s->array[FIRST][k] *= c->share;
        s->array[SECOND][k] = pow(fmax(s->array[SECOND][k], 0) * c->share, 2);
    }
    s->scalar[AGE] = old->scalar[AGE];
out:
    imp__release(s->ctx, root);
    return st;
}

const struct imp__opt_kind imp__opt_adam = {init, run, carry};
