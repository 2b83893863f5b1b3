/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal equations of pixels that share no walk: the job, and its tiles. */
#ifndef IMP_NORMAL_TILES_H
#define IMP_NORMAL_TILES_H

#include "film/film_tiles.h"
#include "gauss_newton.h"

struct imp__normal_job {
    const struct imp_problem *problem;
    const struct imp__target *target;
    struct imp_tracer tracer;
    struct imp__replicates plan;
    int width, channels;
    size_t K;
    struct imp_tiles tiles;
    struct imp__normal_worker {
        double *x;      /* [K][channels] of one walk, or set: mean */
        double *sum_x;  /* [K][seen] of a replicate */
        double *sum_lx; /* [K][seen] */
        double *sum_xx; /* [seen][K*K] */
        double *g;      /* [R][K] of a pixel */
        double *u, *au; /* [seen][K*K] of a pixel: sums over its replicates of w^2 J^T J,
                           and of that times the replicate's squared residual */
        double a[3];    /* sum over replicates of squared residuals */
        double *each_x; /* [n][K][channels] of all walks, for losses that are not
                           quadratic; NULL: there are none */
        imp_spec L[IMP_BATCH_MAX], P[IMP_BATCH_MAX];
    } * workers;
    double *total, *excess; /* [imp__normal_count]; [K*K] of wide filters alone */
};

static inline size_t imp__normal_count(size_t K)
{
    return 4 * K * K + K + IMP_NORMAL_SCALARS;
}

static inline struct imp__normal_sums imp__normal_at(double *p, size_t K)
{
    return (struct imp__normal_sums){.H = p,
                                     .H_same = p + K * K,
                                     .H_meas = p + 2 * K * K,
                                     .cov_g = p + 3 * K * K,
                                     .g = p + 4 * K * K,
                                     .scalars = p + 4 * K * K + K};
}

/* For imp__tiles_run. */
enum imp_status imp__normal_work(const struct imp_tile *t, struct imp_tile_worker *tile,
                                 void *result, void *payload);
void imp__normal_add(void *into, const void *from, void *payload);
enum imp_status imp__normal_take(size_t group, const void *sum, void *payload);

#endif
