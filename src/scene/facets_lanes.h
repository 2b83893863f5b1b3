/* SPDX-License-Identifier: Apache-2.0
 *
 * Facets as facets.c intersects them and facets_build.c makes them. */
#ifndef IMP_SCENE_FACETS_LANES_H
#define IMP_SCENE_FACETS_LANES_H

#include "facets.h"

/* Planes of a triangle with corners A, B, C about the centre of all, as numbers of (x, y, z, 1):
 *
 *     n = (e x f, -A.(e x f))          e = B - A,  f = C - A
 *     u = (f x n, ..) / n.n            1 at B, 0 at A and C
 *     v = (n x e, ..) / n.n            1 at C, 0 at A and B */
struct planes {
    imp_v3 n, u, v;
};
/* The same by columns: of (n, u, v) what x, y, z and 1 are multiplied by. */
struct triangle {
    imp_v3 x, y, z, one;
    int shape, prim;
};

enum { LANES = 8 };
typedef float lanes __attribute__((vector_size(4 * LANES)));
typedef int32_t mask __attribute__((vector_size(4 * LANES)));

/* The triangle of a facet's corner A and its neighbours B and C, about the centre of all
 * facets: the plane with a unit normal, and u and v, which go from -1 to 1 in the facet: from A
 * to B or C, or to the fourth corner, if it lies farther off. */
struct group {
    lanes n[4], u[4], v[4];
    lanes sum;   /* of u and v, at most: 0 in a triangle, 2 in a quadrilateral */
    lanes slack; /* of u and v where the ray meets the facet at a right angle */
};

struct imp_facets {
    int n_groups;
    imp_v3 centre, half; /* of the box of all */
    imp_v3 near;         /* of rays' origins to the box, at most */
    float reach;         /* of all corners from there */
    float slack;         /* of distances */
    float blur;          /* the largest slack of a facet's u and v */
    struct group *group; /* [n_groups] */
    /* [LANES n_groups] by group and lane; the second may be nothing but zeros, which no ray
     * meets */
    struct triangle (*facet)[2];
};

/* Rays start at most so many reaches before the box (facets.c); slacks are made for that. */
#define NEAR 2

static inline lanes imp__splat(float x) { return (lanes){x, x, x, x, x, x, x, x}; }

#endif
