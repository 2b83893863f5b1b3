/* SPDX-License-Identifier: Apache-2.0
 *
 * The walks of a list of pixels one behind the other, made in bundles of a few pixels, or of a part
 * of one pixel's walks. Who takes them may lay things above them in the arena, and takes those away
 * before a group of walks begins. */
#ifndef IMP_WALK_BUNDLE_SUPPLY_H
#define IMP_WALK_BUNDLE_SUPPLY_H

#include "base/arena.h"
#include "bundle.h"

struct imp_supply {
    const struct imp_tracer *tracer;
    struct imp_arena *arena;
    struct imp_arena_mark mark; /* of the arena, before a bundle */
    const int (*xy)[2];         /* [n_pixels] */
    const int64_t *numbers;     /* [n_numbers] of the walks of each pixel */
    int n_pixels, n_numbers;
    int group;         /* so many walks of a pixel are taken together */
    int pixel, number; /* that the next bundle begins with */
    int pixels, walks; /* of a bundle: pixels, walks of each */
    struct imp_bundle at_work;
    bool made;       /* at_work is there; else there was no memory for it */
    int left, place; /* walks of it that were not taken; number of the next one */
};

/* Pixels of a rectangle for which counts(payload, x, y): row by row, or where points of a grid share
 * what they meet, four neighbours at a time. */
struct imp_supply_pixels {
    int x0, y0, x1, y1; /* without x1 and y1 */
    bool (*counts)(const void *payload, int x, int y);
    const void *payload;
};

/* Walks with the given numbers of each pixel, which are as many as a multiple of `group`; `numbers`
 * lives as long as the supply. False: tracer is NULL (imp__bundle_use), a group is too large for a
 * bundle, or there is no memory. */
bool imp__supply_begin(const struct imp_tracer *tracer, struct imp_arena *arena,
                       const struct imp_supply_pixels *pixels, const int64_t *numbers,
                       int n_numbers, int group, struct imp_supply *out);

/* Before the first walk of a group: the bundle that it is in is made. */
void imp__supply_ready(struct imp_supply *supply);
/* The next walk, which is that of this pixel and sample. */
void imp__supply_take(struct imp_supply *supply, int x, int y, int64_t sample,
                      struct imp_walk *walk);
/* Where points share: what the walk that was taken last has without that. */
imp_spec imp__supply_alone(const struct imp_supply *supply, const struct imp_walk *walk);

#endif
