/* SPDX-License-Identifier: Apache-2.0
 *
 * Distortion by a lens: the model of Brown (1966) and Conrady (1919) with the five numbers
 * and the signs of OpenCV. A pinhole's ray along (x, y, 1), x to the right and y down, is
 * seen where that of (x'', y'', 1) would be without the lens:
 *
 *     x'' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2)
 *     y'' = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y
 *
 * A pixel's ray is the inverse, by Newton's method from a table. The polynomials fold the
 * plane far from the middle; the inverse is that which is continuous from there. */
#ifndef IMP_KIND_DISTORTION_H
#define IMP_KIND_DISTORTION_H

#include <stdbool.h>

#define IMP_DISTORTION_NODES 33 /* of the table, to a side */

struct imp_distortion {
    double k1, k2, k3, p1, p2;
    double lo[2], step[2]; /* x'', y'' of the table's first node, and of the next */
    double node[IMP_DISTORTION_NODES][IMP_DISTORTION_NODES][2]; /* x, y; rows by y'' */
};

/* (x'', y''), and d(x'', y'')/d(x, y), which is symmetric: xx, xy, yy. */
void imp__distort(const struct imp_distortion *d, const double at[2], double out[2],
                  double slope[3]);
/* d(x'', y'')/dk at (x, y); k: 0 to 4 for k1, k2, p1, p2, k3, OpenCV's order. */
void imp__distort_by(const double at[2], int k, double out[2]);
/* Its inverse; the table must be filled. */
void imp__undistort(const struct imp_distortion *d, const double seen[2], double out[2]);

/* Fills the table for x'' in [lo[0], hi[0]], y'' in [lo[1], hi[1]], from k and p. False:
 * there is no inverse at *seen. */
bool imp__distortion_invert(struct imp_distortion *d, const double lo[2],
                            const double hi[2], double seen[2]);

#endif
