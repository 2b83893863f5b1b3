/* SPDX-License-Identifier: Apache-2.0
 *
 * What loops of a pool are made for: ranges that fill an array, and sums in a fixed order. */
#include "pool.h"

/* ---- Ranges --------------------------------------------------------------------- */

struct ranges {
    size_t n, each;
    enum imp_status (*work)(size_t first, size_t end, void *payload);
    void *payload;
};

static enum imp_status range_work(size_t i, int worker, int slot, void *payload)
{
    const struct ranges *r = payload;
    (void)worker, (void)slot;
    return r->work(i * r->each, imp_min((i + 1) * r->each, r->n), r->payload);
}

enum imp_status imp__parallel_ranges(imp_context *ctx, size_t n, size_t least,
                                     enum imp_status (*work)(size_t first, size_t end,
                                                             void *payload),
                                     void *payload)
{
    const size_t most = (size_t)ctx->threads;
    const size_t each = imp_max(n / most + (n % most != 0), least);
    if (n <= each) return n > 0 ? work(0, n, payload) : IMP_OK;
    struct ranges r = {n, each, work, payload};
    const struct imp_loop loop = {
        .n_items = n / each + (n % each != 0), .work = range_work, .payload = &r};
    enum imp_status st;
    return imp__parallel_try(ctx, &loop, &st) ? st : work(0, n, payload);
}

/* ---- Sums ---------------------------------------------------------------------- */

/* Nodes that wait for a slow item: no more than this many a thread. */
#define WINDOW_PER_THREAD 8

size_t imp__sum_window(const imp_context *ctx)
{
    return (size_t)ctx->threads * WINDOW_PER_THREAD;
}

struct summing {
    struct imp_sum_tree *tree;
    size_t first;
    enum imp_status (*work)(size_t i, int worker, void *result, void *payload);
    void *payload;
};

static enum imp_status sum_work(size_t i, int worker, int slot, void *payload)
{
    struct summing *s = payload;
    (void)slot;
    void *result = imp__sum_tree_room(s->tree);
    if (!result)
        return imp__error(s->tree->ctx, IMP_E_NOMEM, "no memory for a part of a sum");
    const enum imp_status st = s->work(s->first + i, worker, result, s->payload);
    if (st == IMP_OK) return imp__sum_tree_put(s->tree, s->first + i, result);
    imp__sum_tree_drop(s->tree, result);
    return st;
}

enum imp_status imp__parallel_sum(imp_context *ctx, const struct imp_loop *loop,
                                  struct imp_sum_tree *tree, size_t first,
                                  enum imp_status (*work)(size_t i, int worker,
                                                          void *result, void *payload),
                                  size_t *done)
{
    struct summing s = {tree, first, work, loop->payload};
    struct imp_loop own = *loop;
    own.work = sum_work;
    own.commit = NULL;
    own.payload = &s;
    own.window = imp__sum_window(ctx);
    return imp__parallel(ctx, &own, done);
}
