/* SPDX-License-Identifier: Apache-2.0
 *
 * Integrals over the sphere of directions in (z, phi), where area is dz dphi, by adaptive
 * Gauss-Legendre, and a tree of cells for histograms of directions. The horizon z = 0 is
 * always a border of cells. */
#ifndef IMP_MATH_SPHERE_CELLS_H
#define IMP_MATH_SPHERE_CELLS_H

#include "vec.h"

typedef double imp__sphere_fn(imp_v3 w, void *payload);

struct imp__sphere_cell {
    double z0, z1, p0, p1;
    int child; /* index of the first of four, or 0 */
    int count; /* draws in it */
};

/* How often a cell is cut at most: of a smooth function, and of one that jumps, where
 * halving would never end. */
enum { IMP_SPHERE_SMOOTH = 12, IMP_SPHERE_STEPS = 5 };

/* Until halving changes less than `tolerance` (absolute, shared out by area). */
double imp__sphere_cell_integral(const struct imp__sphere_cell *c, imp__sphere_fn *f,
                                 void *payload, double tolerance, int depth);
/* The same after the cell has been cut `cuts` times, whatever that changes: for what may hide
 * between the nodes of a wide cell. */
double imp__sphere_cell_integral_cut(const struct imp__sphere_cell *c, imp__sphere_fn *f,
                                     void *payload, double tolerance, int depth,
                                     int cuts);
/* Over the whole sphere (lo = -1, hi = 1) or a zone of it; first cut into cells about
 * 1/16 wide. */
double imp__sphere_integral(imp__sphere_fn *f, void *payload, double lo, double hi,
                            double tolerance, int depth);

#define IMP_SPHERE_CELLS_MAX 4096
struct imp__sphere_tree {
    int n;
    struct imp__sphere_cell cell[IMP_SPHERE_CELLS_MAX];
};
void imp__sphere_tree_init(struct imp__sphere_tree *t);
struct imp__sphere_cell *imp__sphere_tree_find(struct imp__sphere_tree *t, imp_v3 w);
/* A pilot draw: cells that hold `limit` of them are cut. The draws that are tested must be
 * others. */
void imp__sphere_tree_pilot(struct imp__sphere_tree *t, imp_v3 w, int limit);
void imp__sphere_tree_reset(struct imp__sphere_tree *t);

#endif
