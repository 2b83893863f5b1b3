/* SPDX-License-Identifier: Apache-2.0
 *
 * Running sums of a table of weights, and the texel that two uniform numbers draw by them: row
 * first, then column. */
#include "weight_table.h"
#include <math.h>

void imp__weight_table_sum(struct imp__weight_table *t, const double *scale)
{
    double sum = 0;
    for (int i = 0; i < t->height; i++) {
        double *c = t->column + (size_t)i * (size_t)t->width;
        for (int j = 1; j < t->width; j++) c[j] += c[j - 1];
        sum += c[t->width - 1] * (scale ? scale[i] : 1);
        t->row[i] = sum;
    }
}

/* The first k with x < sum[k], and the part of its weight that x has passed. A weight of
 * 0 is never found: its sum is that of its neighbour before. */
static int find(const double *sum, int n, double u, double *rest)
{
    const double x = u * sum[n - 1];
    int lo = 0;
    for (int left = n - 1; left > 0;) { /* without branches on x, which nobody foresees */
        const int half = left / 2;
        const bool above = !(x < sum[lo + half]);
        lo = above ? lo + half + 1 : lo;
        left = above ? left - half - 1 : half;
    }
    while (lo > 0 && !(sum[lo] > sum[lo - 1])) lo--; /* x rounded up to the total */
    const double before = lo ? sum[lo - 1] : 0;
    *rest = fmin((x - before) / (sum[lo] - before), 0x1.fffffffffffffp-1);
    return lo;
}

void imp__weight_table_draw(const struct imp__weight_table *t, const double u[2], int *i,
                            int *j, double r[2])
{
    *i = find(t->row, t->height, u[1], &r[1]);
    *j = find(t->column + (size_t)*i * (size_t)t->width, t->width, u[0], &r[0]);
}
