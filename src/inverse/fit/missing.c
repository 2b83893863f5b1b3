/* SPDX-License-Identifier: Apache-2.0
 *
 * Which parameter value that is not fitted may be wrong? Where the active values a are
 * fitted, the loss J has the gradient g = J^T W r with respect to all values and the
 * Gauss-Newton matrix H = J^T W J, both unbiased (docs/estimators.md 15.1). With the
 * active ones free to follow, a value j has the score, its noise and its information
 *
 *     score  s_j = g_j - b^T g_a,         b = H_aa^-1 H_aj
 *     noise  V_j = (e_j - b)^T (J^T W Sigma W J + Cov g) (e_j - b)
 *     S_j = H_jj - H_ja b
 *
 * Moved by -s_j/S_j, it would lower the loss by s_j^2/(2 S_j); in units of the pictures'
 * noise, which with weights 1/sigma^2 are those of chi^2, by s_j^2/V_j of the measurement
 * alone (the score test: Rao 1948). One sweep gives the scores of all values; those
 * largest in units of their Monte Carlo noise have Gauss-Newton rows. */
#include "base/arguments.h"
#include "inverse/estimate/replicates.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/problem/problem.h"
#include "math/linalg.h"
#include "math/rng.h"
#include "scene/pose.h"
#include "search/optimize.h"
#include "walk/run/run.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ROWS       20 /* values with Gauss-Newton rows, at least; fewer if there are fewer */
#define REPLICATES 6
#define APART      8 /* a parameter of more values is tested through one common factor */
#define LOOSE      1e-6 /* directions of H_aa below this, scaled, are not followed */
#define SEED       0x5c03e

struct missing {
    struct imp_problem *p;
    struct imp_run run;
    uint8_t *own;  /* [n_params] chosen by the caller */
    uint8_t *able; /* [n_params] may be tested */
    size_t own_ties;
    /* Values that have been tested: the factor of Bonferroni's correction. */
    size_t asked;
    /* For the present layout: */
    size_t n;
    double *H, *H_meas, *cov, *g, *g_prior; /* sums over replicates */
};

/* ---- Layouts --------------------------------------------------------------------- */

static void ties_back(struct imp_problem *p, size_t n)
{
    while (p->n_ties > n) imp__tie_last_free(p);
}

/* Textures, volumes and lists among `chosen` become common factors. */
static enum imp_status layout(struct missing *m, const uint8_t *chosen)
{
    enum imp_status st = IMP_OK;
    struct imp_problem *p = m->p;
    IMP_TRY(imp__problem_layout(p, chosen));
    for (size_t k = 0; k < p->scene->n_params; k++)
        if (chosen[k] && !m->own[k] && p->scene->params[k].info.count > APART)
            IMP_TRY(imp_problem_tie(p, p->scene->params[k].info.name, IMP_TIE_FACTOR));
    m->n = p->n;
out:
    return st;
}

/* May this parameter be tested? Its values within their bounds; one that is 0 everywhere
 * has no factor. */
static bool may_ask(const struct imp_scene *s, size_t k)
{
    const struct imp_param *q = &s->params[k];
    if (!(q->info.flags & IMP_PARAM_DIFFERENTIABLE) || q->info.count == 0) return false;
    for (int b = 0; b < s->n_bodies; b++) /* bent rays have no rows here */
        for (int i = 0; i < s->bodies[b]->n_numbers; i++)
            if (s->bodies[b]->numbers[i].param == (int)k) return false;
    if (q->info.count <= APART) return true;
    for (size_t e = 0; e < q->info.count; e++)
        if (imp__param_get(q, e) != 0) return !strpbrk(q->info.name, "*?[],");
    return false;
}

/* Leaves parameters of geometry out of the search; false: there were none. */
static bool places_leave(struct missing *m)
{
    bool met = false;
    for (size_t k = 0; k < m->p->scene->n_params; k++) {
        if (!m->able[k] || !imp__pose_of(m->p->scene, k)) continue;
        m->able[k] = 0;
        met = true;
    }
    return met;
}

static bool is_own(const struct missing *m, size_t i)
{
    return m->own[imp__problem_block(m->p, i)->param];
}

/* ---- Choosing rows --------------------------------------------------------------- */

struct ranked {
    size_t param;
    double z;
    size_t count;
};
static int by_z(const void *a, const void *b)
{
    const struct ranked *x = a, *y = b;
    if (x->z != y->z) return x->z > y->z ? -1 : 1;
    return x->param < y->param ? -1 : x->param > y->param;
}

/* One sweep over all values; `chosen` becomes the caller's and those with the largest
 * scores. */
static enum imp_status rows_choose(struct missing *m, uint8_t *chosen)
{
    enum imp_status st = IMP_OK;
    struct imp_problem *p = m->p;
    const size_t n_params = p->scene->n_params;
    double *g = NULL, *se = NULL;
    struct ranked *list = imp__alloc(p->ctx, n_params + 1, sizeof *list);
    size_t n = 0, rows = 0;
    if (!list) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for scores"));
    for (size_t k = 0; k < n_params; k++) chosen[k] = m->own[k] || m->able[k];
    IMP_TRY(layout(m, chosen));
    g = imp__alloc(p->ctx, 2 * m->n + 1, sizeof *g);
    if (!g) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for scores"));
    se = g + m->n;
    struct imp_run run = m->run;
    run.seed = imp__mix64(m->run.seed ^ SEED);
    IMP_TRY(imp_problem_objective(p, NULL, &run, NULL, g, se));
    for (size_t b = 0; b < p->n_blocks; b++) {
        const struct imp__block *block = &p->blocks[b];
        if (m->own[block->param]) continue;
        struct ranked r = {block->param, 0, block->count};
        for (size_t i = block->first; i < block->first + block->count; i++)
            if (se[i] > 0) r.z = fmax(r.z, fabs(g[i]) / se[i]);
        m->asked += block->count;
        if (r.z > 0) list[n++] = r;
    }
    qsort(list, n, sizeof *list, by_z);
    memcpy(chosen, m->own, n_params);
    size_t all = 0;
    for (size_t b = 0; b < p->n_blocks; b++)
        if (m->own[p->blocks[b].param]) all += p->blocks[b].count;
    for (size_t i = 0; i < n && rows < ROWS && all + list[i].count <= IMP_DENSE_MAX;
         i++) {
        chosen[list[i].param] = 1;
        rows += list[i].count;
        all += list[i].count;
    }
out:
    imp__release(p->ctx, list);
    imp__release(p->ctx, g);
    return st;
}

/* ---- Gauss-Newton rows ----------------------------------------------------------- */

static enum imp_status rows_make(struct missing *m)
{
    enum imp_status st = IMP_OK;
    struct imp_problem *p = m->p;
    imp_context *ctx = p->ctx;
    const size_t n = m->n, n2 = n * n;
    double *work = imp__alloc(ctx, 5 * n2 + 2 * n, sizeof *work);
    m->H = imp__alloc(ctx, 3 * n2 + 2 * n, sizeof *m->H);
    if (!work || !m->H) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for scores"));
    m->H_meas = m->H + n2;
    m->cov = m->H_meas + n2;
    m->g = m->cov + n2;
    m->g_prior = m->g + n;
    for (int r = 0; r < REPLICATES; r++) {
        struct imp__gauss_newton one = {.H = work,
                                        .H_same = work + n2,
                                        .H_meas = work + 2 * n2,
                                        .cov_g = work + 3 * n2,
                                        .cov_excess = work + 4 * n2,
                                        .g = work + 5 * n2,
                                        .g_se = work + 5 * n2 + n};
        struct imp_run run = m->run;
        run.seed = imp__mix64(m->run.seed ^ (SEED + 1 + (uint64_t)r));
        IMP_TRY(imp__gauss_newton(p, NULL, &run, &one));
        for (size_t k = 0; k < n2; k++) {
            m->H[k] += one.H[k] / REPLICATES;
            m->H_meas[k] += one.H_meas[k] / REPLICATES;
            m->cov[k] += (one.cov_g[k] - one.cov_excess[k]) / (REPLICATES * REPLICATES);
        }
        for (size_t k = 0; k < n; k++) m->g[k] += one.g[k] / REPLICATES;
    }
    IMP_TRY(imp__regularise_second(p, work));
    for (size_t k = 0; k < n2; k++) m->H[k] += work[k];
    imp__regularise(p, NULL, m->g_prior);
    for (size_t k = 0; k < n; k++) m->g[k] += m->g_prior[k];
out:
    imp__release(ctx, work);
    return st;
}

/* Inverse of H_aa, in the directions that it determines: inverse [n_a][n_a] of rows a[]. */
static enum imp_status inverse_of(const struct missing *m, const size_t *a, size_t n_a,
                                  double *inverse)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = m->p->ctx;
    const size_t n = m->n;
    double *work = imp__alloc(ctx, 2 * n_a * n_a + 2 * n_a + 1, sizeof *work);
    if (!work) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for scores"));
    double *scaled = work, *vectors = work + n_a * n_a, *values = vectors + n_a * n_a,
           *scale = values + n_a;
    for (size_t i = 0; i < n_a; i++) {
        const double h = m->H[a[i] * n + a[i]];
        scale[i] = h > 0 ? 1 / sqrt(h) : 0;
    }
    for (size_t i = 0; i < n_a; i++)
        for (size_t j = 0; j < n_a; j++)
            scaled[i * n_a + j] = 0.5 * scale[i] * scale[j] *
                                  (m->H[a[i] * n + a[j]] + m->H[a[j] * n + a[i]]);
    if (n_a > 0 && !imp__eigen_symmetric(n_a, scaled, values, vectors))
        IMP_TRY(imp__error(ctx, IMP_E_NUMERIC, "no eigenvalues of J^T W J"));
    memset(inverse, 0, n_a * n_a * sizeof *inverse);
    for (size_t k = 0; k < n_a; k++)
        for (size_t i = 0; values[k] > LOOSE && i < n_a; i++)
            for (size_t j = 0; j < n_a; j++)
                inverse[i * n_a + j] += scale[i] * scale[j] * vectors[k * n_a + i] *
                                        vectors[k * n_a + j] / values[k];
out:
    imp__release(ctx, work);
    return st;
}

/* v^T A v, of the symmetric part of A [n][n]. */
static double square(const double *A, const double *v, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) sum += v[i] * A[i * n + j] * v[j];
    return sum;
}

/* v [n]: e_j - b, with the inverse of H_aa. */
static void follow(const struct missing *m, const size_t *a, size_t n_a,
                   const double *inverse, size_t j, double *v)
{
    const size_t n = m->n;
    memset(v, 0, n * sizeof *v);
    v[j] = 1;
    for (size_t i = 0; i < n_a; i++)
        for (size_t k = 0; k < n_a; k++)
            v[a[i]] -=
                inverse[i * n_a + k] * 0.5 * (m->H[a[k] * n + j] + m->H[j * n + a[k]]);
}

/* By the drop that Monte Carlo leaves no doubt of. */
static int by_drop(const void *a, const void *b)
{
    const struct imp_missing *x = a, *y = b;
    const double sure_x = x->chi2 - 2 * x->chi2_se, sure_y = y->chi2 - 2 * y->chi2_se;
    if (sure_x != sure_y) return sure_x > sure_y ? -1 : 1;
    if (x->param != y->param) return x->param < y->param ? -1 : 1;
    return x->element < y->element ? -1 : x->element > y->element;
}

/* The row of value j; false: it cannot lower the loss. */
static bool row_make(const struct missing *m, const double *v, size_t j,
                     struct imp_missing *row)
{
    const size_t n = m->n;
    const struct imp__block *b = imp__problem_block(m->p, j);
    double score = 0, information = 0;
    for (size_t i = 0; i < n; i++) score += v[i] * m->g[i];
    for (size_t i = 0; i < n; i++) /* H_aa b = H_aj: e_j^T H v */
        information += 0.5 * (m->H[j * n + i] + m->H[i * n + j]) * v[i];
    const double noise = square(m->H_meas, v, n), ours = fmax(square(m->cov, v, n), 0);
    if (!(information > 0) || !(noise > 0)) return false;
    const double x = imp__block_get(m->p, b, j - b->first), free = -score / information;
    const double step = imp_clamp(x + free, b->lo, b->hi) - x;
    if (!(step / free > 0)) return false;
    const double part = step / free * (2 - step / free); /* of the drop, at a bound */
    *row = (struct imp_missing){
        .size = sizeof *row,
        .param = b->param,
        .element = j - b->first,
        .factor = imp__block_factor(m->p, b),
        .value = x,
        .step = step,
        .step_se = sqrt(noise + ours) / information,
        .chi2 = part * (score * score - ours) / noise,
        .chi2_se = part * 2 * fabs(score) * sqrt(ours) / noise,
        .chance =
            fmin(erfc(fabs(score) / sqrt(2 * (noise + ours))) * (double)m->asked, 1)};
    return true;
}

static enum imp_status answer(struct missing *m, const struct imp_missing **rows,
                              size_t *n_out)
{
    enum imp_status st = IMP_OK;
    struct imp_problem *p = m->p;
    imp_context *ctx = p->ctx;
    const size_t n = m->n;
    size_t n_a = 0, n_rows = 0;
    size_t *a = imp__alloc(ctx, n + 1, sizeof *a);
    double *inverse = imp__alloc(ctx, n * n + n + 1, sizeof *inverse);
    struct imp_missing *out = imp__arena_array(&p->missing_arena, n + 1, sizeof *out);
    if (!a || !inverse || !out)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for scores"));
    for (size_t i = 0; i < n; i++) {
        const struct imp__block *b = imp__problem_block(p, i);
        const double x = imp__block_get(p, b, i - b->first);
        if (is_own(m, i) && x > b->lo && x < b->hi &&
            !imp__block_held(p, b, i - b->first))
            a[n_a++] = i;
    }
    IMP_TRY(inverse_of(m, a, n_a, inverse));
    double *v = inverse + n * n;
    for (size_t j = 0; j < n; j++) {
        if (is_own(m, j)) continue;
        follow(m, a, n_a, inverse, j, v);
        n_rows += row_make(m, v, j, &out[n_rows]);
    }
    qsort(out, n_rows, sizeof *out, by_drop);
    *rows = out;
    *n_out = n_rows;
out:
    imp__release(ctx, a);
    imp__release(ctx, inverse);
    return st;
}

/* ---- All of it ------------------------------------------------------------------- */

enum imp_status imp_problem_missing(struct imp_problem *p, const struct imp_run *run,
                                    const struct imp_missing **rows, size_t *n)
{
    enum imp_status st = IMP_OK;
    struct missing m = {.p = p};
    uint8_t *chosen = NULL;
    IMP_REQUIRE(NULL, p, "problem");
    imp_context *ctx = p->ctx;
    IMP_REQUIRE(ctx, rows, "rows");
    IMP_REQUIRE(ctx, n, "n");
    IMP_CHECKED(imp__problem_no_parts(p, "a search for missing numbers"));
    m.run = (struct imp_run)IMP_RUN_INIT;
    IMP_CHECKED(imp__run_take(ctx, "imp_problem_missing", run, &m.run));
    IMP_CHECKED(imp__run_traces(ctx, "imp_problem_missing", &m.run));
    imp__points_of_losses(p, &m.run);
    if (p->n_targets == 0) return imp__error(ctx, IMP_E_ARG, "there is no target");
    if (p->n > IMP_DENSE_MAX - ROWS)
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "missing numbers are looked for beside at most %d active ones, "
                          "and there are %zu",
                          IMP_DENSE_MAX - ROWS, p->n);
    IMP_SETS(p->scene, st);
    if (st != IMP_OK) return st;
    *rows = NULL;
    *n = 0;
    imp__arena_free(&p->missing_arena);
    const size_t n_params = p->scene->n_params;
    m.own = imp__alloc(ctx, n_params + 1, 1);
    m.able = imp__alloc(ctx, n_params + 1, 1);
    chosen = imp__alloc(ctx, n_params + 1, 1);
    if (!m.own || !m.able || !chosen) {
        st = imp__error(ctx, IMP_E_NOMEM, "no memory for scores");
        goto out;
    }
    memcpy(m.own, p->chosen, n_params);
    m.own_ties = p->n_ties;
    bool some = false;
    for (size_t k = 0; k < n_params; k++)
        some |= m.able[k] = !m.own[k] && may_ask(p->scene, k);
    if (!some) goto out;
    st = rows_choose(&m, chosen);
    ties_back(p, m.own_ties);
    /* Scenes whose geometry has no derivatives have other numbers that may be wrong. */
    if ((st == IMP_E_UNSUPPORTED || st == IMP_E_BIAS) && places_leave(&m)) {
        st = rows_choose(&m, chosen);
        ties_back(p, m.own_ties);
    }
    if (st == IMP_OK) st = layout(&m, chosen);
    if (st == IMP_OK && m.n > 0) st = rows_make(&m);
    if (st == IMP_OK && m.n > 0) st = answer(&m, rows, n);
    ties_back(p, m.own_ties);
    const enum imp_status back = imp__problem_layout(p, m.own);
    if (st == IMP_OK) st = back;
out:
    imp__release(ctx, m.own);
    imp__release(ctx, m.able);
    imp__release(ctx, chosen);
    imp__release(ctx, m.H);
    return st;
}
