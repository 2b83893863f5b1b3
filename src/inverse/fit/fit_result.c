/* SPDX-License-Identifier: Apache-2.0
 *
 * The result that a fit leaves with its problem, and the values at its start. Rows of 48
 * bytes for millions of values would take more memory than the fit: they are made on
 * request, from the search, which is kept. */
#include "base/arguments.h"
#include "fit.h"
#include "inverse/estimate/replicates.h"
#include "math/linalg.h"
#include "search/covariance.h"
#include <math.h>
#include <string.h>

/* ---- Where it began ------------------------------------------------------------ */

/* Are the block's values kept in doubles? */
static bool is_double(const struct imp_problem *p, const struct imp__block *b)
{
    return p->scene->params[b->param].store != IMP_STORE_BULK;
}
static size_t many_doubles(const struct imp_problem *p)
{
    size_t n = 0;
    for (size_t k = 0; k < p->n_blocks; k++)
        n += is_double(p, &p->blocks[k]) ? p->blocks[k].count : 0;
    return n;
}

enum imp_status imp__fit_start_keep(const struct imp_problem *p, bool many, double **out)
{
    size_t used = 0;
    double *start = imp__alloc_raw(p->ctx, many ? many_doubles(p) : p->n, sizeof *start);
    if (!start)
        return imp__error(p->ctx, IMP_E_NOMEM, "no memory for %zu variables", p->n);
    *out = start;
    if (!many) {
        imp_problem_get_x(p, start);
        return IMP_OK;
    }
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp__block *b = &p->blocks[k];
        for (size_t e = 0; is_double(p, b) && e < b->count; e++)
            start[used++] = imp__block_get(p, b, e);
    }
    return IMP_OK;
}

void imp__fit_start_restore(struct imp_problem *p, bool many, const double *start,
                            struct imp__search *s)
{
    size_t used = 0;
    if (!many) {
        (void)!imp_problem_set_x(p, start);
        return;
    }
    for (size_t k = 0; k < p->n; k++) s->x[k] = imp__search_start(s, k);
    for (size_t k = 0; k < p->n_blocks; k++) {
        const struct imp__block *b = &p->blocks[k];
        for (size_t e = 0; is_double(p, b) && e < b->count; e++)
            s->x[b->first + e] = start[used++];
    }
    (void)!imp_problem_set_x(p, s->x);
}

/* ---- Its answer ---------------------------------------------------------------- */

/* One entry per active parameter. Values kept in doubles start at `start`; those of
 * textures where the search does, which has them as floats. */
static enum imp_status blocks_make(struct imp__fit *f, const double *start)
{
    struct imp_problem *p = f->problem;
    struct imp__fit_answer *a = &p->fit_answer;
    const bool many = f->spans != NULL;
    a->blocks = imp__arena_array(&p->fit_arena, p->n_blocks, sizeof *a->blocks);
    double *kept =
        many ? imp__arena_array(&p->fit_arena, many_doubles(p) + 1, sizeof *kept) : NULL;
    if (!a->blocks || (many && !kept))
        return imp__error(p->ctx, IMP_E_NOMEM, "no memory for the result of a fit");
    for (size_t b = 0; b < p->n_blocks; b++) {
        const struct imp__block *own = &p->blocks[b];
        const bool doubles = many && is_double(p, own);
        a->blocks[b] = (struct imp__fit_block){.first = own->first,
                                               .lo = own->lo,
                                               .hi = own->hi,
                                               .log = own->log,
                                               .start = doubles ? kept : NULL};
        for (size_t e = 0; doubles && e < own->count; e++) *kept++ = *start++;
    }
    a->n_blocks = p->n_blocks;
    return IMP_OK;
}

/* One of many variables: error and interval by drawn vectors, in the units of x. */
static void error_of(const struct imp__fit_block *b, double x, double se,
                     struct imp_fit_variable *v)
{
    const double lo = imp_clamp(x - IMP_ERROR_T * se, b->lo, b->hi);
    const double hi = imp_clamp(x + IMP_ERROR_T * se, b->lo, b->hi);
    v->determined = !isnan(se) || v->at_bound != 0;
    if (isnan(se)) return;
    v->se = se * (b->log ? exp(x) : 1);
    v->lo95 = b->log ? exp(lo) : lo;
    v->hi95 = b->log ? exp(hi) : hi;
}

/* The row of a value, without standard error and interval where those are of matrices. */
static struct imp_fit_variable variable_of(const struct imp_problem *p, size_t i)
{
    const struct imp__fit_answer *a = &p->fit_answer;
    size_t at = 0, end = a->n_blocks;
    while (end - at > 1) { /* the last block that begins at i or before */
        const size_t middle = at + (end - at) / 2;
        if (a->blocks[middle].first <= i) at = middle;
        else end = middle;
    }
    const struct imp__fit_block *b = &a->blocks[at];
    const double x = a->search->x[i];
    const double start =
        b->start ? b->start[i - b->first] : imp__search_start(a->search, i);
    struct imp_fit_variable v = {.size = sizeof v,
                                 .start = b->log ? exp(start) : start,
                                 .value = b->log ? exp(x) : x,
                                 .se = NAN,
                                 .lo95 = NAN,
                                 .hi95 = NAN,
                                 .at_bound = x <= b->lo   ? -1
                                             : x >= b->hi ? 1
                                                          : 0,
                                 .determined = 1}; /* until a covariance shows the
                                                      contrary */
    if (a->se) error_of(b, x, a->se[i], &v);
    const struct imp__block *own = imp__problem_block(p, i);
    if (!imp__block_held(p, own, i - own->first)) return v;
    v.se = v.at_bound = 0;
    v.lo95 = v.hi95 = v.value;
    v.determined = 1;
    return v;
}

enum imp_status imp_problem_get_fit_variable(const imp_problem *p, size_t i,
                                             struct imp_fit_variable *variable)
{
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, variable, "variable");
    IMP_SIZED(p->ctx, variable, "variable");
    const struct imp__fit_answer *a = &p->fit_answer;
    if (i >= a->n)
        return imp__error(p->ctx, IMP_E_ARG,
                          a->n ? "there is no number i = %zu in the last fit (it has %zu)"
                               : "number i = %zu: there is no fit yet",
                          i, a->n);
    const struct imp_fit_variable all = a->rows ? a->rows[i] : variable_of(p, i);
    IMP_GIVE(p->ctx, variable, all, "variable");
    return IMP_OK;
}

/* The nearest matrix without negative eigenvalues, in place. */
static enum imp_status clip_negative(imp_context *ctx, size_t n, double *matrix)
{
    enum imp_status st = IMP_OK;
    double *values = imp__alloc(ctx, n, sizeof *values);
    double *vectors = imp__alloc(ctx, n * n, sizeof *vectors);
    if (!values || !vectors)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance"));
    if (!imp__eigen_symmetric(n, matrix, values, vectors))
        IMP_TRY(imp__error(ctx, IMP_E_NUMERIC, "no eigenvalues of a covariance"));
    memset(matrix, 0, n * n * sizeof *matrix);
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; values[k] > 0 && i < n; i++)
            for (size_t j = 0; j < n; j++)
                matrix[i * n + j] += values[k] * vectors[k * n + i] * vectors[k * n + j];
out:
    imp__release(ctx, values);
    imp__release(ctx, vectors);
    return st;
}

/* Covariance by both sources of error, measurement and Monte Carlo. Each element is an
 * unbiased estimate, so the matrix may have negative eigenvalues, and correlations beyond
 * 1: these are clipped, and the matrix is rescaled to the variances of the intervals
 * (rows). */
static enum imp_status covariance_give(struct imp__fit *f,
                                       const struct imp__uncertainty *u,
                                       const struct imp_fit_variable *rows,
                                       const double *x, const double **out)
{
    const size_t n = u->n;
    if (!n) return IMP_OK;
    double *sum = imp__arena_array(&f->problem->fit_arena, n * n, sizeof *sum);
    double *by = imp__arena_array(&f->problem->fit_arena, n, sizeof *by);
    if (!sum || !by)
        return imp__error(f->problem->ctx, IMP_E_NOMEM, "no memory for a covariance");
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) /* rounding leaves the halves a bit apart */
            sum[i * n + j] =
                0.5 * (u->measurement[i * n + j] + u->monte_carlo[i * n + j] +
                       u->measurement[j * n + i] + u->monte_carlo[j * n + i]);
    IMP_CHECKED(clip_negative(f->problem->ctx, n, sum));
    for (size_t k = 0; k < n; k++) {
        const double variance = sum[k * n + k];
        by[k] = variance > 0 && isfinite(rows[k].se) ? rows[k].se / sqrt(variance) : 1;
        if (imp__problem_block(f->problem, k)->log) by[k] *= exp(x[k]);
    }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) sum[i * n + j] *= by[i] * by[j];
    *out = sum;
    return IMP_OK;
}

/* In units of x; NULL where all values are determined. */
static enum imp_status loosest_give(struct imp__fit *f, const struct imp__uncertainty *u,
                                    bool missing, const double **out)
{
    if (!u->n || !missing) return IMP_OK;
    double *change = imp__arena_array(&f->problem->fit_arena, u->n, sizeof *change);
    if (!change)
        return imp__error(f->problem->ctx, IMP_E_NOMEM,
                          "no memory for the result of a fit");
    for (size_t i = 0; i < u->n; i++) change[i] = u->loosest[i] * f->scale[i];
    *out = change;
    return IMP_OK;
}

static int spp_taken(const struct imp__fit *f)
{
    const struct imp_problem *p = f->problem;
    int most = 0;
    for (size_t t = 0; t < p->n_targets; t++) {
        const struct imp__replicates r =
            f->options.optimizer == IMP_LM
                ? imp__replicates_normal(p->scene, &p->targets[t], &f->outer, 1)
                : imp__replicates_loss(p, &p->targets[t], &f->outer);
        most = imp_max(most, r.n * r.R);
    }
    return most;
}

enum imp_status imp__fit_answer(struct imp__fit *f, struct imp__search *s,
                                struct imp_estimate objective,
                                const struct imp__uncertainty *u,
                                struct imp_fit_variable *rows, const double *start,
                                const char *why, const struct imp__fit_shift *shift,
                                const struct imp_fit_result **out)
{
    struct imp_arena *arena = &f->problem->fit_arena;
    struct imp__fit_answer *answer = &f->problem->fit_answer;
    const size_t n = f->problem->n;
    size_t determined = n - imp__held_count(f->problem);
    bool missing = f->errors.x && f->errors.n_loose > 0;
    struct imp_fit_result *r = imp__arena_array(arena, 1, sizeof *r);
    const size_t n_trail = imp__search_trail(s);
    double *history =
        imp__arena_array(arena, 2 * s->n_history + n_trail + 1, sizeof *history);

    if (!r || !history)
        return imp__error(f->problem->ctx, IMP_E_NOMEM,
                          "no memory for the result of a fit");
    const double *covariance = NULL;
    IMP_CHECKED(covariance_give(f, u, rows, s->x, &covariance));
    *answer = (struct imp__fit_answer){.search = s};
    enum imp_status st = blocks_make(f, start);
    if (st == IMP_OK && f->errors.x) {
        double *se = imp__arena_array(arena, n, sizeof *se);
        if (se) memcpy(se, f->errors.se, n * sizeof *se);
        else st = imp__error(f->problem->ctx, IMP_E_NOMEM, "no memory for %zu errors", n);
        answer->se = se;
        determined -= f->errors.n_loose;
    }
    if (st != IMP_OK) {
        answer->search = NULL; /* the caller's */
        return st;
    }
    for (size_t k = 0; rows && k < n; k++) {
        const struct imp_fit_variable known = rows[k];
        rows[k] = variable_of(f->problem, k);
        if (!u->n) continue;
        const bool log = imp__problem_block(f->problem, k)->log;
        rows[k].se = known.se * (log ? rows[k].value : 1);
        rows[k].lo95 = log ? exp(known.lo95) : known.lo95;
        rows[k].hi95 = log ? exp(known.hi95) : known.hi95;
        rows[k].determined = known.determined;
        determined -= !known.determined;
        missing |= !known.determined;
    }
    const double *loosest = NULL;
    IMP_CHECKED(loosest_give(f, u, missing, &loosest));
    if (s->n_history > 0) {
        memcpy(history, s->history, s->n_history * sizeof *history);
        memcpy(history + s->n_history, s->history_se, s->n_history * sizeof *history);
        if (n_trail > 0)
            memcpy(history + 2 * s->n_history, s->history_x, n_trail * sizeof *history);
    }
    const struct imp__fit_residual left =
        imp__fit_residual(f, s->x, objective, determined);
    *r = (struct imp_fit_result){
        .size = sizeof *r,
        .iterations = s->iteration,
        .objective = objective,
        .n_history = s->n_history,
        .history = history,
        .history_se = history + s->n_history,
        .history_x = n_trail ? history + 2 * s->n_history : NULL,
        .n = n,
        .variables = rows,
        .condition = u->condition,
        .own_part = u->n ? u->own_part : NAN,
        .reason = !f->stopped                                       ? s->reason
                  : f->deadline_s > 0 && imp__now() > f->deadline_s ? "time limit reached"
                                                                    : "cancelled",
        .warning = imp__fit_warning(f, objective.bias_order, rows, u, why, &left, shift),
        .shift = shift->of_se >= 0 ? shift->of_se : NAN,
        .spp = spp_taken(f),
        .residual = left.relative,
        .residual_hi = left.relative_hi,
        .chi2 = left.chi2,
        .chi2_se = left.chi2_se,
        .covariance = covariance,
        .loosest = loosest,
        .walks = imp__fit_walks_text(f),
        .control_variate = imp__fit_variate_text(f)};
    answer->n = n;
    answer->rows = rows;
    if (rows) answer->search = NULL; /* every row is filled */
    *out = r;
    return IMP_OK;
}
