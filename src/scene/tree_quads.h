/* SPDX-License-Identifier: Apache-2.0
 *
 * Pairs of triangles that lie one after the other in a mesh and share an edge. Embree takes a pair as
 * one quadrilateral (v0, v1, v2, v3), and meets its halves, (v0, v1, v3) and (v2, v3, v1), as
 * triangles: its tree has half of the leaves. */
#ifndef IMP_SCENE_TREE_QUADS_H
#define IMP_SCENE_TREE_QUADS_H

#include "scene.h"

struct imp_tree_quad {
    uint32_t corner[4]; /* Embree's indices, with a stride */
    uint32_t first;     /* the triangle of the first half; the other is the next one */
    uint32_t turned; /* j + 4 k: v0 is corner j of the first, v2 corner k of the second;
                           k = 3: there is no second */
};
struct imp_tree_quads {
    size_t n;
    const float *positions; /* the mesh's */
    struct imp_tree_quad *quad;
};
/* Those of a mesh most of whose triangles are in pairs; *out is NULL of others. Those that are alone have
 * a second half without area, and a triangle without area is alone. False: out of memory. */
bool imp__tree_quads_create(imp_context *ctx, const struct imp_triangles *mesh,
                            struct imp_tree_quads **out, int64_t *bytes);
void imp__tree_quads_destroy(imp_context *ctx, struct imp_tree_quads *quads);

/* The hit of quadrilateral `prim` by a ray, in double: the rounding of Embree's numbers is not the same
 * for one ray and for eight. u, v: where it says it is, barycentric of v1 and v3 in the first half; in
 * the second, of v3 and v1, from 1. Beside the quadrilateral, by that rounding, the nearest point of an
 * edge counts; hit->t is Embree's before, and stays where the plane is met before tmin. */
void imp__tree_quads_hit(const struct imp_tree_quads *q, unsigned prim, double u,
                         double v, imp_v3 o, imp_v3 d, double tmin, struct imp_hit *hit);

#endif
