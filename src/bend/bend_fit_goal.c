/* SPDX-License-Identifier: Apache-2.0
 *
 * The objective of a fit as an optimiser sees it, over the numbers that are not held; reports
 * and checkpoints between iterations. */
#include "bend_fit.h"
#include <math.h>
#include <stdio.h>

enum imp_status imp__bend_fit_set(struct imp__bend_run *f, const double *x)
{
    for (size_t k = 0; k < f->goal.n; k++) f->theta[f->at[k]] = x[k];
    return imp_field_set_theta(f->b->field, f->theta);
}

bool imp__bend_fit_report(struct imp__bend_run *f, bool force)
{
    const double now = imp__now();
    if (!f->o->progress || (!force && now - f->last_report_s < 0.1)) return false;
    f->last_report_s = now;
    const double elapsed = now - f->start_s;
    snprintf(f->note, sizeof f->note, "level %d of %d, objective %.4g", f->level + 1,
             f->levels, f->best_value);
    const double part = imp_min(1.0, (double)f->done_iterations / f->opt.max_iterations);
    const double fraction = f->fraction_lo + (f->fraction_hi - f->fraction_lo) * part;
    const struct imp_progress p = {
        .size = sizeof p,
        .stage = "fit",
        .fraction = fraction,
        .elapsed_s = elapsed,
        .eta_s = fraction > 1e-3 ? elapsed * (1 - fraction) / fraction : -1,
        .rate = elapsed > 0 ? f->rays_done / elapsed : 0,
        .rate_unit = "rays",
        .note = f->note};
    return f->o->progress(&p, f->o->progress_payload) != 0;
}

enum imp_status imp__bend_fit_eval(const double *x, uint64_t seed, struct imp_estimate *e,
                                   double *g, double *g_se, void *payload)
{
    struct imp__bend_run *f = payload;
    (void)seed; /* the rays are fixed */
    enum imp_status st = imp__bend_fit_set(f, x);
    double value = 0;
    if (st != IMP_OK) return st;
    st = imp_bend_objective(f->b, &value, g ? f->bar : NULL, NULL, &f->stats);
    if (st == IMP_E_NUMERIC && f->o->optimizer == IMP_LBFGS && f->n_evaluated > 0) {
        value = INFINITY; /* every ray is lost: the line search takes a shorter step */
        st = IMP_OK;
    }
    if (st != IMP_OK) return st;
    f->n_evaluated++;
    f->rays_done += (double)f->b->n;
    f->last_value = value;
    if (value < f->best_value) f->best_value = value;
    *e = (struct imp_estimate){.value = value, .se = 0};
    for (size_t k = 0; g && k < f->goal.n; k++) g[k] = f->bar[f->at[k]];
    for (size_t k = 0; g_se && k < f->goal.n; k++) g_se[k] = 0;
    return IMP_OK;
}

/* Calls the caller's function after an iteration. True: the fit is to stop. */
static bool show_step(struct imp__bend_run *f, const struct imp__search *s)
{
    const struct imp_bend_fit_step step = {
        .size = sizeof step,
        .level = f->level,
        .levels = f->levels,
        .iteration = s->iteration,
        .value = s->n_history ? s->history[s->n_history - 1] : NAN};
    return f->o->step && imp__bend_fit_set(f, s->x) == IMP_OK &&
           f->o->step(&step, f->o->step_payload) != 0;
}

enum imp_status imp__bend_fit_iterated(const struct imp__search *s, void *payload)
{
    struct imp__bend_run *f = payload;
    f->done_iterations = s->iteration;
    const double now = imp__now();
    if (f->o->checkpoint && now - f->last_checkpoint_s > 5) {
        f->last_checkpoint_s = now;
        const enum imp_status st =
            imp__checkpoint_write(f->b->ctx, f->o->checkpoint, &f->print, s);
        if (st != IMP_OK) return st;
    }
    const bool stops = show_step(f, s);
    return imp__bend_fit_report(f, false) || stops
               ? imp__error(f->b->ctx, IMP_CANCELLED, "%s",
                            imp_status_text(IMP_CANCELLED))
               : IMP_OK;
}

void imp__bend_fit_smoothed(double *x, void *payload)
{
    struct imp__bend_run *f = payload;
    for (size_t k = 0; k < f->goal.n; k++) f->bar[f->at[k]] = x[k];
    imp__sobolev_apply(&f->metric, f->bar);
    for (size_t k = 0; k < f->goal.n; k++) x[k] = f->bar[f->at[k]];
}
