/* SPDX-License-Identifier: Apache-2.0
 *
 * The adjoint of traced rays, between bend_adjoint.c (the call, slices of rays), lane.c (one
 * ray from its end to its start) and bend_gradient.c (sums of large gradients). */
#ifndef IMP_BEND_ADJOINT_H
#define IMP_BEND_ADJOINT_H

#include "bend_rays.h"
#include <pthread.h>

/* ---- Gradients by slices ------------------------------------------------------- */

/* The gradient of one slice of rays. Blocks that were not touched are not initialised. */
struct imp__partial {
    struct imp__partial *next;
    size_t slice;
    int parts_left; /* to be added to the sum */
    double *theta;
    uint8_t *touched; /* [n_blocks] */
};
/* A part of the coefficients; slices are added to it in order, by one thread at a time.
 */
struct imp__partials_part {
    size_t first, last; /* blocks */
    size_t slice;       /* the next one to be added */
    bool busy;
};
#define IMP_PARTIALS_PARTS 16
/* A slice takes an idle buffer or makes one, so there are as many as slices at work at
 * once. */
struct imp__partials {
    imp_context *ctx;
    size_t n_theta, n_blocks;
    pthread_mutex_t lock;
    struct imp__partial *idle, *ready; /* ready: to be added */
    struct imp__partial *sum;
    int n_parts;
    struct imp__partials_part part[IMP_PARTIALS_PARTS];
};
void imp__partials_init(struct imp__partials *p, imp_context *ctx, size_t n_theta);
void imp__partials_free(struct imp__partials *p);
enum imp_status imp__partial_take(struct imp__partials *p, struct imp__partial **out);
/* Hands in the gradient of slice `slice` (0, 1, ... each once). The calling thread adds
 * the parts that are ready: every coefficient gets the slices in their order, and
 * different threads add different parts. */
void imp__partial_add(struct imp__partials *p, size_t slice, struct imp__partial *own);
/* Releases the gradient of a slice that failed; NULL is fine. */
void imp__partial_drop(struct imp__partials *p, struct imp__partial *own);
/* After all slices: theta = the sum. */
enum imp_status imp__partials_sum(struct imp__partials *p, double *theta);

/* ---- Rays backwards ------------------------------------------------------------ */

struct imp__adjoint_slot {
    struct imp__partial *partial; /* of the slice under way; NULL: no gradient wanted */
    double (*surfaces)[8];
    struct imp__track *track; /* [IMP_LANES] */
    uint64_t reversal;
    double worst;
};
struct imp__adjoint {
    const struct imp__plan *plan;
    const struct imp_bend_rays *rays;
    const struct imp_bend_exit *exits, *taps;
    const struct imp_bend_cotangent *bars, *tap_bars;
    struct imp_bend_gradient *out;
    struct imp__partials partials;
    size_t slice; /* rays of one item */
    size_t n_surfaces;
    struct imp__adjoint_slot *slots;
    uint64_t reversal;
    double worst;
};
struct imp__lane {
    size_t ray;
    struct imp__start start;
    uint32_t left; /* whole steps still to undo in this segment */
    int segment;
    size_t base;              /* of the segment's states in the track */
    struct imp__track *track; /* NULL: one segment, reversed */
    bool taps;
};

/* Put a ray into lane i of b: from the cotangents of its exit to the start of the
 * fractional step there. */
enum imp_status imp__lane_begin(const struct imp__adjoint *job,
                                struct imp__adjoint_slot *slot, size_t ray,
                                struct imp__track *track, struct imp__lane *l,
                                struct imp__back *b, int i, struct imp__bar *bar);
/* Add the cotangents of taps crossed within the step that begins at the lane's state,
 * each through the adjoint of its own fractional step. */
void imp__lane_taps(const struct imp__adjoint *job, struct imp__lane *l,
                    struct imp__back *b, int i, struct imp__bar *bar);
/* Adjoint of a reflection between two segments; the lane goes on with the earlier one. */
void imp__lane_turn(const struct imp__adjoint *job, struct imp__adjoint_slot *slot,
                    struct imp__lane *l, struct imp__back *b, int i,
                    struct imp__bar *bar);
/* From the start of the first step to the ray's origin and direction as given. */
void imp__lane_end(const struct imp__adjoint *job, struct imp__adjoint_slot *slot,
                   struct imp__lane *l, struct imp__back *b, int i, struct imp__bar *bar);

#endif
