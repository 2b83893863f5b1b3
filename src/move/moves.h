/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers that move things, and velocities: how a point of a shape, its normal and its area
 * change by each of them. A mover is a shape or the camera with the numbers of one kind:
 *
 *     pose      e, a: every point X has the velocity  V = e + a x (X - c), c the centre (6)
 *     key       of one of the two places between which an instance moves in time (6): at a time the instance
 *               is turned and shifted by a blend of both (keys.c)
 *     scale     V = s (X - c) at the scale 1 of the shape as it is, or over that scale (1)
 *     affine    V = e + A (X - c), A row by row (12): of what is stretched or turned as a whole
 *     vertices  V = b_0 e_0 + b_1 e_1 + b_2 e_2, of a triangle with weights b (3 each)
 *     control   of a bsplinecurve: x, y, z and radius of each point (4 each; strand.h)
 *     normals   V = 0, of a triangle with weights b of the vertex normals n_i:  N' = b_0 n_0' + b_1 n_1'
 *               + b_2 n_2' (3 each)
 *     view      of a camera: the velocity of what a fixed film position sees by its field of view,
 *               its principal point, a coefficient or the aperture of its lens
 *               (imp_sensor_ops.view_velocity, lens_velocity) (1 each)
 *     light     a point light's position V = e, or the direction d of parallel light, of any
 *               length |d|: the unit direction turns by  e/|d| across d (3)
 *     axis      of a spot, projector or ies light, by a direction of any length, likewise (3); the frame turns
 *               as little as possible from where the file has its axis, z:
 *                   a x a' - a (z x a).a'/(1 + z.a)
 *     turn      of a sky, a rotation vector: its light from w, a unit vector, comes from where w goes,
 *               V = a x w (3). The direction of a sun, an axis, turns it likewise. Of a distant sensor
 *               V = a x (X - c), c the middle of the scene
 *
 *     sun       of a sky, towards its sun, of any length: its disc, and what that sends, turns as by an
 *               axis; what is around it stays, and changes with the sun's place (3)
 *     disc      of a sun or such a sky, by the angular radius r: what its disc sends from the angle g to
 *               its middle comes from where g' = tan(g/2)/tan(r/2), so that the solid angle keeps its
 *               parts of the disc's (1)
 *     spread    of a projector, by its field of view: its picture grows about the axis a, a unit vector;
 *               a part of it at r from the light has the velocity  (r - a a.r)  times d ln tan (1)
 *
 * e: a translation in scene units; a: a rotation vector in radians. Velocities are linear in the
 * numbers; each function that applies the map has its transpose beside it. The geometric normal is
 * the same all over a triangle or disk; on a sphere it turns with the place.
 *
 * A mesh with vertex normals n_i has the shading normal  N/|N|, N = sum_i b_i n_i.  It turns with a
 * pose, stays under a scale, and follows vertices, whose normals are then the sums of those of
 * their faces, weighted by angles (kind/shape/mesh_normals.c). A mover of such vertices has 3 more
 * numbers for each: velocities of n_i, which shade.c takes back to positions. */
#ifndef IMP_MOVE_MOVES_H
#define IMP_MOVE_MOVES_H

#include "scene/instances.h"
#include "scene/located.h"
#include "scene/media_around.h"
#include "scene/pose.h"
#include <limits.h>

enum imp__move_kind {
    IMP_MOVE_POSE,
    IMP_MOVE_KEY,
    IMP_MOVE_SCALE,
    IMP_MOVE_VERTICES,
    IMP_MOVE_NORMALS,
    IMP_MOVE_CONTROL,
    IMP_MOVE_AFFINE,
    IMP_MOVE_LIGHT,
    IMP_MOVE_AXIS,
    IMP_MOVE_TURN,
    IMP_MOVE_SUN,
    IMP_MOVE_DISC,
    IMP_MOVE_SPREAD,
    IMP_MOVE_VIEW /* + k: number k of a camera's view */
};
struct imp__fans; /* triangles around each vertex: shade.c */
struct imp__suns; /* a sky with its sun beside its place: suns.h */
/* In place of a shape: the camera, emitter k and instance k of the scene. */
#define IMP_MOVE_CAMERA      (-1)
#define IMP_MOVE_EMITTER(k)  (-2 - (k))
#define IMP_MOVE_INSTANCE(k) (INT_MIN + (k))
static inline bool imp__is_moved_instance(int shape) { return shape < INT_MIN / 2; }

struct imp__mover {
    enum imp__move_kind kind;
    int shape; /* index in the scene, or one of IMP_MOVE_* */
    imp_v3 centre;
    imp_v3
        axis; /* of a spot or ies light; of parallel light its direction; towards a sun; unit */
    imp_v3 twist;           /* of such an axis: a' turns its frame about it by twist.a' */
    int key;                /* of IMP_MOVE_KEY: 0 is its first place, 1 its last */
    double rate;            /* the velocities' factor */
    size_t first, count;    /* its numbers */
    struct imp__fans *fans; /* of vertices with normals; else NULL */
    struct imp__suns *suns; /* of IMP_MOVE_SUN, and of IMP_MOVE_DISC that changes what
                                it sends; else NULL */
};

struct imp__moves {
    const struct imp_scene *scene;
    const struct imp_sensor *sensor;
    int n_movers;
    size_t cap_movers;
    struct imp__mover *mover;
    size_t n;                    /* numbers in all */
    bool skies;                  /* a sky, or its sun, is among them */
    struct imp__borders borders; /* of media, as far as walks go through any */
    /* Vertices of a mesh at one place move together, as the caller sees to: what is wanted of their
     * numbers is the sum. */
    bool seams_join;
};

/* A point that is glued to its triangle, or to a sphere, disk, cylinder or curve, world. */
struct imp__glued {
    int shape, prim;
    int64_t place; /* the instance that the shape is in (imp_hit.place); 0: none */
    int carrier;   /* by whose movers it moves, as imp__mover.shape */
    double time;   /* at which it is there */
    double b[3];   /* weights of the vertices, as the shape's indices have them; of a
                      curve its place in the segment */
    imp_v3 p, n;   /* place, and the unit geometric normal of either side */
    imp_v3 s; /* a unit direction in the surface that is glued to it; 0: none is wanted */
    double
        curvature; /* of the surface: the normal at a place shifted by x across n turns by
                         curvature x */
    imp_v3 straight; /* unit: along which it does not, of a cylinder; else 0 */
    /* Meshes with vertex normals: N/|N| and |N|; shifted by x in the surface it turns by
     * sum_k turn[k] (slope[k].x). So does the normal of a curve (strand). */
    bool smooth, strand;
    double length;
    imp_v3 shade, turn[2], slope[2];
};

/* The normal of the shading frame. */
static inline imp_v3 imp__shading_normal(const struct imp__glued *x)
{
    return x->smooth ? x->shade : x->n;
}

struct imp__velocity {
    imp_v3 v, n;  /* of the point, and of its normal */
    double area;  /* of the logarithm of an area around it */
    double turn;  /* of its direction s about n */
    imp_v3 shade; /* of the shading normal, where the surface is smooth; else that is n */
};

/* Three numbers as a vector, and the transpose. */
static inline imp_v3 imp__move_vector(const double *theta)
{
    return imp__v3(theta[0], theta[1], theta[2]);
}
static inline void imp__move_vector_bar(double *bar, imp_v3 v)
{
    for (int i = 0; i < 3; i++) bar[i] += v[i];
}

/* Without movers and borders. imp__moves_free releases them. */
struct imp__moves imp__moves_begin(const struct imp_scene *scene,
                                   const struct imp_sensor *sensor);
void imp__moves_free(struct imp__moves *moves);
/* Adds a mover behind the last; its numbers are theta[first .. first + count). IMP_E_UNSUPPORTED:
 * a shape that is neither made of triangles nor a sphere, disk, cylinder or bsplinecurve, or a camera whose rays
 * meet in no point. */
enum imp_status imp__moves_add(struct imp__moves *moves, enum imp__move_kind kind,
                               int shape);
/* The mover of a parameter, at its value now; of a group one for each of its instances. */
enum imp_status imp__moves_add_pose(struct imp__moves *moves,
                                    const struct imp_pose *pose);
/* From the adjoint of a mover's numbers to that of its parameter's, in place: a mover turns the
 * object as it is, the parameter is one vector of rotation; normals follow vertices; ends and radius of
 * a cylinder turn and stretch it. */
void imp__pose_numbers_bar(const struct imp__moves *moves, const struct imp__mover *mover,
                           const struct imp_pose *pose, double *bar);
/* Does it move (imp__mover.shape)? By a mover that is not `but` (NULL: any). */
bool imp__moves_shape(const struct imp__moves *moves, int shape,
                      const struct imp__mover *but);
/* Do its points? Those of a mesh stay where its normals alone turn. */
bool imp__moves_place(const struct imp__moves *moves, int shape);

/* Velocity along theta_dot [moves->n]; the transpose adds to theta_bar [moves->n]. */
struct imp__velocity imp__velocity_of(const struct imp__moves *moves,
                                      const struct imp__glued *x,
                                      const double *theta_dot);
void imp__velocity_bar(const struct imp__moves *moves, const struct imp__glued *x,
                       const struct imp__velocity *bar, double *theta_bar);
/* Numbers that the velocity of a point of its shape depends on, by their index among all; of vertices
 * those of one triangle, of a curve those of one segment. Returns how many. */
#define IMP_TOUCHED_MOST 18
size_t imp__mover_touched(const struct imp__moves *moves, const struct imp__mover *mover,
                          const struct imp__glued *x, size_t index[IMP_TOUCHED_MOST]);

/* ---- keys.c ---- */
/* An instance that moves in time, at a time: its points p move by  e + a x (p - c), by theta [6] of one of
 * its places; and the transpose. */
struct imp__turned {
    imp_v3 e, a, c;
};
struct imp__turned imp__key_turned(const struct imp__moves *moves,
                                   const struct imp__mover *m, double time,
                                   const double *theta);
void imp__key_turned_bar(const struct imp__moves *moves, const struct imp__mover *m,
                         double time, imp_v3 e_bar, imp_v3 a_bar, double *theta_bar);

/* ---- glued.c ---- */
/* What carries a shape at a place, as imp__mover.shape: itself, or the instance that it is in. */
int imp__carrier(const struct imp_scene *scene, int shape, int64_t place);
/* Corners of a triangle at a time, world, and the normals of its vertices, which are of unit length where the
 * shape is in no instance; 0: it has none. */
struct imp__corners {
    imp_v3 p[3], n[3];
    bool smooth;
};
struct imp__corners imp__corners(const struct imp_scene *scene, int shape, int prim,
                                 int64_t place, double time);
/* The same by the maps of the place, to the world and back. NULL: there is none. */
struct imp__corners imp__corners_mapped(const struct imp_scene *scene, int shape,
                                        int prim, const struct imp_map *map);
/* The point of a triangle with these weights of its second and third vertex (located.h), or the
 * one next to p. n: the side of the normal that is wanted. */
struct imp__glued imp__glued_at(const struct imp_scene *scene, int shape,
                                const struct imp_located *x, int64_t place, double time,
                                imp_v3 n);
struct imp__glued imp__glued_near(const struct imp_scene *scene, int shape, int prim,
                                  int64_t place, double time, imp_v3 p, imp_v3 n);

/* ---- curved.c: of a shape, in an instance where place > 0 ---- */
/* Centre and radius of a sphere. False: another shape, or one that its instance stretches. */
bool imp__moves_sphere(const struct imp_scene *scene, int shape, int64_t place,
                       struct imp_round *out);
bool imp__moves_disk(const struct imp_scene *scene, int shape);
/* A circular cylinder, open at both ends. False: another shape. */
struct imp__tube {
    imp_v3 base, axis; /* the middle of its first end; unit */
    double radius, length;
};
bool imp__moves_cylinder(const struct imp_scene *scene, int shape, int64_t place,
                         struct imp__tube *out);
/* Does the place stretch all directions alike? By *factor. */
bool imp__place_alike(const struct imp_scene *scene, int64_t place, double *factor);
/* One of these, or a curve (strand.h)? */
bool imp__moves_curved(const struct imp_scene *scene, int shape, int64_t place);
/* The length of what has the length 1 in the group, on the average over volumes; 1: of the world. */
double imp__place_scale(const struct imp_scene *scene, int64_t place);
/* Rims: one of a disk, two of a cylinder, 0 of others. A point of rim k, by v of a turn, with its unit
 * direction, the unit direction in the surface away from it, the normal, and the length of dp/dv. */
int imp__rims(const struct imp_scene *scene, int shape);
struct imp__rim_point {
    imp_v3 p, along, out, n;
    double rate;
};
struct imp__rim_point imp__rim(const struct imp_scene *scene, int shape, int64_t place,
                               int k, double v);
/* A rim, and do two of them lie on each other? */
struct imp__rim_name {
    int shape;
    int64_t place;
    int k;
};
bool imp__rims_meet(const struct imp_scene *scene, const struct imp__rim_name *a,
                    const struct imp__rim_name *b);
/* The point next to p, whose normal n is on this side; in a direction from the middle of a sphere; on a
 * segment of a curve. */
struct imp__glued imp__glued_curved(const struct imp_scene *scene, int shape, int prim,
                                    int64_t place, imp_v3 p, imp_v3 n);

/* ---- cameras_lights.c ---- */
/* Velocity of emitter k: of its place, or of the unit direction in which parallel light, or that of a
 * sky, travels, or comes from, which is p; where its sun moves, of what the disc sends. */
imp_v3 imp__light_velocity(const struct imp__moves *moves, int k, imp_v3 p,
                           const double *theta_dot);
void imp__light_velocity_bar(const struct imp__moves *moves, int k, imp_v3 p, imp_v3 bar,
                             double *theta_bar);
/* The turn of a spot's or projector's frame or a sky, a rotation vector, and the transpose. */
imp_v3 imp__light_turn(const struct imp__moves *moves, int k, const double *theta_dot);
void imp__light_turn_bar(const struct imp__moves *moves, int k, imp_v3 turn_bar,
                         double *theta_bar);
/* The velocity of the part of a projector's picture at r from it, by its field of view, and the
 * transpose. */
imp_v3 imp__light_spread(const struct imp__moves *moves, int k, imp_v3 r,
                         const double *theta_dot);
void imp__light_spread_bar(const struct imp__moves *moves, int k, imp_v3 r, imp_v3 bar,
                           double *theta_bar);
/* Velocity of what the camera sees at p through a fixed film position and, of a lens, fixed numbers of
 * its point: origin and direction of the ray move with the camera, the distance is held. eye: another
 * point of the ray. */
imp_v3 imp__camera_velocity(const struct imp__moves *moves, imp_v3 eye, imp_v3 p,
                            const double *theta_dot);
void imp__camera_velocity_bar(const struct imp__moves *moves, imp_v3 eye, imp_v3 p,
                              imp_v3 bar, double *theta_bar);

/* ---- shade.c ---- */
/* Has this shape vertex normals, by which it is shaded? */
bool imp__moves_smooth(const struct imp_scene *scene, int shape);
/* Sets what a glued point of a triangle has of a mesh with vertex normals. Another shape: nothing. */
void imp__glued_shade(struct imp__glued *x, const struct imp__corners *f);
/* For each of n positions [n][3] the least vertex at the same one, to place [n]. IMP_E_NOMEM. */
enum imp_status imp__vertex_places(imp_context *ctx, const float *positions, size_t n,
                                   uint32_t *place);
/* The triangles around each vertex, or around all that lie where it lies. */
enum imp_status imp__fans_make(imp_context *ctx, const struct imp_triangles *t,
                               struct imp__fans **out);
void imp__fans_free(imp_context *ctx, struct imp__fans *fans);
/* Adds what adjoints of vertex normals [3 n_vertices], which become zero, are to positions. */
void imp__fans_normals_bar(const struct imp__fans *fans, const struct imp_triangles *t,
                           double *normals_bar, double *positions_bar);

#endif
