/* SPDX-License-Identifier: Apache-2.0
 *
 * Velocities of what moves as a whole by  V = e + A (X - c), and their transposes (moves.h): of unit
 * normals  n' = n (n.A n) - A^T n,  of areas  d ln dA = tr A - n.A n.  Numbers: e, then A row by row. */
#ifndef IMP_MOVE_AFFINE_H
#define IMP_MOVE_AFFINE_H

#include "moves.h"

#define IMP_AFFINE_NUMBERS 12

/* r = X - c; adds to *out, or to bar's numbers. */
void imp__affine_velocity(const struct imp_scene *scene, const struct imp__glued *x,
                          imp_v3 r, const double *number, struct imp__velocity *out);
void imp__affine_bar(const struct imp_scene *scene, const struct imp__glued *x, imp_v3 r,
                     const struct imp__velocity *bar, double *number_bar);
/* The velocity of a place, and its transpose. */
imp_v3 imp__affine_place(imp_v3 r, const double *number);
void imp__affine_place_bar(imp_v3 r, imp_v3 bar, double *number_bar);
/* The turn by a rotation vector, which A - A^T is, and the transpose. */
imp_v3 imp__affine_turn(const double *number);
void imp__affine_turn_bar(imp_v3 turn_bar, double *number_bar);

/* The transpose of how ends and radius of a cylinder move it: in place, from bars of an affine mover
 * about c to those of the parameter. */
void imp__ends_bar(const struct imp__tube *tube, imp_v3 c, enum imp_pose_kind kind,
                   double bar[IMP_AFFINE_NUMBERS]);
/* The same of the three rows of to_world. */
void imp__world_bar(const struct imp_pose *pose, imp_v3 c,
                    double bar[IMP_AFFINE_NUMBERS]);

#endif
