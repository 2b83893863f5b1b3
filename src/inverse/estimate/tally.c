/* SPDX-License-Identifier: Apache-2.0
 *
 * The sink of sweeps: batches, pixels and tiles, in arrays or in a hash table. */
#include "tally.h"
#include "overlap.h"
#include <string.h>

#define TABLE_MIN 1024

/* ---- Few numbers ---------------------------------------------------------------- */

static void add_dense(struct imp_sink *sink, int param, size_t element, int channels,
                      const imp_spec *bar)
{
    struct imp_tally *t = (struct imp_tally *)sink;
    const int64_t base = t->active->base[param];
    if (base < 0) return;
    double *batch = t->batch + base + element;
    if (channels == 3)
        for (int c = 0; c < 3; c++) batch[c] += (*bar)[c];
    else batch[0] += imp__sum_used(*bar, t->lanes);
}

/* Where some values are tied to others. */
static void add_dense_tied(struct imp_sink *sink, int param, size_t element, int channels,
                           const imp_spec *bar)
{
    struct imp_tally *t = (struct imp_tally *)sink;
    if (t->active->base[param] < 0) return;
    for (int c = 0; c < (channels == 3 ? 3 : 1); c++) {
        const size_t e = element + (size_t)c;
        const double d = channels == 3 ? (*bar)[c] : imp__sum_used(*bar, t->lanes);
        t->batch[imp__active_at(t->active, param, e)] +=
            d * imp__active_slope(t->active, param, e);
    }
}

/* ---- Many numbers --------------------------------------------------------------- */

/* The tag of a slot of the table; 0 is an empty slot. One key may have two entries: a
 * triple where a texture is read as a colour, a single where it is read as one number. */
static inline uint32_t tag_of(uint32_t key, bool single)
{
    return (key << 1 | single) + 1;
}

/* Where key is, or would be (Fibonacci hashing; Knuth, vol. 3, 6.4). Eight neighbours
 * share a line of the cache: cells and texels are touched side by side. Triples are counted by
 * threes: the keys between them have no entry. */
static inline struct imp__tally_slot *slot_of(const struct imp_tally *t, uint32_t key,
                                              bool single)
{
    const uint32_t tag = tag_of(key, single), number = single ? key : key / 3;
    const uint32_t hash = (number >> 3) * UINT32_C(0x9e3779b9);
    size_t k = (size_t)(hash >> t->shift) << 3 | (number & 7);
    while (imp_unlikely(t->table[k].tag != tag) && t->table[k].tag != 0)
        k = (k + 1) & (t->table_size - 1);
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
    t->shift = imp_max(35 - __builtin_ctzll(size), 0);
    for (size_t k = 0; k < t->n_triples; k++) {
        const uint32_t key = t->triples[k].key;
        *slot_of(t, key, false) =
            (struct imp__tally_slot){tag_of(key, false), (uint32_t)k};
    }
    for (size_t k = 0; k < t->n_singles; k++) {
        const uint32_t key = t->singles[k].key;
        *slot_of(t, key, true) = (struct imp__tally_slot){tag_of(key, true), (uint32_t)k};
    }
    return true;
}

/* Grows the tile's sums by those of a new entry. */
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

/* A new entry. False: no memory. */
static bool entry_add(struct imp_tally *t, uint32_t key, bool single, size_t *index)
{
    if (2 * (t->n_triples + t->n_singles) >= t->table_size && !table_grow(t))
        return false;
    if (!of_tile_grow(t, single)) return false;
    if (single) {
        void *grown = imp__grow(t->ctx, t->singles, &t->cap_singles, t->n_singles + 1,
                                sizeof *t->singles);
        if (!grown) return false;
        t->singles = grown;
        *index = t->n_singles++;
        t->singles[*index] = (struct imp__tally_single){.key = key};
    } else {
        void *grown = imp__grow(t->ctx, t->triples, &t->cap_triples, t->n_triples + 1,
                                sizeof *t->triples);
        if (!grown) return false;
        t->triples = grown;
        *index = t->n_triples++;
        t->triples[*index] = (struct imp__tally_triple){.key = key};
    }
    *slot_of(t, key, single) =
        (struct imp__tally_slot){tag_of(key, single), (uint32_t)*index};
    return true;
}

static bool touch(struct imp_tally *t, struct imp__tally_list *list, size_t entry)
{
    if (imp_unlikely(list->n == list->cap)) {
        void *grown =
            imp__grow(t->ctx, list->index, &list->cap, list->n + 1, sizeof *list->index);
        if (!grown) return false;
        list->index = grown;
    }
    list->index[list->n++] = (uint32_t)entry;
    return true;
}

/* The first addition of a pixel to an entry, which the tile may not have yet. */
static __attribute__((noinline)) void add_first(struct imp_tally *t, uint32_t key,
                                                bool single, const imp_spec *bar)
{
    const struct imp__tally_slot *s = slot_of(t, key, single);
    size_t k = s->entry;
    if (s->tag == 0 && !entry_add(t, key, single, &k)) goto no_memory;
    if (!touch(t, single ? &t->touched_singles : &t->touched_triples, k)) goto no_memory;
    if (single) {
        t->singles[k].touched = true;
        t->singles[k].batch += imp__sum_used(*bar, t->lanes);
    } else {
        t->triples[k].touched = true;
        t->triples[k].batch += *bar;
    }
    return;
no_memory:
    t->failed = true;
}

static inline void add_entry(struct imp_tally *t, size_t at, bool single,
                             const imp_spec *bar)
{
    const uint32_t key = (uint32_t)at;
    const struct imp__tally_slot *s = slot_of(t, key, single);
    if (imp_likely(s->tag != 0)) {
        if (single && imp_likely(t->singles[s->entry].touched)) {
            t->singles[s->entry].batch += imp__sum_used(*bar, t->lanes);
            return;
        }
        if (!single && imp_likely(t->triples[s->entry].touched)) {
            t->triples[s->entry].batch += *bar;
            return;
        }
    }
    add_first(t, key, single, bar);
}

static void add_hashed(struct imp_sink *sink, int param, size_t element, int channels,
                       const imp_spec *bar)
{
    struct imp_tally *t = (struct imp_tally *)sink;
    const int64_t base = t->active->base[param];
    if (base >= 0) add_entry(t, (size_t)base + element, channels != 3, bar);
}

/* Where some values are tied to others. */
static void add_hashed_tied(struct imp_sink *sink, int param, size_t element,
                            int channels, const imp_spec *bar)
{
    struct imp_tally *t = (struct imp_tally *)sink;
    const bool single = channels != 3;
    if (t->active->base[param] < 0) return;
    imp_spec tied = {0};
    for (int c = 0; c < (single ? t->lanes : 3); c++)
        tied[c] = (*bar)[c] *
                  imp__active_slope(t->active, param, element + (single ? 0 : (size_t)c));
    const bool one = t->active->tied[param].factor != NULL;
    add_entry(t, imp__active_at(t->active, param, element), single || one,
              one && !single ? &(imp_spec){tied[0] + tied[1] + tied[2]} : &tied);
}

/* ---- Tallies -------------------------------------------------------------------- */

enum imp_status imp__tally_create(imp_context *ctx, const struct imp_active *active,
                                  int lanes, int R, struct imp_tally *out)
{
    struct imp_tally t = {.ctx = ctx, .active = active, .lanes = lanes, .R = R};
    t.dense = active->n <= IMP_TALLY_DENSE;
    if (active->tied) t.sink.add = t.dense ? add_dense_tied : add_hashed_tied;
    else t.sink.add = t.dense ? add_dense : add_hashed;
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
    } else if (!table_grow(&t)) {
        return imp__error(ctx, IMP_E_NOMEM, "no memory for gradients");
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

void imp__tally_error(struct imp_tally *t)
{
    if (imp_unlikely(imp__tally_probes(t))) imp__tally_probe_error(t);
    for (size_t k = 0; t->dense && k < t->active->n; k++) {
        t->variance[k] += t->batch[k] * t->batch[k];
        t->batch[k] = 0;
    }
    for (size_t k = 0; k < t->touched_triples.n; k++) {
        struct imp__tally_triple *e = &t->triples[t->touched_triples.index[k]];
        for (int c = 0; c < 3; c++) e->variance[c] += e->batch[c] * e->batch[c];
        e->batch = (imp_spec){0};
    }
    for (size_t k = 0; k < t->touched_singles.n; k++) {
        struct imp__tally_single *e = &t->singles[t->touched_singles.index[k]];
        e->variance += e->batch * e->batch;
        e->batch = 0;
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
