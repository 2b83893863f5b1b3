/* SPDX-License-Identifier: Apache-2.0
 *
 * Levenberg-Marquardt with an unbiased Gauss-Newton matrix: the U-statistic H need not be
 * positive definite, the same-sample matrix is, and damps it (docs/estimators.md 15):
 *
 *     (H + mu diag H_same) delta = -g
 *
 * Every iteration has its own random numbers; the trial steps of one iteration share
 * them, so that the gain is not drowned. The search ends when g^T H^-1 g is within what
 * noise in g alone would give, twice in a row; the estimate is the average of the two
 * Newton points. A goal may offer fewer samples for all of this: then once is enough,
 * since further samples follow (answer.c), and after any other end the search continues
 * with the full number. */
#include "lm_system.h"
#include <math.h>
#include <string.h>

#define MU_START 1e-2
#define TRIALS   8
#define NEARER   0.8  /* a step goes this part of the way to a bound, */
#define TOUCH    1e-3 /* and all of it from this near, in scales */

enum { FIRST }; /* arrays: [n] the first Newton point within noise */
enum {
    MU,
    WITHIN,
    COARSE
}; /* scalars; WITHIN: iterations within noise, in a row;
                                COARSE: with fewer samples than given */

struct work {
    struct imp__lm_system *system;
    double *delta, *trial, *h; /* [n]; h: H delta */
};

static enum imp_status init(const struct imp__goal *goal,
                            const struct imp__opt_options *options, struct imp__search *s)
{
    const bool sparse = !goal->normal && goal->sparse;
    (void)options;
    if (goal->n > (sparse ? IMP_SPARSE_MAX : IMP_DENSE_MAX) || (!goal->normal && !sparse))
        return imp__error(
            goal->ctx, IMP_E_ARG,
            "Levenberg-Marquardt is for at most %d variables, here are %zu: use "
            "Adam",
            sparse ? IMP_SPARSE_MAX : IMP_DENSE_MAX, goal->n);
    s->scalar[MU] = MU_START;
    s->scalar[COARSE] = goal->coarsen != NULL;
    return imp__search_array(s, FIRST, goal->n);
}

void imp__lm_system_destroy(struct imp__lm_system *s)
{
    if (!s) return;
    s->kind->end(s);
    imp__release(s->goal->ctx, s);
}

enum imp_status imp__lm_system_create(const struct imp__goal *goal,
                                      const struct imp__lm_kind *kind,
                                      struct imp__lm_system **out)
{
    struct imp__lm_system *s = imp__alloc(goal->ctx, 1, kind->size);
    if (!s)
        return imp__error(goal->ctx, IMP_E_NOMEM, "no memory for %zu variables", goal->n);
    s->kind = kind;
    s->goal = goal;
    const enum imp_status st = kind->begin(s);
    if (st == IMP_OK) *out = s;
    else imp__lm_system_destroy(s);
    return st;
}

static void work_destroy(imp_context *ctx, struct work *w)
{
    imp__lm_system_destroy(w->system);
    imp__release(ctx, w->delta);
}

static enum imp_status work_create(const struct imp__goal *goal, struct work *w)
{
    const size_t n = goal->n;
    w->delta = imp__alloc(goal->ctx, 3 * n, sizeof *w->delta);
    if (!w->delta)
        return imp__error(goal->ctx, IMP_E_NOMEM, "no memory for %zu variables", n);
    w->trial = w->delta + n;
    w->h = w->delta + 2 * n;
    return imp__lm_system_create(goal, goal->normal ? &imp__lm_dense : &imp__lm_sparse,
                                 &w->system);
}

/* Newton's point for a variable, cut off on its way to a bound. A step from far away may
 * promise the bound itself, and some bounds are traps: a lobe as narrow as a mirror's
 * hardly depends on its roughness, and the search would end there. */
static double toward(const struct imp__goal *goal, size_t k, double x, double to)
{
    const double lo = goal->lo[k], hi = goal->hi[k], touch = TOUCH * goal->scale[k];
    if (isfinite(lo) && x - lo > touch) to = fmax(to, x - NEARER * (x - lo));
    if (isfinite(hi) && hi - x > touch) to = fmin(to, x + NEARER * (hi - x));
    return imp__into_bounds(goal, k, to);
}

/* delta, cut off at the bounds; *gain: the decrease the model promises. */
static enum imp_status propose(const struct imp__goal *goal, const double *x,
                               struct work *w, double *gain)
{
    const size_t n = goal->n;
    for (size_t k = 0; k < n; k++) {
        w->trial[k] = toward(goal, k, x[k], x[k] - w->delta[k]);
        w->delta[k] = w->trial[k] - x[k];
    }
    const enum imp_status st = w->system->kind->product(w->system, w->delta, w->h);
    *gain = 0;
    for (size_t k = 0; k < n; k++)
        *gain -= w->delta[k] * (w->system->g[k] + 0.5 * w->h[k]);
    return st;
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
    struct imp__lm_system *system = w->system;
    const uint64_t seed = imp__search_seed(goal, s->iteration, 0);
    double mu = s->scalar[MU];
    bool moved = false, quiet;

    system->after_step = s->iteration > 0;
    IMP_TRY(system->kind->take(system, s->x, seed));
    const double f0 = system->f.value;
    if (system->n_free == 0) {
        IMP_TRY(imp__search_log(s, system->f, s->x));
        imp__search_finish(s, IMP_FINISH_BOUNDED);
        goto out;
    }
    IMP_TRY(system->kind->within_noise(system, &quiet));

    for (int trial = 0; trial < TRIALS && !moved; trial++) {
        struct imp_estimate f1;
        double promised;
        bool found;
        IMP_TRY(system->kind->newton(system, &mu, w->delta, &found));
        if (!found) break;
        IMP_TRY(propose(goal, s->x, w, &promised));
        if (promised > 0 && largest_step(goal, w->delta) < options->tolerance && !quiet) {
            imp__search_finish(s, IMP_FINISH_STEPS);
            break;
        }
        IMP_TRY(goal->eval(w->trial, seed, &f1, NULL, NULL, goal->payload));
        const double ratio = promised > 0 ? (f0 - f1.value) / promised : -1;
        moved = isfinite(ratio) && ratio > 1e-3;
        if (ratio > 0.75) mu = fmax(mu / 10, IMP_LM_MU_MIN);
        else if (!(ratio > 0.25)) mu = fmin(fmax(mu, 1e-4) * 5, IMP_LM_MU_MAX);
    }
    IMP_TRY(imp__search_log(s, system->f, s->x));
    s->scalar[MU] = fmin(mu, IMP_LM_MU_MAX);
    if (moved) memcpy(s->x, w->trial, n * sizeof *s->x);
    if (s->finished) goto out;
    s->scalar[WITHIN] = quiet ? s->scalar[WITHIN] + 1 : 0;
    if (quiet && s->scalar[COARSE] != 0) {
        imp__search_finish(s, IMP_FINISH_NOISE);
    } else if (s->scalar[WITHIN] == 1) {
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
    IMP_TRY(work_create(goal, &w));
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
