/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks from every point of a grid, one point an item of work. */
#ifndef IMP_INVERSE_POINT_LOOP_H
#define IMP_INVERSE_POINT_LOOP_H

#include "base/drops.h"
#include "base/pool.h"

/* `work` for each of n points, with `walks` walks in all; then the budget of dropped walks, which
 * `work` adds to `drops`. `stage` is what progress is called. */
static inline enum imp_status
imp__point_loop(imp_context *ctx, const struct imp_run *run, size_t n, double walks,
                const char *stage, enum imp_status (*work)(size_t, int, int, void *),
                void *payload, const struct imp_drops *drops)
{
    const struct imp_loop loop = {.n_items = n,
                                  .work = work,
                                  .payload = payload,
                                  .progress = run->progress,
                                  .progress_payload = run->progress_payload,
                                  .stage = stage,
                                  .rate_unit = "walks",
                                  .units = walks};
    IMP_CHECKED(imp__parallel(ctx, &loop, NULL));
    return imp__drops_budget(ctx, drops, run->drop_budget, walks, "");
}

#endif
