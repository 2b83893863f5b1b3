/* SPDX-License-Identifier: Apache-2.0
 *
 * The surface of a bsplinecurve as what moves has it: circles of the radius r(v) about a line c(v) in
 * space, across it. With a = c'/|c'|, the turn t about the line and the unit vector e from it,
 *
 *     X = c + r e,   N = e A - a B,   A = |c'|^2 - r e.c'',  B = |c'| r',
 *     X_v = (a A + e B)/|c'|,   X_t = r a x e,   |X_v x X_t| = r |N|/|c'|
 *
 * where e keeps its turn along the line: e_v = -a (e.c'')/|c'|. N is outward where A > 0: elsewhere the
 * line bends more sharply than the radius allows. A point is glued to a place v and a vector e that turns
 * as little as possible when points of control move:  e' = -a (e.a').  It is open at both ends, and is met
 * from outside alone. */
#ifndef IMP_MOVE_STRAND_H
#define IMP_MOVE_STRAND_H

#include "moves.h"

/* The line of a segment at v, world, with derivatives with respect to v. */
struct imp__strand {
    imp_v3 c, d1, d2, d3;
    double r, r1, r2, v;
};
/* What is no bsplinecurve, or stretched by its instance, has none. */
bool imp__is_strand(const struct imp_scene *scene, int shape, int64_t place);
void imp__strand_at(const struct imp_scene *scene, int shape, int64_t place, int segment,
                    double v, struct imp__strand *out);
/* The line at the beginning of a segment, or at its end: next to it where points coincide there. */
void imp__strand_end(const struct imp_scene *scene, int shape, int64_t place, int segment,
                     bool end, struct imp__strand *out);
/* v of the point of the segment's line next to p. */
double imp__strand_foot(const struct imp_scene *scene, int shape, int64_t place,
                        int segment, imp_v3 p);

/* Along the line and across it, unit. */
struct imp__strand_axes {
    imp_v3 a, s, t;
    double length; /* of c' */
};
struct imp__strand_axes imp__strand_axes(const struct imp__strand *x);

/* A point of the surface. */
struct imp__strand_point {
    imp_v3 p, n, along, around; /* along: X_v; around: a x e, unit */
    imp_v3 n_v, n_t;            /* of the unit normal */
    double area;                /* |X_v x X_t| */
};
/* False: there is no normal. */
bool imp__strand_point(const struct imp__strand *x, const struct imp__strand_axes *axes,
                       imp_v3 e, struct imp__strand_point *out);
/* How fast the unit normal turns along the unit tangent w, towards it: above 0 where a line along w
 * that touches the surface is outside of it. */
double imp__strand_bends(const struct imp__strand_point *x, const struct imp__strand *at,
                         imp_v3 w);

/* Turns t, from s to t of the axes, at which lines from there, or along it where `parallel`, touch the
 * surface, or are about to leave it. Returns how many. */
#define IMP_STRAND_OUTLINES 4
int imp__strand_outline(const struct imp__strand *x, const struct imp__strand_axes *axes,
                        imp_v3 from, bool parallel, double turn[IMP_STRAND_OUTLINES]);

/* Ends of the shape: bit 0, the segment begins a curve; bit 1, it ends one. */
int imp__strand_ends(const struct imp_curves *k, int segment);
/* A place of the line bends more sharply than its radius allows, or stands still; -1: none does. */
int imp__strand_folds(const struct imp_scene *scene, int shape, int64_t place);

/* Velocities by the points of control: four numbers each. */
void imp__strand_velocity(const struct imp__moves *moves, const struct imp__glued *x,
                          const double *theta, struct imp__velocity *out);
void imp__strand_bar(const struct imp__moves *moves, const struct imp__glued *x,
                     const struct imp__velocity *bar, double *theta_bar);

#endif
