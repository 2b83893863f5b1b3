/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks where something has moved since (check_poses.c): places by the numbers of a pose
 * themselves, in double, and what the walk's values are there. */
#ifndef IMP_CHECK_MOVED_H
#define IMP_CHECK_MOVED_H

#include "check.h"
#include "scene/pose.h"
#include "walk/core/vertex.h"
#include "walk/moved/moved_chain.h"

/* One pose, scale, place or direction of a light, moved by h along one of its numbers. */
struct imp__moved_by {
    const struct imp__check *c;
    const struct imp_pose *pose;
    int shape;                /* or IMP_MOVE_CAMERA, or that of a light */
    double turn[9];           /* R(a') R(a)^T */
    double by;                /* scale after over before */
    struct imp_motion motion; /* of an instance that moves in time, then */
    imp_v3 from, to; /* the centre, or a light's place or direction, before and after */
    struct imp__borders borders; /* of media */
    bool fades;                  /* there are media */
    imp_spec extinction;         /* of one that fills the scene, by lanes; else 0 */
};

/* Moves it by h along a number. */
void imp__move_by(struct imp__moved_by *m, size_t number, double h);
/* Sets what an instance that moves in time is turned and shifted by at a time. Another thing: nothing. */
void imp__moved_time(struct imp__moved_by *m, double time);
static inline bool imp__moves_rigidly(const struct imp__moved_by *m)
{
    return imp__pose_is_rigid(m->pose->kind);
}
imp_v3 imp__moved_turn(const struct imp__moved_by *m, imp_v3 d);

/* A point of a shape, its normal and a direction in it, and the curvature there, where the pose has
 * moved; the normal of its shading frame. */
struct imp__moved_at {
    imp_v3 p, n, s;
    double curvature;
    imp_v3 straight, shade;
    bool strand; /* as imp__glued has it, with turn and slope */
    imp_v3 turn[2], slope[2];
};
struct imp__moved_at imp__moved_rest(const struct imp__glued *x);
struct imp__moved_at imp__moved_placed(const struct imp__moved_by *m,
                                       const struct imp__glued *x);
/* The shading normal at x, in the plane of a triangle with vertex normals. */
imp_v3 imp__moved_shade(const struct imp__moved_by *m, const struct imp__glued *then,
                        imp_v3 x);
/* The point of a vertex, with its frame's s where its material is not Lambertian. */
struct imp__glued imp__moved_glued(const struct imp_scene *scene,
                                   const struct imp_vertex *v, double time);
/* Where a ray from o along w meets the plane of a place, or the sphere that it lies on; the normal
 * there. */
imp_v3 imp__moved_met(imp_v3 o, imp_v3 w, struct imp__moved_at *x);
/* cos_y/d^2 from a point to another one. */
double imp__moved_receives(imp_v3 x, imp_v3 y, imp_v3 n_y);
/* The kernel of a vertex, now at x, over that at its recorded place, by lanes: between o and w, unit,
 * now and then. */
imp_spec imp__moved_kernel(const struct imp__moved_by *m, const struct imp_vertex *v,
                           const struct imp__moved_at *now, imp_v3 x, const imp_v3 o[2],
                           const imp_v3 w[2], const struct imp__glued *then, int lobe);
/* Directions to the light sample of a vertex at x, now and at its recorded place, and by how much it
 * is farther away; returns how what it receives, without its kernel, has changed. */
double imp__moved_light(const struct imp__moved_by *m, const struct imp_vertex *v,
                        const struct imp__glued *old, imp_v3 x, imp_v3 w[2],
                        double *farther);

/* ---- check_moved_walk.c ---- */
/* The walk's value, weighted by channels, where the pose has moved. What the camera sees through
 * nothing does not change, and is left out. */
double imp__frozen_walk(struct imp__moved_by *m, const struct imp_walk *walk, imp_spec P);

#endif
