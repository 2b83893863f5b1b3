/* SPDX-License-Identifier: Apache-2.0
 *
 * The directions of the variables that the data determine: the eigenvectors of the scaled
 * Gauss-Newton matrix whose eigenvalues exceed their own noise, and the inverse of the
 * matrix within them. */
#ifndef IMP_SEARCH_DIRECTIONS_H
#define IMP_SEARCH_DIRECTIONS_H

#include "sampled.h"

struct imp__directions {      /* of a subset of the variables; all zero is none */
    size_t m;                 /* variables in it */
    size_t *index;            /* [m] */
    double *values, *vectors; /* [m], [m][m] of the scaled H, from data alone */
    double *se;               /* [m] of the eigenvalues */
    size_t n_loose;
    bool *loose; /* [m] eigenvalue not above its noise */
    bool held;   /* some are loose, and the prior determines these: G is all of H^-1 */
    double *G;   /* [n][n] generalised inverse, 0 outside */
};

/* Directions of the variables that are not fixed (fixed: [n], or NULL for none). Release
 * `out` with imp__directions_destroy, also after a failure. */
enum imp_status imp__directions_find(const struct imp__sampled *s, const bool *fixed,
                                     struct imp__directions *out);
void imp__directions_destroy(imp_context *ctx, struct imp__directions *d);

/* Does variable k take part in a direction that is not determined? */
bool imp__is_loose(const struct imp__directions *d, size_t k);

#endif
