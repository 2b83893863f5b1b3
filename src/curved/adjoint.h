/* SPDX-License-Identifier: Apache-2.0
 *
 * The adjoint of traced rays, between adjoint.c (the call, slices of rays), lane.c (one
 * ray from its end to its start) and gradient.c (sums of large gradients). */
#ifndef IMP_CURVED_ADJOINT_H
#define IMP_CURVED_ADJOINT_H

#include "curved.h"
#include <pthread.h>

/* ---- Gradients by slices ------------------------------------------------------- */

/* The gradient of one slice of rays. Blocks that were not touched hold nothing. */
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
/* Buffers are made when a slice begins and none is idle: as many as slices are under way
 * at once. */
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
/* The gradient of slice `slice` (0, 1, ... each once) is complete, and no longer the
 * caller's. Whoever calls adds what can be added: coefficient by coefficient the order is
 * that of the slices, and different parts are added by different threads. */
void imp__partial_add(struct imp__partials *p, size_t slice, struct imp__partial *own);
/* Of a slice that failed; NULL is fine. */
void imp__partial_drop(struct imp__partials *p, struct imp__partial *own);
/* All slices are there: theta = the sum. */
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

/* Lane i of b: from the cotangents of a ray's end to the start of its fractional step. */
enum imp_status imp__lane_begin(const struct imp__adjoint *job,
                                struct imp__adjoint_slot *slot, size_t ray,
                                struct imp__track *track, struct imp__lane *l,
                                struct imp__back *b, int i, struct imp__bar *bar);
/* Taps inside the step that begins here: their cotangents come in through their own
 * fractional step. */
void imp__lane_taps(const struct imp__adjoint *job, struct imp__lane *l,
                    struct imp__back *b, int i, struct imp__bar *bar);
/* Back through a turn in the middle of the ray, into the segment before it. */
void imp__lane_turn(const struct imp__adjoint *job, struct imp__adjoint_slot *slot,
                    struct imp__lane *l, struct imp__back *b, int i,
                    struct imp__bar *bar);
/* From the start of the steps back to the ray as it was given. */
void imp__lane_end(const struct imp__adjoint *job, struct imp__adjoint_slot *slot,
                   struct imp__lane *l, struct imp__back *b, int i, struct imp__bar *bar);

#endif
