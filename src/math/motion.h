/* SPDX-License-Identifier: Apache-2.0
 *
 * Affine maps of twelve numbers, and maps that change with time. A motion goes from one
 * map to another: the translation and the stretch linearly, the rotation about one axis
 * with constant speed (polar decomposition M = R S, Shoemake and Duff, "Matrix Animation
 * and Polar Decomposition", 1992). Before its start and after its end it is at rest. */
#ifndef IMP_MATH_MOTION_H
#define IMP_MATH_MOTION_H

#include "transform.h"

struct imp_map { /* the rows of an affine map: p' = m p + its last column */
    double m[12];
};

static inline imp_v3 imp__map_point(const struct imp_map *a, imp_v3 p)
{
    return imp__rows_point(a->m, p);
}
static inline imp_v3 imp__map_vector(const struct imp_map *a, imp_v3 v)
{
    return imp__rows_vector(a->m, v);
}
static inline imp_v3 imp__map_normal(const struct imp_map *inverse, imp_v3 n)
{
    return imp__rows_normal(inverse->m, n);
}
struct imp_map imp__map_of(const struct imp_mat4 *a);
/* False, and *out unchanged, if it is singular. */
bool imp__map_inverse(const struct imp_map *a, struct imp_map *out);
/* a after b. */
struct imp_map imp__map_product(const struct imp_map *a, const struct imp_map *b);
/* The box around the image of a box. */
void imp__map_box(const struct imp_map *a, imp_v3 *lo, imp_v3 *hi);

struct imp_motion {
    double start, end; /* times */
    imp_v3 shift[2];   /* at both of them */
    double turn[2][4]; /* unit quaternions, x y z w */
    double stretch[2][9];
    double angle; /* between them, in [0, pi] */
};

/* False: one of the maps is singular, or one mirrors and the other does not. */
bool imp__motion_make(const struct imp_map *from, const struct imp_map *to, double start,
                      double end, struct imp_motion *out);
/* The map at a time, and its inverse. */
void imp__motion_at(const struct imp_motion *m, double time, struct imp_map *map,
                    struct imp_map *inverse);
/* Does it turn and shift alone: is the stretch the same at both times? */
bool imp__motion_is_rigid(const struct imp_motion *m);
/* One of its maps, turned by a vector of rotation about the origin; then its translation is `shift`. */
void imp__motion_turn(struct imp_motion *m, int side, const double by[3], imp_v3 shift);
/* The vector of rotation, in the world, from its first map to its second. */
imp_v3 imp__motion_rotation(const struct imp_motion *m);
/* Which part of its way it has gone. */
static inline double imp__motion_part(const struct imp_motion *m, double time)
{
    const double span = m->end - m->start;
    return span > 0 ? imp_clamp((time - m->start) / span, 0.0, 1.0) : 0;
}
/* A box around all that a box passes. */
void imp__motion_box(const struct imp_motion *m, imp_v3 *lo, imp_v3 *hi);

#endif
