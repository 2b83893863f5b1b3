/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal equations of pixels that share no walk: the job, and its tiles. */
#ifndef IMP_NORMAL_TILES_H
#define IMP_NORMAL_TILES_H

#include "film/film_tiles.h"
#include "gauss_newton.h"

/* The sets of a pixel are put together to so many units at most, and to fewer where their
 * number needs it; all pairs of units are multiplied. */
enum {
    IMP_NORMAL_UNITS = 16,
    IMP_NORMAL_PAIRS = IMP_NORMAL_UNITS * (IMP_NORMAL_UNITS - 1) / 2
};

struct imp__normal_job {
    const struct imp_problem *problem;
    const struct imp__target *target;
    struct imp_tracer tracer;
    struct imp__replicates plan;
    int width, channels;
    size_t K;
    bool deviate; /* the deviations of J^T W J, too */
    bool pairs;   /* channels may share their noise */
    bool cross;   /* they do, and some target has given sigmas */
    struct imp_tiles tiles;
    struct imp__normal_worker {
        double *x;              /* [K][channels] of one set: mean */
        double *X;              /* [units][seen][K] of a pixel, then [units][seen][T] */
        size_t *touched;        /* [T] in increasing order: values with a derivative in
                                 * the pixel's walks; the others' entries are 0 */
        double *sum, *sum_xx;   /* [T], [T*T] of a channel: over half of the units */
        double *sum1, *sum1_xx; /* and over the other half */
        double *own;            /* [T], [T*T] of a group of units */
        double *h, *e, *total;  /* [pairs][T], [units][T], [T] of the gradient */
        double r[IMP_NORMAL_UNITS][3]; /* radiance, then residual of a unit */
        double weight[3];
        imp_spec L[IMP_BATCH_MAX], P[IMP_BATCH_MAX];
    } * workers;
    double *total; /* [imp__normal_count] */
};

static inline size_t imp__normal_count(const struct imp__normal_job *j)
{
    const size_t matrices = 5 + (j->cross ? 3 : 0) + (j->deviate ? IMP_DEVIATIONS : 0);
    return matrices * j->K * j->K + j->K + IMP_NORMAL_SCALARS;
}

static inline struct imp__normal_sums imp__normal_at(const struct imp__normal_job *j,
                                                     double *p)
{
    const size_t K = j->K, KK = K * K;
    double *more = p + 5 * KK + K + IMP_NORMAL_SCALARS;
    return (struct imp__normal_sums){
        .H = p,
        .H_same = p + KK,
        .H_meas = p + 2 * KK,
        .cov_g = p + 3 * KK,
        .cov_excess = p + 4 * KK,
        .g = p + 5 * KK,
        .scalars = p + 5 * KK + K,
        .cross = j->cross ? more : NULL,
        .deviations = j->deviate ? more + (j->cross ? 3 * KK : 0) : NULL};
}

/* normal_units.c: units of a pixel that has so many sets. */
int imp__normal_units(int sets);
/* r[unit][c], in: radiance of channel c, out: residual, so that the loss is 1/2 w r^2;
 * @return w. factor [units]: for a loss that is not quadratic, the factor of each unit's
 * derivatives; not set for others. */
double imp__normal_residuals(const struct imp__target *target, size_t pixel, size_t c,
                             int units, double r[][3], double *factor);

/* Channels of pixels whose weight is not 0; and pixels with such a channel, of all targets. */
double imp__normal_residual_count(const struct imp__target *target);
double imp__normal_pixel_count(const struct imp_problem *problem);

/* Adds `cross` of all targets to H_meas, with the channels' correlations. */
void imp__normal_cross(const struct imp__normal_job *j, struct imp__normal_sums *sums);

/* For imp__tiles_run. */
enum imp_status imp__normal_work(const struct imp_tile *t, struct imp_tile_worker *tile,
                                 void *result, void *payload);
void imp__normal_add(void *into, const void *from, void *payload);
enum imp_status imp__normal_take(size_t group, const void *sum, void *payload);

#endif
