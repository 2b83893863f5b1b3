/* SPDX-License-Identifier: Apache-2.0
 *
 * Levenberg and Marquardt's systems with matrices. */
#include "excess.h"
#include "lm_system.h"
#include "math/linalg.h"
#include <math.h>
#include <string.h>

struct dense {
    struct imp__lm_system system; /* first */
    struct imp__normal eq;
    double *a;             /* [n_free][n_free] Cholesky factor of the damped system */
    double *p;             /* [n][n] */
    double *delta, *c, *d; /* [n]; d: (diag H_same)^-1/2 */
    size_t *free;          /* [n_free] */
};

/* Variables that neither press against a bound nor are without any effect. */
static void free_set(const struct imp__goal *goal, const double *x, struct dense *w)
{
    w->system.n_free = 0;
    for (size_t k = 0; k < goal->n; k++) {
        const int wall = imp__at_bound(goal, x, k);
        const double h = w->eq.H_same[k * goal->n + k];
        w->d[k] = h > 0 ? 1 / sqrt(h) : 0;
        if (!(h > 0) || (wall < 0 && w->eq.g[k] >= 0) || (wall > 0 && w->eq.g[k] <= 0))
            continue;
        w->free[w->system.n_free++] = k;
    }
}

static enum imp_status take(struct imp__lm_system *s, const double *x, uint64_t seed)
{
    struct dense *w = (struct dense *)s;
    enum imp_status st = IMP_OK;
    IMP_TRY(s->goal->normal(x, seed, 1, &w->eq, s->goal->payload));
    IMP_TRY(imp__excess_take(s->goal->ctx, s->goal->n, w->eq.cov_g, w->eq.cov_excess));
    s->f = w->eq.f;
    free_set(s->goal, x, w);
out:
    return st;
}

/* Factor of D (H + mu diag H_same) D over the free variables, D = (diag H_same)^-1/2. */
static bool factor(size_t n, struct dense *w, double mu)
{
    const size_t m = w->system.n_free;
    for (size_t i = 0; i < m; i++)
        for (size_t j = 0; j < m; j++) {
            const size_t k = w->free[i], l = w->free[j];
            w->a[i * m + j] = w->d[k] * w->eq.H[k * n + l] * w->d[l] + (i == j ? mu : 0);
        }
    return imp__cholesky(m, w->a);
}

/* Smallest mu >= the given one whose system is positive definite. */
static bool factor_up(size_t n, struct dense *w, double *mu)
{
    while (!factor(n, w, *mu)) {
        *mu = fmax(4 * *mu, 1e-6);
        if (*mu > IMP_LM_MU_MAX) return false;
    }
    return true;
}

/* out = A^-1 b over the free variables, 0 elsewhere. */
static void solve(size_t n, struct dense *w, const double *b, double *out)
{
    const size_t m = w->system.n_free;
    double *c = w->c;
    for (size_t i = 0; i < m; i++) c[i] = w->d[w->free[i]] * b[w->free[i]];
    imp__cholesky_solve(m, w->a, c);
    memset(out, 0, n * sizeof *out);
    for (size_t i = 0; i < m; i++) out[w->free[i]] = w->d[w->free[i]] * c[i];
}

static enum imp_status newton(struct imp__lm_system *s, double *mu, double *delta,
                              bool *found)
{
    struct dense *w = (struct dense *)s;
    *found = factor_up(s->goal->n, w, mu);
    if (*found) solve(s->goal->n, w, w->eq.g, delta);
    return IMP_OK;
}

static enum imp_status product(struct imp__lm_system *s, const double *v, double *out)
{
    const struct dense *w = (const struct dense *)s;
    const size_t n = s->goal->n;
    for (size_t k = 0; k < n; k++) {
        out[k] = 0;
        for (size_t l = 0; l < n; l++) out[k] += w->eq.H[k * n + l] * v[l];
    }
    return IMP_OK;
}

static enum imp_status within_noise(struct imp__lm_system *s, bool *within)
{
    struct dense *w = (struct dense *)s;
    const size_t n = s->goal->n;
    double q = 0, mean = 0, half_var = 0, mu = IMP_LM_MU_MIN;
    *within = false;
    if (!factor_up(n, w, &mu)) return IMP_OK;
    solve(n, w, w->eq.g, w->delta);
    for (size_t k = 0; k < n; k++) q += w->eq.g[k] * w->delta[k];
    for (size_t k = 0; k < n; k++) { /* row k of p is column k of A^-1 C, as C = C^T */
        solve(n, w, w->eq.cov_g + k * n, w->p + k * n);
        mean += w->p[k * n + k];
    }
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) half_var += w->p[k * n + l] * w->p[l * n + k];
    *within = q <= mean + 2 * sqrt(2 * half_var);
    return IMP_OK;
}

static void end(struct imp__lm_system *s)
{
    struct dense *w = (struct dense *)s;
    imp_context *ctx = s->goal->ctx;
    imp__normal_destroy(ctx, &w->eq);
    imp__release(ctx, w->a);
    imp__release(ctx, w->p);
    imp__release(ctx, w->delta);
    imp__release(ctx, w->free);
}

static enum imp_status begin(struct imp__lm_system *s)
{
    struct dense *w = (struct dense *)s;
    imp_context *ctx = s->goal->ctx;
    const size_t n = s->goal->n;
    const enum imp_status st = imp__normal_create(ctx, n, false, &w->eq);
    if (st != IMP_OK) return st;
    w->a = imp__alloc(ctx, n * n, sizeof *w->a);
    w->p = imp__alloc(ctx, n * n, sizeof *w->p);
    w->delta = imp__alloc(ctx, 3 * n, sizeof *w->delta);
    w->free = imp__alloc(ctx, n, sizeof *w->free);
    if (!w->a || !w->p || !w->delta || !w->free)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu x %zu matrices", n, n);
    w->c = w->delta + n;
    w->d = w->delta + 2 * n;
    s->g = w->eq.g;
    return IMP_OK;
}

const struct imp__lm_kind imp__lm_dense = {
    sizeof(struct dense), begin, end, take, newton, product, within_noise};
