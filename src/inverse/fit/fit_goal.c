/* SPDX-License-Identifier: Apache-2.0
 *
 * A problem as an optimiser sees it. */
#include "base/team.h"
#include "fit.h"
#include "inverse/estimate/moved_gradient.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/gradient/objective_gradient.h"
#include "inverse/gradient/variate.h"
#include "inverse/problem/loss.h"
#include "scene/pose.h"
#include "walk/kept/store.h"
#include "walk/run/run.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define CHECKPOINT_S     2  /* seconds between checkpoints, and at most */
#define CHECKPOINT_SHARE 20 /* 1/20 of the time */
#define REPORT_S         0.1
#define COARSER          4  /* samples of an evaluation, over those of a coarse search, */
#define COARSE_SPP       16 /* which are at least so many: fewer lead far away */

/* ---- Progress ------------------------------------------------------------------ */

static void report(struct imp__fit *f, double fraction)
{
    const double now = imp__now();
    if (f->deadline_s > 0 && now > f->deadline_s) f->stopped = true;
    f->fraction = fmax(f->fraction, fmin(fraction, 1));
    if (!f->outer.progress || (now - f->last_report_s < REPORT_S && fraction < 1)) return;
    f->last_report_s = now;
    const double elapsed = now - f->start_s;
    const int done = f->search ? f->search->iteration - f->first_iteration : 0;
    const bool closing = f->final_total > 0; /* the search is over */
    const struct imp_progress p = {
        .size = sizeof p,
        .stage = closing ? "intervals" : "fit",
        .fraction = f->fraction,
        .elapsed_s = elapsed,
        .eta_s = f->fraction > 1e-3 ? elapsed * (1 - f->fraction) / f->fraction : -1,
        .rate = elapsed > 0 && !closing ? done / elapsed : 0,
        .rate_unit = "iterations",
        .note = f->note[0] && !closing ? f->note : NULL};
    if (f->outer.progress(&p, f->outer.progress_payload) != 0) f->stopped = true;
}

enum imp_status imp__fit_goes_on(struct imp__fit *f, double fraction)
{
    report(f, fraction);
    IMP_CHECKED(imp__team_any(f->problem->ctx, f->stopped, &f->stopped));
    return f->stopped ? imp__error(f->problem->ctx, IMP_CANCELLED, "%s",
                                   imp_status_text(IMP_CANCELLED))
                      : IMP_OK;
}

/* Progress of the evaluation at work. */
static int inner_progress(const struct imp_progress *p, void *payload)
{
    struct imp__fit *f = payload;
    const double done = f->search ? f->search->iteration : 0;
    if (f->final_total >
        0) /* A covariance that moves to the Newton point takes more evaluations than planned. */
        report(f, f->search_share +
                      (0.999 - f->search_share) *
                          fmin(1, (f->final_calls - 1 + p->fraction) / f->final_total));
    else
        report(f,
               f->search_share * (done + 0.5 * p->fraction) / f->options.max_iterations);
    return f->stopped;
}

/* With many variables the answer so far would need extra memory: none is shown. */
static void show_step(struct imp__fit *f, const struct imp__search *s)
{
    const struct imp_fit_step step = {.size = sizeof step,
                                      .iteration = s->iteration,
                                      .n = s->start ? s->n : 0,
                                      .x = s->start ? s->x : NULL,
                                      .n_history = s->n_history,
                                      .history = s->history,
                                      .history_se = s->history_se,
                                      .history_x = s->history_x};
    if (f->options.step && f->options.step(&step, f->options.step_payload) != 0)
        f->stopped = true;
}

static enum imp_status iterated(const struct imp__search *s, void *payload)
{
    struct imp__fit *f = payload;
    const double now = imp__now();
    if (f->allocation.n > 0) imp__allocation_update(&f->allocation);
    snprintf(f->note, sizeof f->note, "loss %.3g +- %.1g", s->history[s->n_history - 1],
             s->history_se[s->n_history - 1]);
    if (f->options.checkpoint &&
        now - f->last_checkpoint_s >
            fmax(CHECKPOINT_S, CHECKPOINT_SHARE * f->checkpoint_cost_s)) {
        const enum imp_status st = imp__fit_checkpoint_write(f, s);
        if (st != IMP_OK) return st;
        f->last_checkpoint_s = imp__now();
        f->checkpoint_cost_s = f->last_checkpoint_s - now;
    }
    show_step(f, s);
    return imp__fit_goes_on(f,
                            f->search_share * s->iteration / f->options.max_iterations);
}

/* ---- Evaluations --------------------------------------------------------------- */

int imp__fit_spp(const struct imp__fit *f)
{
    const struct imp_problem *p = f->problem;
    return f->outer.spp > 0 ? f->outer.spp
                            : p->scene->sensors[p->targets[0].desc.sensor]->spp;
}

static bool is_placed(const struct imp_problem *p, const struct imp_pose *q)
{
    return !imp__pose_moves(q) && p->active.base[q->param] >= 0;
}

static bool any_placed(const struct imp_problem *p)
{
    for (const struct imp_pose *q = p->scene->poses; q; q = q->next)
        if (is_placed(p, q)) return true;
    return false;
}

/* A volume ends at 0, and is to end there at all steps. */
enum imp_status imp__fit_places(const struct imp_problem *p)
{
    for (const struct imp_pose *q = p->scene->poses; q; q = q->next) {
        if (!is_placed(p, q) || p->active.base[q->texture->param] < 0) continue;
        const struct imp_param_info *cells = &p->scene->params[q->texture->param].info;
        const struct imp_medium *m =
            imp__volume_may_jump(p->scene, q, p->held ? p->held + cells->offset : NULL);
        if (m)
            return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                              "%s moves the border of a box, and the outermost cells of "
                              "%s, at which medium '%s' ends, are fitted, too: hold "
                              "these at 0",
                              p->scene->params[q->param].info.name, cells->name, m->name);
    }
    return IMP_OK;
}

/* Where poses are active: may objects be as x has them? Not so: what cannot be moved (numbers beyond
 * floats), where edges are none (a tube that passes through a wall), or where a volume that moves does
 * not end at 0. */
static enum imp_status poses_allow(const struct imp__fit *f, const double *x)
{
    const struct imp_problem *p = f->problem;
    IMP_CHECKED(imp_problem_set_x(f->problem, x));
    for (const struct imp_pose *q = p->scene->poses; q; q = q->next)
        if (is_placed(p, q) && imp__volume_jumps(p->scene, q)) return IMP_E_BIAS;
    return imp__problem_moves(p) ? imp__moved_possible(f->problem, &f->run) : IMP_OK;
}
static bool is_impossible(enum imp_status st)
{
    return st == IMP_E_UNSUPPORTED || st == IMP_E_NUMERIC || st == IMP_E_BIAS;
}
static bool possible(const double *x, void *payload)
{
    return !is_impossible(poses_allow(payload, x));
}

static enum imp_status eval(const double *x, uint64_t seed, struct imp_estimate *f,
                            double *g, double *g_se, void *payload)
{
    struct imp__fit *fit = payload;
    fit->run.seed = seed;
    fit->final_calls++;
    if (!g && fit->goal.possible && !possible(x, fit)) {
        *f = (struct imp_estimate){.value = INFINITY, .se = 0};
        return IMP_OK;
    }
    enum imp_status st = imp__fit_take_walks(fit, x, seed);
    /* What comes after the search is of samples that are alike. */
    if (fit->allocation.n > 0 && fit->searching)
        fit->problem->allocation = &fit->allocation;
    fit->allocation.metric = fit->metric;
    fit->metric = NULL;
    fit->problem->variate = fit->searching && g ? fit->variate : NULL;
    if (st == IMP_OK)
        st = imp__problem_objective(fit->problem, x, &fit->run, true, f, g, g_se);
    fit->problem->variate = NULL;
    fit->problem->allocation = NULL;
    fit->run.walks = NULL;
    if (st == IMP_CANCELLED) fit->stopped = true; /* by this rank or another */
    return st;
}

static void measure(const struct imp__metric *metric, void *payload)
{
    ((struct imp__fit *)payload)->metric = metric;
}

static bool quadratic(const struct imp__fit *f)
{
    const struct imp_problem *p = f->problem;
    for (size_t t = 0; t < p->n_targets; t++)
        if (!imp__loss_quadratic(p->targets[t].desc.loss)) return false;
    return true;
}

static enum imp_status normal(const double *x, uint64_t seed, int rounds,
                              struct imp__normal *out, void *payload)
{
    struct imp__fit *fit = payload;
    const size_t n = fit->problem->n;
    struct imp__gauss_newton gn = {.H = out->H,
                                   .H_same = out->H_same,
                                   .H_meas = out->H_meas,
                                   .g = out->g,
                                   .g_se = fit->g_se,
                                   .cov_g = out->cov_g,
                                   .cov_excess = out->cov_excess,
                                   .deviations = out->deviations,
                                   .rounds = rounds};
    fit->run.seed = seed;
    fit->final_calls++;
    const enum imp_status st = imp__gauss_newton(fit->problem, x, &fit->run, &gn);
    if (st == IMP_CANCELLED) fit->stopped = true;
    if (st != IMP_OK) return st;
    const double prior = imp__regularise(fit->problem, x, out->g);
    out->f = gn.objective;
    out->f.value += prior;
    out->pairs =
        (struct imp_estimate){.value = quadratic(fit) ? 0.5 * gn.chi2 + prior : NAN,
                              .se = 0.5 * gn.chi2_se,
                              .bias_order = out->f.bias_order};
    out->chi2 = gn.chi2;
    out->n_residuals = gn.n_residuals;
    out->noise_known = true;
    /* A fit of n variables reduces the squared residuals of M observations by (M - n)/M on
     * average; corrected where they are used as estimates of the noise. A pixel is one where its
     * channels may share their noise. */
    const double observations = gn.n_pixels > 0 ? gn.n_pixels : gn.n_residuals;
    const double freedom = observations - (double)(n - imp__held_count(fit->problem));
    const double widen = fit->noise_known || freedom < 1 ? 1 : observations / freedom;
    for (size_t i = 0; i < n * n; i++) out->H_meas[i] *= widen;
    for (size_t i = 0; i < n * n; i++) {
        out->H_prior[i] = fit->H_prior[i];
        out->H[i] += fit->H_prior[i];
        out->H_same[i] += fit->H_prior[i];
    }
    return IMP_OK;
}

/* A search by Levenberg-Marquardt whose end is tested and may be continued takes a
 * quarter of the samples: otherwise half of its time would be spent far from the answer.
 * A loss that is not quadratic has a bias that grows. */
int imp__fit_coarse_spp(const struct imp__fit *f)
{
    const struct imp_problem *p = f->problem;
    const int spp = imp__fit_spp(f);
    return f->options.optimizer == IMP_LM && f->options.intervals && quadratic(f) &&
                   p->n <= IMP_DENSE_MAX
               ? imp_min(spp, imp_max(spp / COARSER, COARSE_SPP))
               : spp;
}

static void coarsen(bool fewer, void *payload)
{
    struct imp__fit *f = payload;
    if (fewer == f->coarse) return;
    if (fewer) f->fine_spp = f->run.spp;
    f->run.spp = fewer ? imp__fit_coarse_spp(f) : f->fine_spp;
    f->coarse = fewer;
}

void imp__fit_goal_make(struct imp__fit *f)
{
    const size_t n = f->problem->n;
    f->run.progress = inner_progress;
    f->run.progress_payload = f;
    f->goal = (struct imp__goal){.ctx = f->problem->ctx,
                                 .n = n,
                                 .lo = f->lo,
                                 .hi = f->hi,
                                 .scale = f->scale,
                                 .settles = f->settles,
                                 .spans = f->spans,
                                 .n_spans = f->n_spans,
                                 .seed = f->outer.seed,
                                 .eval = eval,
                                 .normal = n <= IMP_DENSE_MAX ? normal : NULL,
                                 .sparse = imp__fit_is_sparse(f) ? imp__fit_sparse : NULL,
                                 .iterated = iterated,
                                 .payload = f};
    if (f->allocation.n > 0) f->goal.measure = measure;
    if (f->n_meshes > 0) f->goal.smooth = imp__fit_smooth;
    if (imp__problem_moves(f->problem) || any_placed(f->problem))
        f->goal.possible = possible;
    if (imp__fit_coarse_spp(f) < imp__fit_spp(f)) f->goal.coarsen = coarsen;
    if (imp__fit_keeps(f)) {
        f->goal.draw = imp__fit_draw;
        f->goal.is_stale = imp__fit_is_stale;
    }
}
