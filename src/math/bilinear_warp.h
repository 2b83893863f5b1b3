/* SPDX-License-Identifier: Apache-2.0
 *
 * Functions of the unit square that are bilinear between the nodes of a grid, [rows][columns]
 * over x[1] and x[0], interpolated between several grids of one size; and draws from those
 * that are densities: the row by the marginal density, then x[0] by the conditional one (as
 * in Dupuy and Jakob 2018). Both are piecewise linear, so that each is drawn by a quadratic
 * equation, and the way back needs no search. */
#ifndef IMP_MATH_BILINEAR_WARP_H
#define IMP_MATH_BILINEAR_WARP_H

#include <stdbool.h>
#include <stddef.h>

/* Grids and their weights. */
struct imp__bilinear_mix {
    int n;
    size_t grid[8];
    double weight[8];
};
double imp__bilinear_value(const float *table, int rows, int columns,
                           const struct imp__bilinear_mix *mix, const double x[2]);

struct imp__bilinear_warp {
    int rows, columns;    /* at least 2 each */
    const float *density; /* [grids][rows][columns], not negative, of any integral */
    double *row;          /* [grids][rows] integral up to the row */
    double *column;       /* [grids][rows][columns] integral along the row up to there */
};
/* Sets row and column. */
void imp__bilinear_warp_fill(struct imp__bilinear_warp *w, size_t grids);

/* The mix of the grids that are each of integral 1. False: all of them are 0. */
bool imp__bilinear_warp_mix(const struct imp__bilinear_warp *w,
                            const struct imp__bilinear_mix *mix,
                            struct imp__bilinear_mix *of_warp);
/* For a mix by that function: a point from two uniform numbers; */
void imp__bilinear_warp_draw(const struct imp__bilinear_warp *w,
                             const struct imp__bilinear_mix *mix, const double u[2],
                             double x[2]);
/* the numbers that draw a point, and its density. */
double imp__bilinear_warp_invert(const struct imp__bilinear_warp *w,
                                 const struct imp__bilinear_mix *mix, const double x[2],
                                 double u[2]);

#endif
