/* SPDX-License-Identifier: Apache-2.0
 *
 * The tile engine, on which pictures, gradients and Gauss-Newton matrices are made: the
 * pixels of a film are cut into tiles, and the samples of a tile into parts (passes,
 * groups of replicates). An item of work is one part of one tile; its result goes to a
 * fixed binary tree of sums. Every worker has an arena, and counts the walks it drops. */
#ifndef IMP_FILM_TILES_H
#define IMP_FILM_TILES_H

#include "base/arena.h"
#include "base/drops.h"
#include "base/team.h"

#define IMP_TILE_SIDE 8 /* pixels, unless larger tiles are needed */

struct imp_tile {
    int x0, y0, x1, y1; /* [x0, x1) x [y0, y1); beyond the picture in its margin */
    size_t index;       /* of the tile, in rows */
    size_t part;
};

struct imp_tile_worker {
    int index;
    struct imp_arena arena;
    struct imp_drops drops; /* of the item in work */
    uint64_t n_drops;
    bool no_memory; /* set by whoever had no memory to record a walk */
    struct imp_tiles *tiles;
};

struct imp_tiles {
    imp_context *ctx;
    const struct imp_run *run;
    double walks; /* planned; a part of them may be dropped (run->drop_budget) */
    int width, height;
    int margin; /* pixels sampled beyond the picture on every side */
    int side;   /* of a tile in pixels; 0: IMP_TILE_SIDE */

    /* Set all of `result` [size]. Samples start from an arena that is empty. */
    enum imp_status (*work)(const struct imp_tile *tile, struct imp_tile_worker *worker,
                            void *result, void *payload);
    size_t size; /* of a result, > 0 */
    void (*add)(void *into, const void *from, void *payload);
    /* `sum` over the parts of a tile, or over all items; by any thread. */
    enum imp_status (*take)(size_t tile, const void *sum, void *payload);
    void *payload;

    /* ---- Set by the engine ---- */
    int across, down;
    struct imp_tile_worker *workers; /* [threads] */
    pthread_mutex_t lock;            /* guards drops */
    bool has_lock;
    struct imp_drops drops; /* of the items done */
    bool late;              /* the last pass was stopped by its deadline */
};

/* The option of `render --pixel` that shows a walk of this run again. */
const char *imp__points_word(const struct imp_run *run);

struct imp_tiles_pass {
    const char *stage, *rate_unit;
    double units, fraction_lo, fraction_hi, start_s, deadline_s; /* as of imp_loop */
    size_t first_part, parts;                                    /* these of every tile */
    bool per_tile; /* a sum for every tile, not one over all items */
    size_t every;  /* > 1: a sample, one in so many items */
};

enum imp_status imp__tiles_create(struct imp_tiles *t);
void imp__tiles_destroy(struct imp_tiles *t);
static inline size_t imp__tiles_count(const struct imp_tiles *t)
{
    return (size_t)t->across * (size_t)t->down;
}
/* @return IMP_OK; IMP_CANCELLED with the tiles done that were taken; IMP_E_PATHS;
 * IMP_E_NOMEM; what work or take returned. */
enum imp_status imp__tiles_run(struct imp_tiles *t, const struct imp_tiles_pass *pass);

/* A walk was dropped, or not (IMP_DROP_NONE). */
void imp__tile_drop(struct imp_tile_worker *w, enum imp_drop cause, int x, int y,
                    int64_t sample);
/* After every pixel: does it make sense to go on? Walks that nothing ends take long. */
enum imp_status imp__tile_check(struct imp_tile_worker *w);

#endif
