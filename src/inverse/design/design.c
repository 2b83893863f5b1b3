/* SPDX-License-Identifier: Apache-2.0
 *
 * Lighting design: what is active, bounds, rounds of refining and searching. */
#include "design.h"
#include "base/arguments.h"
#include "inverse/problem/match.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static enum imp_status iterated(const struct imp__search *s, void *payload)
{
    struct imp__design *d = payload;
    const double share = (double)s->iteration / d->o.max_iterations;
    char note[64];
    snprintf(note, sizeof note, "loss %.3g", s->history[s->n_history - 1]);
    imp__el_tick(d->e, "fit", (d->round + fmin(share, 0.999)) / d->o.rounds, note);
    return imp__design_stopped(d);
}

/* ---- What is active ------------------------------------------------------------ */

/* Lights and materials among the active parameters; others have no derivative here. */
static enum imp_status sort_out(struct imp__design *d)
{
    const imp_elements *e = d->e;
    const struct imp_scene *scene = d->p->scene;
    for (size_t i = 0; i < e->n_roots; i++)
        if (e->roots[i].light != EL_DARK && e->roots[i].light_param >= 0)
            d->light[e->roots[i].light_param] = 1;
    for (int i = 0; i < e->n_materials; i++)
        for (int j = 0; j < e->materials[i].n_d; j++)
            if (e->materials[i].d[j].param >= 0)
                d->material[e->materials[i].d[j].param] = 1;
    d->linear = true;
    for (size_t k = 0; k < scene->n_params; k++) {
        if (d->p->active.base[k] < 0) continue;
        if (!d->light[k] && !d->material[k])
            return imp__error(d->goal.ctx, IMP_E_UNSUPPORTED,
                              "%s: finite elements have no derivative to it",
                              scene->params[k].info.name);
        if (d->material[k]) d->linear = false;
    }
    return IMP_OK;
}

static enum imp_status bounds_take(struct imp__design *d)
{
    const struct imp_scene *scene = d->p->scene;
    for (size_t k = 0; k < d->p->n_blocks; k++) {
        const struct imp__block *b = &d->p->blocks[k];
        for (size_t i = b->first; i < b->first + b->count; i++) {
            d->lo[i] = b->lo;
            d->hi[i] = b->hi;
        }
    }
    if (d->o.n_bounds > 0 && !d->o.bounds)
        return imp__error(d->goal.ctx, IMP_E_ARG, "imp_elements_fit: bounds is NULL");
    for (size_t b = 0; b < d->o.n_bounds; b++) {
        struct imp_elements_bounds own = IMP_ELEMENTS_BOUNDS_INIT, *want = &own;
        bool met = false;
        IMP_CHECKED(imp__element_take(d->goal.ctx, "imp_elements_fit", "bounds",
                                      d->o.bounds, b, want, sizeof *want));
        if (!want->glob || !(want->lo <= want->hi))
            return imp__error(d->goal.ctx, IMP_E_ARG,
                              "bounds %g to %g of '%s' make no sense", want->lo, want->hi,
                              want->glob ? want->glob : "");
        for (size_t k = 0; k < scene->n_params; k++) {
            const struct imp_param_info *info = &scene->params[k].info;
            const int64_t base = d->p->active.base[k];
            if (base < 0 || !imp__glob(want->glob, info->name)) continue;
            met = true;
            if (want->lo > info->hi || want->hi < info->lo)
                return imp__error(d->goal.ctx, IMP_E_ARG,
                                  "bounds %g to %g of %s are outside its own, %g to %g",
                                  want->lo, want->hi, info->name, info->lo, info->hi);
            for (size_t i = (size_t)base; i < (size_t)base + info->count; i++) {
                d->lo[i] = fmax(d->lo[i], want->lo);
                d->hi[i] = fmin(d->hi[i], want->hi);
            }
        }
        if (!met)
            return imp__error(d->goal.ctx, IMP_E_ARG,
                              "no active parameter matches '%s', which has bounds",
                              want->glob);
    }
    return IMP_OK;
}

/* Emission that weighs links in the first refinement: a light that is off counts as if it
 * shone like the brightest, or by 1 if all are off. Otherwise its links would be too
 * coarse to show its effect. */
static void lit(const struct imp__design *d, const double *x, double *out)
{
    double most = 0;
    memcpy(out, x, d->n * sizeof *out);
    for (int pass = 0; pass < 2; pass++)
        for (size_t k = 0; k < d->p->scene->n_params; k++) {
            const int64_t base = d->p->active.base[k];
            const size_t count = d->p->scene->params[k].info.count;
            for (size_t i = 0; base >= 0 && d->light[k] && i < count; i++) {
                double *v = &out[(size_t)base + i];
                if (pass == 0) most = fmax(most, *v);
                else if (*v < 1e-3 * most || most == 0)
                    *v = imp_clamp(most > 0 ? most : 1, d->lo[(size_t)base + i],
                                   d->hi[(size_t)base + i]);
            }
        }
}

static void scales(struct imp__design *d, const double *x)
{
    double most = 0;
    for (size_t i = 0; i < d->n; i++) most = fmax(most, fabs(x[i]));
    for (size_t i = 0; i < d->n; i++) {
        const double range = d->hi[i] - d->lo[i];
        d->scale[i] = isfinite(range) && range < DBL_MAX
                          ? range
                          : fmax(fabs(x[i]), most > 0 ? 1e-3 * most : 1);
        if (!(d->scale[i] > 0)) d->scale[i] = 1;
    }
}

/* Values that are free to move and that no regulariser weighs. */
static size_t unpriced(const struct imp__design *d)
{
    const struct imp_problem *p = d->p;
    size_t count = 0;
    for (size_t k = 0; k < p->scene->n_params; k++) {
        const int64_t base = p->active.base[k];
        bool priced = base < 0;
        for (size_t r = 0; r < p->n_regularisers; r++)
            priced |= p->regularisers[r].weight > 0 && p->regularisers[r].on[k];
        for (size_t i = 0; !priced && i < p->scene->params[k].info.count; i++)
            count += d->lo[(size_t)base + i] < d->hi[(size_t)base + i];
    }
    return count;
}

/* ---- The search ---------------------------------------------------------------- */

static enum imp_status begin(struct imp__design *d)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = d->goal.ctx;
    const size_t n = d->n, m = d->goals, params = d->p->scene->n_params;
    if (d->o.max_iterations == 0) d->o.max_iterations = 100;
    if (d->o.tolerance == 0) d->o.tolerance = 1e-8;
    if (d->o.rounds == 0) d->o.rounds = 3;
    if (d->o.optimizer == IMP_ADAM)
        d->o.optimizer = n <= IMP_DENSE_MAX ? IMP_LM : IMP_LBFGS;
    if (n == 0)
        return imp__error(ctx, IMP_E_ARG, "nothing to fit: no parameter is active");
    IMP_CHECKED(imp__ties_equal_only(d->p, "imp_elements_fit"));
    if (!d->o.targets)
        return imp__error(ctx, IMP_E_ARG, "nothing to fit to: targets is NULL");
    if (d->o.max_iterations < 0 || d->o.rounds < 0 || !(d->o.tolerance > 0) ||
        isinf(d->o.tolerance))
        return imp__error(ctx, IMP_E_ARG, "max_iterations %d, rounds %d, tolerance %g",
                          d->o.max_iterations, d->o.rounds, d->o.tolerance);
    double *all = imp__arena_array(&d->p->fit_arena, 3 * n + 5 * m, sizeof *all);
    d->A = imp__arena_array(&d->p->fit_arena, m * n, sizeof *d->A);
    d->light = imp__arena_array(&d->p->fit_arena, 2 * params + 1, 1);
    if (n <= IMP_DENSE_MAX)
        d->H_prior = imp__arena_array(&d->p->fit_arena, n * n, sizeof *d->H_prior);
    if (!all || !d->A || !d->light || (n <= IMP_DENSE_MAX && !d->H_prior))
        return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu variables", n);
    d->lo = all, d->hi = all + n, d->scale = all + 2 * n;
    d->t = all + 3 * n, d->w = d->t + m, d->J = d->w + m;
    d->unit = d->J + m, d->J0 = d->unit + m;
    d->material = d->light + params;
    for (size_t k = 0; k < m; k++) {
        d->t[k] = d->o.targets[k];
        const double scale = d->t[k] != 0 ? fabs(d->t[k]) : 1;
        d->w[k] = d->e->sources[k].weight / (scale * scale);
        if (!isfinite(d->t[k]) || !(d->w[k] > 0) || !isfinite(d->w[k]))
            return imp__error(ctx, IMP_E_ARG, "target %g with weight %g", d->t[k],
                              d->e->sources[k].weight);
        if (d->t[k] < 0)
            return imp__error(ctx, IMP_E_ARG,
                              "target %g: neither an illuminance nor a radiance is "
                              "negative",
                              d->t[k]);
    }
    IMP_TRY(sort_out(d));
    IMP_TRY(bounds_take(d));
    const size_t free_numbers = unpriced(d);
    if (free_numbers > m)
        imp__warn(ctx,
                  "underdetermined: %zu targets for %zu numbers, so many answers meet "
                  "them; a Tikhonov weight on the numbers picks the smallest",
                  m, free_numbers);
    if (d->H_prior) IMP_TRY(imp__regularise_second(d->p, d->H_prior));
out:
    return st;
}

/* Refine links at the scene's values, with every source weighted by its relative
 * error. */
static enum imp_status refine(struct imp__design *d)
{
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < d->goals; k++) d->unit[k] = sqrt(d->w[k]);
    IMP_TRY(imp__el_parameters(d->e));
    imp__el_weigh(d->e, d->unit);
    if (d->deadline_s > 0)
        d->e->opt.time_limit_s = fmax(d->deadline_s - imp__now(), 1e-3);
    IMP_TRY(imp_elements_solve(d->e));
    d->e->deadline_s = d->deadline_s;
out:
    return st;
}

/* One round: links at x, then the best x on them. *moved: the largest step, in scales. */
static enum imp_status round_run(struct imp__design *d, double *x, double *trial,
                                 double *before, struct imp__search **search,
                                 double *moved)
{
    enum imp_status st = IMP_OK;
    const struct imp__opt_options oo = {d->o.max_iterations, 0, d->o.tolerance, 0, false};
    struct imp__search *s = NULL;
    memcpy(trial, x, d->n * sizeof *x);
    if (d->round == 0) lit(d, x, trial);
    IMP_TRY(imp_problem_set_x(d->p, trial));
    IMP_TRY(refine(d));
    if (d->linear) IMP_TRY(imp__design_matrix(d, trial));
    IMP_TRY(imp__design_at(d, x));
    if (d->round == 0) memcpy(before, d->J, d->goals * sizeof *before);
    scales(d, trial);
    IMP_TRY(imp__search_create(&d->goal, d->o.optimizer, &oo, x, &s));
    st = imp__optimize(&d->goal, &oo, s);
    if (st != IMP_OK && st != IMP_CANCELLED) goto out;
    *moved = 0;
    for (size_t i = 0; i < d->n; i++) {
        *moved = fmax(*moved, fabs(s->x[i] - x[i]) / d->scale[i]);
        x[i] = s->x[i];
    }
    imp__search_destroy(*search);
    *search = s;
    s = NULL;
out:
    imp__search_destroy(s);
    return st;
}

static enum imp_status result_make(const struct imp__design *d, const double *start,
                                   const double *x, const double *before,
                                   const struct imp__search *s, int iterations,
                                   const char *reason,
                                   const struct imp_elements_fit_result **out)
{
    struct imp_arena *arena = &d->p->fit_arena;
    const size_t n_history = s ? s->n_history : 0;
    struct imp_elements_fit_result *r = imp__arena_array(arena, 1, sizeof *r);
    struct imp_fit_variable *v = imp__arena_array(arena, d->n, sizeof *v);
    struct imp_elements_goal *g = imp__arena_array(arena, d->goals, sizeof *g);
    double *history = imp__arena_array(arena, n_history + 1, sizeof *history);
    if (!r || !v || !g || !history)
        return imp__error(d->goal.ctx, IMP_E_NOMEM, "no memory for the result of a fit");
    for (size_t i = 0; i < d->n; i++)
        v[i] = (struct imp_fit_variable){.size = sizeof *v,
                                         .start = start[i],
                                         .value = x[i],
                                         .lo95 = NAN,
                                         .hi95 = NAN,
                                         .at_bound = imp__at_bound(&d->goal, x, i),
                                         .determined = 1};
    for (size_t k = 0; k < d->goals; k++)
        g[k] = (struct imp_elements_goal){
            .size = sizeof *g,
            .target = d->t[k],
            .before = isnan(before[k]) ? d->J[k] : before[k], /* no step yet */
            .after = d->J[k]};
    if (n_history) memcpy(history, s->history, n_history * sizeof *history);
    *r = (struct imp_elements_fit_result){.size = sizeof *r,
                                          .iterations = iterations,
                                          .rounds = d->round,
                                          .objective = imp__design_value(d) +
                                                       imp__regularise(d->p, x, NULL),
                                          .linear = d->linear,
                                          .n_goals = d->goals,
                                          .goals = g,
                                          .n = d->n,
                                          .variables = v,
                                          .n_history = n_history,
                                          .history = history,
                                          .reason = reason};
    *out = r;
    return IMP_OK;
}

enum imp_status imp_elements_fit(imp_elements *e, imp_problem *p,
                                 const struct imp_elements_fit_options *options,
                                 const struct imp_elements_fit_result **result)
{
    enum imp_status st = IMP_OK, ended = IMP_OK;
    struct imp_elements_fit_options o = IMP_ELEMENTS_FIT_OPTIONS_INIT;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, p, "problem");
    IMP_REQUIRE(e->ctx, options, "options");
    IMP_REQUIRE(e->ctx, result, "result");
    IMP_OPTIONS(e->ctx, o, options, "options");
    IMP_FLOAT_MODE;
    IMP_SETS(p->scene, st);
    if (st != IMP_OK) return st;
    if (p->scene != e->scene || e->opt.no_importance)
        return imp__error(e->ctx, IMP_E_ARG,
                          "the problem and the elements must be of one scene, and the "
                          "elements have importance");
    struct imp__design d = {.e = e, .p = p, .n = p->n, .goals = e->n_sources, .o = o};
    struct imp__search *s = NULL;
    const imp_progress_fn progress = e->opt.progress;
    const char *reason = "no step was made";
    int iterations = 0;
    double *x = NULL, moved = INFINITY;
    d.goal =
        (struct imp__goal){.ctx = e->ctx,
                           .n = d.n,
                           .eval = imp__design_eval,
                           .normal = d.n <= IMP_DENSE_MAX ? imp__design_normal : NULL,
                           .iterated = iterated,
                           .payload = &d};
    imp__arena_free(&p->fit_arena);
    IMP_TRY(begin(&d));
    d.goal.lo = d.lo, d.goal.hi = d.hi, d.goal.scale = d.scale;
    const double time_limit = e->opt.time_limit_s;
    if (time_limit > 0) d.deadline_s = imp__now() + time_limit;
    x = imp__alloc(e->ctx, 3 * d.n + d.goals, sizeof *x);
    if (!x) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "no memory for %zu variables", d.n));
    double *start = x + d.n, *trial = x + 2 * d.n, *before = x + 3 * d.n;
    imp_problem_get_x(p, start);
    for (size_t i = 0; i < d.n; i++) x[i] = imp__into_bounds(&d.goal, i, start[i]);
    for (size_t k = 0; k < d.goals; k++) before[k] = NAN;

    for (; d.round < d.o.rounds && ended == IMP_OK && moved > 1e-3; d.round++) {
        const struct imp__search *last = s;
        ended = round_run(&d, x, trial, before, &s, &moved);
        if (s && s != last) iterations += s->iteration, reason = s->reason;
    }
    e->opt.time_limit_s = time_limit;
    if (ended != IMP_OK && ended != IMP_CANCELLED) {
        (void)!imp_problem_set_x(p, start); /* the scene keeps its values */
        IMP_TRY(ended);
    }
    if (ended == IMP_CANCELLED) reason = e->reason;
    /* After a request to stop, the solution at the answer is still completed, without a
     * further callback. */
    e->opt.progress = NULL;
    e->stop = false;
    e->deadline_s = 0;
    /* Back to the measurements that the elements were made for, at the answer. */
    IMP_TRY(imp_problem_set_x(p, x));
    IMP_TRY(imp_elements_update(e));
    IMP_TRY(imp__design_measure(&d, d.J));
    for (size_t k = 0; k < d.goals; k++) d.unit[k] = e->sources[k].weight;
    IMP_TRY(imp__design_weigh(&d, d.unit));
    IMP_TRY(imp_elements_update(e));
    IMP_TRY(result_make(&d, start, x, before, s, iterations, reason, result));
    st = ended;
out:
    e->opt.progress = progress;
    imp__search_destroy(s);
    imp__release(e->ctx, x);
    return st;
}
