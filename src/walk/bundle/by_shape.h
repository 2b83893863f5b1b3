/* SPDX-License-Identifier: Apache-2.0
 *
 * The vertices of a depth, by the shapes that rays meet. */
#ifndef IMP_WALK_BUNDLE_BY_SHAPE_H
#define IMP_WALK_BUNDLE_BY_SHAPE_H

#include "depth.h"

/* Rays in the order of what they meet: of shapes, and of materials. Counts are 0 between
 * depths. */
struct imp_by_shape {
    bool lanes, sky; /* vertices may be made, and the sky met, in lanes */
    int32_t *count;  /* [shapes] */
    int32_t *shape;  /* [rays] those that are met, in this order */
    int32_t *order;  /* [rays] rays of the first shape, then of the second, ... */
    int n;           /* shapes that are met */
    int32_t *few;    /* [rays] those on shapes that few rays meet */
    int32_t *by_material;
    int32_t *materials; /* [materials] counts */
};
/* Room for n rays. False: no memory. */
bool imp__by_shape_create(const struct imp_tracer *tracer, struct imp_arena *arena,
                          size_t n, struct imp_by_shape *out);

/* Fewer vertices on a shape are not worth lanes of their own. */
enum { IMP_LANES_FEW = IMP_WIDE_LANES / 2 };

/* Counts the n rays that meet shapes; s->order has those that meet nothing, so many. */
int imp__by_shape_count(struct imp_by_shape *s, const struct imp_hit_columns *hits,
                        int n);
/* ... and orders them: those of a shape end in s->order before s->count[shape], which the caller sets
 * to 0. */
void imp__by_shape_order(struct imp_by_shape *s, const struct imp_hit_columns *hits,
                         int n);
/* The n rays of s->few by their materials. */
typedef void imp__few_make(struct imp_depth *d, const int32_t *order, int n);
void imp__by_shape_few(struct imp_depth *d, struct imp_by_shape *s, int n,
                       imp__few_make *make);
/* The vertices of such rays, which have one material. */
void imp__few_bin(const struct imp_depth *d, const int32_t *order, int n,
                  struct imp_bin *bin);

/* The vertices that d->rays lead to, and the sky, whose value goes to `beyond` of the vertices
 * before. */
void imp__vertices(struct imp_depth *d, double *const beyond[4], struct imp_by_shape *s);

#endif
