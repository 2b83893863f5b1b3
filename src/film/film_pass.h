/* SPDX-License-Identifier: Apache-2.0
 *
 * A pass of samples over the tiles of a picture (film_picture.c makes the passes). */
#ifndef IMP_FILM_PASS_H
#define IMP_FILM_PASS_H

#include "film_patch.h"

struct imp_passes {
    const struct imp_run *run;
    const struct imp_picture *picture;
    struct imp_patch patch;
    struct imp_tiles tiles;
    struct imp_film_sums sums;
    int spp, passes, pass_spp;
    /* Rows of the threads on cache lines of their own. */
    double *values;      /* [threads][n] */
    double *patches;     /* [threads][imp__patch_size] what one pixel sends in a
                        pass through a wide filter */
    int set;             /* samples that depend on each other, about; 1: none do */
    int64_t period;      /* samples of a pixel; 0: not known */
    int sets, pass_sets; /* in all of them, in a pass */
    double *set_values;  /* [threads][n] box: sums of a set */
    double *set_patches; /* [threads] as patches, of a set: sums of w and w v alone */
    int sweep_spp;       /* samples of a pixel in the sweep at work */
};

/* Doubles from one thread's row of n to the next's: no cache line is written by two. */
static inline size_t imp__row_apart(size_t n)
{
    const size_t line = IMP_CACHE_LINE / sizeof(double);
    return (n + line - 1) / line * line;
}

/* First sample of a pass; passes end with sets. */
int imp__pass_begin(const struct imp_passes *r, int pass);

/* What imp__tiles_run calls, with the passes as its payload. */
enum imp_status imp__pass_work(const struct imp_tile *t, struct imp_tile_worker *w,
                               void *result, void *payload);
void imp__pass_add(void *into, const void *from, void *payload);
enum imp_status imp__pass_take(size_t tile, const void *sum, void *payload);

#endif
