/* SPDX-License-Identifier: Apache-2.0
 *
 * Levenberg and Marquardt's systems of many variables, solved by conjugate gradients. What
 * noise alone would make of g^T A^-1 g is found from vectors z with the covariance of g
 * (Hutchinson, Commun. Stat. Simul. 18, 1989): with u = A^-1 z,
 *
 *     tr(A^-1 C) = E z^T u,      tr((A^-1 C)^2) = E (z_i^T u_j)^2 of independent z_i, z_j,
 *
 * all of them in one solution of several right sides. */
#include "conjugate.h"
#include "lm_system.h"
#include "math/vec.h"
#include <math.h>
#include <string.h>

#define STEP_TOLERANCE  1e-4
#define NOISE_TOLERANCE 1e-2
#define ITERATIONS      2000
#define EXCESS_MOST     (2.0 / 3) /* of the covariance (excess.h) */

/* Right sides: g, vectors with its covariance, vectors with what that has too much. */
enum { WIDTH = IMP_SPARSE_WIDTH, DRAWS = 4, EXCESSES = WIDTH - 1 - DRAWS };

struct sparse {
    struct imp__lm_system system; /* first */
    struct imp__sparse_normal eq;
    bool *fixed;       /* [n] */
    double *b, *u, *z; /* [n][WIDTH] */
    uint64_t seed;
};

static enum imp_status take(struct imp__lm_system *s, const double *x, uint64_t seed)
{
    struct sparse *w = (struct sparse *)s;
    const struct imp__goal *goal = s->goal;
    imp__sparse_normal_destroy(&w->eq);
    const enum imp_status st = goal->sparse(x, seed, 1, &w->eq, goal->payload);
    if (st != IMP_OK) return st;
    w->seed = seed;
    s->g = w->eq.g;
    s->f = w->eq.f;
    s->n_free = 0;
    for (size_t k = 0; k < goal->n; k++) {
        const int wall = imp__at_bound(goal, x, k);
        w->fixed[k] = !(w->eq.same[k] > 0) || (wall < 0 && w->eq.g[k] >= 0) ||
                      (wall > 0 && w->eq.g[k] <= 0);
        s->n_free += !w->fixed[k];
    }
    return IMP_OK;
}

static enum imp_status newton(struct imp__lm_system *s, double *mu, double *delta,
                              bool *found)
{
    struct sparse *w = (struct sparse *)s;
    struct imp__conjugate c = {
        .eq = &w->eq, .fixed = w->fixed, .tolerance = STEP_TOLERANCE, .most = ITERATIONS};
    return imp__conjugate_up(s->goal->ctx, &c, IMP_LM_MU_MAX, mu, 1, w->eq.g, delta,
                             found);
}

static enum imp_status product(struct imp__lm_system *s, const double *v, double *out)
{
    const struct sparse *w = (const struct sparse *)s;
    return w->eq.product(&w->eq, 1, v, out);
}

static enum imp_status sides_make(struct sparse *w)
{
    enum imp_status st = IMP_OK;
    const size_t n = w->eq.n;
    IMP_TRY(w->eq.draw(&w->eq, IMP_DRAW_GRADIENT, w->seed, w->z));
    for (size_t k = 0; k < n; k++) {
        w->b[k * WIDTH] = w->eq.g[k];
        for (size_t v = 0; v < DRAWS; v++) w->b[k * WIDTH + 1 + v] = w->z[k * WIDTH + v];
    }
    IMP_TRY(w->eq.draw(&w->eq, IMP_DRAW_EXCESS, w->seed, w->z));
    for (size_t k = 0; k < n; k++)
        for (size_t v = 0; v < EXCESSES; v++)
            w->b[k * WIDTH + 1 + DRAWS + v] = w->z[k * WIDTH + v];
out:
    return st;
}

/* b_i^T u_j */
static double inner(const struct sparse *w, size_t i, size_t j)
{
    double sum = 0;
    for (size_t k = 0; k < w->eq.n; k++)
        if (!w->fixed[k]) sum += w->b[k * WIDTH + i] * w->u[k * WIDTH + j];
    return sum;
}

static enum imp_status within_noise(struct imp__lm_system *s, bool *within)
{
    struct sparse *w = (struct sparse *)s;
    struct imp__conjugate c = {.eq = &w->eq,
                               .fixed = w->fixed,
                               .tolerance = NOISE_TOLERANCE,
                               .most = ITERATIONS};
    enum imp_status st = IMP_OK;
    double mu = IMP_LM_MU_MIN, mean = 0, excess = 0, half_var = 0;
    bool found;
    *within = false;
    IMP_TRY(sides_make(w));
    IMP_TRY(imp__conjugate_up(s->goal->ctx, &c, IMP_LM_MU_MAX, &mu, WIDTH, w->b, w->u,
                              &found));
    if (!found) goto out;
    for (size_t i = 1; i <= DRAWS; i++) mean += inner(w, i, i) / DRAWS;
    for (size_t i = 1 + DRAWS; i < WIDTH; i++) excess += inner(w, i, i) / EXCESSES;
    for (size_t i = 1; i <= DRAWS; i++)
        for (size_t j = i + 1; j <= DRAWS; j++)
            half_var += imp__sqr(inner(w, i, j)) / (DRAWS * (DRAWS - 1) / 2.0);
    mean -= imp_clamp(excess, 0.0, EXCESS_MOST * mean);
    /* The noise that x has from the step before makes as much of q as that of g here. With few
     * variables the spread of q covers it, with many it does not. */
    *within = inner(w, 0, 0) <= (s->after_step ? 2 : 1) * (mean + 2 * sqrt(2 * half_var));
out:
    return st;
}

static void end(struct imp__lm_system *s)
{
    struct sparse *w = (struct sparse *)s;
    imp__sparse_normal_destroy(&w->eq);
    imp__release(s->goal->ctx, w->fixed);
    imp__release(s->goal->ctx, w->b);
}

static enum imp_status begin(struct imp__lm_system *s)
{
    struct sparse *w = (struct sparse *)s;
    imp_context *ctx = s->goal->ctx;
    const size_t n = s->goal->n;
    w->fixed = imp__alloc(ctx, n, sizeof *w->fixed);
    w->b = imp__alloc_raw(ctx, 3 * WIDTH * n, sizeof *w->b);
    if (!w->fixed || !w->b)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu variables", n);
    w->u = w->b + WIDTH * n;
    w->z = w->u + WIDTH * n;
    return IMP_OK;
}

const struct imp__lm_kind imp__lm_sparse = {
    sizeof(struct sparse), begin, end, take, newton, product, within_noise};
