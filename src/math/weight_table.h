/* SPDX-License-Identifier: Apache-2.0
 *
 * Draws texels of a picture by weight: the row by the sums of rows, then the column by
 * the running sum inside the row. Running sums of rows, and not of rectangles, so that
 * texels beside one that is a million times brighter keep their digits. */
#ifndef IMP_MATH_WEIGHT_TABLE_H
#define IMP_MATH_WEIGHT_TABLE_H

#include <stdbool.h>
#include <stddef.h>

struct imp__weight_table {
    int width, height;
    double *row;    /* [height] running sum of the rows' weights */
    double *column; /* [height][width] running sums inside the rows */
};

/* From column[i][j], which hold the weights of the texels (>= 0), and scale[i] of row i
 * (NULL: 1). */
void imp__weight_table_sum(struct imp__weight_table *t, const double *scale);
/* Sum of all weights; 0: there is nothing to draw. */
static inline double imp__weight_table_total(const struct imp__weight_table *t)
{
    return t->row[t->height - 1];
}
/* A texel of weight > 0, and in r what is left of the two numbers, in [0, 1). */
void imp__weight_table_draw(const struct imp__weight_table *t, const double u[2], int *i,
                            int *j, double r[2]);

#endif
