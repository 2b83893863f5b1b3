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

static inline lanes imp__lanes_choose(mask m, lanes a, lanes b)
{
    return (lanes)((m & (mask)a) | (~m & (mask)b));
}
static inline lanes imp__lanes_magnitude(lanes a) { return (lanes)((mask)a & INT32_MAX); }
static inline unsigned imp__lanes_bits(mask m)
{
#ifdef __AVX__
    return (unsigned)__builtin_ia32_movmskps256((lanes)m);
#else
    unsigned bits = 0;
    for (int k = 0; k < LANES; k++) bits |= (m[k] & 1u) << k;
    return bits;
#endif
}

/* Triangles that share an edge overlap by this part of their sides: more than what is rounded
 * off, and far less than what a picture shows. */
#define OVERLAP 1e-10
static inline bool imp__triangle_met(const struct triangle *s, imp_v3 from, imp_v3 d,
                                     double tmin, double tmax, struct imp_hit *hit)
{
    const imp_v3 off = (s->x * from[0] + s->y * from[1]) + (s->z * from[2] + s->one);
    const imp_v3 step = (s->x * d[0] + s->y * d[1]) + s->z * d[2];
    const double t = -off[0] / step[0];
    const imp_v3 p = off + t * step;
    const double u = p[1], v = p[2];
    if (!(t > tmin && t < tmax && u >= -OVERLAP && v >= -OVERLAP && u + v <= 1 + OVERLAP))
        return false;
    hit->t = t;
    hit->u = imp_clamp(u, 0, 1);
    hit->v = imp_clamp(v, 0, 1 - hit->u);
    hit->shape = s->shape;
    hit->prim = s->prim;
    hit->place = 0;
    return true;
}

/* first: the half that is tested first. */
static inline bool imp__facet_met(const struct triangle half[2], int first, imp_v3 from,
                                  imp_v3 d, double tmin, double tmax, struct imp_hit *hit)
{
    return imp__triangle_met(&half[first], from, d, tmin, tmax, hit) ||
           imp__triangle_met(&half[1 - first], from, d, tmin, tmax, hit);
}

#endif
