/* SPDX-License-Identifier: Apache-2.0
 *
 * One pixel and one tile of the normal equations with a filter no wider than a pixel
 * (gauss_newton.c has the formulas). */
#include "inverse/estimate/adjoint.h"
#include "inverse/estimate/channel_sink.h"
#include "inverse/estimate/tile_walks.h"
#include "inverse/problem/loss.h"
#include "normal_pixel.h"
#include <math.h>
#include <string.h>
/* A walk's L and x as the target sees them. */
static double seen(const struct imp__normal_job *j, const double *lanes, int c)
{
    return imp__seen(imp__sees_luminance(j->target, j->channels), lanes, c);
}

/* Set s of a replicate: its mean radiance, and x, the mean of its derivatives. */
static imp_spec set_mean(const struct imp__normal_job *j, struct imp_tile_worker *tile,
                         struct imp__tile_walks *walks, int x, int y, int b, int s)
{
    double *sum_x = j->workers[tile->index].x;
    const size_t width = j->K * (size_t)j->channels;
    const int64_t number = imp__replicates_first(j->plan, b, s);
    const int n = imp__replicates_set(j->plan, s + 1) - imp__replicates_set(j->plan, s);
    imp_spec L = {0};
    memset(sum_x, 0, width * sizeof *sum_x);
    for (int64_t sample = number; sample < number + n; sample++) {
        imp__tile_walks_ready(walks);
        const struct imp_arena_mark mark = imp__arena_mark(&tile->arena);
        struct imp_walk walk;
        imp__tile_walk(walks, x, y, sample, &walk);
        imp__tile_drop(tile, walk.dropped, x, y, sample);
        imp__lanes_sweep(&j->tracer, &walk, sum_x);
        imp__arena_rewind(&tile->arena, mark);
        L += walk.L;
    }
    if (n == 1) return L;
    for (size_t k = 0; k < width; k++) sum_x[k] /= n;
    return L / imp__spec(n);
}
/* ---- The units of a pixel ------------------------------------------------------- */

/* Replicates [b0, b1) of a pixel as units; their losses are those of the objective. */
static void units_gather(const struct imp__normal_job *j, struct imp_tile_worker *tile,
                         int x, int y, int b0, int b1, struct imp__normal_pixel *p)
{
    struct imp__normal_worker *w = p->w;
    const size_t K = j->K, S = (size_t)imp__normal_channels(j);
    const int m = j->plan.m, sets = (b1 - b0) * m;
    memset(w->X, 0, (size_t)p->M * K * S * sizeof *w->X);
    memset(w->r, 0, sizeof w->r);
    for (int i = 0; i < sets; i++) {
        const int u = (int)((int64_t)i * p->M / sets);
        const int u1 = (int)(((int64_t)(u + 1) * sets + p->M - 1) / p->M);
        const int u0 = (int)(((int64_t)u * sets + p->M - 1) / p->M);
        const double part = 1.0 / (u1 - u0);
        const imp_spec mean = set_mean(j, tile, p->walks, x, y, b0 + i / m, i % m);
        const double L[3] = {mean[0], mean[1], mean[2]};
        double *X = w->X + (size_t)u * K * S;
        for (size_t c = 0; c < S; c++) w->r[u][c] += part * seen(j, L, (int)c);
        for (size_t k = 0; k < K; k++)
            for (size_t c = 0; c < S; c++)
                X[c * K + k] += part * seen(j, w->x + k * (size_t)j->channels, (int)c);
        w->L[i % m] = mean;
        if (i % m < m - 1) continue;
        const double v = imp__replicate_adjoints(j->target, j->channels, p->index, m,
                                                 w->L, w->L, w->P);
        p->value += v;
        p->square += v * v;
    }
}

/* X without the values whose entries are 0 in all units. */
static void touched_find(const struct imp__normal_job *j, struct imp__normal_pixel *p)
{
    struct imp__normal_worker *w = p->w;
    const size_t K = j->K, rows = (size_t)p->M * (size_t)imp__normal_channels(j);
    p->T = 0;
    for (size_t k = 0; k < K; k++) {
        bool any = false;
        for (size_t i = 0; i < rows && !any; i++) any = w->X[i * K + k] != 0;
        if (any) w->touched[p->T++] = k;
    }
    if (p->T == K) return;
    double *to = w->X;
    for (size_t i = 0; i < rows; i++) /* never ahead of what is read */
        for (size_t t = 0; t < p->T; t++) *to++ = w->X[i * K + w->touched[t]];
}

/* ---- Tiles ------------------------------------------------------------------------ */

static bool counts(const void *job, int x, int y)
{
    const struct imp__normal_job *j = job;
    return imp__target_counts(j->target, (size_t)y * (size_t)j->width + (size_t)x);
}

enum imp_status imp__normal_work(const struct imp_tile *t, struct imp_tile_worker *tile,
                                 void *result, void *payload)
{
    struct imp__normal_job *j = payload;
    struct imp__normal_sums out = imp__normal_at(j, result);
    const int b0 = imp__replicates_begin(j->plan, (int)t->part);
    const int b1 = imp__replicates_begin(j->plan, (int)t->part + 1);
    const double R = b1 - b0, all = j->plan.R;
    struct imp__tile_walks walks;
    memset(result, 0, imp__normal_count(j) * sizeof(double));
    imp__tile_walks_begin(&j->tracer, t, tile, j->plan, b0, b1, 1, counts, j, &walks);
    for (int y = t->y0; y < t->y1; y++)
        for (int x = t->x0; x < t->x1; x++) {
            struct imp__normal_pixel p = {.w = &j->workers[tile->index],
                                          .walks = &walks,
                                          .index =
                                              (size_t)y * (size_t)j->width + (size_t)x,
                                          .M = imp__normal_units((b1 - b0) * j->plan.m),
                                          .share = R / all};
            if (!counts(j, x, y)) continue;
            units_gather(j, tile, x, y, b0, b1, &p);
            const enum imp_status st = imp__tile_check(tile);
            if (st != IMP_OK) return st;
            touched_find(j, &p);
            imp__normal_channels_add(j, &p, &out);
            imp__normal_slope_add(j, &p, &out);
            out.scalars[IMP_NORMAL_OBJECTIVE] += p.value / all;
            out.scalars[IMP_NORMAL_VARIANCE] +=
                (p.square - p.value * p.value / R) * R / ((R - 1) * all * all);
        }
    return IMP_OK;
}

void imp__normal_add(void *into, const void *from, void *payload)
{
    const struct imp__normal_job *j = payload;
    double *a = into;
    const double *b = from;
    for (size_t k = 0; k < imp__normal_count(j); k++) a[k] += b[k];
}

enum imp_status imp__normal_take(size_t group, const void *sum, void *payload)
{
    struct imp__normal_job *j = payload;
    (void)group;
    imp__normal_add(j->total, sum, j);
    return IMP_OK;
}
