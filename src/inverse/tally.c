/* SPDX-License-Identifier: Apache-2.0
 *
 * The sink of sweeps: batches, pixels and tiles, in arrays or in a hash table. */
#include "tally.h"
#include <string.h>

#define TABLE_MIN 1024

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

/* Where key is, or would be (Fibonacci hashing; Knuth, vol. 3, 6.4). */
static inline struct imp__tally_slot *slot_of(const struct imp_tally *t, uint32_t key)
{
    const size_t mask = t->table_size - 1;
    size_t k = (key * UINT64_C(0x9e3779b97f4a7c15)) >> 32 & mask;
    while (t->table[k].entry && t->table[k].key != key) k = (k + 1) & mask;
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
    for (size_t k = 0; k < t->n_entries; k++)
        *slot_of(t, t->entries[k].key) =
            (struct imp__tally_slot){t->entries[k].key, (uint32_t)k + 1};
    return true;
}

static __attribute__((noinline)) struct imp__tally_entry *
entry_add(struct imp_tally *t, uint32_t key, int channels)
{
    if (2 * t->n_entries >= t->table_size && !table_grow(t)) return NULL;
    void *grown = imp__grow(t->ctx, t->entries, &t->cap_entries, t->n_entries + 1,
                            sizeof *t->entries);
    if (!grown) return NULL;
    t->entries = grown;
    struct imp__tally_entry *e = &t->entries[t->n_entries++];
    memset(e, 0, sizeof *e);
    e->key = key;
    e->channels = (uint32_t)channels;
    *slot_of(t, key) = (struct imp__tally_slot){key, (uint32_t)t->n_entries};
    return e;
}

static inline struct imp__tally_entry *entry_find(struct imp_tally *t, uint32_t key,
                                                  int channels)
{
    if (imp_likely(t->table_size > 0)) {
        const struct imp__tally_slot *s = slot_of(t, key);
        if (imp_likely(s->entry)) return &t->entries[s->entry - 1];
    }
    return entry_add(t, key, channels);
}

static void add_hashed(struct imp_sink *sink, int param, size_t element, int channels,
                       const imp_spec *bar)
{
    struct imp_tally *t = (struct imp_tally *)sink;
    const int64_t base = t->active->base[param];
    if (base < 0 || t->failed) return;
    struct imp__tally_entry *e =
        entry_find(t, (uint32_t)((size_t)base + element), channels);
    if (!e) {
        t->failed = true;
        return;
    }
    if (!e->touched) {
        void *grown = imp__grow(t->ctx, t->touched, &t->cap_touched, t->n_touched + 1,
                                sizeof *t->touched);
        if (!grown) {
            t->failed = true;
            return;
        }
        t->touched = grown;
        t->touched[t->n_touched++] = (uint32_t)(e - t->entries);
        e->touched = true;
    }
    if (channels == 3) e->batch += *bar;
    else e->batch[0] += imp__sum_used(*bar, t->lanes);
}

enum imp_status imp__tally_create(imp_context *ctx, const struct imp_active *active,
                                  int lanes, struct imp_tally *out)
{
    struct imp_tally t = {.ctx = ctx, .active = active, .lanes = lanes};
    t.dense = active->n <= IMP_TALLY_DENSE;
    t.sink.add = t.dense ? add_dense : add_hashed;
    if (active->n >= UINT32_MAX)
        return imp__error(ctx, IMP_E_ARG, "more than %u active numbers", UINT32_MAX);
    if (t.dense) {
        t.batch = imp__alloc(ctx, 5 * active->n, sizeof *t.batch);
        if (!t.batch) return imp__error(ctx, IMP_E_NOMEM, "no memory for gradients");
        t.sum = t.batch + active->n;
        t.square = t.sum + active->n;
        t.mean = t.square + active->n;
        t.variance = t.mean + active->n;
    }
    *out = t;
    return IMP_OK;
}

void imp__tally_destroy(struct imp_tally *t)
{
    if (!t->ctx) return;
    imp__release(t->ctx, t->batch);
    imp__release(t->ctx, t->table);
    imp__release(t->ctx, t->entries);
    imp__release(t->ctx, t->touched);
    *t = (struct imp_tally){0};
}

void imp__tally_clear(struct imp_tally *t)
{
    if (t->dense) {
        memset(t->batch, 0, 5 * t->active->n * sizeof *t->batch);
    } else {
        if (t->table_size) memset(t->table, 0, t->table_size * sizeof *t->table);
        t->n_entries = t->n_touched = 0;
    }
}

void imp__tally_batch(struct imp_tally *t)
{
    if (t->dense) {
        for (size_t k = 0; k < t->active->n; k++) {
            t->sum[k] += t->batch[k];
            t->square[k] += t->batch[k] * t->batch[k];
            t->batch[k] = 0;
        }
        return;
    }
    for (size_t k = 0; k < t->n_touched; k++) {
        struct imp__tally_entry *e = &t->entries[t->touched[k]];
        e->sum += e->batch;
        e->square += e->batch * e->batch;
        e->batch = (imp_spec){0};
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
    for (size_t k = 0; k < t->n_touched; k++) {
        struct imp__tally_entry *e = &t->entries[t->touched[k]];
        const imp_spec spread = e->square - e->sum * e->sum * r;
        for (int c = 0; c < 3; c++) {
            e->mean[c] += by_mean * e->sum[c];
            e->variance[c] += by_variance * spread[c];
        }
        e->sum = e->square = (imp_spec){0};
        e->touched = false;
    }
    t->n_touched = 0;
}

void imp__tally_flush(const struct imp_tally *t, struct imp_fixed_sum *mean,
                      struct imp_fixed_sum *variance)
{
    for (size_t k = 0; k < t->n_entries; k++) {
        const struct imp__tally_entry *e = &t->entries[k];
        for (uint32_t c = 0; c < e->channels; c++) {
            imp__fixed_add(mean, e->key + c, e->mean[c]);
            if (variance) imp__fixed_add(variance, e->key + c, e->variance[c]);
        }
    }
}
