/* SPDX-License-Identifier: Apache-2.0
 *
 * Skies and what moves (moved.h). Directions in which walks are scattered, and light samples of a
 * sky, stay fixed in the world, and with them what the sky sends along: a sky enters only where the
 * camera sees it, along a direction d that turns,
 *
 *     dL = dL/dd.d'
 *
 * and jumps across the circles of imp_emitter_ops.jumps, whose pictures are edges.
 *
 * Light samples of a sky that turns by the rotation vector O, and directions in which it is met, are
 * glued to the sky, w' = O x w. The radiance along them does not change, nor does the density of samples:
 *
 *     d ln B = d ln K/dw.(O x w),   and for the camera   dL = dL/dd.(d' - O x d);
 *
 * its circles, and lines from it past silhouettes, turn likewise.
 *
 * Where the sun of a sky moves in it (moves.h, sun, disc), what its disc sends is glued to that, and what
 * is around it to the world: of one light sample each part counts by what it sends,
 *
 *     dL/dtheta K = K dL_around + K d(L_disc along w) + L_disc dK/dw.w',   L = L_around + L_disc. */
#ifndef IMP_WALK_MOVED_SKY_H
#define IMP_WALK_MOVED_SKY_H

#include "move/suns.h"
#include "walk/core/walk.h"

/* Radiance of a sky, environment `emitter`, that arrives from the unit direction w, by lanes. */
imp_spec imp__sky_radiance_from(const struct imp_scene *scene, int emitter, imp_v3 w,
                                const struct imp_carried *carried);
/* The same of all skies. */
imp_spec imp__skies_from(const struct imp_scene *scene, imp_v3 w,
                         const struct imp_carried *carried);
/* bar, by lanes, times the derivative of what arrives of all skies from the unit direction w, by w, across
 * it. */
imp_v3 imp__skies_slope(const struct imp_scene *scene, imp_v3 w, imp_spec bar,
                        const struct imp_carried *carried);
/* The share of light from w, of which `bar` is the adjoint of the logarithm by lanes, that is glued to
 * the sky or to its sun, by lanes. Adds to theta_bar what its radiance, and the density of a disc that
 * grows, change by. */
imp_spec imp__sky_sent_bar(const struct imp__moves *moves, int emitter, imp_v3 w,
                           imp_spec bar, const struct imp_carried *carried,
                           double *theta_bar);
/* Radiance of a part of a sky. */
imp_spec imp__sky_part_from(const struct imp_emitter *e, enum imp__sky_part part,
                            imp_v3 w, const struct imp_carried *carried);
/* Does the sun of a sky move, and not all of it? */
bool imp__sky_in_parts(const struct imp__moves *moves, int emitter);
/* Skies through a fixed film position, by the adjoint of what arrives there: the direction d of the ray
 * turns by u(o + d) - u(o), and skies under it. Adds to theta_bar. */
void imp__skies_seen_bar(const struct imp__moves *moves, const struct imp_sensor_ray *ray,
                         imp_spec seen, const struct imp_carried *carried,
                         double *theta_bar);
/* Are silhouettes looked for along directions that the sky draws? One that is the same from
 * everywhere comes with scattered light. */
bool imp__sky_has_draws(const struct imp_scene *scene, int emitter);
/* Integral of a sky's radiance over all directions, by its own draws, roughly: of the lane that has
 * most. */
double imp__sky_whole(const struct imp_tracer *tracer, int emitter);
/* Does it come from less than a steradian, (int L dw)^2 / int L^2 dw, roughly? */
bool imp__sky_is_narrow(const struct imp_tracer *tracer, int emitter);

#endif
