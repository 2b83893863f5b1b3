/* SPDX-License-Identifier: Apache-2.0
 *
 * Fit: an optimiser is run on a problem; covariance and intervals of its answer. */
#include "fit.h"
#include "base/arguments.h"
#include "base/lock.h"
#include "censor.h"
#include "inverse/estimate/walks_make.h"
#include "inverse/gradient/variate.h"
#include "search/covariance.h"
#include <math.h>
#include <string.h>

#define ROUNDS       5 /* samples behind intervals, at most, in those of an evaluation */
#define EFFORT_SHARE 4 /* ROUNDS are at least 1/4 of the samples that the search took */
#define FINAL_SEED   0x40000001

/* A loss that is not twice differentiable at its minimum has no second-order expansion,
 * on which Gauss-Newton and its covariances rely. */
static bool has_kink(const struct imp_problem *p)
{
    bool kink = false;
    for (size_t t = 0; t < p->n_targets; t++)
        kink |= p->targets[t].desc.loss == IMP_LOSS_L1;
    return kink;
}

/* Evaluate the answer with random numbers that the search has not used. The seed depends
 * on the bits of the answer too: two fits with one seed that end at different answers
 * would otherwise share the noise of their losses, and their chi-squares could not be
 * compared. */
static enum imp_status final_objective(struct imp__fit *f, const double *x,
                                       struct imp_estimate *out)
{
    uint64_t seed = imp__search_seed(&f->goal, FINAL_SEED, 0);
    for (size_t k = 0; k < f->goal.n; k++) {
        const double value = x[k] + 0.0; /* -0 and 0 are one answer */
        uint64_t bits;
        memcpy(&bits, &value, sizeof bits);
        seed = imp__mix64(seed ^ bits);
    }
    return f->goal.eval(x, seed, out, NULL, NULL, f);
}

/* Samples per pixel of a round. The answer of a search that averaged many
 * evaluations with few samples (Adam) has less noise than its last evaluations. */
static int round_spp(const struct imp__fit *f, const struct imp__search *s, int spp)
{
    const double wanted = (double)spp * s->iteration / (EFFORT_SHARE * ROUNDS);
    return wanted > spp ? (int)fmin(wanted, 1 << 24) : f->outer.spp;
}

/* Rounds behind an average of iterates: of n with weights 1, 2, ..., n it has the variance
 * of 3/4 n equally weighted ones. */
static double rounds_searched(const struct imp__fit *f, const struct imp__search *s,
                              int spp)
{
    return 0.75 * s->scalar[IMP_SEARCH_AVERAGED] * spp /
           (f->run.spp > 0 ? f->run.spp : spp);
}

/* Evaluations after the search: two of intervals, two that accept their step, bias, loss. */
static int final_total(const struct imp__fit *f)
{
    if (f->options.intervals && imp__fit_is_sparse(f)) return 1 + 2 + 1;
    return f->options.intervals && f->problem->n <= IMP_DENSE_MAX
               ? 2 + 3 + imp__fit_is_biased(f->problem)
               : 1;
}

/* Covariance, intervals, and the last Newton step that belongs to them. *why: the reason
 * when there are none. */
static enum imp_status intervals(struct imp__fit *f, const struct imp__search *s,
                                 double *x, struct imp_fit_variable *variables,
                                 struct imp__uncertainty *u, const char **why)
{
    imp_context *ctx = f->problem->ctx;
    if (f->seams) {
        *why = "vertices of a mesh at one place move together";
        return IMP_OK;
    }
    if (imp__fit_is_sparse(f)) {
        imp__sparse_errors_destroy(ctx, &f->errors);
        IMP_CHECKED(imp__sparse_errors_find(&f->goal, x, f->clipped_rounds, &f->errors));
        if (f->errors.x) memcpy(x, f->errors.x, f->problem->n * sizeof *x);
        *why = f->errors.why;
        return IMP_OK;
    }
    if (f->problem->n > IMP_DENSE_MAX) {
        *why = "they are for at most 256 numbers, and with lm for any";
        return IMP_OK;
    }
    const struct imp_problem *p = f->problem;
    if (has_kink(p)) {
        *why = "the l1 loss has no second derivative";
        return IMP_OK;
    }
    const int spp = imp__fit_spp(f);
    f->run.spp = round_spp(f, s, spp);
    const struct imp__rounds rounds = {.most = ROUNDS,
                                       .look = f->clipped_rounds,
                                       .searched = rounds_searched(f, s, spp),
                                       .at_newton = imp__search_is_coarse(s) &&
                                                    s->finished == IMP_FINISH_NOISE};
    const enum imp_status st = imp__covariance(&f->goal, x, &rounds, variables, u);
    if (st == IMP_OK && u->found) memcpy(x, u->x, f->problem->n * sizeof *x);
    if (st != IMP_E_NUMERIC && st != IMP_E_UNSUPPORTED) return st;
    *why = imp__arena_strdup(&f->problem->fit_arena, imp_last_error(ctx));
    return IMP_OK;
}

static enum imp_status search(struct imp__fit *f, const struct imp__opt_options *o,
                              struct imp__search *s)
{
    f->searching = true;
    const enum imp_status ended = imp__optimize(&f->goal, o, s);
    f->searching = false;
    if (!f->options.checkpoint || (ended != IMP_OK && ended != IMP_CANCELLED))
        return ended;
    const enum imp_status st = imp__fit_checkpoint_write(f, s);
    return st == IMP_OK ? ended : st;
}

/* Intervals at the end of the search, and of one that has to go on from there. */
static enum imp_status search_look(struct imp__fit *f, const struct imp__opt_options *o,
                                   struct imp__search *s, struct imp_fit_variable *rows,
                                   struct imp__uncertainty *u, const char **why)
{
    const bool coarse = imp__search_is_coarse(s) && s->finished == IMP_FINISH_NOISE;
    enum imp_status st = intervals(f, s, s->x, rows, u, why);
    if (st != IMP_OK || !coarse || u->found) return st;
    imp__search_refine(s);
    *why = NULL;
    f->final_total = 0;
    st = search(f, o, s);
    f->final_calls = 0;
    f->final_total = final_total(f);
    return st == IMP_OK ? intervals(f, s, s->x, rows, u, why) : st;
}

/* Clipped targets: searches and their intervals, until the set of pixels that count is fixed. */
static enum imp_status clipped_searches(struct imp__fit *f,
                                        const struct imp__opt_options *o,
                                        struct imp__search **s,
                                        struct imp_fit_variable *rows,
                                        struct imp__uncertainty *u, const char **why)
{
    for (int round = 0;; round++) {
        struct imp__opt_options own = *o;
        bool again;
        IMP_CHECKED(imp__fit_clipped(f, round, &own, s, &again));
        if (!again) return IMP_OK;
        f->final_total = 0;
        f->clipped_rounds = round + 1;
        f->run.spp = f->outer.spp; /* intervals took others */
        imp__variate_forget(f->variate);
        imp__uncertainty_destroy(f->problem->ctx, u);
        imp__sparse_errors_destroy(f->problem->ctx, &f->errors);
        *u = (struct imp__uncertainty){0};
        *why = NULL;
        const enum imp_status st = search(f, &own, *s);
        imp__search_settle(*s);
        if (st != IMP_OK) return st;
        f->final_calls = 0;
        f->final_total = final_total(f);
        if (!f->options.intervals) continue;
        IMP_CHECKED(search_look(f, &own, *s, rows, u, why));
    }
}

/* The search of a fit, from its start or from a checkpoint; *found: from the latter. */
static enum imp_status search_make(struct imp__fit *f, const struct imp__opt_options *o,
                                   struct imp__search **out, bool *found)
{
    struct imp_problem *p = f->problem;
    double *x = imp__alloc_raw(p->ctx, p->n, sizeof *x);
    if (!x) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for %zu variables", p->n);
    imp_problem_get_x(p, x);
    const enum imp_status st =
        imp__search_create(&f->goal, f->options.optimizer, o, x, out);
    imp__release(p->ctx, x);
    *found = false;
    if (st != IMP_OK || !f->options.resume) return st;
    return imp__fit_checkpoint_read(f, *out, found);
}

/* From the start, or the checkpoint, to the end of the search: coarse levels first. */
static enum imp_status search_all(struct imp__fit *f, const struct imp__opt_options *o,
                                  struct imp__search *s, bool found)
{
    enum imp_status st = IMP_OK;
    imp__fit_scales(f, s);
    f->first_iteration = s->iteration;
    f->searching = true;
    if (imp__fit_blurs(f) && !found) st = imp__fit_blurred(f, o, s);
    else if (f->options.levels > 1 && !found) st = imp__fit_levels(f, o, s);
    f->searching = false;
    f->search = s;
    return st == IMP_OK ? search(f, o, s) : st;
}

/* What follows a search, with walks of its own. */
struct found {
    struct imp__uncertainty u;
    struct imp__fit_shift shift;
    struct imp_estimate objective; /* of the last iteration, unless it was found anew */
    const char *why;               /* there are no intervals; NULL: there are */
};

/* Intervals, searches anew where targets were clipped, the shift by a bias, and the objective
 * at the end. */
static enum imp_status answers_find(struct imp__fit *f, const struct imp__opt_options *o,
                                    struct imp__search **s, struct imp_fit_variable *rows,
                                    struct found *a)
{
    const bool biased = imp__fit_is_biased(f->problem);
    if (f->options.intervals) IMP_CHECKED(search_look(f, o, *s, rows, &a->u, &a->why));
    IMP_CHECKED(clipped_searches(f, o, s, rows, &a->u, &a->why));
    if (a->u.n && biased)
        IMP_CHECKED(imp__fit_shift(f, (*s)->x, a->u.G,
                                   imp__search_seed(&f->goal, FINAL_SEED, 1), rows,
                                   &a->shift));
    if (a->u.n && isfinite(a->u.loss.value)) a->objective = a->u.loss;
    else return final_objective(f, (*s)->x, &a->objective);
    return IMP_OK;
}

static void last_progress(const struct imp__fit *f)
{
    const struct imp_progress last = {.size = sizeof last,
                                      .stage = "fit",
                                      .fraction = 1,
                                      .elapsed_s = imp__now() - f->start_s,
                                      .rate_unit = "iterations",
                                      .note = f->note};
    if (f->outer.progress) f->outer.progress(&last, f->outer.progress_payload);
}

enum imp_status imp_fit(imp_problem *p, const struct imp_fit_options *options,
                        const struct imp_run *run, const struct imp_fit_result **result)
{
    enum imp_status st = IMP_OK, ended = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    IMP_REQUIRE(ctx, result, "result");
    IMP_CHECKED(imp__problem_no_parts(p, "a fit"));
    IMP_FLOAT_MODE;
    IMP_SETS(p->scene, st);
    if (st != IMP_OK) return st;
    struct imp__fit f = {0};
    struct imp__search *s = NULL;
    struct imp_file_lock lock = {0};
    struct found a = {.shift = {.of_se = -1}, .objective = {NAN, NAN, 0}};
    struct imp_fit_variable *rows = NULL;
    double *start = NULL;
    bool kept = false; /* the search, by the problem */
    bool found;

    IMP_TRY(imp__fit_begin(p, options, run, &f));
    IMP_TRY(imp__file_lock(ctx, f.options.checkpoint, &lock));
    if (f.options.optimizer == IMP_LM && has_kink(p))
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "Levenberg-Marquardt needs a second derivative of the loss, "
                           "and l1 has none: use Adam, or another loss"));
    if (!(f.options.headroom >= 0 && f.options.headroom <= IMP_HEADROOM_MOST))
        IMP_TRY(
            imp__error(ctx, IMP_E_ARG, "headroom %g: out of range", f.options.headroom));
    IMP_TRY(imp__fit_start_keep(p, f.spans != NULL, &start));
    imp__fit_answer_free(p);
    IMP_TRY(imp__fit_clipped_begin(&f));
    const struct imp__opt_options o = {f.options.max_iterations, f.options.learning_rate,
                                       f.options.tolerance, f.options.momentum, f.quiet};
    IMP_TRY(search_make(&f, &o, &s, &found));
    ended = search_all(&f, &o, s, found);
    if (ended != IMP_OK && ended != IMP_CANCELLED) IMP_TRY(ended);
    imp__search_settle(s);
    if (p->n <= IMP_SEARCH_FEW) {
        rows = imp__arena_array(&p->fit_arena, p->n, sizeof *rows);
        if (!rows)
            IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for the result of a fit"));
    }
    if (s->n_history > 0)
        a.objective = (struct imp_estimate){.value = s->history[s->n_history - 1],
                                            .se = s->history_se[s->n_history - 1]};
    f.final_calls = 0;
    f.final_total = final_total(&f);
    if (ended == IMP_OK) ended = answers_find(&f, &o, &s, rows, &a);
    if (ended != IMP_OK && ended != IMP_CANCELLED) IMP_TRY(ended);
    IMP_TRY(imp_problem_set_x(p, s->x));
    IMP_TRY(
        imp__fit_answer(&f, s, a.objective, &a.u, rows, start, a.why, &a.shift, result));
    kept = !rows;
    if (ended == IMP_OK) last_progress(&f);
    st = ended;
out:
    if (st != IMP_OK && st != IMP_CANCELLED && start && s) /* x stays as it was */
        imp__fit_start_restore(p, f.spans != NULL, start, s);
    imp__uncertainty_destroy(ctx, &a.u);
    if (!kept) imp__search_destroy(s);
    imp__release(ctx, start);
    imp__file_unlock(ctx, &lock);
    imp__fit_end(&f);
    return st;
}

enum imp_status imp_checkpoint_free(imp_context *ctx, const char *path)
{
    struct imp_file_lock lock;
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    const enum imp_status st = imp__file_lock(ctx, path, &lock);
    imp__file_unlock(ctx, &lock);
    return st;
}
