/* SPDX-License-Identifier: Apache-2.0
 *
 * A linear model seen through noise, whose least-squares answer is known: pixels
 * I = A x, targets T = A x_true + noise, and "renders" I + Monte Carlo noise that depends
 * on the seed alone. Optimisers and covariances are tested on it. */
#ifndef TOY_GOAL_H
#define TOY_GOAL_H

#include "math/rng.h"
#include "search/optimize.h"
#include <math.h>
#include <string.h>

enum { TOY_M = 60, TOY_N = 4 };

struct toy {
    double A[TOY_M][TOY_N], T[TOY_M], truth[TOY_N];
    double lo[TOY_N], hi[TOY_N], scale[TOY_N];
    double mc;             /* standard deviation of a "rendered" pixel */
    double H_noise;        /* relative noise of J^T J */
    int evals, stop_after; /* cancel in evaluation number stop_after; 0: never */
    int iterations, stop_iteration;
    struct imp__goal goal;
};

static inline double toy_gauss(uint64_t seed, uint64_t i)
{
    const struct imp_key key = imp__key(seed, i, 77);
    return sqrt(-2 * log(1 - imp__u01(key, 0))) *
           cos(2 * 3.14159265358979323846 * imp__u01(key, 1));
}

static inline enum imp_status toy_eval(const double *x, uint64_t seed,
                                       struct imp_estimate *f, double *g, double *g_se,
                                       void *payload)
{
    struct toy *t = payload;
    double value = 0, var = 0;
    if (++t->evals == t->stop_after) return IMP_CANCELLED;
    if (g) memset(g, 0, sizeof(double) * TOY_N);
    if (g_se) memset(g_se, 0, sizeof(double) * TOY_N);
    for (int p = 0; p < TOY_M; p++) {
        double r = t->mc * toy_gauss(seed, (uint64_t)p) - t->T[p];
        for (int k = 0; k < TOY_N; k++) r += t->A[p][k] * x[k];
        value += 0.5 * (r * r - t->mc * t->mc);
        var += t->mc * t->mc * (r * r + 0.5 * t->mc * t->mc);
        for (int k = 0; g && k < TOY_N; k++) g[k] += t->A[p][k] * r;
        for (int k = 0; g_se && k < TOY_N; k++)
            g_se[k] += t->mc * t->mc * t->A[p][k] * t->A[p][k];
    }
    for (int k = 0; g_se && k < TOY_N; k++) g_se[k] = sqrt(g_se[k]);
    *f = (struct imp_estimate){.value = value, .se = sqrt(var)};
    return IMP_OK;
}

static inline enum imp_status toy_normal(const double *x, uint64_t seed, int rounds,
                                         struct imp__normal *out, void *payload)
{
    struct toy *t = payload;
    const double mc = t->mc, few = sqrt(1.0 / rounds);
    double r2 = 0;
    t->mc *= few;
    const enum imp_status st = toy_eval(x, seed, &out->f, out->g, NULL, t);
    t->mc = mc;
    if (st != IMP_OK) return st;
    for (int p = 0; p < TOY_M; p++) {
        double r = mc * few * toy_gauss(seed, (uint64_t)p) - t->T[p];
        for (int k = 0; k < TOY_N; k++) r += t->A[p][k] * x[k];
        r2 += r * r;
    }
    out->pairs = out->f;
    out->chi2 = r2 - TOY_M * mc * mc / rounds;
    out->n_residuals = TOY_M;
    out->noise_known = false;
    for (int k = 0; k < TOY_N; k++)
        for (int l = 0; l <= k; l++) {
            double h = 0;
            for (int p = 0; p < TOY_M; p++) h += t->A[p][k] * t->A[p][l];
            const uint64_t entry = (uint64_t)(k * TOY_N + l);
            const double sigma = t->H_noise * 5 * few;
            const double e = sigma * toy_gauss(seed, 1000 + entry);
            const int at[2] = {k * TOY_N + l, l * TOY_N + k};
            for (int i = 0; i < 2; i++) {
                out->H[at[i]] = h + e;
                out->H_same[at[i]] = h * (1 + (k == l) * 0.1);
                out->H_prior[at[i]] = 0;
                out->H_meas[at[i]] = 0;
                out->cov_g[at[i]] = mc * mc * h / rounds;
                for (uint64_t d = 0; out->deviations && d < IMP_DEVIATIONS; d++)
                    out->deviations[d * TOY_N * TOY_N + (size_t)at[i]] =
                        sigma * sqrt(1.0 / IMP_DEVIATIONS) *
                        toy_gauss(seed, 2000 + 100 * d + entry);
            }
        }
    return IMP_OK;
}

static inline enum imp_status toy_iterated(const struct imp__search *s, void *payload)
{
    struct toy *t = payload;
    (void)s;
    return ++t->iterations == t->stop_iteration ? IMP_CANCELLED : IMP_OK;
}

/* Columns of A of very different size; the variables' scales know it. */
static inline void toy_make(struct toy *t, imp_context *ctx, uint64_t seed, double noise,
                            double mc)
{
    static const double size[TOY_N] = {1, 0.05, 3, 0.5};
    *t = (struct toy){.mc = mc, .H_noise = 1e-3};
    for (int k = 0; k < TOY_N; k++) {
        t->truth[k] = (k + 1) / size[k];
        t->lo[k] = -INFINITY;
        t->hi[k] = INFINITY;
        t->scale[k] = 2 / size[k];
    }
    for (int p = 0; p < TOY_M; p++) {
        t->T[p] = noise * toy_gauss(seed + 1, (uint64_t)p);
        for (int k = 0; k < TOY_N; k++) {
            t->A[p][k] = size[k] * (toy_gauss(5, (uint64_t)(p * TOY_N + k)) + 0.5);
            t->T[p] += t->A[p][k] * t->truth[k];
        }
    }
    t->goal = (struct imp__goal){.ctx = ctx,
                                 .n = TOY_N,
                                 .lo = t->lo,
                                 .hi = t->hi,
                                 .scale = t->scale,
                                 .seed = seed,
                                 .eval = toy_eval,
                                 .normal = toy_normal,
                                 .iterated = toy_iterated,
                                 .payload = t};
}

/* Least squares without any noise of ours: x_ls, and (A^T A)^-1. */
#include "math/linalg.h"
static inline void toy_least_squares(const struct toy *t, double x[TOY_N],
                                     double inverse[TOY_N * TOY_N])
{
    double L[TOY_N * TOY_N] = {0}, b[TOY_N] = {0};
    for (int p = 0; p < TOY_M; p++)
        for (int k = 0; k < TOY_N; k++) {
            b[k] += t->A[p][k] * t->T[p];
            for (int l = 0; l < TOY_N; l++) L[k * TOY_N + l] += t->A[p][k] * t->A[p][l];
        }
    imp__cholesky(TOY_N, L);
    memcpy(x, b, sizeof b);
    imp__cholesky_solve(TOY_N, L, x);
    for (int k = 0; k < TOY_N; k++) {
        double e[TOY_N] = {0};
        e[k] = 1;
        imp__cholesky_solve(TOY_N, L, e);
        for (int l = 0; l < TOY_N; l++) inverse[k * TOY_N + l] = e[l];
    }
}

#endif
