/* SPDX-License-Identifier: Apache-2.0
 *
 * Rows of derivatives in the making: the job, its tiles and their pixels. */
#ifndef IMP_INVERSE_SPARSE_JOB_H
#define IMP_INVERSE_SPARSE_JOB_H

#include "inverse/estimate/tile_walks.h"
#include "sparse_rows.h"
#include "sparse_sink.h"

/* Scalars of a tile, and their sums. */
enum {
    IMP_ROWS_OBJECTIVE,
    IMP_ROWS_VARIANCE,
    IMP_ROWS_BYTES,
    IMP_ROWS_ITEMS,
    IMP_ROWS_SCALARS
};

struct imp__rows_worker {
    struct imp__sparse_sink sink;
    struct imp__row_block made; /* arrays that grow */
    size_t cap_pixel, cap_r, cap_push, cap_end, cap_number, cap_value;
    imp_spec L[IMP_BATCH_MAX], P[IMP_BATCH_MAX];
};

struct imp__rows_job {
    const struct imp_problem *problem;
    const struct imp__target *target;
    uint64_t key; /* of the target */
    struct imp_tracer tracer;
    struct imp__replicates plan;
    struct imp_tiles tiles;
    struct imp__rows_worker *workers;
    struct imp__row_block *block; /* of this target's items */
    bool look;
    double total[IMP_ROWS_SCALARS];
};

/* sparse_pixel.c: replicates [b0, b1) of a pixel, of whose tile these are the walks, in units, to
 * what the worker makes; adds to the loss of the tile. */
enum imp_status imp__rows_pixel(const struct imp__rows_job *j,
                                struct imp_tile_worker *tile,
                                struct imp__tile_walks *walks, int x, int y, int b0,
                                int b1, double *sums);

#endif
