/* SPDX-License-Identifier: Apache-2.0
 *
 * Where a shape or a camera is, as six numbers: the parameter `NAME.pose`. A point X of it that the
 * scene file has at X0 is at
 *
 *     X = c + e + R(a) (X0 - c),    R(a): the rotation about a by |a| radians
 *
 * with e the first three numbers, in scene units, a the last three, and c the centre: of a shape
 * the middle of its box, of a camera its own place. 0 0 0 0 0 0 is the scene file's pose. A pose
 * is a parameter when it is asked for, behind all others: imp_scene_add_pose. */
#ifndef IMP_SCENE_POSE_H
#define IMP_SCENE_POSE_H

#include "scene.h"

struct imp_pose {
    struct imp_pose *next; /* added later */
    struct imp_scene *scene;
    int shape;                 /* index; -1: a sensor */
    struct imp_sensor *sensor; /* NULL: a shape */
    int param;
    double number[6];
    imp_v3 centre;
    bool due; /* its numbers have changed since the object was moved */
    /* As the file has it: the kind's object, and positions and normals of a mesh. */
    void *rest;
    size_t rest_size;
    float *positions, *normals; /* NULL: in the object, or none */
};

/* The pose that is this parameter; NULL: it is none. */
static inline const struct imp_pose *imp__pose_of(const struct imp_scene *scene,
                                                  size_t param)
{
    const struct imp_pose *p = scene->poses;
    while (p && p->param != (int)param) p = p->next;
    return p;
}

/* Where the rays of a camera meet. False: in no point, as those of a lens with an aperture or of
 * parallel light. */
bool imp__pinhole(const struct imp_sensor *sensor, imp_v3 *centre);

/* The rotation of a vector of rotation, row by row. */
void imp__rotation_of(const double a[3], double R[9]);
/* Adds to a_bar what an adjoint of the turning at the pose, a rotation about the moved centre, is to
 * the numbers a: the transpose of the left Jacobian of the rotations. */
void imp__rotation_bar(const double a[3], imp_v3 turn_bar, double a_bar[3]);

/* Moves what is due, and makes the tree of shapes again. Whoever has set parameters calls it behind
 * imp__theta_announce. IMP_E_NOMEM, or what Embree says: the scene is not to be used before it
 * has succeeded. */
enum imp_status imp__poses_settle(struct imp_scene *scene);

#endif
