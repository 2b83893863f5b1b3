/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of sweeps: batches, pixels and tiles, in arrays or in a hash table. */
#include "tally.h"
#include "overlap.h"
#include <string.h>

/* ---- Tallies -------------------------------------------------------------------- */

enum imp_status imp__tally_create(imp_context *ctx, const struct imp_active *active,
                                  int lanes, int R, struct imp_tally *out)
{
    struct imp_tally t = {.ctx = ctx, .active = active, .lanes = lanes, .R = R};
    t.dense = active->n <= IMP_TALLY_DENSE;
    if (active->n >= INT32_MAX)
        return imp__error(ctx, IMP_E_ARG, "more than %d active numbers", INT32_MAX);
    if (t.dense) {
        t.batch = imp__alloc(ctx, (7 + (size_t)R) * active->n, sizeof *t.batch);
        if (!t.batch) return imp__error(ctx, IMP_E_NOMEM, "no memory for gradients");
        t.error = t.batch + active->n;
        t.sum = t.error + active->n;
        t.square = t.sum + active->n;
        t.mean = t.square + active->n;
        t.variance = t.mean + active->n;
        t.tile = t.variance + active->n;
        t.of_tile = t.tile + active->n;
    } else if (!imp__tally_table_grow(&t)) {
        return imp__error(ctx, IMP_E_NOMEM, "no memory for gradients");
    }
    *out = t;
    imp__tally_sinks(out);
    return IMP_OK;
}

void imp__tally_destroy(struct imp_tally *t)
{
    if (!t->ctx) return;
    imp__release(t->ctx, t->batch);
    imp__release(t->ctx, t->table);
    imp__release(t->ctx, t->triples);
    imp__release(t->ctx, t->singles);
    imp__release(t->ctx, t->triples_of_tile);
    imp__release(t->ctx, t->singles_of_tile);
    imp__release(t->ctx, t->touched_triples.index);
    imp__release(t->ctx, t->touched_singles.index);
    *t = (struct imp_tally){0};
}

void imp__tally_clear(struct imp_tally *t)
{
    if (t->dense) {
        memset(t->batch, 0, (7 + (size_t)t->R) * t->active->n * sizeof *t->batch);
    } else {
        memset(t->table, 0, t->table_size * sizeof *t->table);
        t->n_triples = t->n_singles = 0;
        t->touched_triples.n = t->touched_singles.n = 0;
    }
}

/* ---- Batches, pixels, tiles --------------------------------------------------------- */

void imp__tally_batch(struct imp_tally *t, int b)
{
    const size_t R = (size_t)t->R, at = R ? (size_t)b : 0;
    if (imp_unlikely(imp__tally_probes(t))) imp__tally_probe_batch(t);
    if (t->dense) {
        double *of_tile = t->of_tile + at * t->active->n;
        for (size_t k = 0; k < t->active->n; k++) {
            t->sum[k] += t->batch[k];
            t->square[k] += t->batch[k] * t->batch[k];
            if (R) of_tile[k] += t->batch[k];
            t->batch[k] = 0;
        }
        return;
    }
    for (size_t k = 0; k < t->touched_triples.n; k++) {
        const size_t number = t->touched_triples.index[k];
        struct imp__tally_triple *e = &t->triples[number];
        for (int c = 0; c < 3; c++) {
            e->sum[c] += e->batch[c];
            e->square[c] += e->batch[c] * e->batch[c];
            if (R) t->triples_of_tile[number * R + at][c] += e->batch[c];
            e->batch[c] = 0;
        }
    }
    for (size_t k = 0; k < t->touched_singles.n; k++) {
        const size_t number = t->touched_singles.index[k];
        struct imp__tally_single *e = &t->singles[number];
        e->sum += e->batch;
        e->square += e->batch * e->batch;
        if (R) t->singles_of_tile[number * R + at] += e->batch;
        e->batch = 0;
    }
}

void imp__tally_pixel(struct imp_tally *t, double replicates, double by_mean,
                      double by_variance)
{
    const double r = 1 / replicates;
    if (imp_unlikely(imp__tally_probes(t))) imp__tally_probe_pixel(t, r, by_variance);
    if (t->dense) {
        for (size_t k = 0; k < t->active->n; k++) {
            t->mean[k] += by_mean * t->sum[k];
            t->variance[k] += by_variance * (t->square[k] - t->sum[k] * t->sum[k] * r);
            t->sum[k] = t->square[k] = 0;
        }
        return;
    }
    for (size_t k = 0; k < t->touched_triples.n; k++) {
        struct imp__tally_triple *e = &t->triples[t->touched_triples.index[k]];
        for (int c = 0; c < 3; c++) {
            e->mean[c] += by_mean * e->sum[c];
            e->variance[c] += by_variance * (e->square[c] - e->sum[c] * e->sum[c] * r);
            e->sum[c] = e->square[c] = 0;
        }
        e->touched = false;
    }
    for (size_t k = 0; k < t->touched_singles.n; k++) {
        struct imp__tally_single *e = &t->singles[t->touched_singles.index[k]];
        e->mean += by_mean * e->sum;
        e->variance += by_variance * (e->square - e->sum * e->sum * r);
        e->sum = e->square = 0;
        e->touched = false;
    }
    t->touched_triples.n = t->touched_singles.n = 0;
}

void imp__tally_error(struct imp_tally *t)
{
    if (imp_unlikely(imp__tally_probes(t))) imp__tally_probe_error(t);
    for (size_t k = 0; t->dense && k < t->active->n; k++) {
        t->variance[k] += t->error[k] * t->error[k];
        t->error[k] = 0;
    }
    for (size_t k = 0; k < t->touched_triples.n; k++) {
        struct imp__tally_triple *e = &t->triples[t->touched_triples.index[k]];
        for (int c = 0; c < 3; c++) {
            e->variance[c] += e->error[c] * e->error[c];
            e->error[c] = 0;
        }
    }
    for (size_t k = 0; k < t->touched_singles.n; k++) {
        struct imp__tally_single *e = &t->singles[t->touched_singles.index[k]];
        e->variance += e->error * e->error;
        e->error = 0;
    }
}

void imp__tally_tile(struct imp_tally *t, double by_variance)
{
    const size_t n = t->active->n;
    for (size_t k = 0; k < n; k++) {
        double sum = 0, square = 0;
        for (int b = 0; b < t->R; b++) {
            const double v = t->of_tile[(size_t)b * n + k];
            sum += v;
            square += v * v;
        }
        t->tile[k] = by_variance * (square - sum * sum / t->R);
    }
}

#define AHEAD 12 /* entries */

static inline __attribute__((always_inline)) void
prefetch(const struct imp_fixed_sum *mean, const struct imp_fixed_sum *variance,
         uint32_t key)
{
    imp__fixed_prefetch(mean, key);
    if (variance) imp__fixed_prefetch(variance, key);
}

void imp__tally_flush(const struct imp_tally *t, double by_variance, double factor,
                      struct imp_fixed_sum *mean, struct imp_fixed_sum *variance)
{
    const size_t R = (size_t)t->R;
    for (size_t k = 0; k < t->n_triples; k++) {
        const struct imp__tally_triple *e = &t->triples[k];
        if (k + AHEAD < t->n_triples) prefetch(mean, variance, e[AHEAD].key);
        imp_spec sum = {0}, square = {0};
        for (size_t b = 0; b < R; b++) {
            const imp_spec v = t->triples_of_tile[k * R + b];
            sum += v;
            square += v * v;
        }
        for (uint32_t c = 0; c < 3; c++) {
            double v = e->variance[c];
            if (R)
                v = imp__overlap_variance(
                    factor, true, v, by_variance * (square[c] - sum[c] * sum[c] / t->R));
            imp__fixed_add(mean, e->key + c, e->mean[c]);
            if (variance) imp__fixed_add(variance, e->key + c, v);
        }
    }
    for (size_t k = 0; k < t->n_singles; k++) {
        const struct imp__tally_single *e = &t->singles[k];
        if (k + AHEAD < t->n_singles) prefetch(mean, variance, e[AHEAD].key);
        double v = e->variance, sum = 0, square = 0;
        for (size_t b = 0; b < R; b++) {
            sum += t->singles_of_tile[k * R + b];
            square += imp__sqr(t->singles_of_tile[k * R + b]);
        }
        if (R)
            v = imp__overlap_variance(factor, true, v,
                                      by_variance * (square - sum * sum / t->R));
        imp__fixed_add(mean, e->key, e->mean);
        if (variance) imp__fixed_add(variance, e->key, v);
    }
}
