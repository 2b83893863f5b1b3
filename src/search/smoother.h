/* SPDX-License-Identifier: Apache-2.0
 *
 * Smooth steps of a mesh (Nicolet, Jacobson, Jakob, "Large steps in inverse rendering of geometry",
 * 2021): a search over
 *
 *     u = (I + lambda L) X,  L = D - A,
 *
 * A the adjacency of the places of a mesh by its triangles' sides, D their numbers of neighbours. L is
 * the uniform Laplacian: symmetric and positive semi-definite whatever the triangles' shapes, and the
 * same wherever the vertices go, so that one factorisation serves a whole search; cotangent weights do
 * neither. On a regular mesh with sides h the steps of X are smooth over a length of about
 * h sqrt(3 lambda / 2).
 *
 * Vertices at the same place (seams) are one row of X and stay together. Held places have no row. */
#ifndef IMP_SEARCH_SMOOTHER_H
#define IMP_SEARCH_SMOOTHER_H

#include "base/context.h"

struct imp__smoother;

struct imp__smooth_mesh {
    size_t n_vertices, n_triangles;
    const uint32_t *indices; /* [n_triangles][3] */
    const uint32_t *place;   /* [n_vertices] the least vertex at the same place */
    const bool *held;        /* [n_vertices] by place; NULL: none */
    double lambda;           /* > 0 */
};

/* Factorises I + lambda L, by sparse Cholesky. IMP_E_UNSUPPORTED: this build has none (CXSparse);
 * IMP_E_NOMEM; IMP_E_NUMERIC: lambda is beyond what numbers hold. */
enum imp_status imp__smoother_create(imp_context *ctx,
                                     const struct imp__smooth_mesh *mesh,
                                     struct imp__smoother **out);
void imp__smoother_destroy(imp_context *ctx, struct imp__smoother *s);

/* In place, [n_vertices][3]: derivatives by vertices become those by u; all vertices of a place have
 * the place's. */
void imp__smoother_derivative(const struct imp__smoother *s, double *g);
/* In place: a step of u, of which all vertices of a place have the place's, becomes that of the
 * vertices. */
void imp__smoother_step(const struct imp__smoother *s, double *step);

#endif
