/* SPDX-License-Identifier: Apache-2.0
 *
 * A plan: informations of all candidates, their rows (plan_rows.c), the chosen set, and what
 * no candidate determines. */
#include "base/arguments.h"
#include "base/team.h"
#include "inverse/fit/fit.h"
#include "math/rng.h"
#include "plan_arguments.h"
#include "plan_rows.h"
#include <math.h>
#include <string.h>

#define SEED  0x91a2
#define KNOWN 1e-6 /* the width of a number that is held, in large changes */

/* ---- Informations ---------------------------------------------------------------------- */

static int progress(const struct imp_progress *p, void *payload)
{
    const struct imp__plan_work *plan = payload;
    struct imp_progress own = *p;
    own.stage = "plan";
    own.fraction = ((double)plan->done + p->fraction) / (2 * (double)plan->own);
    own.eta_s = own.fraction > 0 ? own.elapsed_s * (1 / own.fraction - 1) : -1;
    return ((const struct imp_run *)&plan->run)
        ->progress(&own, plan->run.progress_payload);
}

/* Candidate i's, by a run of its own. */
static enum imp_status information_find(struct imp__plan_work *plan, size_t i)
{
    imp_context *ctx = plan->p->ctx;
    struct imp_run run = plan->run;
    run.seed = imp__mix64(plan->run.seed ^ imp__mix64(SEED + i));
    if (run.progress) {
        run.progress = progress;
        run.progress_payload = plan;
    }
    struct imp__team *team = imp__plan_part_alone(ctx);
    const enum imp_status st = imp__plan_information(
        plan->p, plan->blank, &plan->c[i], &plan->o, &run, plan->width, &plan->data[i]);
    if (team) ctx->team = team;
    plan->done += 2;
    return st == IMP_OK || st == IMP_CANCELLED
               ? st
               : imp__error_prefix(ctx, st, "%s",
                                   imp__plan_name(plan->p->scene, &plan->c[i]));
}

static enum imp_status informations(struct imp__plan_work *plan)
{
    imp_context *ctx = plan->p->ctx;
    const size_t n = plan->n;
    size_t lit = 0;
    IMP_CHECKED(imp__plan_parts_same(plan->p, plan->c, plan->n_all, &plan->o, plan->width,
                                     &plan->run));
    for (size_t i = 0; i < plan->n_all; i++)
        plan->own += imp__plan_part_has(ctx, i, plan->n_all);
    for (size_t i = 0; i < plan->n_all; i++) {
        struct imp__plan_data *d = &plan->data[i];
        const bool own = imp__plan_part_has(ctx, i, plan->n_all);
        if (!own && !imp__team_merges(ctx)) continue;
        d->H = imp__alloc(ctx, (1 + IMP_DEVIATIONS) * n * n, sizeof *d->H);
        if (!d->H) return imp__error(ctx, IMP_E_NOMEM, "no memory for a plan");
        d->deviations = d->H + n * n;
        if (own) IMP_CHECKED(information_find(plan, i));
    }
    IMP_CHECKED(imp__plan_parts_share(ctx, plan->data, plan->n_all, n));
    for (size_t i = 0; i < plan->n_all; i++) {
        if (plan->data[i].lit == 0)
            imp__warn(ctx, "%s: all values are 0 or saturated: it tells nothing",
                      imp__plan_name(plan->p->scene, &plan->c[i]));
        else lit += !plan->c[i].have;
    }
    return lit > 0 ? IMP_OK
                   : imp__error(
                         ctx, IMP_E_ARG,
                         "candidates: all values of all of them, %s the first, are 0 or "
                         "saturated",
                         imp__plan_name(plan->p->scene, &plan->c[0]));
}

/* ---- The set, and what stays open ---------------------------------------------------------- */

static enum imp_status set_choose(struct imp__plan_work *plan, struct imp_plan_result *r)
{
    const struct imp__plan_choice choice = {.model = &plan->model,
                                            .have = plan->have,
                                            .n_have = plan->n_have,
                                            .items = plan->open,
                                            .cost = plan->cost,
                                            .n = plan->n_open,
                                            .take = plan->o.take,
                                            .budget = plan->o.budget};
    size_t *chosen = imp__arena_array(plan->arena, plan->n_open, sizeof *chosen);
    if (!chosen) return imp__error(plan->p->ctx, IMP_E_NOMEM, "no memory for a plan");
    IMP_CHECKED(
        imp__plan_choose(&choice, chosen, &r->n_chosen, &plan->then, &r->chosen_gain));
    for (size_t k = 0; k < r->n_chosen; k++) chosen[k] = plan->open_at[chosen[k]];
    r->chosen = chosen;
    return imp__plan_errors(plan, plan->then.C, &r->chosen_se);
}

/* From the units of the priors to those of large changes. */
static void data_rescale(const struct imp__plan_work *plan, struct imp__plan_data *d)
{
    const size_t n = plan->n;
    for (size_t g = 0; g <= IMP_DEVIATIONS; g++) {
        double *A = g ? d->deviations + (g - 1) * n * n : d->H;
        for (size_t k = 0; k < n; k++)
            for (size_t l = 0; l < n; l++)
                A[k * n + l] *=
                    plan->span[k] / plan->width[k] * (plan->span[l] / plan->width[l]);
    }
}

/* The last one to use the informations, whose units it changes: what pictures determine is
 * not a matter of priors. */
static enum imp_status loose_find(struct imp__plan_work *plan, struct imp_plan_result *r)
{
    enum imp_status st = IMP_OK;
    const size_t n = plan->n;
    const struct imp__plan_data **all =
        imp__alloc(plan->p->ctx, plan->n_all, sizeof *all);
    double *loose = imp__arena_array(plan->arena, n * n, sizeof *loose);
    if (!all || !loose)
        IMP_TRY(imp__error(plan->p->ctx, IMP_E_NOMEM, "no memory for a plan"));
    for (size_t i = 0; i < plan->n_all; i++) {
        data_rescale(plan, &plan->data[i]);
        all[i] = &plan->data[i];
    }
    for (size_t k = 0; k < n; k++) /* which derivatives do not tell of */
        if (plan->held[k]) plan->data[0].H[k * n + k] = 1 / (KNOWN * KNOWN);
    IMP_TRY(
        imp__plan_loose(&plan->model, all, plan->n_all, &plan->then, loose, &r->n_loose));
    r->loose = loose;
out:
    imp__release(plan->p->ctx, all);
    return st;
}

/* ---- All of it ----------------------------------------------------------------------------- */

static enum imp_status widths_set(struct imp__plan_work *plan)
{
    const struct imp_problem *p = plan->p;
    const size_t n = p->n;
    double *x = imp__alloc(p->ctx, n, sizeof *x);
    bool *given = imp__arena_array(plan->arena, n, sizeof *given),
         *held = imp__arena_array(plan->arena, n, sizeof *held);
    plan->width = imp__arena_array(plan->arena, n, sizeof *plan->width);
    plan->span = imp__arena_array(plan->arena, n, sizeof *plan->span);
    plan->unit = imp__arena_array(plan->arena, n, sizeof *plan->unit);
    enum imp_status st = IMP_OK;
    if (!x || !given || !held || !plan->width || !plan->span || !plan->unit)
        IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a plan"));
    imp_problem_get_x(p, x);
    for (size_t b = 0; b < p->n_blocks; b++) {
        const struct imp__block *block = &p->blocks[b];
        double square = 0;
        for (size_t e = 0; e < block->count; e++) square += imp__sqr(x[block->first + e]);
        for (size_t e = 0; e < block->count; e++) {
            const size_t k = block->first + e;
            plan->span[k] = imp__large_change(p, block, e, x[k], square);
            /* What is held is known. */
            held[k] = imp__block_held(p, block, e);
            const double own = held[k]         ? KNOWN * plan->span[k]
                               : plan->o.prior ? plan->o.prior[k]
                                               : 0;
            given[k] = own > 0;
            plan->width[k] = given[k] ? own : plan->span[k];
            plan->unit[k] = block->log ? exp(x[k]) : 1;
        }
    }
    plan->given = given;
    plan->held = held;
out:
    imp__release(p->ctx, x);
    return st;
}

static enum imp_status lists_make(struct imp__plan_work *plan)
{
    imp_context *ctx = plan->p->ctx;
    const size_t n = plan->n_all;
    plan->data = imp__alloc(ctx, n, sizeof *plan->data);
    plan->have = imp__alloc(ctx, n + 1, sizeof *plan->have);
    plan->open = imp__alloc(ctx, n, sizeof *plan->open);
    plan->open_at = imp__alloc(ctx, n, sizeof *plan->open_at);
    plan->cost = imp__alloc(ctx, n, sizeof *plan->cost);
    if (!plan->data || !plan->have || !plan->open || !plan->open_at || !plan->cost)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for a plan");
    for (size_t i = 0; i < n; i++) {
        if (plan->c[i].have) {
            plan->have[plan->n_have++] = &plan->data[i];
            continue;
        }
        plan->open_at[plan->n_open] = i;
        plan->cost[plan->n_open] = plan->c[i].cost;
        plan->open[plan->n_open++] = &plan->data[i];
    }
    return imp__plan_take_check(plan->p, &plan->o, plan->n_open);
}

static enum imp_status model_make(struct imp__plan_work *plan)
{
    size_t *of = imp__arena_array(plan->arena, plan->n, sizeof *of);
    if (!of) return imp__error(plan->p->ctx, IMP_E_NOMEM, "no memory for a plan");
    size_t n = 0;
    for (size_t i = 0; i < (plan->o.n_of > 0 ? plan->o.n_of : plan->n); i++) {
        const size_t k = plan->o.n_of > 0 ? plan->o.of[i] : i;
        if (!plan->held[k]) of[n++] = k;
    }
    if (n == 0)
        return imp__error(plan->p->ctx, IMP_E_ARG,
                          "imp_plan: all numbers that are wanted are held");
    plan->model = (struct imp__plan_model){.ctx = plan->p->ctx,
                                           .n = plan->n,
                                           .kind = plan->o.criterion,
                                           .of = of,
                                           .n_of = n};
    IMP_CHECKED(imp__plan_known_create(&plan->model, &plan->today));
    return imp__plan_known_create(&plan->model, &plan->then);
}

static void plan_end(struct imp__plan_work *plan)
{
    imp_context *ctx = plan->p->ctx;
    for (size_t i = 0; plan->data && i < plan->n_all; i++)
        imp__release(ctx, plan->data[i].H);
    imp__plan_known_destroy(ctx, &plan->today);
    imp__plan_known_destroy(ctx, &plan->then);
    imp__release(ctx, plan->data);
    imp__release(ctx, plan->have);
    imp__release(ctx, plan->open);
    imp__release(ctx, plan->open_at);
    imp__release(ctx, plan->cost);
    imp__release(ctx, plan->c);
    imp_problem_destroy(plan->blank);
}

enum imp_status imp_plan(imp_problem *problem,
                         const struct imp_plan_candidate *candidates, size_t n,
                         const struct imp_plan_options *options,
                         const struct imp_run *run, const struct imp_plan_result **result)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, problem, "problem");
    imp_context *ctx = problem->ctx;
    struct imp__plan_work plan = {
        .p = problem, .arena = &problem->plan_arena, .n = problem->n};
    IMP_REQUIRE(ctx, candidates, "candidates");
    IMP_REQUIRE(ctx, result, "result");
    IMP_RUN(ctx, plan.run, run);
    IMP_CHECKED(imp__run_traces(ctx, "imp_plan", &plan.run));
    IMP_CHECKED(imp__plan_options_take(problem, __func__, options, &plan.o));
    IMP_FLOAT_MODE;
    IMP_SETS(problem->scene, st);
    if (st != IMP_OK) return st;
    imp__arena_free(&problem->plan_arena);
    IMP_TRY(imp__plan_candidates_take(problem, __func__, "candidates", candidates, n,
                                      &plan.c));
    plan.n_all = n;
    IMP_TRY(widths_set(&plan));
    IMP_TRY(lists_make(&plan));
    IMP_TRY(model_make(&plan));
    IMP_TRY(imp_problem_create(problem->scene, &plan.blank));
    IMP_TRY(informations(&plan));
    struct imp_plan_result *r = imp__arena_array(plan.arena, 1, sizeof *r);
    if (!r) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a plan"));
    r->size = sizeof *r;
    r->n = plan.n;
    r->prior = plan.width;
    r->span = plan.span;
    IMP_TRY(imp__plan_evaluate(&plan.model, plan.have, plan.n_have, &plan.today));
    IMP_TRY(imp__plan_errors(&plan, plan.today.C, &r->today));
    IMP_TRY(imp__plan_rows(&plan, r));
    IMP_TRY(set_choose(&plan, r));
    IMP_TRY(loose_find(&plan, r));
    *result = r;
out:
    plan_end(&plan);
    return st;
}
