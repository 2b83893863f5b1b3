/* SPDX-License-Identifier: Apache-2.0
 *
 * Loss and gradient of one target, or of a fixed adjoint image, tile by tile. The n walks
 * of a replicate are kept in the arena until their adjoints are known (adjoint.c), then
 * swept: the price of one render and a sweep. A fixed adjoint image needs no mean, and no
 * walk is kept. Filters wider than a pixel take two passes with the same random numbers
 * (splat.c). */
#ifndef IMP_INVERSE_GRADIENT_JOB_H
#define IMP_INVERSE_GRADIENT_JOB_H

#include "film/film_tiles.h"
#include "inverse/estimate/overlap.h"
#include "inverse/estimate/replicates.h"
#include "inverse/estimate/splat.h"
#include "inverse/estimate/tally.h"
#include "inverse/estimate/tile_walks.h"
#include "inverse/estimate/totals.h"
#include "variate.h"

struct imp__allocation;
struct imp__moved_gradient;

/* What a job with poses is of: a fixed adjoint is known before, that of draws in a loss when all walks
 * are there. */
enum imp__job_of { IMP_JOB_OF_ALL, IMP_JOB_OF_WALKS, IMP_JOB_OF_DRAWS };

struct imp__gradient_job {
    const struct imp_problem *problem;
    struct imp__totals *totals;
    struct imp_tracer tracer;
    struct imp__replicates plan;
    const struct imp__target *target; /* NULL: fixed adjoint */
    const float *seed;                /* fixed adjoint image, [h][w][channels] */
    const struct imp__splat *splat;   /* wide filters and poses: pictures; else NULL */
    bool splat_made; /* its pictures are there; else they are made of this job's walks */
    enum imp__job_of of;
    /* Adjoints in light tracing; NULL: walks begin at the sensor. */
    const struct imp__light_adjoints *light;
    const struct imp__moved_gradient *moved; /* NULL: no pose is active */
    double *contrasts; /* of `moved`, sums over all items (moved_gradient.h) */
    struct imp__variate_view *variate; /* NULL: none */
    struct imp_tracer there;           /* of the variate; scene NULL: nowhere yet */
    bool want_gradient;
    bool want_errors; /* of the gradient */
    /* Set by imp__gradient_job_run. */
    const struct imp_run *run;
    struct imp__allocation *allocation; /* of samples to tiles; NULL: all have `plan` */
    size_t first_tile;                  /* of this job, in the allocation */
    size_t parts;                       /* work items of a tile */
    int width, channels;
    bool shared; /* pixels share walks, to the extent of overlap */
    struct imp__overlap overlap;
    bool look;                           /* only the size of terms is wanted */
    struct imp_active nothing;           /* what the tally keeps without want_gradient */
    struct imp_fixed_sum *mean, *spread; /* of many values; spread NULL: not wanted */
    struct imp_tiles tiles;
    struct imp_tally *tallies; /* [threads] */
    double *item_contrasts; /* [threads][n] of `moved`, of the item at work; NULL: none */
    /* [threads][IMP_MOVED_BARS][n] of `moved`, of many numbers: what the item at work gives to
     * velocities, and room for draws. NULL: replicates have room of their own. */
    double *item_bars;
    bool
        bars_of_replicates; /* each gives its own to the tally: errors are wanted, or few */
};

/* Has a pixel a part in the loss? One that has none has no walks. */
static inline bool imp__gradient_counts(const struct imp__gradient_job *j, int x, int y)
{
    return !j->target || j->splat || j->light ||
           imp__target_counts(j->target, (size_t)y * (size_t)j->width + (size_t)x);
}

/* Adds objective, variance and gradients of this job to the totals. */
enum imp_status imp__gradient_job_run(struct imp__gradient_job *job,
                                      const struct imp_run *run, const char *stage,
                                      double lo, double hi, double start_s);

/* ---- Of one pixel (gradient_replicate.c) ---- */
/* Replicate b, in work item `part` of its tile, of which these are the walks: to the worker's tally;
 * returns its estimate of the loss. moments: of the variate. variance: of that estimate, from a lone replicate only. */
double imp__gradient_replicate(struct imp__gradient_job *job, struct imp__replicates plan,
                               struct imp_tile_worker *worker,
                               struct imp__tile_walks *walks, int x, int y, int b,
                               int part, double *moments, double *variance);

/* ---- Samples of tiles (gradient_samples.c) ---- */
/* Sets the allocation, parts and walks of a job whose tiles are known. */
void imp__gradient_samples(struct imp__gradient_job *job);
struct imp__replicates imp__gradient_plan(const struct imp__gradient_job *job,
                                          size_t tile);
/* What the allocation measures tallies by; NULL: nothing. */
const struct imp__metric *imp__gradient_metric(const struct imp__gradient_job *job);
/* Gives a tile's item to the allocation; and all items to the team. */
void imp__gradient_see(const struct imp__gradient_job *job, const struct imp_tile *tile,
                       const struct imp_tally *tally, double loss_variance);
enum imp_status imp__gradient_seen(const struct imp__gradient_job *job);

/* ---- Sums of many numbers (gradient_unit.c) ---- */
/* Sets their unit. */
enum imp_status imp__gradient_unit(struct imp__gradient_job *job,
                                   const struct imp_tiles_pass *pass);

#endif
