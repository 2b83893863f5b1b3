/* SPDX-License-Identifier: Apache-2.0
 *
 * Methods with common random numbers (L-BFGS, MMA, SLSQP) evaluate one draw of walks many
 * times: the walks are recorded, and evaluated at other values without a ray. A new draw
 * is made when the effective sample size of n walks falls below REDRAW_ESS n
 * (walk/kept/store_weight.c), or an extinction leaves its headroom. The objective and the
 * intervals of an answer come from fresh walks (fit.c): the search has fitted the noise
 * of its own walks, whose errors would be too small. */
#include "base/team.h"
#include "fit.h"
#include "inverse/estimate/walks_make.h"
#include <stdio.h>

#define REDRAW_ESS     0.8  /* below: a new draw */
#define TRACED_ESS     0.5  /* below: the evaluation traces its own walks */
#define SURVIVAL       0.8  /* most that roulette's floor is */
#define SURVIVAL_LEAST 0.45 /* grey of .66 in a closed room */
#define ROOM           1.7 /* to which the second moment of a step may grow under the floor */
#define PILOT          2         /* samples of a pixel by which it is found, */
#define PILOT_SHARE    (1. / 16) /* of all at most */
#define MEMORY         ((size_t)1 << 30)

bool imp__fit_keeps(const struct imp__fit *f)
{
    const enum imp_optimizer o = f->options.optimizer;
    return (o == IMP_LBFGS || o == IMP_MMA || o == IMP_SLSQP) && !f->options.no_recording;
}

/* No walks are kept from here on; the last error is the reason that is reported. Where none ever
 * were, losses need not compare with theirs. */
static void give_up(struct imp__fit *f)
{
    imp__walks_destroy(f->walks);
    f->walks = NULL;
    if (f->draws == 0) f->problem->use = IMP_LOSS_SOUGHT;
    f->untaken =
        imp__arena_strdup(&f->problem->fit_arena, imp_last_error(f->problem->ctx));
}

/* May all active parameters change while walks are kept? */
static bool all_chosen(const struct imp_problem *p, const imp_walks *w)
{
    for (size_t k = 0; k < p->scene->n_params; k++)
        if (p->active.base[k] >= 0 && !w->chosen[k]) {
            imp__error(p->ctx, IMP_E_UNSUPPORTED,
                       "%s moves rays or collisions, so that walks are not kept",
                       p->scene->params[k].info.name);
            return false;
        }
    return true;
}

/* Roulette's floor, no higher than the scene needs: high ones make long walks, and each
 * evaluation pays for them. It is a bound of rho'^2, which a few walks estimate. */
static enum imp_status survival_find(struct imp__fit *f, const struct imp_run *run,
                                     const struct imp_walks_options *o,
                                     const uint8_t *sensors, const uint8_t *free,
                                     double *survival)
{
    struct imp_problem *p = f->problem;
    const double spp = imp__fit_spp(f);
    struct imp_run few = *run;
    imp_walks *pilot = NULL;
    double most = 0;
    *survival = SURVIVAL;
    if (run->guide || PILOT > PILOT_SHARE * spp) return IMP_OK;
    few.spp = PILOT;
    few.progress = NULL;
    enum imp_status st = imp__walks_make(p->scene, &few, o, sensors, free, &pilot);
    /* As if all had changed: growth is found for that, though densities stay. */
    for (size_t k = 0; st == IMP_OK && k < p->scene->n_params; k++)
        for (size_t e = 0; pilot->chosen[k] && e < p->scene->params[k].info.count; e++)
            pilot->theta[p->scene->params[k].info.offset + e] = NAN;
    for (int k = 0; st == IMP_OK && k < pilot->n_stores; k++) {
        struct imp_walks_weight w;
        st = imp__walks_weigh(pilot, &pilot->stores[k], NULL, 0, &w, NULL);
        most = fmax(most, w.growth);
    }
    if (st == IMP_OK && most > 0)
        *survival = imp_clamp(ROOM * SURVIVAL * most, SURVIVAL_LEAST, SURVIVAL);
    imp__walks_destroy(pilot);
    return st;
}

enum imp_status imp__fit_draw(const double *x, uint64_t seed, void *payload)
{
    struct imp__fit *f = payload;
    struct imp_problem *p = f->problem;
    struct imp_run run = f->run;
    struct imp_walks_options o = {.size = sizeof o,
                                  .memory =
                                      f->options.memory > 0 ? f->options.memory : MEMORY,
                                  .losses = 1,
                                  .survival = SURVIVAL,
                                  .headroom = f->options.headroom,
                                  .ess = -1}; /* imp__fit_take_walks checks it */
    imp__walks_destroy(f->walks);
    f->walks = NULL;
    f->stale = false;
    if (f->untaken) return IMP_OK;
    for (size_t t = 0; t < p->n_targets; t++)
        if (p->targets[t].n_parts > 0) {
            imp__error(p->ctx, IMP_E_UNSUPPORTED,
                       "walks are not kept of films with other than three response "
                       "curves");
            give_up(f);
            return IMP_OK;
        }
    const size_t n_sensors = (size_t)p->scene->n_sensors, n_params = p->scene->n_params;
    uint8_t *sensors = imp__alloc(p->ctx, n_sensors + n_params + 1, 1);
    if (!sensors) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for recorded walks");
    uint8_t *free = sensors + n_sensors;
    for (size_t k = 0; k < n_params; k++) free[k] = p->active.base[k] >= 0;
    for (size_t t = 0; t < p->n_targets; t++) sensors[p->targets[t].desc.sensor] = 1;
    run.seed = seed;
    enum imp_status st = imp_problem_set_x(p, x);
    if (st == IMP_OK) {
        st = survival_find(f, &run, &o, sensors, free, &o.survival);
        if (st == IMP_OK)
            st = imp__walks_make(p->scene, &run, &o, sensors, free, &f->walks);
        if (st == IMP_E_NOMEM || st == IMP_E_UNSUPPORTED ||
            (st == IMP_OK && !all_chosen(p, f->walks))) {
            give_up(f);
            st = IMP_OK;
        }
    }
    imp__release(p->ctx, sensors);
    /* A draw may fail on one rank alone, but all ranks must go on alike. */
    bool stopped, without;
    const enum imp_status asked = imp__team_any(p->ctx, st == IMP_CANCELLED, &stopped);
    if (asked != IMP_OK) return asked;
    if (stopped) st = IMP_CANCELLED;
    if (st == IMP_OK) st = imp__team_any(p->ctx, !f->walks, &without);
    if (st == IMP_OK && without && f->walks) {
        imp__error(p->ctx, IMP_E_NOMEM, "another rank keeps no walks");
        give_up(f);
    }
    if (st == IMP_CANCELLED) f->stopped = true;
    if (st != IMP_OK || !f->walks) return st;
    f->walks_seed = seed;
    f->walks_bytes = 0;
    for (int k = 0; k < f->walks->n_stores; k++)
        f->walks_bytes +=
            (double)f->walks->stores[k].bytes + (double)f->walks->stores[k].reduced_bytes;
    f->draws++;
    return IMP_OK;
}

bool imp__fit_is_stale(void *payload) { return ((struct imp__fit *)payload)->stale; }

enum imp_status imp__fit_take_walks(struct imp__fit *f, const double *x, uint64_t seed)
{
    double ess = 1;
    bool finite = true;
    f->run.walks = NULL;
    f->stale = false;
    if (!f->walks || seed != f->walks_seed) return IMP_OK;
    enum imp_status st = imp_problem_set_x(f->problem, x);
    for (int k = 0; k < f->walks->n_stores && st == IMP_OK; k++) {
        struct imp_walks_weight w;
        st = imp__walks_weigh(f->walks, &f->walks->stores[k], NULL, IMP_WALKS_ASKED, &w,
                              NULL);
        if (st == IMP_E_UNSUPPORTED) { /* an extinction is above its bounds */
            w.ess = 0;
            st = IMP_OK;
        }
        ess = fmin(ess, w.ess);
        finite &= imp__walks_finite(f->walks, &w);
    }
    if (st != IMP_OK) return st;
    f->stale = ess < REDRAW_ESS || !finite;
    if (ess < TRACED_ESS || !finite) {
        f->traced++;
        return IMP_OK;
    }
    f->evaluated++;
    f->run.walks = f->walks;
    return IMP_OK;
}

const char *imp__fit_walks_text(const struct imp__fit *f)
{
    char text[512];
    if (!imp__fit_keeps(f) || (f->draws == 0 && !f->untaken)) return NULL;
    if (f->untaken)
        snprintf(text, sizeof text, "every evaluation traced its walks: %s", f->untaken);
    else
        snprintf(text, sizeof text,
                 "%d of %d evaluations are of recorded walks, which were drawn %d time%s "
                 "(%.3g MB)",
                 f->evaluated, f->evaluated + f->traced, f->draws,
                 f->draws == 1 ? "" : "s", f->walks_bytes / 1e6);
    return imp__arena_strdup(&f->problem->fit_arena, text);
}
