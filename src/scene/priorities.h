/* SPDX-License-Identifier: Apache-2.0
 *
 * Closed shapes that overlap, by priority (Schmidt, Budge, "Simple nested dielectrics in
 * ray traced images", Journal of Graphics Tools 7(2), 2002). Where a point
 * lies in several shapes with a priority, the one with the highest is there, the later one of
 * the file among equals; the boundaries of the others are not there. So a liquid may reach into
 * the wall of its glass, and there is one boundary of the two.
 *
 * A nest is the list of these shapes around a point. A ray that passes a boundary enters
 * or leaves a shape of its nest; what is seen of the boundary, the medium behind it and
 * its index follow from the highest of the list before and behind it. Copies of one shape
 * (instances) count one by one, and are one body. */
#ifndef IMP_SCENE_PRIORITIES_H
#define IMP_SCENE_PRIORITIES_H

#include "scene.h"

#define IMP_PRIORITY_MAX 1000000
#define IMP_NEST_MAX     8 /* shapes around a point */

struct imp_nest {
    const struct imp_medium *around; /* by shapes without priority, and the sensor */
    int n;
    int32_t shape[IMP_NEST_MAX];
};

struct imp_priorities {
    struct imp_scene *scene;
    /* Materials that have an index, as they are beside each other: at a boundary with
     * material i inside and j outside the index is that of i over that of j. */
    int n;
    int *material;            /* [n] index in the scene */
    struct imp_bsdf *between; /* [n][n], of i and j */
    struct imp_input *index;  /* [n][n] */
};

/* scene->priorities, when all shapes are there. */
enum imp_status imp__priorities_build(struct imp_scene *scene);

/* The shape that is there; NULL: none. */
const struct imp_shape *imp__nest_top(const struct imp_scene *scene,
                                      const struct imp_nest *nest);
const struct imp_medium *imp__nest_medium(const struct imp_scene *scene,
                                          const struct imp_nest *nest);
bool imp__nest_has(const struct imp_nest *nest, int shape);
/* False: it has no room. */
bool imp__nest_enter(struct imp_nest *nest, int shape);
/* False: it was not in it. */
bool imp__nest_leave(struct imp_nest *nest, int shape);
/* Is the boundary of a shape seen by a ray in `nest`, without the shape itself? */
bool imp__nest_sees(const struct imp_scene *scene, const struct imp_nest *nest,
                    const struct imp_shape *shape);
/* Its material there. */
const struct imp_bsdf *imp__nest_bsdf(const struct imp_scene *scene,
                                      const struct imp_nest *nest,
                                      const struct imp_shape *shape);
/* The nest of a point by what a ray from it meets; `around` is not touched. False: it has
 * no room, or the ray comes to no end. */
bool imp__nest_at(const struct imp_scene *scene, double time, imp_v3 p, imp_v3 d,
                  struct imp_nest *nest);

#endif
