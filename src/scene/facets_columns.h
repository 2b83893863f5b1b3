/* SPDX-License-Identifier: Apache-2.0
 *
 * Facets (facets.h) against sixteen or eight rays. */
#ifndef IMP_SCENE_FACETS_COLUMNS_H
#define IMP_SCENE_FACETS_COLUMNS_H

#include "facets.h"
#include "math/wide_real.h"

/* Rays are taken as many at a time as a register has floats, their doubles in two. */
enum {
    IMP_RAY_BLOCK = IMP_WIDE_LANES > 4 ? 16 : 8,
    IMP_RAY_PARTS = IMP_RAY_BLOCK / IMP_WIDE_LANES
};
struct imp_ray_block {
    imp_wide3 o[IMP_RAY_PARTS], d[IMP_RAY_PARTS];
    imp_wide near[IMP_RAY_PARTS], far[IMP_RAY_PARTS];
};
/* Numbers of ray k. */
static inline imp_v3 imp__block_origin(const struct imp_ray_block *b, int k)
{
    return imp__wide3_lane(&b->o[k / IMP_WIDE_LANES], k % IMP_WIDE_LANES);
}
static inline imp_v3 imp__block_direction(const struct imp_ray_block *b, int k)
{
    return imp__wide3_lane(&b->d[k / IMP_WIDE_LANES], k % IMP_WIDE_LANES);
}
static inline double imp__block_near(const struct imp_ray_block *b, int k)
{
    return b->near[k / IMP_WIDE_LANES][k % IMP_WIDE_LANES];
}
static inline double imp__block_far(const struct imp_ray_block *b, int k)
{
    return b->far[k / IMP_WIDE_LANES][k % IMP_WIDE_LANES];
}

/* The nearest facet that each ray with a bit in `on` meets, as imp__facets_nearest gives it. The
 * result has a bit for each ray that meets one, and `hit` its hit. */
unsigned imp__facets_nearest_block(const struct imp_facets *f,
                                   const struct imp_ray_block *rays, unsigned on,
                                   struct imp_hit hit[IMP_RAY_BLOCK]);
/* The rays with a bit in `on` that imp__facets_occluded calls hidden, a bit for each. */
unsigned imp__facets_occluded_block(const struct imp_facets *f,
                                    const struct imp_ray_block *rays, unsigned on);

#endif
