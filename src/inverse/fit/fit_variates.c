/* SPDX-License-Identifier: Apache-2.0
 *
 * Control variates of a fit by Adam (variate.h), used in the search where they are
 * possible; intervals and the loss of the answer are of fresh walks. Checkpoints contain
 * their state and that of the allocation. */
#include "base/team.h"
#include "fit.h"
#include "inverse/gradient/variate.h"
#include <stdio.h>
#include <string.h>

enum imp_status imp__fit_variates(struct imp__fit *f)
{
    const struct imp_problem *p = f->problem;
    const enum imp_variates wanted = f->options.control_variate;
    const bool asked = wanted == IMP_VARIATES_ON;
    enum imp_status st = IMP_OK;
    bool without;
    if ((unsigned)wanted > IMP_VARIATES_OFF)
        return imp__error(p->ctx, IMP_E_ARG, "options: control_variate %d does not exist",
                          (int)wanted);
    if (wanted == IMP_VARIATES_OFF) return IMP_OK;
    if (!asked && (f->options.optimizer != IMP_ADAM || p->n <= IMP_TRAIL_MAX))
        return IMP_OK;
    if (f->options.optimizer != IMP_ADAM) {
        return imp__error(p->ctx, IMP_E_UNSUPPORTED,
                          "control variate: it is for Adam; other optimisers take few "
                          "and long steps, or evaluate one draw of walks");
    }
    st = imp__variate_create(p, &f->run, &f->variate);
    if (!asked && (st == IMP_E_UNSUPPORTED || st == IMP_E_NOMEM)) {
        /* The arena of the last fit's answer is released before this one begins. */
        snprintf(f->without_variate, sizeof f->without_variate, "%s",
                 imp_last_error(p->ctx));
        st = IMP_OK;
    }
    /* Memory may be short on one rank alone, but all ranks must go on alike, or fail. */
    const enum imp_status heard = imp__team_any(p->ctx, !f->variate, &without);
    if (st == IMP_OK) st = heard;
    if (st != IMP_OK || !without || !f->variate) return st;
    if (asked)
        return imp__error(p->ctx, IMP_E_NOMEM,
                          "control variate: another rank has no memory for it");
    imp__variate_destroy(f->variate);
    f->variate = NULL;
    snprintf(f->without_variate, sizeof f->without_variate,
             "control variate: another rank has none");
    return IMP_OK;
}

/* ---- Checkpoints ------------------------------------------------------------------ */

static size_t variate_numbers(const struct imp__fit *f)
{
    return f->variate ? imp__variate_numbers(f->variate, f->problem) : 0;
}

static size_t allocation_numbers(const struct imp__fit *f)
{
    return f->allocation.n > 0 ? imp__allocation_numbers(&f->allocation) : 0;
}

/* Room for the numbers of the variate, then those of the allocation, in a search that is written
 * or read. */
static enum imp_status state_begin(const struct imp__fit *f, struct imp__search *s)
{
    s->n_goal = variate_numbers(f) + allocation_numbers(f);
    if (s->n_goal == 0) return IMP_OK;
    s->goal_numbers = imp__alloc_raw(f->problem->ctx, s->n_goal, sizeof *s->goal_numbers);
    if (s->goal_numbers) return IMP_OK;
    s->n_goal = 0;
    return imp__error(f->problem->ctx, IMP_E_NOMEM, "no memory for a checkpoint");
}

static void state_end(const struct imp__fit *f, struct imp__search *s)
{
    imp__release(f->problem->ctx, s->goal_numbers);
    s->goal_numbers = NULL;
    s->n_goal = 0;
}

enum imp_status imp__fit_checkpoint_write(const struct imp__fit *f,
                                          const struct imp__search *search)
{
    struct imp__search s = *search;
    enum imp_status st = state_begin(f, &s);
    if (st != IMP_OK) return st;
    if (f->variate) imp__variate_save(f->variate, f->problem, s.goal_numbers);
    if (f->allocation.n > 0)
        memcpy(s.goal_numbers + variate_numbers(f), f->allocation.state,
               allocation_numbers(f) * sizeof *s.goal_numbers);
    st = imp__checkpoint_write(f->problem->ctx, f->options.checkpoint, &f->fingerprint,
                               &s);
    state_end(f, &s);
    return st;
}

enum imp_status imp__fit_checkpoint_read(struct imp__fit *f, struct imp__search *s,
                                         bool *found)
{
    enum imp_status st = state_begin(f, s);
    if (st != IMP_OK) return st;
    st = imp__checkpoint_read(f->problem->ctx, f->options.checkpoint, &f->fingerprint,
                              &f->goal, s, found);
    if (st == IMP_OK && *found) {
        if (f->variate) imp__variate_restore(f->variate, f->problem, s->goal_numbers);
        if (f->allocation.n > 0) {
            memcpy(f->allocation.state, s->goal_numbers + variate_numbers(f),
                   allocation_numbers(f) * sizeof *f->allocation.state);
            imp__allocation_place(&f->allocation);
        }
    }
    state_end(f, s);
    return st;
}

/* ---- What it brought -------------------------------------------------------------- */

const char *imp__fit_variate_text(const struct imp__fit *f)
{
    char text[160];
    if (f->options.control_variate == IMP_VARIATES_OFF) return NULL;
    if (f->without_variate[0])
        return imp__arena_strdup(&f->problem->fit_arena, f->without_variate);
    if (!f->variate || f->variate->evaluations < 2) return NULL;
    snprintf(
        text, sizeof text,
        "control variate: at the end, the pictures that residuals are taken from had "
        "1/%.3g of the variance of an iteration's samples",
        imp__variate_gain(f->variate));
    return imp__arena_strdup(&f->problem->fit_arena, text);
}
