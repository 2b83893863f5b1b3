/* SPDX-License-Identifier: Apache-2.0
 *
 * State that all optimisers share: arrays, log, seeds, and the choice of the method. */
#include "optimize.h"
#include "adam_many.h"
#include "math/rng.h"
#include <math.h>
#include <string.h>

static const struct imp__opt_kind *kind_of(enum imp_optimizer kind)
{
    switch (kind) {
    case IMP_ADAM: return &imp__opt_adam;
    case IMP_LM: return &imp__opt_lm;
    case IMP_LBFGS:
    case IMP_MMA:
    case IMP_SLSQP: return &imp__opt_nlopt;
    }
    return NULL;
}

enum imp_status imp__search_create(const struct imp__goal *goal, enum imp_optimizer kind,
                                   const struct imp__opt_options *options,
                                   const double *x0, struct imp__search **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = goal->ctx;
    struct imp__search *s = NULL;

    if (!kind_of(kind))
        return imp__error(ctx, IMP_E_ARG, "optimizer %d does not exist", kind);
    s = imp__alloc(ctx, 1, sizeof *s);
    if (!s) return imp__error(ctx, IMP_E_NOMEM, "no memory for an optimiser");
    s->ctx = ctx;
    s->kind = kind;
    s->n = goal->n;
    s->x = imp__alloc(ctx, imp_max(goal->n, (size_t)1), sizeof *s->x);
    const bool many = goal->spans != NULL;
    if (!many) s->start = imp__alloc(ctx, imp_max(goal->n, (size_t)1), sizeof *s->start);
    if (!s->x || (!many && !s->start))
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu variables", goal->n));
    for (size_t k = 0; k < goal->n; k++) s->x[k] = imp__into_bounds(goal, k, x0[k]);
    if (!many) memcpy(s->start, s->x, goal->n * sizeof *s->x);
    IMP_TRY(kind_of(kind)->init(goal, options, s));
    *out = s;
    return IMP_OK;
out:
    imp__search_destroy(s);
    return st;
}

void imp__search_destroy(struct imp__search *s)
{
    if (!s) return;
    for (int k = 0; k < IMP_SEARCH_ARRAYS; k++) imp__release(s->ctx, s->array[k]);
    imp__release(s->ctx, s->history);
    imp__release(s->ctx, s->history_se);
    imp__release(s->ctx, s->history_x);
    imp__release(s->ctx, s->start);
    imp__release(s->ctx, s->x);
    imp__release(s->ctx, s);
}

enum imp_status imp__optimize(const struct imp__goal *goal,
                              const struct imp__opt_options *options,
                              struct imp__search *s)
{
    if (s->finished) return IMP_OK;
    const enum imp_status st = kind_of(s->kind)->run(goal, options, s);
    /* The average that Adam answers with is as good as its iterations are many. */
    if (st == IMP_OK && !s->finished)
        s->reason =
            s->kind == IMP_ADAM ? "all iterations are done" : "iteration limit reached";
    return st;
}

void imp__search_finish(struct imp__search *s, enum imp__finish why)
{
    static const char *const reasons[IMP_FINISH_KINDS] = {
        [IMP_FINISH_STEPS] = "steps stay below the tolerance",
        [IMP_FINISH_NOISE] = "the gradient is within its noise",
        [IMP_FINISH_LOWEST] = "no step lowers the objective further",
        [IMP_FINISH_BOUNDED] = "no variable has an effect inside its bounds"};
    s->finished = why;
    s->reason = reasons[why];
}

double imp__search_start(const struct imp__search *s, size_t k)
{
    return s->start ? s->start[k] : imp__adam_many_start(s, k);
}
double imp__search_answer(const struct imp__search *s, size_t k)
{
    return s->start ? s->x[k] : imp__adam_many_answer(s, k);
}

void imp__search_settle(struct imp__search *s)
{
    if (!s->start) imp__adam_many_settle(s);
}

enum imp_status imp__search_exact(struct imp__search *s, int k, size_t n)
{
    s->array[k] = imp__alloc(s->ctx, n, sizeof *s->array[k]);
    if (!s->array[k])
        return imp__error(s->ctx, IMP_E_NOMEM,
                          "no memory for %zu numbers of an optimiser's state", n);
    s->array_n[k] = s->array_cap[k] = n;
    return IMP_OK;
}

enum imp_status imp__search_array(struct imp__search *s, int k, size_t n)
{
    double *grown = imp__grow(s->ctx, s->array[k], &s->array_cap[k],
                              imp_max(n, (size_t)1), sizeof *grown);
    if (!grown)
        return imp__error(s->ctx, IMP_E_NOMEM,
                          "no memory for %zu numbers of an "
                          "optimiser's state",
                          n);
    s->array[k] = grown;
    s->array_n[k] = n;
    return IMP_OK;
}

enum imp_status imp__search_carry(const struct imp__search *old,
                                  const struct imp__carry *carry, struct imp__search *s)
{
    const struct imp__opt_kind *kind = kind_of(s->kind);
    return kind && kind->carry && old->kind == s->kind ? kind->carry(old, carry, s)
                                                       : IMP_OK;
}

enum imp_status imp__search_log(struct imp__search *s, struct imp_estimate f,
                                const double *x)
{
    const size_t n = imp__search_trails(s) ? s->n : 0;
    double *h =
        imp__grow(s->ctx, s->history, &s->cap_history, s->n_history + 1, sizeof *h);
    if (h) s->history = h;
    double *e =
        imp__grow(s->ctx, s->history_se, &s->cap_history_se, s->n_history + 1, sizeof *e);
    if (e) s->history_se = e;
    double *trail = n ? imp__grow(s->ctx, s->history_x, &s->cap_history_x,
                                  (s->n_history + 1) * n, sizeof *trail)
                      : NULL;
    if (trail) s->history_x = trail;
    if (!h || !e || (n && !trail))
        return imp__error(s->ctx, IMP_E_NOMEM, "no memory for the loss history");
    if (n) memcpy(trail + s->n_history * n, x, n * sizeof *x);
    h[s->n_history] = f.value;
    e[s->n_history++] = f.se;
    return IMP_OK;
}

enum imp_status imp__search_iterated(const struct imp__goal *goal, struct imp__search *s)
{
    s->iteration++;
    return goal->iterated ? goal->iterated(s, goal->payload) : IMP_OK;
}

void imp__search_move(const struct imp__goal *goal, struct imp__search *s,
                      const double *x)
{
    for (size_t k = 0; k < s->n; k++) s->x[k] = imp__into_bounds(goal, k, x[k]);
    if (!imp__adam_is_many(goal)) imp__adam_moved(s);
}

void imp__search_take_history(struct imp__search *s, struct imp__search *from)
{
    imp__release(s->ctx, s->history);
    imp__release(s->ctx, s->history_se);
    s->history = from->history, s->history_se = from->history_se;
    s->n_history = from->n_history;
    s->cap_history = from->cap_history, s->cap_history_se = from->cap_history_se;
    s->iteration = from->iteration;
    from->history = from->history_se = NULL;
    from->n_history = from->cap_history = from->cap_history_se = 0;
}

uint64_t imp__search_seed(const struct imp__goal *goal, int i, int k)
{
    return imp__mix64(imp__mix64(goal->seed + 0x9e3779b97f4a7c15u) + 64 * (uint64_t)i +
                      (uint64_t)k);
}

enum imp_status imp__normal_create(imp_context *ctx, size_t n, bool deviate,
                                   struct imp__normal *out)
{
    struct imp__normal m = {0};
    const size_t nn = n * n;
    double *all =
        imp__alloc(ctx, (deviate ? 6 + IMP_DEVIATIONS : 6) * nn + n, sizeof *all);
    if (!all)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu x %zu matrices", n, n);
    m.H = all;
    m.H_same = all + nn;
    m.H_prior = all + 2 * nn;
    m.cov_g = all + 3 * nn;
    m.H_meas = all + 4 * nn;
    m.cov_excess = all + 5 * nn;
    m.g = all + 6 * nn;
    if (deviate) m.deviations = m.g + n;
    *out = m;
    return IMP_OK;
}

void imp__normal_destroy(imp_context *ctx, struct imp__normal *m)
{
    imp__release(ctx, m->H);
    *m = (struct imp__normal){0};
}
