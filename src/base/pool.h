/* SPDX-License-Identifier: Apache-2.0
 *
 * Parallel loops whose results do not depend on the number of threads. Work is cut into
 * items whose number is fixed by the problem; any worker computes any item; the results
 * are committed one at a time and in item order, or added up in a fixed binary tree. Sums
 * therefore have one order, whoever computed what. */
#ifndef IMP_BASE_POOL_H
#define IMP_BASE_POOL_H

#include "context.h"
#include "sum_tree.h"

struct imp_loop {
    size_t n_items;
    /* Compute item `i` on worker `worker` (0 <= worker < threads) into the slot's result;
     * `slot` < imp__pool_slots(ctx) names the result buffer to use. */
    enum imp_status (*work)(size_t i, int worker, int slot, void *payload);
    /* Add the result in `slot`; called for items 0, 1, 2, ... never two at a time. NULL:
     * no results to collect; then no worker ever waits for another's item, and `slot` is
     * the worker. */
    enum imp_status (*commit)(size_t i, int slot, void *payload);
    void *payload;
    /* Progress, or NULL; item weights are equal. */
    imp_progress_fn progress;
    void *progress_payload;
    const char *stage, *rate_unit;
    double units; /* of rate_unit, in the whole loop */
    double fraction_lo,
        fraction_hi;   /* part of the caller's work this loop is; hi 0: all */
    double start_s;    /* imp__now() when the caller's work began; 0: now */
    double deadline_s; /* imp__now() after which no item starts; 0: none */
    /* Without commits: items this far after the oldest in work are not begun; 0: all are.
     */
    size_t window;
    /* Items done, where others do some of them; NULL: those that this loop has done. */
    size_t (*reached)(void *payload);
};

/* Result buffers a loop may need at once: a worker that runs ahead of the commits waits.
 */
int imp__pool_slots(const imp_context *ctx);

/* Run the loop. Items are committed in order up to the first that failed; `*done` (may be
 * NULL) is how many, or without commits how many were done. @return the first failure in
 * item order, IMP_CANCELLED if progress stopped it or the deadline passed, or IMP_OK.
 * A loop inside a loop runs on the calling worker alone. */
enum imp_status imp__parallel(imp_context *ctx, const struct imp_loop *loop,
                              size_t *done);

/* The same, but nothing is done if another thread runs a loop of this context, which may be
 * a picture of hours. @return whether the loop ran; `*st` is what it gave. */
bool imp__parallel_try(imp_context *ctx, const struct imp_loop *loop,
                       enum imp_status *st);

/* work(first, end) for [0, n) in as many ranges as there are threads, of `least` or more
 * elements; if these are fewer than two, or another thread runs a loop, in one. Nothing may
 * depend on where one begins; work may stop at its first failure: the first is returned. */
enum imp_status imp__parallel_ranges(imp_context *ctx, size_t n, size_t least,
                                     enum imp_status (*work)(size_t first, size_t end,
                                                             void *payload),
                                     void *payload);

/* Is the calling thread at work on a loop of this context? */
bool imp__pool_inside(imp_context *ctx);
/* Add up results over items [first, first + loop->n_items) of the tree (sum_tree.h):
 * `work` computes item `i`, counted in the tree, into `result`, which is not cleared.
 * loop->work and commit are not looked at. On failure or IMP_CANCELLED the tree holds
 * some of the items. */
enum imp_status imp__parallel_sum(imp_context *ctx, const struct imp_loop *loop,
                                  struct imp_sum_tree *tree, size_t first,
                                  enum imp_status (*work)(size_t i, int worker,
                                                          void *result, void *payload),
                                  size_t *done);

/* Items of a sum that may be in work beyond the oldest. */
size_t imp__sum_window(const imp_context *ctx);

void imp__pool_destroy(imp_context *ctx, struct imp_pool *pool);

/* Seconds on a monotonic clock. */
double imp__now(void);

#endif
