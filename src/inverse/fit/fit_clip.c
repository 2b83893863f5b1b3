/* SPDX-License-Identifier: Apache-2.0
 *
 * A fit with clipped values (clip.h). It begins with the weights without a picture:
 * clipped values have none. Where that search ends, pictures decide which of them count;
 * with other weights the search goes on, until they stay. The objective of each search
 * has weights that do not change, so no optimiser sees it jump. */
#include "base/arguments.h"
#include "censor.h"
#include "fit.h"
#include "walk/rules/features.h"
#include <string.h>

#define DECIDING_SEED 0x40000003
#define ROUNDS        5 /* of deciding and searching, at most; and at least: */
#define ROUNDS_PHOTO  2 /* of photographs, which are expanded about the pictures */
#define ADAM_SHARE    4 /* part of the first search's iterations that the next ones take */
#define STAYS         1e-3 /* part of the weights that may still change */

/* The next search: from the answer of the last, with its history. */
static enum imp_status follow(struct imp__fit *f, const struct imp__opt_options *o,
                              struct imp__search *last, struct imp__search **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = f->problem->ctx;
    struct imp__search *s = NULL;
    const size_t n = f->problem->n;
    double *x = imp__alloc_raw(ctx, 2 * n, sizeof *x), *start = x + n;
    if (!x) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu variables", n));
    for (size_t k = 0; k < n; k++) {
        x[k] = imp__search_answer(last, k);
        start[k] = imp__search_start(last, k);
    }
    const bool many = f->goal.spans != NULL; /* whose start is in their state */
    IMP_TRY(imp__search_create(&f->goal, f->options.optimizer, o, many ? start : x, &s));
    if (many) imp__search_move(&f->goal, s, x);
    else memcpy(s->start, start, n * sizeof *x);
    imp__search_take_history(s, last);
    s->history_x = last->history_x;
    s->cap_history_x = last->cap_history_x;
    last->history_x = NULL;
    last->cap_history_x = 0;
    *out = s;
out:
    imp__release(ctx, x);
    return st;
}

static enum imp_status decide(struct imp__fit *f, const struct imp__search *s, int round,
                              size_t *changed, size_t *numbers)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = f->problem->ctx;
    struct imp_run run = f->run;
    double *x = imp__alloc_raw(ctx, f->problem->n, sizeof *x);
    if (!x)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu variables", f->problem->n);
    for (size_t k = 0; k < f->problem->n; k++) x[k] = imp__search_answer(s, k);
    run.spp = imp__fit_spp(f);
    run.seed = imp__search_seed(&f->goal, DECIDING_SEED, round);
    IMP_TRY(imp_problem_set_x(f->problem, x));
    IMP_TRY(imp__censor(f->problem, &run, changed, numbers));
out:
    imp__release(ctx, x);
    return st;
}

enum imp_status imp__fit_clipped_begin(struct imp__fit *f)
{
    struct imp_run run = f->run;
    size_t changed, numbers;
    imp__clip_reset(f->problem);
    if (f->problem->near_searches == 0) return IMP_OK;
    run.spp = imp__fit_spp(f);
    run.seed = imp__search_seed(&f->goal, DECIDING_SEED, ROUNDS);
    return imp__censor(f->problem, &run, &changed, &numbers);
}

enum imp_status imp__fit_clipped(struct imp__fit *f, int round,
                                 struct imp__opt_options *o, struct imp__search **s,
                                 bool *again)
{
    struct imp__search *next = NULL;
    size_t changed, numbers;
    bool photographs = false;
    for (size_t t = 0; t < f->problem->n_targets; t++) {
        const struct imp__clip *c = f->problem->targets[t].clip;
        photographs |= c && c->base;
    }
    *again = false;
    const int near = f->problem->near_searches;
    if (!imp__problem_clips(f->problem) || round >= (near ? near - 1 : ROUNDS))
        return IMP_OK;
    IMP_CHECKED(decide(f, *s, round, &changed, &numbers));
    *again = (double)changed > STAYS * (double)numbers ||
             (photographs && round < (near ? 1 : ROUNDS_PHOTO));
    if (!*again) return IMP_OK;
    /* Adam takes all iterations that it may; the others end where they arrive. */
    if (f->options.optimizer == IMP_ADAM)
        o->max_iterations = imp_max(o->max_iterations / ADAM_SHARE, 1);
    o->max_iterations += (*s)->iteration;
    IMP_CHECKED(follow(f, o, *s, &next));
    imp__search_destroy(*s);
    *s = next;
    f->search = next;
    return IMP_OK;
}

enum imp_status imp__fit_clipped_allowed(const struct imp_problem *p,
                                         const struct imp_fit_options *o)
{
    struct imp_job job = {.ctx = p->ctx};
    if (imp__problem_clips(p)) imp__job_state(&job, IMP_HAS_CLIPPED_TARGET, NULL);
    if (o->checkpoint) imp__job_state(&job, IMP_HAS_CHECKPOINT, NULL);
    return imp__job_allowed(&job);
}
