/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of a picture by what moves (move/moves.h). A film position and the directions in
 * which a walk is scattered stay fixed; the point of a light sample, and emission that is met, are
 * glued to the light. With these held, the derivative of a pixel is
 *
 *     interior   that of each walk's radiance: its vertices slide along fixed rays and over
 *                light samples that move (moved_sweep.c)
 *     boundary   integrals over edges, where what is seen past them jumps
 *
 * With v_k' the velocity of vertex k, V that of the surface there, n its normal, w the direction
 * from vertex k on, u what the camera makes of a fixed film position:
 *
 *     v_0'     = u + d n.(V - u)/(n.d)
 *     v_{k+1}' = v_k' + w n.(V - v_k')/(n.w)
 *     d ln w_k = n'.w/(n.w)
 *     d ln B_k = (n'.w + n.w')/(n.w) + (n_y'.w + n_y.w')/(n_y.w) - 2 w.(V_y - v_k')/d + d ln dA_y
 *
 * A point of a medium of extinction sigma, at the part s of its stretch of the ray from v_k to the
 * surface beyond it, of the length D, from v_k or from a border of the medium on; and light on a line of
 * length d through media of the optical depth tau:
 *
 *     v_{k+1}' = v_k' + s w D',  D' = n.(V - v_k')/(n.w)
 *     d ln w_k = (1 - sigma s D) D'/D,  of what reaches the surface  -sigma D'
 *     d ln B_k = ... - tau d'/d
 *
 * Where sigma varies it is that at the end of the ray, and media at rest are met elsewhere: a line from x to
 * y, of which the point at the part r moves by v(r) = (1 - r) x' + r y', and the point of the medium have
 *
 *     d ln T = -int grad sigma . v dt, of a ray that is shifted with v_k' alone,
 *     d ln w_k = ... + grad ln(sigma p) . v_{k+1}',  p albedo times phase function
 *
 * beside those (media/media_along.h). Where a border ends the stretch, D' = 0: that the border moves is a part of the boundary (boundary.h).
 *
 * of Lambertian materials (of others moved_kernel.h), w' the part of (V_y - v_k')/d across w; of a light at a point without
 * cos_y and dA_y, of parallel light (n'.w + n.w')/(n.w) alone. Of emission that is met the
 * same holds as of a light sample: MIS weights are constants, so both techniques move one point in
 * one way. (Li et al. 2018; Zhang et al. 2020.) */
#ifndef IMP_WALK_MOVED_H
#define IMP_WALK_MOVED_H

#include "move/edges.h"
#include "walk/core/walk.h"

/* May walks of this tracer be differentiated by what moves? IMP_E_UNSUPPORTED with the name of
 * what has no such derivative: a material, light, shape, medium, sensor or integrator. */
enum imp_status imp__moved_allowed(const struct imp_tracer *tracer);

/* Do its walks go through a medium that fills the scene? Its extinction, by lanes. */
bool imp__fog(const struct imp_tracer *tracer, const struct imp_carried *carried,
              imp_spec *extinction);

bool imp__medium_scatters(const struct imp_medium *m);

/* Light that a point of a medium has from a lamp nearby would have a derivative as large as one over
 * the distance d if it were glued to the lamp. So only the part  g = d^2/(d^2 + a^2)  of it is, with a
 * quarter of the lamp's width; the rest keeps its direction, and the lamp has edges to it. *slope:
 * g'. */
static inline double imp__glued_part(const struct imp_emitter *e, double d, double *slope)
{
    const double a2 = e->shape->area / 16, all = d * d + a2;
    *slope = 2 * d * a2 / (all * all);
    return d * d / all;
}

/* Does a surface, light or camera of the recorded walk move? If none does, its derivative is 0. */
bool imp__moved_touches(const struct imp_tracer *tracer, const struct imp__moves *moves,
                        const struct imp_walk *walk);

/* Interior, reverse mode: adds adjoint times the derivative of the recorded walk's values to
 * theta_bar [moves->n]. False: no memory. */
bool imp__moved_sweep(const struct imp_tracer *tracer, struct imp_arena *arena,
                      const struct imp__moves *moves, const struct imp_walk *walk,
                      imp_spec adjoint, double *theta_bar);

#endif
