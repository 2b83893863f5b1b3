/* SPDX-License-Identifier: Apache-2.0
 *
 * Preconditioned conjugate gradients for WIDTH right-hand sides at once, and the mu that makes the
 * matrix positive along the directions met. */
#include "conjugate.h"
#include "base/arguments.h"
#include "math/vec.h"
#include <math.h>
#include <string.h>

enum { WIDTH = IMP_SPARSE_WIDTH };

struct work {
    double *r, *p, *q; /* [n][width] residual, direction, product with it */
    double rho[WIDTH], rho0[WIDTH], curvature[WIDTH], length[WIDTH];
    bool at_work[WIDTH];
};

static void start(const struct imp__conjugate *of, int width, const double *b, double *x,
                  struct work *w)
{
    const size_t n = of->eq->n, W = (size_t)width;
    memset(x, 0, n * W * sizeof *x);
    memset(w->rho, 0, sizeof w->rho);
    for (size_t k = 0; k < n; k++)
        for (size_t v = 0; v < W; v++) {
            const size_t i = k * W + v;
            w->r[i] = of->fixed[k] ? 0 : b[i];
            w->p[i] = of->fixed[k] ? 0 : b[i] / of->eq->same[k];
            w->rho[v] += w->r[i] * w->p[i];
        }
    for (size_t v = 0; v < W; v++) {
        w->rho0[v] = w->rho[v];
        w->at_work[v] = w->rho[v] > 0;
    }
}

/* q = (H + mu D) p, and p^T q, p^T D p. */
static enum imp_status product(const struct imp__conjugate *of, double mu, int width,
                               struct work *w)
{
    const size_t n = of->eq->n, W = (size_t)width;
    const enum imp_status st = of->eq->product(of->eq, width, w->p, w->q);
    memset(w->curvature, 0, sizeof w->curvature);
    memset(w->length, 0, sizeof w->length);
    for (size_t k = 0; k < n && st == IMP_OK; k++)
        for (size_t v = 0; v < W; v++) {
            const size_t i = k * W + v;
            const double d = of->fixed[k] ? 0 : of->eq->same[k] * w->p[i];
            w->q[i] = of->fixed[k] ? 0 : w->q[i] + mu * d;
            w->curvature[v] += w->p[i] * w->q[i];
            w->length[v] += w->p[i] * d;
        }
    return st;
}

/* Is every p a direction of positive curvature? */
static bool positive(struct imp__conjugate *of, double mu, int width,
                     const struct work *w)
{
    of->positive = true;
    of->needed = mu;
    for (int v = 0; v < width; v++) {
        if (!w->at_work[v] || w->curvature[v] > 1e-14 * w->length[v]) continue;
        of->positive = false;
        of->needed = fmax(of->needed, mu - w->curvature[v] / w->length[v]);
    }
    return of->positive;
}

static void step(const struct imp__conjugate *of, int width, struct work *w, double *x)
{
    const size_t n = of->eq->n, W = (size_t)width;
    double alpha[WIDTH], rho[WIDTH] = {0}, beta[WIDTH];
    for (size_t v = 0; v < W; v++)
        alpha[v] = w->at_work[v] ? w->rho[v] / w->curvature[v] : 0;
    for (size_t k = 0; k < n; k++) {
        const double by = of->fixed[k] ? 0 : 1 / of->eq->same[k];
        for (size_t v = 0; v < W; v++) {
            const size_t i = k * W + v;
            x[i] += alpha[v] * w->p[i];
            w->r[i] -= alpha[v] * w->q[i];
            rho[v] += w->r[i] * w->r[i] * by;
        }
    }
    for (size_t v = 0; v < W; v++) {
        beta[v] = w->at_work[v] ? rho[v] / w->rho[v] : 0;
        w->rho[v] = rho[v];
        w->at_work[v] &= rho[v] > imp__sqr(of->tolerance) * w->rho0[v];
    }
    for (size_t k = 0; k < n; k++) {
        const double by = of->fixed[k] ? 0 : 1 / of->eq->same[k];
        for (size_t v = 0; v < W; v++) {
            const size_t i = k * W + v;
            w->p[i] = w->at_work[v] ? w->r[i] * by + beta[v] * w->p[i] : 0;
        }
    }
}

static bool any(const bool *at_work, int width)
{
    for (int v = 0; v < width; v++)
        if (at_work[v]) return true;
    return false;
}

enum imp_status imp__conjugate_solve(imp_context *ctx, struct imp__conjugate *of,
                                     double mu, int width, const double *b, double *x)
{
    enum imp_status st = IMP_OK;
    const size_t all = of->eq->n * (size_t)width;
    struct work w = {.r = imp__alloc_raw(ctx, 3 * all, sizeof *w.r)};
    if (!w.r) return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu numbers", of->eq->n);
    w.p = w.r + all;
    w.q = w.p + all;
    start(of, width, b, x, &w);
    of->positive = true;
    for (of->iterations = 0; of->iterations < of->most && any(w.at_work, width);
         of->iterations++) {
        IMP_TRY(product(of, mu, width, &w));
        if (!positive(of, mu, width, &w)) break;
        step(of, width, &w, x);
    }
    of->converged = of->positive && !any(w.at_work, width);
out:
    imp__release(ctx, w.r);
    return st;
}

enum imp_status imp__conjugate_up(imp_context *ctx, struct imp__conjugate *of,
                                  double mu_most, double *mu, int width, const double *b,
                                  double *x, bool *found)
{
    *found = false;
    for (;;) {
        IMP_CHECKED(imp__conjugate_solve(ctx, of, *mu, width, b, x));
        *found = of->positive;
        if (of->positive) return IMP_OK;
        *mu = fmax(fmax(4 * *mu, 1e-6), of->needed);
        if (!(*mu <= mu_most)) return IMP_OK;
    }
}
