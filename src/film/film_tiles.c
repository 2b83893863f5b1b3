/* SPDX-License-Identifier: Apache-2.0
 *
 * The tile engine: items, workers, dropped walks, and the tree of sums. */
#include "film_tiles.h"
#include <string.h>

enum imp_status imp__tiles_create(struct imp_tiles *t)
{
    imp_context *ctx = t->ctx;
    if (t->side <= 0) t->side = IMP_TILE_SIDE;
    t->across = (t->width + 2 * t->margin + t->side - 1) / t->side;
    t->down = (t->height + 2 * t->margin + t->side - 1) / t->side;
    t->drops = (struct imp_drops){0};
    t->workers = imp__alloc(ctx, (size_t)ctx->threads, sizeof *t->workers);
    t->has_lock = t->workers && pthread_mutex_init(&t->lock, NULL) == 0;
    if (!t->has_lock) return imp__error(ctx, IMP_E_NOMEM, "no memory for workers");
    for (int k = 0; k < ctx->threads; k++) {
        t->workers[k].index = k;
        t->workers[k].tiles = t;
        imp__arena_init(&t->workers[k].arena, ctx);
    }
    return IMP_OK;
}

void imp__tiles_destroy(struct imp_tiles *t)
{
    for (int k = 0; t->has_lock && k < t->ctx->threads; k++)
        imp__arena_free(&t->workers[k].arena);
    if (t->has_lock) pthread_mutex_destroy(&t->lock);
    if (t->workers) imp__release(t->ctx, t->workers);
    t->workers = NULL;
    t->has_lock = false;
}

void imp__tile_drop(struct imp_tile_worker *w, enum imp_drop cause, int x, int y,
                    int64_t sample)
{
    if (imp_likely(cause == IMP_DROP_NONE)) return;
    const struct imp_run *run = w->tiles->run;
    const struct imp_drop_key key = {.seed = run->seed,
                                     .sample = sample,
                                     .x = x,
                                     .y = y,
                                     .sensor = run->sensor,
                                     .cause = (int32_t)cause};
    imp__drops_add(&w->drops, &key);
    w->n_drops++;
    w->no_memory |= cause == IMP_DROP_MEMORY;
}

const char *imp__points_word(const struct imp_run *run)
{
    return run->points == IMP_POINTS_SCENE         ? ""
           : run->points == IMP_POINTS_INDEPENDENT ? " --points independent"
                                                   : " --points sobol";
}

enum imp_status imp__tile_check(struct imp_tile_worker *w)
{
    const struct imp_tiles *t = w->tiles;
    /* A walk dropped for want of memory is not a walk with a bad value. */
    if (w->no_memory || w->arena.failed)
        return imp__error(t->ctx, IMP_E_NOMEM, "no memory to record a walk");
    if (imp_likely(w->n_drops == 0)) return IMP_OK;
    return imp__drops_budget(t->ctx, &w->drops, t->run->drop_budget, t->walks,
                             imp__points_word(t->run));
}

struct running {
    struct imp_tiles *tiles;
    const struct imp_tiles_pass *pass;
};

static struct imp_tile tile_of(const struct running *r, size_t item)
{
    const struct imp_tiles *t = r->tiles;
    const size_t every = imp_max(r->pass->every, (size_t)1);
    const size_t at = item * every + every / 2, k = at / r->pass->parts;
    struct imp_tile tile = {.index = k,
                            .part = r->pass->first_part + at % r->pass->parts};
    tile.x0 = (int)(k % (size_t)t->across) * t->side - t->margin;
    tile.y0 = (int)(k / (size_t)t->across) * t->side - t->margin;
    tile.x1 = imp_min(tile.x0 + t->side, t->width + t->margin);
    tile.y1 = imp_min(tile.y0 + t->side, t->height + t->margin);
    return tile;
}

static enum imp_status item_work(size_t item, int worker, void *result, void *payload)
{
    const struct running *r = payload;
    struct imp_tiles *t = r->tiles;
    struct imp_tile_worker *w = &t->workers[worker];
    const struct imp_tile tile = tile_of(r, item);
    const struct imp_arena_mark mark = imp__arena_mark(&w->arena);
    enum imp_status st = t->work(&tile, w, result, t->payload);
    imp__arena_rewind(&w->arena, mark);
    if (st == IMP_OK) st = imp__tile_check(w);
    if (w->n_drops > 0) {
        pthread_mutex_lock(&t->lock);
        imp__drops_merge(&t->drops, &w->drops);
        if (st == IMP_OK)
            st = imp__drops_budget(t->ctx, &t->drops, t->run->drop_budget, t->walks,
                                   imp__points_word(t->run));
        pthread_mutex_unlock(&t->lock);
        memset(&w->drops, 0, sizeof w->drops);
        w->n_drops = 0;
    }
    return st;
}

static void add(void *into, const void *from, void *payload)
{
    const struct running *r = payload;
    r->tiles->add(into, from, r->tiles->payload);
}

static enum imp_status take(size_t group, void *sum, void *payload)
{
    const struct running *r = payload;
    return r->tiles->take(group, sum, r->tiles->payload);
}

enum imp_status imp__tiles_run(struct imp_tiles *t, const struct imp_tiles_pass *pass)
{
    struct running r = {t, pass};
    const struct imp_drops before = t->drops;
    struct imp_shared shared = {.drops = &t->drops};
    imp_context *ctx = t->ctx;
    const size_t all = imp__tiles_count(t) * pass->parts;
    const size_t items = imp_max(all / imp_max(pass->every, (size_t)1), (size_t)1);
    const struct imp_sum_desc desc = {.n_items = items,
                                      .group = pass->per_tile ? pass->parts : items,
                                      .size = t->size,
                                      .add = add,
                                      .take = take,
                                      .payload = &r};
    const struct imp_loop loop = {.n_items = items,
                                  .payload = &r,
                                  .progress = t->run->progress,
                                  .progress_payload = t->run->progress_payload,
                                  .stage = pass->stage,
                                  .rate_unit = pass->rate_unit,
                                  .units = pass->units,
                                  .fraction_lo = pass->fraction_lo,
                                  .fraction_hi = pass->fraction_hi,
                                  .start_s = pass->start_s,
                                  .deadline_s = pass->deadline_s};
    /* Every rank takes the sample of items by itself. */
    const int alone = ctx->team && pass->every > 1;
    if (alone) ctx->team->alone++;
    if (imp__team_shares(ctx)) t->drops = (struct imp_drops){0};
    enum imp_status st = imp__shared_sum(ctx, &loop, &desc, item_work, &shared);
    if (imp__team_shares(ctx)) imp__drops_merge(&t->drops, &before);
    if (alone) ctx->team->alone--;
    t->late = shared.late;
    if (st == IMP_OK)
        st = imp__drops_budget(ctx, &t->drops, t->run->drop_budget, t->walks,
                               imp__points_word(t->run));
    return st;
}
