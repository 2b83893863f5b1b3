/* SPDX-License-Identifier: Apache-2.0
 *
 * Choice of points on edges (edges.h), by a density that is known exactly. Each edge has a measure,
 * which is spread evenly over its length; cells of equal measure along the list, which follows a
 * curve through space, have chances: at first the same, later what a pilot has found,
 *
 *     chance of a cell ~ .15 + .85 sqrt(cell's second moment)/(sum of these roots)
 *
 * so that every edge that has a measure keeps a chance (Yan et al. 2022; .15 is a floor for what the
 * pilot has missed). Silhouettes seen from a point, or along a direction, are chosen by a tree over
 * the edges: a node bounds its edges by a sphere and the normals of their faces by a cone, and is
 * passed over where all of its faces are seen from one side. */
#ifndef IMP_MOVE_EDGE_CHOICE_H
#define IMP_MOVE_EDGE_CHOICE_H

#include "edges.h"

#define IMP_EDGE_CELLS_MAX 4096

struct imp__edge_node; /* edge_tree.c */

struct imp__edge_tree {
    imp_context *ctx;
    const struct imp__edges *edges;
    struct imp__edge_node *node;
    size_t *root; /* [n_runs] of the edges of a run; SIZE_MAX: it has none */
};

struct imp__edge_choice {
    const struct imp__edges *edges;
    const struct imp__edge_tree *tree;
    double *until;  /* [n + 1] measure of the edges before this one; the last is 1 */
    double *chance; /* [n + 1] probability of the edges before this one; the last is 1 */
    int n_cells;
    double *cell; /* [n_cells + 1] probability of the cells before this one */
};

struct imp__edge_point {
    const struct imp__edge *edge;
    imp_v3 p;
    double inv_pdf; /* length over probability */
    int cell;
};

enum imp_status imp__edge_tree_build(const struct imp__edges *edges,
                                     struct imp__edge_tree *out);
void imp__edge_tree_free(struct imp__edge_tree *tree);

/* Edges by measure [n], at least 0; one of measure 0 has no chance, and is never asked for by the tree.
 * NULL: their lengths. The tree is borrowed. */
enum imp_status imp__edge_choice_begin(const struct imp__edges *edges,
                                       const struct imp__edge_tree *tree,
                                       const double *measure, int n_cells,
                                       struct imp__edge_choice *out);
void imp__edge_choice_free(struct imp__edge_choice *c);
/* Second moments [n_cells] of what is estimated, per cell: integrals of the square over length,
 * of any unit. All zero: the choice stays as it is. kept: the probability that stays with the measure. */
void imp__edge_choice_learn(struct imp__edge_choice *c, const double *moment,
                            double kept);

/* u in [0, 1); neighbours on the list have neighbouring u. */
void imp__edge_choice_draw(const struct imp__edge_choice *c, double u,
                           struct imp__edge_point *out);
/* A run of the list by its probability, *chance; *u is uniform on [0, 1) again. */
int imp__edge_choice_run(const struct imp__edge_choice *c, double *u, double *chance);
/* A silhouette of this run to lines that come from a point, or, where `parallel`, along this direction, given
 * where the run is at time 0. False: this u leads to none. */
bool imp__edge_choice_silhouette(const struct imp__edge_choice *c, int run, imp_v3 from,
                                 bool parallel, double u, struct imp__edge_point *out);

/* ---- edge_tree.c ---- */
/* The edge of a run that u chooses among those before and behind which `chance` [n + 1] says that so much
 * probability lies; *u is uniform on [0, 1) again, *pmf the probability. -1: none. */
ptrdiff_t imp__edge_tree_choose(const struct imp__edge_tree *tree, int run,
                                const double *chance, imp_v3 from, bool parallel,
                                double *u, double *pmf);

#endif
