/* SPDX-License-Identifier: Apache-2.0
 *
 * The recorded walks of a sensor: made, settled and destroyed (store.h). */
#include "store.h"
#include <assert.h>
#include <string.h>

enum imp_status imp__store_create(const struct imp_tracer *tracer, int index, int margin,
                                  const int64_t *samples, size_t n, size_t budget,
                                  const struct imp_reduction *reduction,
                                  struct imp_store *out)
{
    enum imp_status st = IMP_OK;
    const struct imp_film_desc *film = &tracer->sensor->film;
    imp_context *ctx = tracer->scene->ctx;
    struct imp_store s = {.source = {.walk = imp__store_walk},
                          .ctx = ctx,
                          .sensor = tracer->sensor,
                          .index = index,
                          .width = film->crop_w,
                          .height = film->crop_h,
                          .margin = margin,
                          .n = n,
                          .reduction = reduction,
                          .budget = budget};
    s.across = (s.width + 2 * margin + IMP_STORE_SIDE - 1) / IMP_STORE_SIDE;
    s.down = (s.height + 2 * margin + IMP_STORE_SIDE - 1) / IMP_STORE_SIDE;
    s.sample = imp__alloc(ctx, n, sizeof *s.sample);
    s.records = imp__alloc(ctx, imp__store_tiles(&s), sizeof *s.records);
    s.reduced = imp__alloc(ctx, imp__store_tiles(&s), sizeof *s.reduced);
    s.meets = imp__alloc(ctx, imp__store_tiles(&s), sizeof *s.meets);
    if (!s.sample || !s.records || !s.reduced || !s.meets)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for recorded walks"));
    memcpy(s.sample, samples, n * sizeof *samples);
    IMP_TRY(imp__record_create(tracer, budget, &s.records[0]));
    for (size_t k = 1; k < imp__store_tiles(&s); k++) s.records[k] = s.records[0];
    *out = s;
    return IMP_OK;
out:
    imp__release(ctx, s.sample);
    imp__release(ctx, s.records);
    imp__release(ctx, s.reduced);
    imp__release(ctx, s.meets);
    return st;
}

void imp__store_destroy(struct imp_store *s)
{
    if (!s->ctx) return;
    for (size_t k = 0; k < imp__store_tiles(s); k++) {
        imp__record_destroy(&s->records[k]);
        imp__reduced_free(&s->reduced[k]);
        imp__release(s->ctx, s->meets[k]);
    }
    imp__release(s->ctx, s->reduced);
    imp__release(s->ctx, s->meets);
    imp__release(s->ctx, s->sample);
    imp__release(s->ctx, s->records);
    s->ctx = NULL;
}

/* Pixels of a tile: [x0, x1) x [y0, y1), from the crop's corner. */
struct tile {
    int x0, y0, x1, y1;
};
static struct tile tile_at(const struct imp_store *s, size_t k)
{
    const int x0 = (int)(k % (size_t)s->across) * IMP_STORE_SIDE - s->margin;
    const int y0 = (int)(k / (size_t)s->across) * IMP_STORE_SIDE - s->margin;
    return (struct tile){x0, y0, imp_min(x0 + IMP_STORE_SIDE, s->width + s->margin),
                         imp_min(y0 + IMP_STORE_SIDE, s->height + s->margin)};
}

/* A tile's walks, unless those so far do not fit. */
static void tile_reduce(struct imp_store *s, size_t k)
{
    if (!s->reduction || s->reduced_bytes > s->budget) return;
    imp__reduced_make(s->reduction, &s->records[k], &s->reduced[k]);
    const size_t bytes =
        s->reduced[k].of ? imp__reduced_bytes(&s->reduced[k]) : s->budget;
    atomic_fetch_add(&s->reduced_bytes, bytes);
}

void imp__store_settle(struct imp_store *s)
{
    const size_t share = s->budget / (size_t)imp_max(s->left, 1);
    if (s->bytes <= share && s->reduced_bytes <= share - s->bytes) return;
    for (size_t k = 0; k < imp__store_tiles(s); k++) imp__reduced_free(&s->reduced[k]);
    atomic_store(&s->reduced_bytes, 0);
}

/* Does the walk have a step that roulette could have ended? */
static bool was_played(const struct imp_walk *w)
{
    for (const struct imp_vertex *v = w->first; v; v = v->next)
        if (v->d.goes_on && v->d.survive < 1) return true;
    return false;
}

enum imp_status imp__store_fill(struct imp_store *s, const struct imp_tracer *tracer,
                                struct imp_arena *arena, size_t k)
{
    enum imp_status st = IMP_OK;
    const struct tile t = tile_at(s, k);
    struct imp_record *r = &s->records[k];
    bool roulette = false;
    for (int y = t.y0; y < t.y1; y++)
        for (int x = t.x0; x < t.x1; x++)
            for (size_t i = 0; i < s->n; i++) {
                const struct imp_arena_mark mark = imp__arena_mark(arena);
                struct imp_walk w;
                imp__walk_trace(tracer, arena, x, y, s->sample[i], &w);
                if (!roulette) roulette = was_played(&w);
                st = imp__record_keep(r, &w, s->sample[i]);
                imp__arena_rewind(arena, mark);
                if (st == IMP_E_NOMEM) goto full;
                if (st != IMP_OK) return st;
            }
    IMP_TRY(imp__record_trim(r));
    IMP_TRY(imp__store_look(s, tracer->scene, k));
    if (roulette) atomic_store(&s->roulette, true);
    tile_reduce(s, k);
    const size_t bytes = imp__store_bytes(s, k);
    if (atomic_fetch_add(&s->bytes, bytes) + bytes <= s->budget) return IMP_OK;
full:;
    const double walks = (double)(s->width + 2 * s->margin) *
                         (double)(s->height + 2 * s->margin) * (double)s->n;
    return imp__error(s->ctx, IMP_E_NOMEM,
                      "%.4g recorded walks need about %.3g MB; %.3g MB are allowed",
                      walks,
                      walks * (double)imp__record_bytes(r) /
                          (double)imp_max(r->n_walks, (size_t)1) / 1e6,
                      (double)s->budget / 1e6);
out:
    return st;
}

int64_t imp__store_find(const struct imp_store *s, int64_t sample)
{
    if (sample >= 0 && (uint64_t)sample < s->n && s->sample[sample] == sample)
        return sample;
    size_t lo = 0, hi = s->n;
    while (lo < hi) {
        const size_t middle = (lo + hi) / 2;
        if (s->sample[middle] < sample) lo = middle + 1;
        else hi = middle;
    }
    return lo < s->n && s->sample[lo] == sample ? (int64_t)lo : -1;
}

void imp__store_walk_at(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                        int y, int64_t at, struct imp_walk *walk)
{
    const struct imp_store *s = tracer->kept;
    /* As of tile_at, without its quotients: each sample asks. */
    const size_t column = (size_t)(x + s->margin), row = (size_t)(y + s->margin);
    const size_t k = row / IMP_STORE_SIDE * (size_t)s->across + column / IMP_STORE_SIDE;
    assert(at >= 0 && (uint64_t)at < s->n && x + s->margin >= 0 && y + s->margin >= 0 &&
           k < imp__store_tiles(s));
    const size_t left = column - column % IMP_STORE_SIDE;
    const size_t side =
        imp_min((size_t)(s->width + 2 * s->margin) - left, (size_t)IMP_STORE_SIDE);
    const size_t pixel = row % IMP_STORE_SIDE * side + (column - left);
    const size_t i = pixel * s->n + (size_t)at;
    if (!s->reduced[k].of ||
        !imp__reduced_walk(&s->reduced[k], &s->records[k], i, tracer, arena, walk))
        imp__record_walk(&s->records[k], i, tracer, arena, walk);
}

void imp__store_walk(const struct imp_tracer *tracer, struct imp_arena *arena, int x,
                     int y, int64_t sample, struct imp_walk *walk)
{
    imp__store_walk_at(tracer, arena, x, y, imp__store_find(tracer->kept, sample), walk);
}

/* ---- In files -------------------------------------------------------------------- */

void imp__store_put(struct imp_file_writer *to, const struct imp_store *s, size_t first,
                    size_t end)
{
    for (size_t k = first; k < end; k++) imp__record_put(to, &s->records[k]);
}

/* Is walk i of a tile the one that is traced there? */
static bool is_placed(const struct imp_store *s, const struct imp_tracer *tracer,
                      const struct tile *t, const struct imp_record_walk *w, size_t i)
{
    const int pixel = (int)(i / s->n), across = t->x1 - t->x0;
    double px, py;
    if (w->sample != s->sample[i % s->n]) return false;
    imp__walk_position(tracer, t->x0 + pixel % across, t->y0 + pixel / across, w->sample,
                       &px, &py);
    return px == w->px && py == w->py;
}

enum imp_status imp__store_take(struct imp_record_source *from, struct imp_store *s,
                                const struct imp_tracer *tracer,
                                const struct imp_record_of *of)
{
    enum imp_status st = IMP_OK;
    for (size_t k = 0; k < imp__store_tiles(s); k++) {
        const struct tile t = tile_at(s, k);
        struct imp_record *r = &s->records[k];
        const size_t n = (size_t)(t.x1 - t.x0) * (size_t)(t.y1 - t.y0) * s->n;
        const size_t left = s->budget - imp_min((size_t)s->bytes, s->budget);
        IMP_TRY(imp__record_take(from, tracer, of, left, r));
        bool placed = r->n_walks == n;
        for (size_t i = 0; i < n && placed; i++)
            placed = is_placed(s, tracer, &t, imp__record_at(r, i), i);
        if (!placed)
            IMP_TRY(imp__error(s->ctx, IMP_E_IO,
                               "%s: damaged (walks that are not those of their pixels)",
                               from->path));
        IMP_TRY(imp__record_trim(r));
        IMP_TRY(imp__store_look(s, tracer->scene, k));
        s->bytes += imp__store_bytes(s, k);
        tile_reduce(s, k);
    }
    imp__store_settle(s);
out:
    return st;
}
