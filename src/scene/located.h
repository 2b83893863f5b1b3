/* SPDX-License-Identifier: Apache-2.0
 *
 * A point of a shape by its primitive and two coordinates on it, from which the surface is
 * computed again, in double, wherever the shape is by then. The coordinates are floats:
 *
 *     triangles         barycentric weights of the second and third vertex
 *     analytic shapes   uv
 *     curves            the turn about the line, and the place along the segment, 0 to 1;
 *                       on the ball at its beginning -1 - a, at its end 2 + a, with the
 *                       angle a to the line's direction */
#ifndef IMP_SCENE_LOCATED_H
#define IMP_SCENE_LOCATED_H

#include "instances.h"
#include "kind/shape/shape.h"

/* Coordinates of a hit on a curve; at: the surface there, world. */
struct imp_located imp__located_curve(const struct imp_scene *scene,
                                      const struct imp_hit *hit,
                                      const struct imp_surface *at);

/* The point of this shape that was hit. */
static inline struct imp_located imp__located_hit(const struct imp_scene *scene,
                                                  const struct imp_shape *s,
                                                  const struct imp_hit *hit,
                                                  const struct imp_surface *at)
{
    if (imp_likely(s->geometry == IMP_TRIANGLES))
        return (struct imp_located){hit->prim, {(float)hit->u, (float)hit->v}};
    if (s->geometry == IMP_ANALYTIC)
        return (struct imp_located){0, {(float)at->uv[0], (float)at->uv[1]}};
    return imp__located_curve(scene, hit, at);
}

/* The surface, world, of a shape in this instance (imp_hit.place) at this time. False: the
 * shape does not compute surfaces without a ray, the point is not known, or the scene is
 * that of a file of walks, which has no geometry. */
bool imp__located_surface(const struct imp_scene *scene, int shape,
                          const struct imp_located *x, int64_t place, double time,
                          struct imp_surface *out);

/* Does the shape have this point? Numbers of a file may be any. */
bool imp__located_fits(const struct imp_scene *scene, const struct imp_shape *shape,
                       const struct imp_located *x, int64_t place);

#endif
