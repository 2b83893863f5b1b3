/* SPDX-License-Identifier: Apache-2.0
 *
 * The walks of the replicates of a tile, in the order in which losses, gradients and Jacobians take
 * them: pixel by pixel, replicate by replicate. They are made in bundles where they can be. */
#ifndef IMP_INVERSE_TILE_WALKS_H
#define IMP_INVERSE_TILE_WALKS_H

#include "film/film_sums.h"
#include "film/film_tiles.h"
#include "replicates.h"
#include "walk/bundle/supply.h"

struct imp__tile_walks {
    const struct imp_tracer *tracer;
    struct imp_arena *arena;
    bool bundled;
    struct imp_supply supply;
};

/* Walks of replicates b0 to b1 of the tile's pixels for which counts(payload, x, y), `group` of
 * them taken together (supply.h): plan.n, or 1. */
void imp__tile_walks_begin(const struct imp_tracer *tracer, const struct imp_tile *tile,
                           struct imp_tile_worker *worker, struct imp__replicates plan,
                           int b0, int b1, int group,
                           bool (*counts)(const void *payload, int x, int y),
                           const void *payload, struct imp__tile_walks *out);

/* Before the first walk of a group, when nothing lies in the arena above the walks. */
static inline void imp__tile_walks_ready(struct imp__tile_walks *w)
{
    if (w->bundled) imp__supply_ready(&w->supply);
}
/* An exposure may make more of a walk than pictures hold: they drop it, and so does this. */
IMP_COLD void imp__beyond_float_drop(struct imp_walk *walk, int channels);
/* The next walk, which is this one. */
static inline void imp__tile_walk(struct imp__tile_walks *w, int x, int y, int64_t sample,
                                  struct imp_walk *walk)
{
    if (w->bundled) imp__supply_take(&w->supply, x, y, sample, walk);
    else imp__walk_trace(w->tracer, w->arena, x, y, sample, walk);
    const int channels = w->tracer->scene->channels;
    const double value[3] = {walk->L[0], channels > 1 ? walk->L[1] : 0,
                             channels > 1 ? walk->L[2] : 0};
    if (imp_unlikely(!imp__fits_float(value, 3)) && !walk->dropped)
        imp__beyond_float_drop(walk, channels);
}

#endif
