/* SPDX-License-Identifier: Apache-2.0
 *
 * Fits: a problem's objective is minimised level by level by the optimisers of
 * src/search. Each level refines the grid by a prolongation P that keeps the field, and
 * may carry the optimiser's memory: steps s become P s and gradients g become P g / 8,
 * because eight fine coefficients share the gradient of a coarse one. Adam's rate is
 * halved. */
#include "bend_fit.h"
#include "base/lock.h"
#include <math.h>
#include <string.h>

static void level_free(struct imp__bend_run *f)
{
    imp_context *ctx = f->b->ctx;
    imp__sobolev_destroy(&f->metric);
    void *const owned[] = {f->held, f->theta, f->bar, f->lo,
                           f->hi,   f->scale, f->x0,  f->at};
    for (size_t i = 0; i < imp_count(owned); i++) imp__release(ctx, owned[i]);
    f->held = NULL;
    f->theta = f->bar = f->lo = f->hi = f->scale = f->x0 = NULL;
    f->at = NULL;
}

static enum imp_status level_begin(struct imp__bend_run *f)
{
    enum imp_status st = IMP_OK;
    imp_bend *b = f->b;
    imp_context *ctx = b->ctx;
    const size_t n = b->field->n_theta;
    level_free(f);
    f->held = imp__alloc(ctx, n + 1, 1);
    f->theta = imp__alloc(ctx, n + 1, sizeof(double));
    f->bar = imp__alloc(ctx, n + 1, sizeof(double));
    f->lo = imp__alloc(ctx, n + 1, sizeof(double));
    f->hi = imp__alloc(ctx, n + 1, sizeof(double));
    f->scale = imp__alloc(ctx, n + 1, sizeof(double));
    f->x0 = imp__alloc(ctx, n + 1, sizeof(double));
    f->at = imp__alloc(ctx, n + 1, sizeof *f->at);
    if (!f->held || !f->theta || !f->bar || !f->lo || !f->hi || !f->scale || !f->x0 ||
        !f->at)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for a fit of %zu numbers", n);
    imp_field_get_theta(b->field, f->theta);
    imp__bend_hold(b, f->held, f->theta);
    IMP_TRY(imp_field_set_theta(b->field, f->theta));
    imp__bend_bounds(b, f->lo, f->hi);
    size_t k = 0;
    for (size_t i = 0; i < n; i++) {
        if (f->held[i]) continue;
        f->lo[k] = f->lo[i], f->hi[k] = f->hi[i]; /* k <= i */
        f->scale[k] = f->o->scale > 0 ? f->o->scale : 0.1;
        f->x0[k] = f->theta[i];
        f->at[k++] = i;
    }
    if (k == 0)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "nothing to fit: every number is held"));
    f->goal = (struct imp__goal){.ctx = ctx,
                                 .n = k,
                                 .lo = f->lo,
                                 .hi = f->hi,
                                 .scale = f->scale,
                                 .eval = imp__bend_fit_eval,
                                 .iterated = imp__bend_fit_iterated,
                                 .payload = f};
    int iterations = 50;
    double rate = f->o->learning_rate > 0 ? f->o->learning_rate : 0.05;
    for (int l = 0; l <= f->level; l++)
        if (f->o->iterations[l] > 0) iterations = f->o->iterations[l];
    for (int l = 0; l < f->level; l++) rate /= 2;
    f->opt = (struct imp__opt_options){
        iterations, rate, f->o->tolerance > 0 ? f->o->tolerance : 1e-6, 0, false};
    f->done_iterations = 0;
    if (f->o->smooth_length > 0)
        IMP_TRY(imp__sobolev_create(b, f->held, f->o->smooth_length, &f->metric));
    imp__bend_fingerprint(b, f->held, f->o->optimizer, f->o->smooth_length, f->level,
                          &f->print);
out:
    return st;
}

static void last_free(struct imp__bend_run *f)
{
    imp__search_destroy(f->last);
    imp_field_destroy(f->coarse);
    imp__release(f->b->ctx, f->coarse_at);
    f->last = NULL;
    f->coarse = NULL;
    f->coarse_at = NULL;
}

/* Prolong active numbers of the coarse grid to those of the fine one; held ones are 0. */
static enum imp_status carry_map(const double *in, double *out, void *payload)
{
    const struct imp__bend_run *f = payload;
    imp_context *ctx = f->b->ctx;
    enum imp_status st = IMP_OK;
    double *coarse = imp__alloc(ctx, f->coarse->n_theta + 1, sizeof *coarse);
    double *fine = imp__alloc(ctx, f->b->field->n_theta + 1, sizeof *fine);
    if (!coarse || !fine) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a level"));
    for (size_t k = 0; k < f->last->n; k++) coarse[f->coarse_at[k]] = in[k];
    IMP_TRY(imp__field_prolong(f->coarse, f->b->field, coarse, fine));
    for (size_t k = 0; k < f->goal.n; k++) out[k] = fine[f->at[k]];
out:
    imp__release(ctx, coarse);
    imp__release(ctx, fine);
    return st;
}

static enum imp_status level_run(struct imp__bend_run *f, bool resume, bool *found,
                                 const char **reason, int *iterations)
{
    enum imp_status st = IMP_OK, ended;
    imp_bend *b = f->b;
    struct imp__search *s = NULL;
    IMP_TRY(imp__search_create(&f->goal, f->o->optimizer, &f->opt, f->x0, &s));
    if (resume) {
        IMP_TRY(imp__checkpoint_read(b->ctx, f->o->checkpoint, &f->print, &f->goal, s,
                                     found));
        if (!*found) goto out;
    } else if (f->last && f->coarse && f->carries) {
        const struct imp__carry carry = {carry_map, f, 1.0 / 8};
        if (f->o->optimizer == IMP_LBFGS) IMP_TRY(imp__lbfgs_carry(f->last, &carry, s));
        else IMP_TRY(imp__search_carry(f->last, &carry, s));
    }
    f->best_value = INFINITY;
    const struct imp__lbfgs_metric metric = {imp__bend_fit_smoothed, f};
    ended = f->o->optimizer == IMP_LBFGS
                ? imp__lbfgs(&f->goal, &f->opt, f->metric.work ? &metric : NULL, s)
                : imp__optimize(&f->goal, &f->opt, s);
    if (ended != IMP_OK && ended != IMP_CANCELLED) IMP_TRY(ended);
    IMP_TRY(imp__bend_fit_set(f, s->x));
    *reason = s->reason                ? s->reason
              : ended == IMP_CANCELLED ? "stopped"
                                       : "all iterations done";
    *iterations += s->iteration;
    const size_t n = b->n_history + s->n_history;
    void *grown =
        imp__grow(b->ctx, b->history, &b->cap_history, n + 1, sizeof *b->history);
    if (!grown) IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "no memory for the history"));
    b->history = grown;
    if (s->n_history)
        memcpy(b->history + b->n_history, s->history, s->n_history * sizeof *b->history);
    b->n_history = n;
    if (f->o->checkpoint)
        IMP_TRY(imp__checkpoint_write(b->ctx, f->o->checkpoint, &f->print, s));
    last_free(f);
    f->last = s;
    s = NULL;
    st = ended;
out:
    imp__search_destroy(s);
    return st;
}

/* Refine the field to the next level. */
static enum imp_status refine(struct imp__bend_run *f)
{
    imp_field *fine;
    const enum imp_status st = imp_field_refine(f->b->field, &fine);
    if (st != IMP_OK) return st;
    imp_field_destroy(f->coarse);
    imp__release(f->b->ctx, f->coarse_at);
    f->coarse = f->b->field;
    f->coarse_at = f->at; /* level_begin makes another */
    f->at = NULL;
    f->b->field = fine;
    return IMP_OK;
}

/* Find the level the checkpoint belongs to, refining until it fits. */
static enum imp_status resume(struct imp__bend_run *f, bool *found, const char **reason,
                              int *iterations)
{
    enum imp_status st = IMP_OK;
    for (f->level = 0; f->level < f->levels; f->level++) {
        if (f->level > 0) IMP_TRY(refine(f));
        IMP_TRY(level_begin(f));
        f->fraction_lo = (double)f->level / f->levels;
        f->fraction_hi = (double)(f->level + 1) / f->levels;
        st = level_run(f, true, found, reason, iterations);
        if (st != IMP_E_ARG) return st;
    }
    st = imp__error(f->b->ctx, IMP_E_ARG, "%s: belongs to another problem",
                    f->o->checkpoint);
out:
    return st;
}

enum imp_status imp_bend_fit(imp_bend *b, const struct imp_bend_fit_options *options,
                             struct imp_bend_fit_result *result)
{
    struct imp_bend_fit_options own = IMP_BEND_FIT_OPTIONS_INIT, *const o = &own;
    IMP_REQUIRE(NULL, b, "bend");
    IMP_OPTIONS(b->ctx, own, options, "options");
    if (result) IMP_SIZED(b->ctx, result, "result");
    IMP_FLOAT_MODE;
    if (!(o->learning_rate >= 0) || !(o->tolerance >= 0) || !(o->scale >= 0) ||
        !(o->smooth_length >= 0) ||
        !isfinite(o->learning_rate + o->tolerance + o->scale + o->smooth_length))
        return imp__error(b->ctx, IMP_E_ARG,
                          "learning_rate %g, tolerance %g, scale %g and smooth_length %g "
                          "must be numbers >= 0",
                          o->learning_rate, o->tolerance, o->scale, o->smooth_length);
    if (o->smooth_length > 0 && o->optimizer != IMP_LBFGS)
        return imp__error(b->ctx, IMP_E_UNSUPPORTED,
                          "smooth_length %g: only lbfgs takes smooth steps",
                          o->smooth_length);
    struct imp__bend_run f = {.b = b,
                              .o = o,
                              .levels = imp_max(o->levels, 1),
                              .start_s = imp__now(),
                              .stats = IMP_BEND_STATS_INIT};
    enum imp_status st = IMP_OK;
    const char *reason = "nothing was done";
    int iterations = 0, first = 0;
    double start = 0, value = 0;
    bool found = false;

    const imp_progress_fn progress = b->options.progress;
    if (f.levels > IMP_BEND_LEVELS_MAX)
        return imp__error(b->ctx, IMP_E_ARG, "%d levels: at most %d", f.levels,
                          IMP_BEND_LEVELS_MAX);
    /* Adam's moments come from the steeper gradients of the coarse grid: it is usually
     * faster to begin anew. */
    f.carries = o->carry > 0 || (o->carry == 0 && o->optimizer == IMP_LBFGS);
    if (o->optimizer == IMP_LM)
        return imp__error(b->ctx, IMP_E_UNSUPPORTED,
                          "bent rays are fitted by lbfgs, adam, mma");
    const uint32_t *number;
    if (f.levels > 1 && !imp__field_nodes(b->field, &number))
        return imp__error(b->ctx, IMP_E_ARG, "levels are for grids, not for a %s field",
                          b->field->ops->name);
    struct imp_file_lock lock;
    IMP_CHECKED(imp__file_lock(b->ctx, o->checkpoint, &lock));
    b->n_history = 0;
    b->options.progress = NULL; /* a fit is cancelled between iterations only */
    IMP_TRY(level_begin(&f));
    /* The start is evaluated before the search moves numbers into their bounds, so that a
     * resumed fit reports the same value. */
    IMP_TRY(imp_bend_objective(b, &start, NULL, NULL, &f.stats));
    const uint64_t traced = f.stats.traced;
    if (o->checkpoint && o->resume) {
        st = resume(&f, &found, &reason, &iterations);
        if (st != IMP_OK && st != IMP_CANCELLED) goto out;
        if (found) first = f.level + 1;
        else f.level = 0;
    }
    for (int level = first; level < f.levels && st == IMP_OK; level++) {
        f.level = level;
        if (level > 0) {
            IMP_TRY(refine(&f));
            IMP_TRY(level_begin(&f));
        }
        f.fraction_lo = (double)level / f.levels;
        f.fraction_hi = (double)(level + 1) / f.levels;
        st = level_run(&f, false, &found, &reason, &iterations);
        if (st != IMP_OK && st != IMP_CANCELLED) goto out;
    }
    const enum imp_status ended = st;
    IMP_TRY(imp_bend_objective(b, &value, NULL, NULL, &f.stats));
    /* Lost rays are not in the objective, so a fit may lower it by losing rays. */
    if ((double)f.stats.traced < (double)traced - 0.01 * (double)f.stats.rays)
        imp__warn(
            b->ctx,
            "%llu rays that came to their ends at the start of the fit are lost now: "
            "the objective does not count them",
            (unsigned long long)(traced - f.stats.traced));
    f.best_value = value;
    f.done_iterations = f.opt.max_iterations;
    imp__bend_fit_report(&f, true);
    if (result) {
        const struct imp_bend_fit_result all = {.size = sizeof all,
                                                .iterations = iterations,
                                                .levels = f.level + 1,
                                                .start = start,
                                                .value = value,
                                                .n_history = b->n_history,
                                                .history = b->history,
                                                .reason = reason,
                                                .stats = f.stats};
        IMP_TRY(imp__info_give(b->ctx, __func__, "result", result, &all, sizeof all));
    }
    st = ended;
out:
    b->options.progress = progress;
    imp__file_unlock(b->ctx, &lock);
    last_free(&f);
    level_free(&f);
    return st;
}
