/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows of derivatives, tile by tile. */
#include "sparse_rows.h"
#include "base/arguments.h"
#include "film/film_filter.h"
#include "film/parts.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/problem/loss.h"
#include "math/hash.h"
#include "normal_tiles.h"
#include "sparse_job.h"
#include "walk/rules/features.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define LOOKS 4 /* tiles by which the memory of all is estimated */

/* ---- Tiles ---------------------------------------------------------------------- */

static size_t rounded(size_t bytes)
{
    return (bytes + sizeof(double) - 1) / sizeof(double) * sizeof(double);
}
static size_t bytes_of(const struct imp__row_block *b)
{
    return rounded(b->n_pixels * sizeof *b->pixel) +
           b->n_rows * (sizeof *b->r + sizeof *b->push) +
           rounded(b->n_rows * sizeof *b->end) +
           rounded(b->n_entries * sizeof *b->number) +
           rounded(b->n_entries * sizeof *b->value);
}

static void *put(char **at, const void *from, size_t bytes)
{
    void *to = *at;
    if (bytes > 0) memcpy(to, from, bytes);
    *at += rounded(bytes);
    return to;
}

/* What the worker has made, in memory of its size. */
static enum imp_status block_keep(imp_context *ctx, const struct imp__row_block *made,
                                  struct imp__row_block *out)
{
    struct imp__row_block b = *made;
    b.memory = imp__alloc_raw(ctx, imp_max(bytes_of(made), (size_t)1), 1);
    if (!b.memory)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for rows of derivatives");
    char *at = b.memory;
    b.pixel = put(&at, made->pixel, made->n_pixels * sizeof *made->pixel);
    b.r = put(&at, made->r, made->n_rows * sizeof *made->r);
    b.push = put(&at, made->push, made->n_rows * sizeof *made->push);
    b.end = put(&at, made->end, made->n_rows * sizeof *made->end);
    b.number = put(&at, made->number, made->n_entries * sizeof *made->number);
    b.value = put(&at, made->value, made->n_entries * sizeof *made->value);
    *out = b;
    return IMP_OK;
}

/* Squared residual of M units with means r, by the pairs of different ones: r^2 has the
 * variance of r by walks, too, and pixel by pixel the difference may be negative. */
static double noise_share(const struct imp__row_block *b)
{
    double pairs = 0, all = 0;
    for (size_t i = 0; i < b->n_pixels; i++) {
        const struct imp__row_pixel *p = &b->pixel[i];
        const double M = p->units;
        for (size_t c = 0; c < (size_t)b->channels; c++) {
            double sum = 0, square = 0;
            for (int a = 0; a < p->units; a++) {
                const double r = b->r[p->row + (size_t)a * (size_t)b->channels + c];
                sum += r;
                square += r * r;
            }
            pairs += p->weight[c] * (sum * sum - square) / (M * (M - 1));
            all += p->weight[c] * sum * sum / (M * M);
        }
    }
    return all > 0 ? imp_clamp(pairs / all, 0.0, 1.0) : 0;
}

static bool counts(const void *job, int x, int y)
{
    const struct imp__rows_job *j = job;
    const size_t index = (size_t)y * (size_t)j->tiles.width + (size_t)x;
    return !j->target->weights || j->target->weights[index] != 0;
}

static enum imp_status work(const struct imp_tile *t, struct imp_tile_worker *tile,
                            void *result, void *payload)
{
    struct imp__rows_job *j = payload;
    struct imp__rows_worker *w = &j->workers[tile->index];
    double *sums = result;
    const int b0 = imp__replicates_begin(j->plan, (int)t->part);
    const int b1 = imp__replicates_begin(j->plan, (int)t->part + 1);
    memset(sums, 0, IMP_ROWS_SCALARS * sizeof *sums);
    w->made.n_pixels = w->made.n_rows = w->made.n_entries = 0;
    w->made.channels = j->target->desc.channels;
    struct imp__tile_walks walks;
    imp__tile_walks_begin(&j->tracer, t, tile, j->plan, b0, b1, 1, counts, j, &walks);
    for (int y = t->y0; y < t->y1; y++)
        for (int x = t->x0; x < t->x1; x++) {
            if (!counts(j, x, y)) continue;
            enum imp_status st = imp__rows_pixel(j, tile, &walks, x, y, b0, b1, sums);
            if (st == IMP_OK) st = imp__tile_check(tile);
            if (st != IMP_OK) return st;
        }
    w->made.noise_share = noise_share(&w->made);
    sums[IMP_ROWS_BYTES] = (double)bytes_of(&w->made);
    sums[IMP_ROWS_ITEMS] = 1;
    if (j->look) return IMP_OK;
    return block_keep(j->problem->ctx, &w->made,
                      &j->block[t->index * (size_t)j->plan.chunks + t->part]);
}

static void add(void *into, const void *from, void *payload)
{
    double *a = into;
    const double *b = from;
    (void)payload;
    for (int k = 0; k < IMP_ROWS_SCALARS; k++) a[k] += b[k];
}

static enum imp_status take(size_t group, const void *sum, void *payload)
{
    struct imp__rows_job *j = payload;
    (void)group;
    add(j->total, sum, NULL);
    return IMP_OK;
}

/* ---- A target ------------------------------------------------------------------- */

/* Do the rows of all tiles fit in memory? Estimated by those of some. */
static enum imp_status look(struct imp__rows_job *j, const struct imp_tiles_pass *run)
{
    const size_t all = imp__tiles_count(&j->tiles) * run->parts;
    struct imp_tiles_pass pass = *run;
    double before[IMP_ROWS_SCALARS];
    pass.fraction_hi = run->fraction_lo + 0.01 * (run->fraction_hi - run->fraction_lo);
    pass.every = imp_max(all / LOOKS, (size_t)1);
    memcpy(before, j->total, sizeof before);
    j->total[IMP_ROWS_BYTES] = j->total[IMP_ROWS_ITEMS] = 0;
    j->look = true;
    enum imp_status st = imp__tiles_run(&j->tiles, &pass);
    j->look = false;
    j->tiles.drops = (struct imp_drops){0};
    const double bytes =
        j->total[IMP_ROWS_BYTES] * (double)all / fmax(j->total[IMP_ROWS_ITEMS], 1);
    memcpy(j->total, before, sizeof before);
    if (st != IMP_OK) return st;
    /* All ranks have all rows. One that comes late counts again what others hold by then: the
     * check may refuse too soon, not too late. */
    imp_context *ctx = j->problem->ctx;
    const int here = imp__team_here(ctx);
    char what[80] = "least squares of many numbers";
    if (here > 1)
        snprintf(what, sizeof what, "least squares of many numbers, by %d processes",
                 here);
    return imp__memory_check(ctx, here * bytes, what);
}

/* Blocks of one more target, and its part of the loss. */
static enum imp_status target_add(struct imp__rows_job *j, struct imp__rows *rows,
                                  int part, const struct imp__target *target,
                                  const struct imp_run *run, int rounds, bool looks,
                                  struct imp_tiles_pass pass)
{
    const struct imp_problem *p = j->problem;
    imp_context *ctx = p->ctx;
    struct imp_run own = *run;
    IMP_CHECKED(imp__target_tracer(p, target, part, &own, &j->tracer));
    const struct imp_film_desc *film = &j->tracer.sensor->film;
    struct imp_job job = imp__job(p->scene, j->tracer.sensor, &own, &p->active);
    imp__job_state(&job, IMP_HAS_SPARSE_ROWS, NULL);
    if (imp__film_border(film) > 0) imp__job_state(&job, IMP_HAS_SHARED_PIXELS, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    j->target = target;
    j->plan = imp__replicates_normal(p->scene, target, &own, rounds);
    j->tiles = (struct imp_tiles){.ctx = ctx,
                                  .run = &own,
                                  .walks = (double)film->crop_w * film->crop_h *
                                           j->plan.n * j->plan.R,
                                  .width = film->crop_w,
                                  .height = film->crop_h,
                                  .work = work,
                                  .size = IMP_ROWS_SCALARS * sizeof(double),
                                  .add = add,
                                  .take = take,
                                  .payload = j};
    pass.units = j->tiles.walks;
    pass.parts = (size_t)j->plan.chunks;
    enum imp_status st = imp__tiles_create(&j->tiles);
    const size_t items = imp__tiles_count(&j->tiles) * pass.parts;
    if (st == IMP_OK && looks && items > 2 * LOOKS) st = look(j, &pass);
    if (st == IMP_OK) {
        size_t cap = rows->n_blocks;
        struct imp__row_block *grown =
            imp__grow(ctx, rows->block, &cap, rows->n_blocks + items, sizeof *grown);
        if (grown) {
            rows->block = grown;
            j->block = grown + rows->n_blocks;
            memset(j->block, 0, items * sizeof *j->block);
            rows->n_blocks += items;
        } else {
            st = imp__error(ctx, IMP_E_NOMEM, "no memory for rows of derivatives");
        }
    }
    if (st == IMP_OK) st = imp__tiles_run(&j->tiles, &pass);
    imp__tiles_destroy(&j->tiles);
    return st;
}

static void worker_free(imp_context *ctx, struct imp__rows_worker *w)
{
    imp__sparse_sink_destroy(&w->sink);
    imp__release(ctx, w->made.pixel);
    imp__release(ctx, w->made.r);
    imp__release(ctx, w->made.push);
    imp__release(ctx, w->made.end);
    imp__release(ctx, w->made.number);
    imp__release(ctx, w->made.value);
}

void imp__rows_destroy(struct imp__rows *rows)
{
    if (!rows->ctx) return;
    for (size_t k = 0; k < rows->n_blocks; k++)
        imp__release(rows->ctx, rows->block[k].memory);
    imp__release(rows->ctx, rows->block);
    imp__release(rows->ctx, rows->sums);
    *rows = (struct imp__rows){0};
}

enum imp_status imp__rows_take(struct imp_problem *p, const double *x,
                               const struct imp_run *run, int rounds, bool look_first,
                               struct imp__rows *out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->ctx;
    struct imp_run own = *run;
    struct imp__rows rows = {.ctx = ctx, .n = p->n};
    struct imp__rows_job j = {.problem = p};
    const double start = imp__now(), targets = (double)p->n_targets;
    /* Every rank of a team has all rows: it multiplies them by itself. */
    if (ctx->team) ctx->team->alone++;
    if (x) IMP_TRY(imp_problem_set_x(p, x));
    imp__team_state(p->scene, &own);
    j.workers = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j.workers);
    rows.sums =
        imp__alloc_raw(ctx, IMP_ROW_GROUPS * IMP_SPARSE_WIDTH * p->n, sizeof(double));
    if (!j.workers || !rows.sums)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu numbers", p->n));
    for (int k = 0; k < ctx->threads; k++)
        IMP_TRY(imp__sparse_sink_create(ctx, &p->active, p->scene->channels,
                                        &j.workers[k].sink));
    for (size_t t = 0; t < p->n_targets; t++) {
        const int parts = imp__target_parts(&p->targets[t]);
        rows.n_residuals += imp__normal_residual_count(&p->targets[t]);
        for (int k = 0; k < parts; k++) {
            const uint64_t key[2] = {t, (uint64_t)k};
            const struct imp_tiles_pass pass = {
                .stage = "gauss-newton",
                .rate_unit = "walks",
                .fraction_lo = ((double)t + (double)k / parts) / targets,
                .fraction_hi = ((double)t + (double)(k + 1) / parts) / targets,
                .start_s = start};
            j.key = imp__hash(0, key, sizeof key);
            IMP_TRY(target_add(&j, &rows, k, imp__target_part(&p->targets[t], k), &own,
                               rounds, look_first, pass));
        }
        const int bias = imp__loss_bias_order(p->targets[t].desc.loss);
        if (bias && (!rows.objective.bias_order || bias < rows.objective.bias_order))
            rows.objective.bias_order = bias;
    }
    imp__rows_share_noise(&rows, p);
    rows.objective.value = j.total[IMP_ROWS_OBJECTIVE];
    rows.objective.se = sqrt(fmax(0, j.total[IMP_ROWS_VARIANCE]));
    *out = rows;
    rows = (struct imp__rows){0};
out:
    if (ctx->team) ctx->team->alone--;
    for (int k = 0; j.workers && k < ctx->threads; k++) worker_free(ctx, &j.workers[k]);
    imp__release(ctx, j.workers);
    imp__rows_destroy(&rows);
    return st;
}
