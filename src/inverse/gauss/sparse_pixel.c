/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows of derivatives of one pixel: units of its samples, and their residuals. */
#include "inverse/estimate/adjoint.h"
#include "inverse/problem/loss.h"
#include "math/hash.h"
#include "normal_tiles.h"
#include "sparse_job.h"

/* Adds set s of a replicate, `part` of the unit; returns its mean radiance. */
static imp_spec set_add(const struct imp__rows_job *j, struct imp_tile_worker *tile,
                        struct imp__tile_walks *walks, int x, int y, int b, int s,
                        double part)
{
    const int64_t number = imp__replicates_first(j->plan, b, s);
    const int n = imp__replicates_set(j->plan, s + 1) - imp__replicates_set(j->plan, s);
    imp_spec L = {0};
    for (int64_t sample = number; sample < number + n; sample++) {
        imp__tile_walks_ready(walks);
        const struct imp_arena_mark mark = imp__arena_mark(&tile->arena);
        struct imp_walk walk;
        imp__tile_walk(walks, x, y, sample, &walk);
        imp__tile_drop(tile, walk.dropped, x, y, sample);
        imp__sparse_sink_sweep(&j->workers[tile->index].sink, &j->tracer, &walk,
                               part / n);
        imp__arena_rewind(&tile->arena, mark);
        L += walk.L;
    }
    return L / imp__spec(n);
}

static bool row_add(const struct imp__rows_job *j, struct imp__rows_worker *w)
{
    struct imp__row_block *m = &w->made;
    imp_context *ctx = j->problem->ctx;
    const size_t n = m->n_rows + 1;
    double *r = imp__grow(ctx, m->r, &w->cap_r, n, sizeof *r);
    if (r) m->r = r;
    double *push = imp__grow(ctx, m->push, &w->cap_push, n, sizeof *push);
    if (push) m->push = push;
    uint32_t *end = imp__grow(ctx, m->end, &w->cap_end, n, sizeof *end);
    if (end) m->end = end;
    if (!r || !push || !end) return false;
    end[m->n_rows++] = (uint32_t)m->n_entries;
    return true;
}

/* The unit in the sink, as a row for each channel that has a weight. */
static bool unit_add(const struct imp__rows_job *j, struct imp__rows_worker *w,
                     const bool *counts)
{
    struct imp__row_block *m = &w->made;
    imp_context *ctx = j->problem->ctx;
    const bool luminance = imp__sees_luminance(j->target, j->problem->scene->channels);
    for (int c = 0; c < j->target->desc.channels; c++) {
        const size_t most = m->n_entries + w->sink.n;
        uint32_t *number =
            imp__grow(ctx, m->number, &w->cap_number, most, sizeof *number);
        if (number) m->number = number;
        float *value = imp__grow(ctx, m->value, &w->cap_value, most, sizeof *value);
        if (value) m->value = value;
        if ((most > 0 && (!number || !value)) || most > UINT32_MAX) return false;
        for (size_t i = 0; counts[c] && i < w->sink.n; i++) {
            const float v = (float)imp__seen(luminance, w->sink.x[i], c);
            if (v == 0) continue;
            number[m->n_entries] = w->sink.number[i];
            value[m->n_entries++] = v;
        }
        if (!row_add(j, w)) return false;
    }
    return true;
}

/* Residuals and weights, once the units of the pixel are there. */
static void pixel_weigh(const struct imp__rows_job *j, struct imp__rows_worker *w,
                        size_t index, double r[][3], struct imp__row_pixel *p)
{
    const size_t S = (size_t)j->target->desc.channels;
    const double M = p->units;
    const bool quadratic = imp__loss_quadratic(j->target->desc.loss);
    for (size_t c = 0; c < S; c++) {
        double factor[IMP_NORMAL_UNITS], sum = 0;
        p->weight[c] = imp__normal_residuals(j->target, index, c, p->units, r, factor);
        p->noise_se[c] = j->target->noise_se ? j->target->noise_se[index * S + c] : -1.0f;
        for (int a = 0; a < p->units; a++) sum += r[a][c];
        for (int a = 0; a < p->units; a++) {
            const size_t row = p->row + (size_t)a * S + c;
            w->made.r[row] = r[a][c];
            w->made.push[row] =
                p->share *
                (quadratic ? p->weight[c] * (sum - r[a][c]) / (M * (M - 1)) : factor[a]);
        }
    }
}

enum imp_status imp__rows_pixel(const struct imp__rows_job *j,
                                struct imp_tile_worker *tile,
                                struct imp__tile_walks *walks, int x, int y, int b0,
                                int b1, double *sums)
{
    struct imp__rows_worker *w = &j->workers[tile->index];
    const int m = j->plan.m, sets = (b1 - b0) * m, M = imp__normal_units(sets);
    const size_t S = (size_t)j->target->desc.channels;
    const size_t index = (size_t)y * (size_t)j->tiles.width + (size_t)x;
    const int channels = j->problem->scene->channels;
    const bool luminance = imp__sees_luminance(j->target, channels);
    const double R = b1 - b0, all = j->plan.R;
    imp_context *ctx = j->problem->ctx;
    double r[IMP_NORMAL_UNITS][3] = {{0}}, value = 0, square = 0;
    bool counts[3];
    struct imp__row_pixel *pixels = imp__grow(ctx, w->made.pixel, &w->cap_pixel,
                                              w->made.n_pixels + 1, sizeof *pixels);
    if (!pixels) return imp__error(ctx, IMP_E_NOMEM, "no memory for derivatives");
    w->made.pixel = pixels;
    struct imp__row_pixel *p = &pixels[w->made.n_pixels++];
    *p = (struct imp__row_pixel){.key = imp__hash(j->key, &index, sizeof index),
                                 .row = (uint32_t)w->made.n_rows,
                                 .units = M,
                                 .share = R / all};
    p->own = imp__hash(p->key, &b0, sizeof b0);
    for (size_t c = 0; c < S; c++)
        counts[c] = imp__target_weight(j->target, index, (int)c) > 0;
    for (int i = 0, u = 0; i < sets; i++) {
        const int u1 = (int)(((int64_t)(u + 1) * sets + M - 1) / M);
        const int u0 = (int)(((int64_t)u * sets + M - 1) / M);
        const double part = 1.0 / (u1 - u0);
        const imp_spec mean = set_add(j, tile, walks, x, y, b0 + i / m, i % m, part);
        const double L[3] = {mean[0], mean[1], mean[2]};
        for (size_t c = 0; c < S; c++) r[u][c] += part * imp__seen(luminance, L, (int)c);
        if (i + 1 == u1) { /* the last set of its unit */
            const bool made = !w->sink.failed && unit_add(j, w, counts);
            imp__sparse_sink_clear(&w->sink);
            if (!made) return imp__error(ctx, IMP_E_NOMEM, "no memory for derivatives");
            u++;
        }
        w->L[i % m] = mean;
        if (i % m < m - 1) continue;
        const double v =
            imp__replicate_adjoints(j->target, channels, index, m, w->L, w->L, w->P);
        value += v;
        square += v * v;
    }
    pixel_weigh(j, w, index, r, p);
    sums[IMP_ROWS_OBJECTIVE] += value / all;
    sums[IMP_ROWS_VARIANCE] += (square - value * value / R) * R / ((R - 1) * all * all);
    return IMP_OK;
}
