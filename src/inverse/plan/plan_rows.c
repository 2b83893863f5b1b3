/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows of a plan: the gain of each candidate with its standard error, and groups without a
 * significant difference. */
#include "plan_rows.h"
#include "inverse/problem/problem.h"
#include <math.h>
#include <stdlib.h>

#define APART 2.5 /* standard errors of a difference that is significant */

enum imp_status imp__plan_errors(const struct imp__plan_work *plan, const double *C,
                                 const double **out)
{
    const size_t n = plan->n;
    double *se = imp__arena_array(plan->arena, n, sizeof *se);
    if (!se) return imp__error(plan->p->ctx, IMP_E_NOMEM, "no memory for a plan");
    for (size_t k = 0; k < n; k++) {
        const double part = sqrt(C[k * n + k]);
        se[k] = !plan->given[k] && part * part > 1. / (1 + IMP_PLAN_LOOSE)
                    ? INFINITY
                    : part * plan->width[k] * plan->unit[k];
        if (plan->held[k]) se[k] = 0;
    }
    *out = se;
    return IMP_OK;
}

/* Matrices from the units of the priors to those of x; power -1: informations; 1: pulls. */
static enum imp_status matrix_give(const struct imp__plan_work *plan, const double *A,
                                   int power, const double **out)
{
    const size_t n = plan->n;
    double *B = imp__arena_array(plan->arena, n * n, sizeof *B);
    if (!B) return imp__error(plan->p->ctx, IMP_E_NOMEM, "no memory for a plan");
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) {
            const double units = plan->width[k] * plan->width[l];
            B[k * n + l] = power > 0 ? A[k * n + l] * units : A[k * n + l] / units;
        }
    *out = B;
    return IMP_OK;
}

/* What the deviations of a candidate, and of what we have, do to its worth. */
struct moves {
    double own[IMP_DEVIATIONS], hidden;
    double *have; /* [n_have][IMP_DEVIATIONS] */
};

static enum imp_status moves_find(const struct imp__plan_work *plan,
                                  const struct imp__plan_data *item, double cost,
                                  struct moves *m)
{
    const size_t n = plan->n;
    m->have = imp__alloc(plan->p->ctx, plan->n_have * IMP_DEVIATIONS + 1, sizeof(double));
    if (!m->have) return imp__error(plan->p->ctx, IMP_E_NOMEM, "no memory for a plan");
    imp__plan_deviations(n, plan->then.pull, item, m->own);
    for (int g = 0; g < IMP_DEVIATIONS; g++) m->own[g] /= cost;
    m->hidden = plan->then.hidden / cost;
    for (size_t i = 0; i < plan->n_have; i++) {
        double before[IMP_DEVIATIONS], *after = m->have + i * IMP_DEVIATIONS;
        imp__plan_deviations(n, plan->today.pull, plan->have[i], before);
        imp__plan_deviations(n, plan->then.pull, plan->have[i], after);
        for (int g = 0; g < IMP_DEVIATIONS; g++) after[g] = (after[g] - before[g]) / cost;
    }
    return IMP_OK;
}

/* Variance of the worth, or of the difference of two. */
static double moves_variance(const struct imp__plan_work *plan, const struct moves *a,
                             const struct moves *b)
{
    double sum = imp__sqr(a->hidden) + (b ? imp__sqr(b->hidden) : 0);
    for (int g = 0; g < IMP_DEVIATIONS; g++)
        sum += imp__sqr(a->own[g]) + (b ? imp__sqr(b->own[g]) : 0);
    for (size_t i = 0; i < plan->n_have * IMP_DEVIATIONS; i++)
        sum += imp__sqr(a->have[i] - (b ? b->have[i] : 0));
    return sum;
}

static enum imp_status row_make(struct imp__plan_work *plan, size_t k,
                                struct imp_plan_row *row, struct moves *moves)
{
    enum imp_status st = IMP_OK;
    const size_t n = plan->n;
    const struct imp__plan_data *d = plan->open[k];
    double *error = plan->then.work;
    plan->have[plan->n_have] = d; /* there is room for one more */
    IMP_TRY(imp__plan_evaluate(&plan->model, plan->have, plan->n_have + 1, &plan->then));
    IMP_TRY(moves_find(plan, d, plan->cost[k], moves));
    const double gain = plan->then.phi - plan->today.phi;
    const double se = hypot(sqrt(moves_variance(plan, moves, NULL)),
                            plan->today.hidden / plan->cost[k]);
    *row = (struct imp_plan_row){.size = sizeof *row,
                                 .candidate = plan->open_at[k],
                                 .gain = {gain, se * plan->cost[k], 1},
                                 .worth = {gain / plan->cost[k], se, 1},
                                 .lit = d->lit};
    IMP_TRY(imp__plan_errors(plan, plan->then.C, &row->se));
    IMP_TRY(matrix_give(plan, d->H, -1, &row->information));
    IMP_TRY(matrix_give(plan, plan->then.pull, 1, &row->pull));
    for (size_t i = 0; i < n * n; i++) {
        error[i] = 0;
        for (size_t g = 0; g < IMP_DEVIATIONS; g++)
            error[i] += imp__sqr(d->deviations[g * n * n + i]);
        error[i] = sqrt(error[i]);
    }
    IMP_TRY(matrix_give(plan, error, -1, &row->information_se));
out:
    return st;
}

struct ranked {
    double worth;
    size_t at;
};
static int by_worth(const void *a, const void *b)
{
    const struct ranked *x = a, *y = b;
    if (x->worth != y->worth) return x->worth > y->worth ? -1 : 1;
    return x->at < y->at ? -1 : x->at > y->at;
}

enum imp_status imp__plan_rows(struct imp__plan_work *plan, struct imp_plan_result *r)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = plan->p->ctx;
    const size_t n = plan->n_open;
    struct imp_plan_row *made = imp__alloc(ctx, n, sizeof *made);
    struct ranked *order = imp__alloc(ctx, n, sizeof *order);
    struct moves *moves = imp__alloc(ctx, n, sizeof *moves);
    struct imp_plan_row *rows = imp__arena_array(plan->arena, n, sizeof *rows);
    if (!made || !order || !moves || !rows)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a plan"));
    for (size_t k = 0; k < n; k++) {
        IMP_TRY(row_make(plan, k, &made[k], &moves[k]));
        order[k] = (struct ranked){made[k].worth.value, k};
    }
    qsort(order, n, sizeof *order, by_worth);
    size_t first = 0, group = 0;
    for (size_t i = 0; i < n; i++) {
        const size_t k = order[i].at, f = order[first].at;
        const double apart = order[first].worth - order[i].worth;
        const double se = sqrt(moves_variance(plan, &moves[f], &moves[k]));
        if (i > 0 && apart > APART * se) {
            group++;
            first = i;
        }
        rows[i] = made[k];
        rows[i].group = group;
    }
    r->rows = rows;
    r->n_rows = n;
out:
    for (size_t k = 0; moves && k < n; k++) imp__release(ctx, moves[k].have);
    imp__release(ctx, moves);
    imp__release(ctx, made);
    imp__release(ctx, order);
    return st;
}
