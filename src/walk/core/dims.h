/* SPDX-License-Identifier: Apache-2.0
 *
 * Which dimension of a walk's random numbers is used for what. Each vertex has its own
 * block, so a walk that stops early, or skips a light sample, leaves the others' numbers
 * alone. */
#ifndef IMP_WALK_DIMS_H
#define IMP_WALK_DIMS_H

#include "math/points.h"

enum { IMP_DIM_PIXEL_X, IMP_DIM_PIXEL_Y, IMP_DIM_LENS_U, IMP_DIM_LENS_V, IMP_DIM_VERTEX };
enum {
    IMP_DIM_LOBE,
    IMP_DIM_DIR_U,
    IMP_DIM_DIR_V,
    IMP_DIM_LIGHT,
    IMP_DIM_LIGHT_U,
    IMP_DIM_LIGHT_V,
    IMP_DIM_SURVIVE,
    IMP_DIM_SPARE,
    IMP_DIMS_PER_VERTEX
};
static inline unsigned imp__dim(int vertex, int use)
{
    return IMP_DIM_VERTEX + (unsigned)vertex * IMP_DIMS_PER_VERTEX + (unsigned)use;
}

/* Where the points of a set have the same numbers (math/points.h): block 0 is that of the
 * start, as above and two more, block k + 1 that of vertex k. Numbers that decide one thing
 * together are a pair. */
enum { IMP_SLOT_WAVELENGTH = IMP_DIM_VERTEX, IMP_SLOT_TIME };
static inline int imp__slot(int use)
{
    static const int slots[IMP_DIMS_PER_VERTEX] = {
        [IMP_DIM_DIR_U] = 0,   [IMP_DIM_DIR_V] = 1,   [IMP_DIM_LOBE] = 2,
        [IMP_DIM_SURVIVE] = 3, [IMP_DIM_LIGHT_U] = 4, [IMP_DIM_LIGHT_V] = 5,
        [IMP_DIM_LIGHT] = 6,   [IMP_DIM_SPARE] = 7};
    return slots[use];
}

static inline uint32_t imp__block(int vertex) { return (uint32_t)(vertex + 1); }

/* A walk's number for the start, and for a vertex: its point's, or of its key where it is
 * of no set. */
static inline double imp__start_number(struct imp_key key, struct imp_point point,
                                       int use)
{
    if (point.points) return imp__point_number(point, 0, use);
    return imp__u01(key, (uint32_t)use);
}
static inline double imp__vertex_number(struct imp_key key, struct imp_point point,
                                        int vertex, int use)
{
    if (point.points) return imp__point_number(point, imp__block(vertex), imp__slot(use));
    return imp__u01(key, imp__dim(vertex, use));
}

/* Uses that came later have blocks in the upper half of the dimensions, so that none of
 * the numbers above moves: one for the start of a walk, one for each vertex. */
enum { IMP_DIM_TIME, IMP_DIM_WAVELENGTH, IMP_DIM_LANE, IMP_DIM_EMITTER };
enum {
    IMP_DIM_TECHNIQUE, /* which way of continuing or connecting */
    IMP_DIM_MEDIUM,    /* first of what tracking through a medium needs */
    IMP_DIMS_LATE_PER_VERTEX = 16
};
static inline unsigned imp__dim_start(int use) { return 1u << 31 | (unsigned)use; }
static inline unsigned imp__dim_late(int vertex, int use)
{
    return 1u << 31 | ((unsigned)(vertex + 1) * IMP_DIMS_LATE_PER_VERTEX + (unsigned)use);
}

#endif
