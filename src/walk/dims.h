/* SPDX-License-Identifier: Apache-2.0
 *
 * Which dimension of a walk's random numbers is used for what. Each vertex has its own
 * block, so a walk that stops early, or skips a light sample, leaves the others' numbers
 * alone. */
#ifndef IMP_WALK_DIMS_H
#define IMP_WALK_DIMS_H

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
