/* SPDX-License-Identifier: Apache-2.0
 *
 * The variance of a net of points, from the spread of its quarters (docs/estimators.md 18). */
#ifndef IMP_FILM_NETS_H
#define IMP_FILM_NETS_H

#include <stdbool.h>
#include <stdint.h>

#define IMP_NET_PARTS 4

/* Are the walks of a pixel whole nets, whose quarters are sets of `set` walks? */
bool imp__nets_whole(int64_t walks, int set);
/* A net's share of the spread of its halves is added to sums [n][2], with a count.
 * parts [IMP_NET_PARTS][n]: sums over its quarters. */
void imp__nets_add(double *sums, const double *parts, int n);
/* What errors from the spread of quarters are multiplied with; 1: nothing is known. */
double imp__nets_factor(const double sums[2]);

#endif
