/* SPDX-License-Identifier: Apache-2.0
 *
 * A table of a measured isotropic BRDF, as a function and as densities. Angles are
 * Rusinkiewicz' (1998): with h the half-vector of wo and wi,
 *
 *     theta_h   of h to the normal           row floor(n sqrt(theta_h/(pi/2)))
 *     theta_d   of wi to h                   column floor(n theta_d/(pi/2))
 *     phi_d     of wi about h, mod pi        floor(n phi_d/pi): reciprocal by itself
 *
 * The table is constant inside its cells, as in the program that came with MERL's data. */
#ifndef IMP_KIND_BSDF_MERL_H
#define IMP_KIND_BSDF_MERL_H

#include "base/props.h"
#include "math/vec.h"
#include "math/weight_table.h"

/* Half-vectors for a direction wo, one table for each of IMP_MERL_WO angles of it: cells
 * of the table's rows in theta_h, and of the azimuth of h from wo, mirrored. */
enum { IMP_MERL_WO = 64, IMP_MERL_TURNS = 16 };
#define IMP_MERL_SHARE 0.125 /* the cosine's least */
struct imp__merl_lobes {
    double *row, *column;      /* [WO][n_half], [WO][n_half][TURNS] */
    double share[IMP_MERL_WO]; /* of directions that are drawn by the cosine instead */
};

/* rho in the three planes, for wo and wi on the front. */
void imp__merl_rho(const struct imp_merl_data *t, imp_v3 wo, imp_v3 wi, double rho[3]);

/* Rows in all, for `row`, and with TURNS columns each, for `column`. */
size_t imp__merl_lobes_rows(const struct imp_merl_data *t);
void imp__merl_lobes_fill(const struct imp_merl_data *t, struct imp__merl_lobes *l);
/* The share for wo. */
double imp__merl_share(const struct imp__merl_lobes *l, imp_v3 wo);
/* A half-vector for wo, and its density per steradian of half-vectors. */
imp_v3 imp__merl_half_draw(const struct imp_merl_data *t, const struct imp__merl_lobes *l,
                           imp_v3 wo, const double u[2]);
double imp__merl_half_pdf(const struct imp_merl_data *t, const struct imp__merl_lobes *l,
                          imp_v3 wo, imp_v3 h);

#endif
