/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight glare probability: the view of an observer in cells, and what they add up to. */
#ifndef IMP_INVERSE_DGP_H
#define IMP_INVERSE_DGP_H

#include "math/vec.h"
#include <importon/rooms.h>

enum { IMP__VIEW_GROUPS = 16 }; /* of walks, independent of each other */

/* The half of all directions before an observer: x to the right, y up, z along the line of
 * sight. Its cells have equal solid angles: squares of the unit square, mapped to the disk
 * (Shirley and Chiu 1997) and from there to the hemisphere. */
struct imp__view {
    int side;    /* side x side cells, even: none is partly below the line of sight */
    size_t n;    /* cells */
    double size; /* of each, sr */
    double *cosine,
        *weight; /* [n] means over the cell: of the cosine to the line of sight,
                                of size over the square of the position index */
};
/* IMP_E_NOMEM. Freed by imp__view_free, which takes one that is all 0, too. */
enum imp_status imp__view_make(imp_context *ctx, int side, struct imp__view *out);
void imp__view_free(imp_context *ctx, struct imp__view *v);
/* The cell of unit direction w; -1: it is behind the observer. */
int imp__view_cell(const struct imp__view *v, imp_v3 w);
/* Direction of the middle of a cell. */
imp_v3 imp__view_middle(const struct imp__view *v, int cell);
/* Guth's or Iwata's, at most 16. */
double imp__view_position(imp_v3 w);

/* A part of the view that has a place and a size of its own: a sun's disc. */
struct imp__view_disc {
    double size, cosine; /* sr; to the line of sight */
    double weight;       /* size over the square of the position index */
};

/* position_index.c: Guth's by Levin's formula, a and b in degrees as of imp_guth_position; NAN. */
double imp__levin_position(double a, double b);

/* glare.c: the formula, with sum = sum L^2 w/p^2. */
double imp__dgp_of(double illuminance, double sum);

/* dgp.c: light [n] of the cells of view[0] by groups, as illuminances, which become luminances;
 * view[1] has half as many cells on a side, which share the array behind the first n.
 * threshold as of imp_dgp_options. The light of the discs, which is not in the cells, is
 * disc_light [n_discs], as the cells'. */
void imp__dgp_rate(const struct imp__view view[2], double (*light)[IMP__VIEW_GROUPS],
                   size_t n_discs, const struct imp__view_disc *disc,
                   double (*disc_light)[IMP__VIEW_GROUPS], double threshold, double *dgp,
                   double *se, double *illuminance);

#endif
