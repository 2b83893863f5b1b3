/* SPDX-License-Identifier: Apache-2.0
 *
 * Loss and gradient of one target, or of a fixed adjoint image, tile by tile. The n walks
 * of a replicate are kept in the arena until their adjoints are known (adjoint.c), then
 * swept: the price of one render and a sweep. A fixed adjoint image needs no mean, and no
 * walk is kept. Filters wider than a pixel take two passes with the same random numbers
 * (splat.c). */
#ifndef IMP_INVERSE_GRADIENT_JOB_H
#define IMP_INVERSE_GRADIENT_JOB_H

#include "allocation.h"
#include "estimate.h"
#include "film/film_tiles.h"
#include "overlap.h"
#include "splat.h"
#include "tally.h"
#include "totals.h"
#include "variate.h"

struct imp__gradient_job {
    const struct imp_problem *problem;
    struct imp__totals *totals;
    struct imp_tracer tracer;
    struct imp__replicates plan;
    const struct imp__target *target; /* NULL: fixed adjoint */
    const float *seed;                /* fixed adjoint image, [h][w][channels] */
    const struct imp__splat *splat;   /* wide filters: pass 2; NULL: box */
    const struct imp__light_adjoints
        *light;                        /* of walks from the lights; NULL: not those */
    struct imp__variate_view *variate; /* NULL: none */
    struct imp_tracer there;           /* of the variate */
    bool want_gradient;
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
    struct imp_fixed_sum *mean, *spread; /* of many numbers; spread NULL: not wanted */
    struct imp_tiles tiles;
    struct imp_tally *tallies; /* [threads] */
};

/* Adds objective, variance and gradients of this job to the totals. */
enum imp_status imp__gradient_job_run(struct imp__gradient_job *job,
                                      const struct imp_run *run, const char *stage,
                                      double lo, double hi, double start_s);

#endif
