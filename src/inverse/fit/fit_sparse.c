/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal equations of many values, as the optimiser sees them: rows of derivatives, and
 * the regularisers, which are quadratic. */
#include "base/arguments.h"
#include "base/team.h"
#include "fit.h"
#include "inverse/gauss/sparse_rows.h"
#include <math.h>
#include <string.h>

enum { WIDTH = IMP_SPARSE_WIDTH };

struct equations {
    struct imp__rows rows;
    struct imp__fit *fit;
    const struct imp_problem *problem;
    double *at_zero;   /* [n] gradient of the regularisers at 0; NULL: there are none */
    double *one, *its; /* [n] a vector, and the regularisers' gradient there */
    double widen;      /* of the noise: of residuals that a fit has reduced */
    double *prior;     /* [n] the diagonal of the regularisers' second derivative */
    double *memory;
};

static enum imp_status product(const struct imp__sparse_normal *eq, int width,
                               const double *v, double *y)
{
    const struct equations *e = eq->of;
    const size_t n = eq->n, W = (size_t)width;
    /* A step takes up to thousands of products. */
    IMP_CHECKED(imp__fit_goes_on(e->fit, e->fit->fraction));
    const enum imp_status st = imp__rows_product(&e->rows, width, v, y);
    for (size_t c = 0; st == IMP_OK && e->at_zero && c < W; c++) {
        for (size_t k = 0; k < n; k++) e->one[k] = v[k * W + c];
        memset(e->its, 0, n * sizeof *e->its);
        imp__regularise(e->problem, e->one, e->its);
        for (size_t k = 0; k < n; k++) y[k * W + c] += e->its[k] - e->at_zero[k];
    }
    return st;
}

static enum imp_status draw(const struct imp__sparse_normal *eq, enum imp__draw what,
                            uint64_t seed, double *z)
{
    const struct equations *e = eq->of;
    const enum imp_status st = imp__rows_draw(&e->rows, what, seed, z);
    if (what == IMP_DRAW_MEASUREMENT)
        for (size_t i = 0; i < eq->n * WIDTH; i++) z[i] *= e->widen;
    return st;
}

static void destroy(struct imp__sparse_normal *eq)
{
    struct equations *e = eq->of;
    imp_context *ctx = e->problem->ctx;
    imp__rows_destroy(&e->rows);
    imp__release(ctx, e->memory);
    imp__release(ctx, e);
}

/* Rows may fail on one rank alone, or meet its time limit, but all ranks must go on alike:
 * of a failure anywhere nothing is left here. */
static enum imp_status alike(struct imp__fit *f, enum imp_status st, struct equations *e,
                             bool *failed)
{
    imp_context *ctx = f->problem->ctx;
    bool stopped = false;
    enum imp_status asked = imp__team_any(ctx, st == IMP_CANCELLED, &stopped);
    if (asked == IMP_OK) asked = imp__team_any(ctx, st != IMP_OK, failed);
    f->stopped |= stopped;
    if (asked == IMP_OK && *failed && st == IMP_OK)
        asked = stopped ? IMP_CANCELLED
                        : imp__error(ctx, IMP_E_NOMEM, "another rank has no equations");
    if (asked == IMP_OK && !*failed) return IMP_OK;
    if (e) {
        imp__rows_destroy(&e->rows);
        imp__release(ctx, e->memory);
        imp__release(ctx, e);
    }
    return asked;
}

enum imp_status imp__fit_sparse(const double *x, uint64_t seed, int rounds,
                                struct imp__sparse_normal *out, void *payload)
{
    struct imp__fit *f = payload;
    struct imp_problem *p = f->problem;
    imp_context *ctx = p->ctx;
    enum imp_status st = IMP_OK;
    const size_t n = p->n;
    bool failed;
    struct equations *e = imp__alloc(ctx, 1, sizeof *e);
    if (!e) st = imp__error(ctx, IMP_E_NOMEM, "no memory for %zu numbers", n);
    else e->memory = imp__alloc(ctx, 8 * n, sizeof *e->memory);
    if (e && !e->memory)
        st = imp__error(ctx, IMP_E_NOMEM, "no memory for %zu numbers", n);
    f->run.seed = seed;
    f->final_calls++;
    if (st == IMP_OK)
        st = imp__rows_take(p, x, &f->run, rounds, rounds > f->rounds_fit, &e->rows);
    IMP_CHECKED(alike(f, st, e, &failed));
    if (failed) return st;
    f->rounds_fit = imp_max(f->rounds_fit, rounds);
    e->problem = p;
    e->fit = f;
    struct imp__sparse_normal eq = {.n = n,
                                    .noise_known = f->noise_known,
                                    .product = product,
                                    .draw = draw,
                                    .destroy = destroy,
                                    .of = e};
    eq.g = e->memory;
    eq.same = eq.g + n;
    eq.diagonal = eq.same + n;
    eq.spread = eq.diagonal + n;
    e->one = eq.spread + n;
    e->its = e->one + n;
    eq.prior = e->prior = e->its + n;
    if (p->n_regularisers > 0) e->at_zero = e->prior + n;
    IMP_TRY(imp__rows_gradient(&e->rows, eq.g));
    IMP_TRY(imp__rows_diagonal(&e->rows, eq.diagonal, eq.spread, eq.same));
    imp__regularise_diagonal(p, e->prior);
    for (size_t k = 0; k < n; k++) eq.same[k] += e->prior[k];
    if (e->at_zero) imp__regularise(p, e->one, e->at_zero); /* `one` is 0 */
    eq.f = e->rows.objective;
    eq.f.value += imp__regularise(p, x, eq.g);
    eq.n_residuals = e->rows.n_residuals;
    /* A fit of n variables reduces the squared residuals of M pixels by (M - n)/M on
     * average; corrected where they are used as estimates of the noise. Channels that share
     * their noise are one observation. */
    const double observations = e->rows.n_pixels > 0 ? e->rows.n_pixels : eq.n_residuals;
    const double freedom = observations - (double)(n - imp__held_count(f->problem));
    e->widen = f->noise_known || freedom < 1 ? 1 : sqrt(observations / freedom);
    *out = eq;
    return IMP_OK;
out:
    destroy(&eq);
    return st;
}
