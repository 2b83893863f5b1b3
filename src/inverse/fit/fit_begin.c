/* SPDX-License-Identifier: Apache-2.0
 *
 * The beginning and the end of a fit: options checked and completed, bounds, what the search
 * needs besides, and its release. */
#include "fit.h"
#include "inverse/gradient/variate.h"
#include "scene/pose.h"
#include "walk/kept/store.h"
#include "walk/lights/light_walk.h"
#include "walk/run/run.h"
#include <math.h>

/* Do tiles get samples by their share of the variance? Beside control variates of many
 * values, which have each their own pixels, nothing is gained by it: there they do if the
 * options demand it. */
static bool allocates(const struct imp__fit *f)
{
    const bool many = f->variate && f->problem->n > IMP_TRAIL_MAX;
    return f->options.optimizer == IMP_ADAM &&
           f->options.allocation != IMP_ALLOCATION_EVEN &&
           (!many || f->options.allocation == IMP_ALLOCATION_VARIANCE);
}

/* The span of a block; of a pose two, of translation and rotation, which have different scales. */
static void spans_add(struct imp__fit *f, const struct imp__block *b)
{
    struct imp__span span = {.end = b->first + b->count,
                             .lo = b->lo,
                             .hi = b->hi,
                             .scale = 1,
                             .smooth = imp__fit_smooths(f, b)};
    if (imp__block_is_rigid(f->problem, b)) {
        struct imp__span first = span;
        first.end = b->first + 3;
        f->spans[f->n_spans++] = first;
    }
    f->spans[f->n_spans++] = span;
}

/* Bounds, by variable or by parameter. Of meshes in smooth steps, which Adam searches as it does many
 * variables, both: intervals of few need the former. */
static enum imp_status bounds_make(struct imp__fit *f)
{
    const struct imp_problem *p = f->problem;
    const size_t n = p->n;
    const bool many = f->options.optimizer == IMP_ADAM && n > IMP_SEARCH_FEW,
               spans = many || f->n_meshes > 0;
    if (spans) f->spans = imp__alloc(p->ctx, 2 * p->n_blocks, sizeof *f->spans);
    if (!many) {
        f->lo = imp__alloc(p->ctx, 4 * n, sizeof *f->lo);
        f->settles = imp__alloc(p->ctx, n, sizeof *f->settles);
    }
    if ((spans && !f->spans) || (!many && !(f->lo && f->settles)))
        return imp__error(p->ctx, IMP_E_NOMEM, "no memory for %zu variables", n);
    if (!many) {
        f->hi = f->lo + n;
        f->scale = f->lo + 2 * n;
        f->g_se = f->lo + 3 * n;
    }
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp__block *b = &p->blocks[k];
        if (spans) spans_add(f, b);
        for (size_t e = 0; !many && e < b->count; e++) {
            const struct imp__bounds bounds = imp__block_bounds(p, b, e);
            f->lo[b->first + e] = bounds.lo;
            f->hi[b->first + e] = bounds.hi;
        }
    }
    return IMP_OK;
}

/* Light tracing does not support everything that targets may contain. */
static void missing_tell(struct imp_problem *p, enum imp_from end)
{
    const struct imp_scene *scene = p->scene;
    const struct imp_walk_integrator *from =
        imp__walks_from(imp__walk_integrator(scene), end);
    if (p->misses_reported || !from) return;
    for (size_t i = 0; i < p->n_targets; i++)
        imp__light_walks_tell(scene, scene->sensors[p->targets[i].desc.sensor], from);
    p->misses_reported = true;
}

/* What reads losses: trial steps beside the loss of a Gauss-Newton matrix, methods whose walks are
 * kept and traced in turn, or Adam, which needs no errors of a gradient. */
static enum imp__loss_use use_of(const struct imp__fit *f)
{
    return f->options.optimizer == IMP_LM || imp__fit_keeps(f) ? IMP_LOSS_COMPARED
                                                               : IMP_LOSS_SOUGHT;
}

/* A sphere, a cylinder, a camera or a spot may be put by few maps, and a step by single numbers leads to
 * none of them, unless the first three columns are held. */
static enum imp_status worlds_check(const struct imp_problem *p)
{
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp__block *b = &p->blocks[k];
        const struct imp_pose *pose = imp__pose_of(p->scene, b->param);
        if (!pose || pose->kind != IMP_POSE_WORLD || imp__world_is_free(pose)) continue;
        for (size_t e = 0; e < b->count; e++)
            if (e % 4 != 3 && !imp__block_held(p, b, e))
                return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                                  "%s: a step by its numbers makes another kind of thing "
                                  "of it; fit its pose, or hold numbers 0-2, 4-6, 8-10",
                                  p->scene->params[b->param].info.name);
    }
    return IMP_OK;
}

/* What another optimiser has is not ignored. */
static enum imp_status foreign_check(imp_context *ctx, const struct imp_fit_options *o)
{
    const bool adam = o->optimizer == IMP_ADAM, keeps = !adam && o->optimizer != IMP_LM;
    const char *of_adam = o->learning_rate > 0                       ? "learning_rate"
                          : o->momentum > 0                          ? "momentum"
                          : o->allocation == IMP_ALLOCATION_VARIANCE ? "allocation"
                          : o->control_variate == IMP_VARIATES_ON    ? "control_variate"
                                                                     : NULL;
    const char *of_kept = o->memory > 0 ? "memory" : o->headroom > 1 ? "headroom" : NULL;
    if (!adam && of_adam)
        return imp__error(ctx, IMP_E_ARG, "%s is Adam's: no other optimiser has it",
                          of_adam);
    if (!keeps && of_kept)
        return imp__error(ctx, IMP_E_ARG,
                          "%s is of walks that L-BFGS, MMA and SLSQP keep: no other "
                          "optimiser has it",
                          of_kept);
    return IMP_OK;
}

static enum imp_status options_check(const struct imp_problem *p,
                                     const struct imp_fit_options *o)
{
    imp_context *ctx = p->ctx;
    if ((unsigned)o->optimizer > IMP_SLSQP)
        return imp__error(ctx, IMP_E_ARG, "optimizer %d does not exist",
                          (int)o->optimizer);
    if (p->n == 0)
        return imp__error(ctx, IMP_E_ARG, "nothing to fit: no parameter is active");
    if (p->n_targets == 0)
        return imp__error(ctx, IMP_E_ARG, "nothing to fit to: no target");
    if (o->max_iterations < 0)
        return imp__error(ctx, IMP_E_ARG, "max_iterations %d is below 0",
                          o->max_iterations);
    if (!(o->learning_rate >= 0) || o->learning_rate > 1)
        return imp__error(ctx, IMP_E_ARG, "learning_rate %g is outside [0, 1]",
                          o->learning_rate);
    if (!(o->tolerance >= 0) || isinf(o->tolerance))
        return imp__error(ctx, IMP_E_ARG, "tolerance %g must be finite and >= 0",
                          o->tolerance);
    if (!(o->momentum >= 0) || !(o->momentum < 1))
        return imp__error(ctx, IMP_E_ARG, "momentum %g is outside [0, 1)", o->momentum);
    if ((unsigned)o->allocation > IMP_ALLOCATION_VARIANCE)
        return imp__error(ctx, IMP_E_ARG, "allocation %d does not exist",
                          (int)o->allocation);
    IMP_CHECKED(foreign_check(ctx, o));
    IMP_CHECKED(worlds_check(p));
    IMP_CHECKED(imp__fit_levels_allowed(p, o));
    IMP_CHECKED(imp__fit_clipped_allowed(p, o));
    if (o->resume && !o->checkpoint)
        return imp__error(ctx, IMP_E_ARG, "resume needs the name of a checkpoint");
    return IMP_OK;
}

static void options_default(struct imp_fit_options *o)
{
    if (o->max_iterations == 0) o->max_iterations = o->optimizer == IMP_ADAM ? 200 : 30;
    if (o->learning_rate == 0) o->learning_rate = 0.05;
    if (o->tolerance == 0) o->tolerance = 1e-4;
}

/* Second derivatives of the regularisers, for methods with matrices. */
static enum imp_status prior_make(struct imp__fit *f)
{
    const size_t n = f->problem->n;
    imp_context *ctx = f->problem->ctx;
    if (n > IMP_DENSE_MAX) return IMP_OK;
    f->H_prior = imp__alloc(ctx, n * n, sizeof *f->H_prior);
    if (!f->H_prior) return imp__error(ctx, IMP_E_NOMEM, "no memory for regularisers");
    return imp__regularise_second(f->problem, f->H_prior);
}

/* Clocks, and the share of progress that belongs to the search. */
static void clock_start(struct imp__fit *f)
{
    const bool errors = f->problem->n <= IMP_DENSE_MAX || imp__fit_is_sparse(f);
    f->start_s = imp__now();
    f->last_checkpoint_s = f->start_s;
    f->deadline_s = f->outer.time_limit_s > 0 ? f->start_s + f->outer.time_limit_s : 0;
    f->search_share = f->options.intervals && errors ? 0.7 : 0.98;
    f->run = f->outer;
    f->run.time_limit_s = 0;
}

enum imp_status imp__fit_begin(struct imp_problem *p,
                               const struct imp_fit_options *options,
                               const struct imp_run *run, struct imp__fit *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->ctx;
    struct imp__fit f = {
        .problem = p, .options = IMP_FIT_OPTIONS_INIT, .outer = IMP_RUN_INIT};

    IMP_CHECKED(imp__options_take(ctx, "imp_fit", "options", options, &f.options,
                                  sizeof f.options));
    IMP_CHECKED(imp__run_take(ctx, "imp_fit", run, &f.outer));
    IMP_CHECKED(imp__run_traces(ctx, "imp_fit", &f.outer));
    if (f.options.optimizer == IMP_LM) imp__points_of_normal(p, &f.outer);
    else imp__points_of_losses(p, &f.outer);
    IMP_CHECKED(options_check(p, &f.options));
    options_default(&f.options);
    IMP_CHECKED(imp__fit_places(p));

    p->use = use_of(&f);
    IMP_TRY(imp__fit_meshes(&f));
    IMP_TRY(bounds_make(&f));
    IMP_TRY(prior_make(&f));
    f.noise_known = true;
    for (size_t i = 0; i < p->n_targets; i++)
        f.noise_known &= p->targets[i].noise_se != NULL;
    missing_tell(p, f.outer.from);
    clock_start(&f);
    IMP_TRY(imp__fit_variates(&f));
    f.quiet = f.variate && p->n > IMP_TRAIL_MAX;
    if (f.options.momentum == 0 && !f.quiet) f.options.momentum = IMP_ADAM_MOMENTUM;
    if (allocates(&f) && !imp__problem_moves(p))
        IMP_TRY(imp__allocation_create(p, &f.run, &f.allocation));
    if (f.options.checkpoint) imp__fit_fingerprint(&f);
    *out = f;
    imp__fit_goal_make(out);
    return IMP_OK;
out:
    imp__fit_end(&f);
    return st;
}

void imp__fit_end(struct imp__fit *f)
{
    if (!f->problem) return;
    f->problem->use = IMP_LOSS_TOLD;
    imp__fit_meshes_free(f);
    imp__walks_destroy(f->walks);
    imp__variate_destroy(f->variate);
    imp__allocation_destroy(&f->allocation);
    imp__release(f->problem->ctx, f->lo);
    imp__release(f->problem->ctx, f->settles);
    imp__release(f->problem->ctx, f->spans);
    imp__release(f->problem->ctx, f->H_prior);
    imp__sparse_errors_destroy(f->problem->ctx, &f->errors);
}
