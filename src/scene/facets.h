/* SPDX-License-Identifier: Apache-2.0
 *
 * Triangles of a scene that has few of them: all are tested, eight facets at a time. A facet is a
 * triangle, or two that are the halves of a flat quadrilateral.
 *
 * Floats choose what a ray may meet, with a slack above their rounding, and doubles decide. So a
 * hit is as exact as that of an analytic shape, and no ray slips between two triangles that
 * share an edge. Where floats cannot separate the distances of two facets, either counts as
 * the nearer. */
#ifndef IMP_SCENE_FACETS_H
#define IMP_SCENE_FACETS_H

#include "scene.h"

#define IMP_FACETS 32 /* more are Embree's: there its tree is faster (docs/speed.md) */

struct imp_facets;

/* Facets of all triangles of the n shapes; shapes of other geometries are passed over. *out is
 * the caller's (imp__facets_destroy), and its size is added to *bytes; NULL: there are none,
 * more than IMP_FACETS, or one that is thinner than about 1 / 26,000 of the way across all.
 * False: out of memory. */
bool imp__facets_create(imp_context *ctx, struct imp_shape *const *shapes, int n,
                        struct imp_facets **out, int64_t *bytes);
void imp__facets_destroy(imp_context *ctx, struct imp_facets *f);

/* The nearest hit at a distance in (tmin, tmax), in units of d; among coincident facets
 * the first in the order of the shapes. */
bool imp__facets_nearest(const struct imp_facets *f, const imp_v3 *o, const imp_v3 *d,
                         double tmin, double tmax, struct imp_hit *hit);
bool imp__facets_occluded(const struct imp_facets *f, const imp_v3 *o, const imp_v3 *d,
                          double tmin, double tmax);

#endif
