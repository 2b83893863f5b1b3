/* SPDX-License-Identifier: Apache-2.0
 *
 * The sinks of a tally: what sweeps bring goes to the sums of a batch, or of its errors. */
#include "tally.h"
#include <string.h>

#define TABLE_MIN 1024

/* ---- Few numbers ---------------------------------------------------------------- */

static inline void dense_to(const struct imp_tally *t, double *sums, int param,
                            size_t element, int channels, const imp_spec *bar)
{
    const int64_t base = t->active->base[param];
    if (base < 0) return;
    double *batch = sums + base + element;
    if (channels == 3)
        for (int c = 0; c < 3; c++) batch[c] += (*bar)[c];
    else batch[0] += imp__sum_used(*bar, t->lanes);
}

/* Where some values are tied to others. */
static inline void tied_to(const struct imp_tally *t, double *sums, int param,
                           size_t element, int channels, const imp_spec *bar)
{
    if (t->active->base[param] < 0) return;
    for (int c = 0; c < (channels == 3 ? 3 : 1); c++) {
        const size_t e = element + (size_t)c;
        const double d = channels == 3 ? (*bar)[c] : imp__sum_used(*bar, t->lanes);
        sums[imp__active_at(t->active, param, e)] +=
            d * imp__active_slope(t->active, param, e);
    }
}

static inline struct imp_tally *of_errors(struct imp_sink *sink)
{
    return ((struct imp_tally_errors *)sink)->of;
}

static void add_dense(struct imp_sink *sink, int param, size_t element, int channels,
                      const imp_spec *bar)
{
    const struct imp_tally *t = (struct imp_tally *)sink;
    dense_to(t, t->batch, param, element, channels, bar);
}
static void error_dense(struct imp_sink *sink, int param, size_t element, int channels,
                        const imp_spec *bar)
{
    const struct imp_tally *t = of_errors(sink);
    dense_to(t, t->error, param, element, channels, bar);
}
static void both_dense(const struct imp_sink_pair *to, int param, size_t element,
                       int channels, const imp_spec *bar, const imp_spec *other)
{
    const struct imp_tally *t = (const struct imp_tally *)to->first;
    dense_to(t, t->batch, param, element, channels, bar);
    dense_to(t, t->error, param, element, channels, other);
}
static void add_dense_tied(struct imp_sink *sink, int param, size_t element, int channels,
                           const imp_spec *bar)
{
    const struct imp_tally *t = (struct imp_tally *)sink;
    tied_to(t, t->batch, param, element, channels, bar);
}
static void error_dense_tied(struct imp_sink *sink, int param, size_t element,
                             int channels, const imp_spec *bar)
{
    const struct imp_tally *t = of_errors(sink);
    tied_to(t, t->error, param, element, channels, bar);
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

bool imp__tally_table_grow(struct imp_tally *t)
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
    if (2 * (t->n_triples + t->n_singles) >= t->table_size && !imp__tally_table_grow(t))
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

static inline void entry_to(struct imp_tally *t, size_t k, bool single, bool error,
                            const imp_spec *bar)
{
    if (single) {
        *(error ? &t->singles[k].error : &t->singles[k].batch) +=
            imp__sum_used(*bar, t->lanes);
    } else {
        double *sum = error ? t->triples[k].error : t->triples[k].batch;
        for (int c = 0; c < 3; c++) sum[c] += (*bar)[c];
    }
}

/* The first addition of a pixel to an entry, which the tile may not have yet. */
static __attribute__((noinline)) void add_first(struct imp_tally *t, uint32_t key,
                                                bool single, const imp_spec *bar,
                                                const imp_spec *other)
{
    const struct imp__tally_slot *s = slot_of(t, key, single);
    size_t k = s->entry;
    if ((s->tag == 0 && !entry_add(t, key, single, &k)) ||
        !touch(t, single ? &t->touched_singles : &t->touched_triples, k)) {
        t->failed = true;
        return;
    }
    *(single ? &t->singles[k].touched : &t->triples[k].touched) = true;
    if (bar) entry_to(t, k, single, false, bar);
    if (other) entry_to(t, k, single, true, other);
}

/* bar NULL: nothing to the sums; other NULL: nothing to those of errors. */
static inline __attribute__((always_inline)) void add_entry(struct imp_tally *t,
                                                            size_t at, bool single,
                                                            const imp_spec *bar,
                                                            const imp_spec *other)
{
    const uint32_t key = (uint32_t)at;
    const struct imp__tally_slot *s = slot_of(t, key, single);
    if (imp_unlikely(s->tag == 0) ||
        imp_unlikely(single ? !t->singles[s->entry].touched
                            : !t->triples[s->entry].touched)) {
        add_first(t, key, single, bar, other);
        return;
    }
    if (bar) entry_to(t, s->entry, single, false, bar);
    if (other) entry_to(t, s->entry, single, true, other);
}

static void add_hashed(struct imp_sink *sink, int param, size_t element, int channels,
                       const imp_spec *bar)
{
    struct imp_tally *t = (struct imp_tally *)sink;
    const int64_t base = t->active->base[param];
    if (base >= 0) add_entry(t, (size_t)base + element, channels != 3, bar, NULL);
}
static void error_hashed(struct imp_sink *sink, int param, size_t element, int channels,
                         const imp_spec *bar)
{
    struct imp_tally *t = of_errors(sink);
    const int64_t base = t->active->base[param];
    if (base >= 0) add_entry(t, (size_t)base + element, channels != 3, NULL, bar);
}
static void both_hashed(const struct imp_sink_pair *to, int param, size_t element,
                        int channels, const imp_spec *bar, const imp_spec *other)
{
    struct imp_tally *t = (struct imp_tally *)to->first;
    const int64_t base = t->active->base[param];
    if (base >= 0) add_entry(t, (size_t)base + element, channels != 3, bar, other);
}

/* Where some values are tied to others. */
static void hashed_tied_to(struct imp_tally *t, int param, size_t element, int channels,
                           bool error, const imp_spec *bar)
{
    const bool single = channels != 3;
    if (t->active->base[param] < 0) return;
    imp_spec tied = {0};
    for (int c = 0; c < (single ? t->lanes : 3); c++)
        tied[c] = (*bar)[c] *
                  imp__active_slope(t->active, param, element + (single ? 0 : (size_t)c));
    const bool one = t->active->tied[param].factor != NULL;
    if (one && !single) tied = (imp_spec){tied[0] + tied[1] + tied[2]};
    add_entry(t, imp__active_at(t->active, param, element), single || one,
              error ? NULL : &tied, error ? &tied : NULL);
}
static void add_hashed_tied(struct imp_sink *sink, int param, size_t element,
                            int channels, const imp_spec *bar)
{
    hashed_tied_to((struct imp_tally *)sink, param, element, channels, false, bar);
}
static void error_hashed_tied(struct imp_sink *sink, int param, size_t element,
                              int channels, const imp_spec *bar)
{
    hashed_tied_to(of_errors(sink), param, element, channels, true, bar);
}

/* ---- Either ------------------------------------------------------------------------ */

void imp__tally_sinks(struct imp_tally *t)
{
    t->errors.of = t;
    t->both = (struct imp_sink_pair){&t->sink, &t->errors.sink,
                                     t->active->tied ? NULL
                                     : t->dense      ? both_dense
                                                     : both_hashed};
    if (t->active->tied) {
        t->sink.add = t->dense ? add_dense_tied : add_hashed_tied;
        t->errors.sink.add = t->dense ? error_dense_tied : error_hashed_tied;
    } else {
        t->sink.add = t->dense ? add_dense : add_hashed;
        t->errors.sink.add = t->dense ? error_dense : error_hashed;
    }
}
