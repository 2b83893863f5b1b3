/* SPDX-License-Identifier: Apache-2.0
 *
 * Groups of shapes, and the instances that place them in a scene: each has a placement of
 * its own, and the shapes are stored once. A group may contain instances of others, so a
 * hit lies at a place: one instance of the scene, one of its group, and so on. Places are
 * numbered from 1, depth first:
 *
 *     number of place (i, rest) of a group = before_i + 1 + number of `rest` in group i
 *
 * with 0 for "no instance", and before_i the places in the instances before i. */
#ifndef IMP_SCENE_INSTANCES_H
#define IMP_SCENE_INSTANCES_H

#include "math/motion.h"
#include "scene.h"

struct imp_instance {
    struct imp_map to_world,
        to_local; /* its placement; of one that moves, at its start */
    const struct imp_group *group;
    const struct imp_motion *motion;   /* NULL: it is at rest */
    const struct imp_covered *covered; /* what its own material makes of the group's
                                          shapes; NULL: they have theirs */
    const int *raised; /* [1 + group->n_places] of an instance of the scene: first of the
                          copies of a group's shapes that stand for them at the rest of a
                          place (build_bumps.c); -1: they stand there themselves. NULL:
                          all do */
    int64_t before;    /* places in the instances before it */
    const char *name;  /* of one of the scene's own that has an id; else NULL */
};

/* The shapes of a group with another material: copies of them, of which the first has
 * index `first`, in the order of group->within. */
struct imp_covered {
    const struct imp_group *group;
    int bsdf, first;
};

struct imp_group {
    const char *name;
    int first, n_shapes; /* its own shapes, in the scene's list */
    int n_instances;
    struct imp_instance *instance; /* [n_instances] */
    int64_t n_places;              /* in all of them */
    int n_within;
    int *within;    /* [n_within] all shapes that a ray can meet in it, ascending; of a
                      group only */
    imp_v3 lo, hi;  /* bounds of all of it */
    bool bumped;    /* a material in it has a bump map */
    bool stretched; /* an instance in it stretches or mirrors */
    void *intersector;
};

/* ---- build_instances.c ---- */
/* Is it what `shape` objects of these types are? */
bool imp__is_group(const struct imp_node *node);
bool imp__is_instance(const struct imp_node *node);
/* All groups and instances of the scene, when its other shapes are there. */
enum imp_status imp__instances_build(struct imp_scene *scene);

/* ---- build_bumps.c ---- */
/* Does it stretch or mirror its group, at any time? */
bool imp__instance_stretches(const struct imp_instance *p);
/* Copies of shapes for the bump maps in an instance of the scene. */
enum imp_status imp__bumps_place(struct imp_scene *scene, const struct imp_node *node,
                                 struct imp_instance *p);

/* ---- instances.c ---- */
/* The copy that replaces this shape of the group. */
int imp__covered_shape(const struct imp_covered *c, int shape);
/* From the world of an instance to its group, at a time; `room`: for what moves. */
static inline const struct imp_map *
imp__instance_local(const struct imp_instance *p, double time, struct imp_map room[2])
{
    if (imp_likely(p->motion == NULL)) return &p->to_local;
    imp__motion_at(p->motion, time, &room[0], &room[1]);
    return &room[1];
}
/* The box of an instance at all times, in the world around it. */
void imp__instance_box(const struct imp_instance *p, imp_v3 *lo, imp_v3 *hi);
/* The group that a place (> 0) is in; NULL: within a group an instance around it moves in time. */
const struct imp_group *imp__place_group(const struct imp_scene *scene, int64_t place);
/* Shapes of the scene that are in no group: the first so many. */
static inline int imp__shapes_outside(const struct imp_scene *scene)
{
    return scene->world ? scene->world->n_shapes : scene->n_shapes;
}
/* Index of the scene's own instance that a place (> 0) is in. */
int imp__place_instance(const struct imp_scene *scene, int64_t place);
/* The same where that moves in time; -1: it rests, or the place is 0. */
int imp__place_clock(const struct imp_scene *scene, int64_t place);
/* From the group that a place (> 0) is in to the world at a time, and back. */
void imp__place_map(const struct imp_scene *scene, int64_t place, double time,
                    struct imp_map *to_world, struct imp_map *to_local);
/* The surface at a hit in an instance. */
void imp__placed_surface(const struct imp_scene *scene, const struct imp_hit *hit,
                         const imp_v3 *o, const imp_v3 *d, struct imp_surface *out);
/* Index of the shape that was hit at this place, with the material and heights that it has
 * there. */
int imp__placed_shape(const struct imp_scene *scene, int shape, int64_t place);
/* The surface at a hit of the ray (o, d). */
static inline void imp__hit_surface(const struct imp_scene *scene,
                                    const struct imp_hit *hit, const imp_v3 *o,
                                    const imp_v3 *d, struct imp_surface *out)
{
    const struct imp_shape *s = scene->shapes[hit->shape];
    if (imp_likely(hit->place == 0)) s->ops->surface(s, hit, o, d, out);
    else imp__placed_surface(scene, hit, o, d, out);
}

#endif
