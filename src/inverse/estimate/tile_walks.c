/* SPDX-License-Identifier: Apache-2.0
 *
 * Lists of a tile's walks for bundles. */
#include "tile_walks.h"

void imp__tile_walks_begin(const struct imp_tracer *tracer, const struct imp_tile *tile,
                           struct imp_tile_worker *worker, struct imp__replicates plan,
                           int b0, int b1, int group,
                           bool (*counts)(const void *payload, int x, int y),
                           const void *payload, struct imp__tile_walks *out)
{
    struct imp_arena *arena = &worker->arena;
    const struct imp_tracer *bundled = imp__bundle_use(tracer);
    const struct imp_supply_pixels pixels = {tile->x0, tile->y0, tile->x1,
                                             tile->y1, counts,   payload};
    int n = 0;
    out->tracer = tracer;
    out->arena = arena;
    out->bundled = false;
    if (!bundled) return;
    int64_t *numbers =
        imp__arena_take(arena, (size_t)(b1 - b0) * (size_t)plan.n, sizeof *numbers);
    if (!numbers) return;
    for (int b = b0; b < b1; b++)
        for (int s = 0; s < plan.m; s++) {
            const int size =
                imp__replicates_set(plan, s + 1) - imp__replicates_set(plan, s);
            for (int i = 0; i < size; i++)
                numbers[n++] = imp__replicates_first(plan, b, s) + i;
        }
    out->bundled =
        imp__supply_begin(bundled, arena, &pixels, numbers, n, group, &out->supply);
}

void imp__beyond_float_drop(struct imp_walk *walk, int channels)
{
    imp_spec L = {0};
    for (int c = 0; c < channels; c++) L[c] = walk->L[c];
    walk->dropped = imp__drop_cause(L);
    walk->L = walk->values = (imp_spec){0};
}
