/* SPDX-License-Identifier: Apache-2.0
 *
 * The sink of sweeps: batches, pixels and tiles, in arrays or in a hash table. */
#include "tally.h"
#include "overlap.h"
#include <string.h>

#define TABLE_MIN 1024

static void add_dense(struct imp_sink *sink, int param, size_t element, int channels,
                      const imp_spec *bar)
{
    struct imp_tally *t = (struct imp_tally *)sink;
    const int64_t base = t->active->base[param];
    if (base < 0) return;
    if (imp_unlikely(t->active->tied != NULL)) {
        for (int c = 0; c < (channels == 3 ? 3 : 1); c++) {
            const size_t e = element + (size_t)c;
            const double d = channels == 3 ? (*bar)[c] : imp__sum_used(*bar, t->lanes);
            t->batch[imp__active_at(t->active, param, e)] +=
                d * imp__active_slope(t->active, param, e);
        }
        return;
    }
    double *batch = t->batch + base + element;
    if (channels == 3)
        for (int c = 0; c < 3; c++) batch[c] += (*bar)[c];
    else batch[0] += imp__sum_used(*bar, t->lanes);
}

/* Where key is, or would be (Fibonacci hashing; Knuth, vol. 3, 6.4). Eight neighbours
 * share a line of the cache: cells and texels are touched side by side. A texture that is
 * read as a colour here and as one number there has a triple and a single of one key. */
static inline struct imp__tally_slot *slot_of(const struct imp_tally *t, uint32_t key,
                                              bool single)
{
    const size_t mask = t->table_size - 1;
    size_t k = ((key >> 3) * UINT64_C(0x9e3779b97f4a7c15) >> 32 << 3 | (key & 7)) & mask;
    while (t->table[k].entry &&
           (t->table[k].key != key || (t->table[k].entry >= IMP__TALLY_SINGLE) != single))
        k = (k + 1) & mask;
    return &t->table[k];
}

static bool table_grow(struct imp_tally *t)
{
    const size_t size = t->table_size ? 2 * t->table_size : TABLE_MIN;
    struct imp__tally_slot *table = imp__alloc(t->ctx, size, sizeof *table);
    if (!table) return false;
    imp__release(t->ctx, t->table);
    t->table = table;
    t->table_size = size;
    for (size_t k = 0; k < t->n_triples; k++)
        *slot_of(t, t->triples[k].key, false) =
            (struct imp__tally_slot){t->triples[k].key, (uint32_t)k + 1};
    for (size_t k = 0; k < t->n_singles; k++)
        *slot_of(t, t->singles[k].key, true) = (struct imp__tally_slot){
            t->singles[k].key, ((uint32_t)k + 1) | IMP__TALLY_SINGLE};
    return true;
}

/* Room for what a new entry has of the tile. */
static bool of_tile_grow(struct imp_tally *t, bool single)
{
    const size_t R = (size_t)t->R;
    if (R == 0) return true;
    if (single) {
        const size_t n = t->n_singles + 1;
        double *grown = imp__grow(t->ctx, t->singles_of_tile, &t->cap_singles_of_tile, n,
                                  R * sizeof *grown);
        if (!grown) return false;
        t->singles_of_tile = grown;
        memset(grown + (n - 1) * R, 0, R * sizeof *grown);
        return true;
    }
    const size_t n = t->n_triples + 1;
    imp_spec *grown = imp__grow(t->ctx, t->triples_of_tile, &t->cap_triples_of_tile, n,
                                R * sizeof *grown);
    if (!grown) return false;
    t->triples_of_tile = grown;
    memset(grown + (n - 1) * R, 0, R * sizeof *grown);
    return true;
}

/* A new entry, and its index; -1: no memory. */
static __attribute__((noinline)) int64_t entry_add(struct imp_tally *t, uint32_t key,
                                                   bool single)
{
    if (2 * (t->n_triples + t->n_singles) >= t->table_size && !table_grow(t)) return -1;
    if (!of_tile_grow(t, single)) return -1;
    if (single) {
        void *grown = imp__grow(t->ctx, t->singles, &t->cap_singles, t->n_singles + 1,
                                sizeof *t->singles);
        if (!grown) return -1;
        t->singles = grown;
        t->singles[t->n_singles++] = (struct imp__tally_single){.key = key};
        *slot_of(t, key, true) =
            (struct imp__tally_slot){key, (uint32_t)t->n_singles | IMP__TALLY_SINGLE};
        return (int64_t)t->n_singles - 1;
    }
    void *grown = imp__grow(t->ctx, t->triples, &t->cap_triples, t->n_triples + 1,
                            sizeof *t->triples);
    if (!grown) return -1;
    t->triples = grown;
    t->triples[t->n_triples++] = (struct imp__tally_triple){.key = key};
    *slot_of(t, key, false) = (struct imp__tally_slot){key, (uint32_t)t->n_triples};
    return (int64_t)t->n_triples - 1;
}

static inline int64_t entry_find(struct imp_tally *t, uint32_t key, bool single)
{
    if (imp_likely(t->table_size > 0)) {
        const struct imp__tally_slot *s = slot_of(t, key, single);
        if (imp_likely(s->entry)) return (int64_t)(s->entry & ~IMP__TALLY_SINGLE) - 1;
    }
    return entry_add(t, key, single);
}

static bool touch(struct imp_tally *t, struct imp__tally_list *list, int64_t entry)
{
    void *grown =
        imp__grow(t->ctx, list->index, &list->cap, list->n + 1, sizeof *list->index);
    if (!grown) return false;
    list->index = grown;
    list->index[list->n++] = (uint32_t)entry;
    return true;
}

static void add_entry(struct imp_tally *t, size_t at, bool single, const imp_spec *bar)
{
    const int64_t k = entry_find(t, (uint32_t)at, single);
    if (k < 0) {
        t->failed = true;
        return;
    }
    if (imp_likely(single)) {
        struct imp__tally_single *e = &t->singles[k];
        if (!e->touched) t->failed |= !touch(t, &t->touched_singles, k);
        e->touched = true;
        e->batch += imp__sum_used(*bar, t->lanes);
    } else {
        struct imp__tally_triple *e = &t->triples[k];
        if (!e->touched) t->failed |= !touch(t, &t->touched_triples, k);
        e->touched = true;
        e->batch += *bar;
    }
}

static void add_hashed(struct imp_sink *sink, int param, size_t element, int channels,
                       const imp_spec *bar)
{
    struct imp_tally *t = (struct imp_tally *)sink;
    const int64_t base = t->active->base[param];
    if (base < 0 || t->failed) return;
    const bool single = channels != 3;
    if (imp_likely(!t->active->tied)) {
        add_entry(t, (size_t)base + element, single, bar);
        return;
    }
    imp_spec tied = {0};
    for (int c = 0; c < (single ? t->lanes : 3); c++)
        tied[c] = (*bar)[c] *
                  imp__active_slope(t->active, param, element + (single ? 0 : (size_t)c));
    const bool one = t->active->tied[param].factor != NULL;
    add_entry(t, imp__active_at(t->active, param, element), single || one,
              one && !single ? &(imp_spec){tied[0] + tied[1] + tied[2]} : &tied);
}

enum imp_status imp__tally_create(imp_context *ctx, const struct imp_active *active,
                                  int lanes, int R, struct imp_tally *out)
{
    struct imp_tally t = {.ctx = ctx, .active = active, .lanes = lanes, .R = R};
    t.dense = active->n <= IMP_TALLY_DENSE;
    t.sink.add = t.dense ? add_dense : add_hashed;
    if (active->n >= INT32_MAX)
        return imp__error(ctx, IMP_E_ARG, "more than %d active numbers", INT32_MAX);
    if (t.dense) {
        t.batch = imp__alloc(ctx, (6 + (size_t)R) * active->n, sizeof *t.batch);
        if (!t.batch) return imp__error(ctx, IMP_E_NOMEM, "no memory for gradients");
        t.sum = t.batch + active->n;
        t.square = t.sum + active->n;
        t.mean = t.square + active->n;
        t.variance = t.mean + active->n;
        t.tile = t.variance + active->n;
        t.of_tile = t.tile + active->n;
    }
    *out = t;
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
        memset(t->batch, 0, (6 + (size_t)t->R) * t->active->n * sizeof *t->batch);
    } else {
        if (t->table_size) memset(t->table, 0, t->table_size * sizeof *t->table);
        t->n_triples = t->n_singles = 0;
        t->touched_triples.n = t->touched_singles.n = 0;
    }
}

void imp__tally_batch(struct imp_tally *t, int b)
{
    const size_t R = (size_t)t->R, at = R ? (size_t)b : 0;
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
        e->sum += e->batch;
        e->square += e->batch * e->batch;
        if (R) t->triples_of_tile[number * R + at] += e->batch;
        e->batch = (imp_spec){0};
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
        const imp_spec spread = e->square - e->sum * e->sum * r;
        for (int c = 0; c < 3; c++) {
            e->mean[c] += by_mean * e->sum[c];
            e->variance[c] += by_variance * spread[c];
        }
        e->sum = e->square = (imp_spec){0};
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

void imp__tally_flush(const struct imp_tally *t, double by_variance, double factor,
                      struct imp_fixed_sum *mean, struct imp_fixed_sum *variance)
{
    const size_t R = (size_t)t->R;
    for (size_t k = 0; k < t->n_triples; k++) {
        const struct imp__tally_triple *e = &t->triples[k];
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
