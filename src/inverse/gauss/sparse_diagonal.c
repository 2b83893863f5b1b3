/* SPDX-License-Identifier: Apache-2.0
 *
 * Diagonals of the matrices made of rows, and their noise: for a value met in a pixel,
 * with x_a its derivative in unit a,
 *
 *     H_kk        w [(sum x)^2 - sum x^2] / (M (M - 1)),        same samples:  w (sum x)^2/M^2
 *
 * and the variance of H_kk is the jackknife's: (M - 1)/M times the sum of squares of what it
 * differs by from its mean when a unit is left out. */
#include "normal_tiles.h"
#include "sparse_rows.h"
#include <math.h>
#include <string.h>

enum { UNITS = IMP_NORMAL_UNITS };

struct entry { /* a value with a derivative in a pixel's walks */
    uint32_t number;
    double x[UNITS];       /* of a channel */
    double without[UNITS]; /* H_kk of all channels, but for this unit */
};

struct worker {
    uint32_t *slot; /* [n] 1 + its entry; 0: none */
    struct entry *entry;
    size_t n, cap;
};

struct job {
    const struct imp__rows *rows;
    struct worker *workers;
    double *sums; /* [IMP_ROW_GROUPS][3][n] */
};

/* Entries for the numbers of rows [row, row + count). */
static bool entries_find(imp_context *ctx, struct worker *w,
                         const struct imp__row_block *b, size_t row, size_t count)
{
    const uint32_t begin = row ? b->end[row - 1] : 0;
    for (uint32_t i = begin; i < b->end[row + count - 1]; i++) {
        if (w->slot[b->number[i]]) continue;
        struct entry *grown = imp__grow(ctx, w->entry, &w->cap, w->n + 1, sizeof *grown);
        if (!grown) return false;
        w->entry = grown;
        grown[w->n].number = b->number[i];
        memset(grown[w->n].without, 0, sizeof grown[w->n].without);
        w->slot[b->number[i]] = (uint32_t)++w->n;
    }
    return true;
}

static void channel_add(struct worker *w, const struct imp__row_block *b,
                        const struct imp__row_pixel *p, size_t c, double *diagonal,
                        double *same)
{
    const size_t S = (size_t)b->channels;
    const double M = p->units, weight = p->weight[c] * p->share;
    for (size_t k = 0; k < w->n; k++) memset(w->entry[k].x, 0, sizeof w->entry[k].x);
    for (int a = 0; a < p->units; a++) {
        const size_t row = p->row + (size_t)a * S + c;
        for (uint32_t i = row ? b->end[row - 1] : 0; i < b->end[row]; i++)
            w->entry[w->slot[b->number[i]] - 1].x[a] = (double)b->value[i];
    }
    for (size_t k = 0; k < w->n; k++) {
        struct entry *e = &w->entry[k];
        double sum = 0, square = 0;
        for (int a = 0; a < p->units; a++) {
            sum += e->x[a];
            square += e->x[a] * e->x[a];
        }
        diagonal[e->number] += weight * (sum * sum - square) / (M * (M - 1));
        same[e->number] += weight * sum * sum / (M * M);
        for (int a = 0; a < p->units; a++) {
            const double s = sum - e->x[a], q = square - e->x[a] * e->x[a];
            e->without[a] += weight * (s * s - q) / ((M - 1) * (M - 2));
        }
    }
}

/* Variances, and no numbers any more. */
static void pixel_close(struct worker *w, int units, double *spread)
{
    for (size_t k = 0; k < w->n; k++) {
        const struct entry *e = &w->entry[k];
        double mean = 0, square = 0;
        for (int a = 0; a < units; a++) mean += e->without[a] / units;
        for (int a = 0; a < units; a++) square += imp__sqr(e->without[a] - mean);
        spread[e->number] += square * (units - 1) / units;
        w->slot[e->number] = 0;
    }
    w->n = 0;
}

static enum imp_status group_work(size_t group, int worker, int slot, void *payload)
{
    const struct job *j = payload;
    const struct imp__rows *rows = j->rows;
    struct worker *w = &j->workers[worker];
    double *diagonal = j->sums + group * 3 * rows->n;
    const size_t end = rows->n_blocks * (group + 1) / IMP_ROW_GROUPS;
    (void)slot;
    for (size_t k = rows->n_blocks * group / IMP_ROW_GROUPS; k < end; k++) {
        const struct imp__row_block *b = &rows->block[k];
        for (size_t i = 0; i < b->n_pixels; i++) {
            const struct imp__row_pixel *p = &b->pixel[i];
            const size_t count = (size_t)p->units * (size_t)b->channels;
            if (!entries_find(rows->ctx, w, b, p->row, count))
                return imp__error(rows->ctx, IMP_E_NOMEM, "no memory for derivatives");
            for (size_t c = 0; c < (size_t)b->channels; c++)
                channel_add(w, b, p, c, diagonal, diagonal + 2 * rows->n);
            pixel_close(w, p->units, diagonal + rows->n);
        }
    }
    return IMP_OK;
}

enum imp_status imp__rows_diagonal(const struct imp__rows *rows, double *diagonal,
                                   double *spread, double *same)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = rows->ctx;
    const size_t n = rows->n;
    double *const out[3] = {diagonal, spread, same};
    struct job j = {.rows = rows};
    const struct imp_loop loop = {
        .n_items = IMP_ROW_GROUPS, .work = group_work, .payload = &j};
    j.workers = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j.workers);
    j.sums = imp__alloc(ctx, IMP_ROW_GROUPS * 3 * n, sizeof *j.sums);
    bool made = j.workers && j.sums;
    for (int k = 0; made && k < ctx->threads; k++) {
        j.workers[k].slot = imp__alloc(ctx, n, sizeof *j.workers[k].slot);
        made = j.workers[k].slot != NULL;
    }
    if (!made) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for %zu numbers", n));
    IMP_TRY(imp__parallel(ctx, &loop, NULL));
    for (int of = 0; of < 3; of++)
        for (size_t k = 0; k < n; k++) {
            out[of][k] = 0;
            for (size_t g = 0; g < IMP_ROW_GROUPS; g++)
                out[of][k] += j.sums[(g * 3 + (size_t)of) * n + k];
        }
out:
    for (int k = 0; j.workers && k < ctx->threads; k++) {
        imp__release(ctx, j.workers[k].slot);
        imp__release(ctx, j.workers[k].entry);
    }
    imp__release(ctx, j.workers);
    imp__release(ctx, j.sums);
    return st;
}
