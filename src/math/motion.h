/* SPDX-License-Identifier: Apache-2.0
 *
 * Affine maps of twelve numbers, and maps that change with time. A motion goes from one
 * map to another: the translation and the stretch linearly, the rotation about one axis
 * with constant speed (polar decomposition M = R S, Shoemake and Duff, "Matrix Animation
 * and Polar Decomposition", 1992). Before its start and after its end it stands still. */
#ifndef IMP_MATH_MOTION_H
#define IMP_MATH_MOTION_H

#include "transform.h"

struct imp_map { /* the rows of an affine map: p' = m p + its last column */
    double m[12];
};

static inline imp_v3 imp__map_point(const struct imp_map *a, imp_v3 p)
{
    const double *m = a->m;
    return imp__v3(m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3],
                   m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
                   m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11]);
}
static inline imp_v3 imp__map_vector(const struct imp_map *a, imp_v3 v)
{
    const double *m = a->m;
    return imp__v3(m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
                   m[4] * v[0] + m[5] * v[1] + m[6] * v[2],
                   m[8] * v[0] + m[9] * v[1] + m[10] * v[2]);
}
/* Normals go with the transpose of the inverse. Not normalised. */
static inline imp_v3 imp__map_normal(const struct imp_map *inverse, imp_v3 n)
{
    const double *m = inverse->m;
    return imp__v3(m[0] * n[0] + m[4] * n[1] + m[8] * n[2],
                   m[1] * n[0] + m[5] * n[1] + m[9] * n[2],
                   m[2] * n[0] + m[6] * n[1] + m[10] * n[2]);
}
struct imp_map imp__map_of(const struct imp_mat4 *a);
/* False, and *out unchanged, if it is singular. */
bool imp__map_inverse(const struct imp_map *a, struct imp_map *out);
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
/* A box around all that a box passes. */
void imp__motion_box(const struct imp_motion *m, imp_v3 *lo, imp_v3 *hi);

#endif
