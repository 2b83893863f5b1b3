/* SPDX-License-Identifier: Apache-2.0
 *
 * Light from a table of intensities; for solvers that keep it analytic. */
#ifndef IMP_KIND_EMITTER_IES_H
#define IMP_KIND_EMITTER_IES_H

#include "base/props.h"
#include "math/vec.h"

struct imp_build;
struct imp_shape;
struct imp_surface;

struct imp__ies_facet {
    imp_v3 n;
    double area;
};
struct imp__ies {
    imp_v3 nadir, c0,
        c90; /* orthonormal, world: w = nadir cos v + sin v (c0 cos h + ...) */
    const struct imp_ies_data *data;
    const char *file; /* that the scene names; NULL: the table came without one */
    double
        factor; /* emitted intensity over the table's: 1 or 1/683, times flux, dimming and
                        maintenance */
    double lumens;                     /* lm in a unit of flux: 1 or 683 */
    double dimming, maintenance, kept; /* kept: by tilted lamps */
    imp_v3 position;                   /* of a point */
    /* Projected area of a surface light in direction w, in parts. */
    double same;   /* sphere: the same for all w; else 0 */
    double across; /* cylinder: seen from its side; else 0 */
    imp_v3 axis;
    int n_facets;
    const struct imp__ies_facet *facets;
};

/* x[k] <= v, k at most n - 2, and the fraction of the way to x[k + 1]. */
int imp__ies_place(const double *x, int n, double v, double *fraction);
/* Intensity along w (world, unit, away from the light), at scale 1. */
double imp__ies_intensity(const struct imp__ies *x, imp_v3 w);
/* Where its table jumps as a function of direction, for a message; NULL: nowhere. */
const char *imp__ies_jump(const struct imp_ies_data *d);
/* The frame of `from`, turned as little as possible until its nadir is along `to`. */
void imp__ies_turn(struct imp__ies *x, const struct imp__ies *from, imp_v3 to);
/* A luminaire that is a shape, moved with it by a rigid map from where `from` is; the facets of x are its
 * own. */
void imp__ies_move(struct imp__ies *x, const struct imp__ies *from, const double map[12]);
/* Int I dw, at scale 1, in lm (or W). */
double imp__ies_flux(const struct imp__ies *x);
/* The shape that glows, and the first place on a flat one; refused: ovals, and many directions. */
enum imp_status imp__ies_surface_read(const struct imp_build *b,
                                      const struct imp_shape *s, struct imp__ies *x,
                                      struct imp_surface *at);
/* Area that faces w, projected along w. */
double imp__ies_projected(const struct imp__ies *x, imp_v3 w);
/* Luminous area that is seen along w by the file's opening, a box whose lower face shines with its
 * sides; 0: the file has none. */
double imp__ies_opening(const struct imp__ies *x, imp_v3 w);
/* Radiance of the surface along w: intensity over projected area. */
double imp__ies_radiance(const struct imp__ies *x, imp_v3 w);
/* For the error of links: the largest intensity within `angle` of d over the largest
 * projected area there. Where the source is narrow this bounds the radiance, and
 * elsewhere what radiance times cosine come to. */
double imp__ies_bound(const struct imp__ies *x, imp_v3 d, double angle);
/* Mean radiance over the hemisphere about n. */
double imp__ies_mean(const struct imp__ies *x, imp_v3 n);

extern const struct imp_emitter_ops imp__ies_light, imp__ies_area;

#endif
