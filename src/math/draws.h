/* SPDX-License-Identifier: Apache-2.0
 *
 * Draws of directions against the density that is claimed for them: chi-square over cells
 * cut where a pilot run falls densely, expected counts by quadrature of the density, with
 * one cell for each lobe without a density and one for "no draw". A density that does not
 * integrate to what is drawn fails as surely as one of the wrong shape. */
#ifndef IMP_MATH_DRAWS_H
#define IMP_MATH_DRAWS_H

#include "sphere_cells.h"

enum { IMP_DRAWS_LOBES = 16 };
struct imp__drawn {
    /* From three uniform numbers: w, and *lobe, -1 if it has a density. False: no draw. */
    bool (*draw)(void *payload, const double u[3], imp_v3 *w, int *lobe);
    imp__sphere_fn *density;                   /* NULL: there is none, lobes alone */
    double (*chance)(void *payload, int lobe); /* of a lobe that has been drawn */
    void *payload;
    /* Draws that the cells are cut by, 0: 1500. More find narrower peaks, and leave
     * larger cells to broad ones. */
    uint32_t pilot;
    /* Asked now and then whether to go no further, with an answer that means nothing; NULL:
     * never. */
    bool (*stopped)(void *watch);
    void *watch;
};
struct imp__draws {
    double chance; /* p of the chi-square; 1: too few cells for a test */
    double chi2;   /* with cells - 1 degrees of freedom; 0: too few cells */
    int cells;
    double total;  /* of the density and the lobes */
    double none;   /* fraction of draws that gave none */
    bool overflow; /* a lobe beyond IMP_DRAWS_LOBES was drawn */
};
/* tree: room, its cells are made anew. depth: imp__sphere_cell_integral's. */
struct imp__draws imp__draws_test(const struct imp__drawn *d, int samples, uint64_t seed,
                                  int depth, struct imp__sphere_tree *tree);

#endif
