/* SPDX-License-Identifier: Apache-2.0
 *
 * 4x4 matrices, row-major, column vectors: p' = M p (docs/scene-format.md 1.4). The matrices of
 * shapes and sensors are affine. */
#ifndef IMP_MATH_TRANSFORM_H
#define IMP_MATH_TRANSFORM_H

#include "vec.h"

struct imp_mat4 {
    double m[16];
};

static inline struct imp_mat4 imp__mat4_identity(void)
{
    return (struct imp_mat4){{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
}
static inline struct imp_mat4 imp__mat4_multiply(const struct imp_mat4 *a,
                                                 const struct imp_mat4 *b)
{
    struct imp_mat4 c;
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            double sum = 0;
            for (int k = 0; k < 4; k++) sum += a->m[4 * i + k] * b->m[4 * k + j];
            c.m[4 * i + j] = sum;
        }
    return c;
}

/* The rows m [12] of an affine map: p' = m p + its last column. */
static inline imp_v3 imp__rows_point(const double *m, imp_v3 p)
{
    return imp__v3(m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3],
                   m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
                   m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11]);
}
static inline imp_v3 imp__rows_vector(const double *m, imp_v3 v)
{
    return imp__v3(m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
                   m[4] * v[0] + m[5] * v[1] + m[6] * v[2],
                   m[8] * v[0] + m[9] * v[1] + m[10] * v[2]);
}
/* Normals go with the transpose of the inverse: m is the inverse. Not normalised. */
static inline imp_v3 imp__rows_normal(const double *m, imp_v3 n)
{
    return imp__v3(m[0] * n[0] + m[4] * n[1] + m[8] * n[2],
                   m[1] * n[0] + m[5] * n[1] + m[9] * n[2],
                   m[2] * n[0] + m[6] * n[1] + m[10] * n[2]);
}

/* Three rows of four, of the images of the axes and the origin; and as a matrix. */
static inline void imp__rows_of_columns(imp_v3 x, imp_v3 y, imp_v3 z, imp_v3 origin,
                                        double m[12])
{
    for (int i = 0; i < 3; i++) {
        m[4 * i] = x[i];
        m[4 * i + 1] = y[i];
        m[4 * i + 2] = z[i];
        m[4 * i + 3] = origin[i];
    }
}
static inline struct imp_mat4 imp__mat4_of_rows(const double m[12])
{
    struct imp_mat4 out = imp__mat4_identity();
    for (int k = 0; k < 12; k++) out.m[k] = m[k];
    return out;
}

/* Affine maps: the last row is taken to be 0 0 0 1. */
static inline imp_v3 imp__point(const struct imp_mat4 *a, imp_v3 p)
{
    return imp__rows_point(a->m, p);
}
static inline imp_v3 imp__vector(const struct imp_mat4 *a, imp_v3 v)
{
    return imp__rows_vector(a->m, v);
}
static inline imp_v3 imp__normal(const struct imp_mat4 *inverse, imp_v3 n)
{
    return imp__rows_normal(inverse->m, n);
}

static inline bool imp__mat4_is_affine(const struct imp_mat4 *a)
{
    return a->m[12] == 0 && a->m[13] == 0 && a->m[14] == 0 && a->m[15] == 1;
}
static inline bool imp__mat4_is_finite(const struct imp_mat4 *a)
{
    for (int i = 0; i < 16; i++)
        if (!isfinite(a->m[i])) return false;
    return true;
}
/* Determinant of the upper left 3x3: negative where the map mirrors. */
double imp__mat4_det3(const struct imp_mat4 *a);
/* False, and *out unchanged, if `a` is singular or not finite. */
bool imp__mat4_inverse(const struct imp_mat4 *a, struct imp_mat4 *out);

struct imp_mat4 imp__translate(imp_v3 t);
struct imp_mat4 imp__scale(imp_v3 s);
/* Right-handed about a unit axis (Rodrigues). */
struct imp_mat4 imp__rotate(imp_v3 axis, double degrees);
/* Columns (left, newup, dir, origin): a sensor looks along +z, +y is up, +x points left.
 * A zero `up` takes the first tangent of the basis of dir. False: target at the origin,
 * up parallel to dir, or not finite. */
bool imp__lookat(imp_v3 origin, imp_v3 target, imp_v3 up, struct imp_mat4 *out);

#endif
