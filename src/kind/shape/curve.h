/* SPDX-License-Identifier: Apache-2.0
 *
 * A tube about a line c(v) in space with radius r(v), 0 <= v <= 1 in each segment. With the
 * degree 1 it is the envelope of the balls about c: a cone that touches those at its ends.
 * With the degree 3 it is swept by circles across the line. */
#ifndef IMP_KIND_SHAPE_CURVE_H
#define IMP_KIND_SHAPE_CURVE_H

#include "shape.h"

struct imp__curve_at {
    imp_v3 c, d1, d2; /* and its derivatives with respect to v */
    double r, r1;
};
void imp__curve_at(const struct imp_curves *k, int segment, double v,
                   struct imp__curve_at *out);
/* Weights of a segment's degree + 1 points in the line, and in its first three derivatives. */
void imp__curve_weights(int degree, double v, double b[4][4]);

/* Along the line, unit; any direction where points coincide. */
static inline imp_v3 imp__curve_axis(const struct imp__curve_at *at)
{
    return imp__dot(at->d1, at->d1) > 0 ? imp__normalize(at->d1) : imp__v3(1, 0, 0);
}

/* Its normal, not unit, where `outward` is the unit vector from the line to the point, across c'
 * if circles are swept: across the turn, and across c' + r' e + r de/dv, e for outward. */
static inline imp_v3 imp__curve_normal(const struct imp_curves *k,
                                       const struct imp__curve_at *at, imp_v3 outward)
{
    if (k->degree == 1) return outward;
    return outward * (imp__dot(at->d1, at->d1) - at->r * imp__dot(outward, at->d2)) -
           at->d1 * at->r1;
}

/* The point where the ray from o along d meets the tube, next to Embree's t and v, in double:
 * v, the line there, and the unit vector from it to the point, which is r away. */
imp_v3 imp__curve_meet(const struct imp_curves *k, int segment, double t, double *v,
                       imp_v3 o, imp_v3 d, struct imp__curve_at *out);

/* Coordinates of a point with this uv and normal on a segment, and the surface there
 * (scene/located.h). */
struct imp_located imp__curve_locate(const struct imp_curves *k, int segment,
                                     const double uv[2], imp_v3 normal);
void imp__curve_surface(const struct imp_curves *k, int segment, const float at[2],
                        struct imp_surface *out);

#endif
