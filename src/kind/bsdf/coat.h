/* SPDX-License-Identifier: Apache-2.0
 *
 * What a rough coat lets through to a diffuse base: means over the facets that are seen,
 * kept in a table (docs/scene-format.md 5.3). With visible normals m of w = (sin, 0, mu)
 *
 *   T(mu) = E[(1 - F(w.m, eta)) G1(w refracted)]
 *   R_int = 2/64 sum_k mu_k E[F(w.m, 1/eta) G1(w reflected)],    mu_k = max(1e-6, k/63)
 *
 * T is linear between the nodes mu_k. All numbers have their derivatives with respect to
 * the roughness alpha and the index eta, those of the quadrature itself. */
#ifndef IMP_KIND_BSDF_COAT_H
#define IMP_KIND_BSDF_COAT_H

#include "microfacet.h"

#define IMP_COAT_NODES 64

/* Value, d/dalpha, d/deta, 0. */
typedef imp_spec imp__dual;

struct imp__coat {
    enum imp__distribution type;
    double alpha, eta; /* what the table was made for; 0: nothing yet */
    imp__dual T[IMP_COAT_NODES], R_int;
};

/* Makes the table, unless it is there already (some milliseconds). */
void imp__coat_make(struct imp__coat *c, enum imp__distribution type, double alpha,
                    double eta);
imp__dual imp__coat_T(const struct imp__coat *c, double mu);
/* Its derivative by mu. */
imp__dual imp__coat_T_slope(const struct imp__coat *c, double mu);

/* The number at alpha and eta: they are those of the table, or near. */
static inline double imp__coat_at(const struct imp__coat *c, imp__dual x, double alpha,
                                  double eta)
{
    return x[0] + x[1] * (alpha - c->alpha) + x[2] * (eta - c->eta);
}

#endif
