/* SPDX-License-Identifier: Apache-2.0
 *
 * Where things are, as parameters:
 *
 *     NAME.pose              of a shape, instance, group, volume, camera or radiancemeter: e and a, six numbers; a point that the
 *                            scene file has at X0 is at  X = c + e + R(a) s (X0 - c)
 *     NAME.pose_end          of an instance that moves in time: the same, of its to_world_end; its pose is then
 *                            that of its to_world
 *     NAME.scale             of a shape, instance, group or volume: s
 *     NAME.to_world          of a shape, instance, volume, camera, spot or projector: the upper three rows of the
 *                            matrix M that puts what the kind has at x at  X = M x, as mi.traverse has it
 *     NAME.vertex_positions  of a mesh: the vertices, three numbers each, world
 *     NAME.vertex_normals    of a mesh that has some: three numbers each, world, of any length; in a
 *                            triangle they are weighted, and the sum is made unit
 *     NAME.control_points    of a bsplinecurve: four numbers each, x, y, z and radius, world
 *     NAME.center, .radius   of a sphere, world
 *     NAME.p0, .p1, .radius  of a circular cylinder: the middles of its ends, world; its points turn with
 *                            the axis as little as possible
 *     NAME.x_fov             of a perspective camera or a projector: its horizontal field of view, degrees
 *     NAME.principal_point_offset_x, _y    of a camera, in parts of the film's width and height
 *     NAME.opencv_k1, _k2, _p1, _p2, _k3   of a camera, by which its lens distorts the picture
 *     NAME.aperture_radius, NAME.focus_distance   of a thin lens
 *     NAME.position          of a light at a point, world
 *     NAME.direction         along which parallel light or that of a sun's middle travels, or of a
 *                            spot's or projector's axis, of any length
 *     NAME.turn              of a sky or a distant sensor, about its target: a rotation vector, away from what the file says
 *     NAME.sun_direction     of a clear sky: towards its sun, world, of any length
 *     NAME.sun_radius        of a sun or of a sky with one: that of its disc, radians
 *
 * A group's X is in the group's own space, and all its instances follow.
 *
 * R(a): the rotation about a by |a| radians; c: the middle of a shape's box, or of a group's where an
 * instance has it; a camera's own place.
 * They are parameters when they are asked for, behind all others: imp_scene_add_geometry. */
#ifndef IMP_SCENE_POSE_H
#define IMP_SCENE_POSE_H

#include "scene.h"

enum imp_pose_kind {
    IMP_POSE_RIGID,
    IMP_POSE_RIGID_END, /* of an instance that moves in time */
    IMP_POSE_SCALE,
    IMP_POSE_WORLD,
    IMP_POSE_VERTICES,
    IMP_POSE_NORMALS,
    IMP_POSE_CONTROL,
    IMP_POSE_CENTER,
    IMP_POSE_RADIUS,
    IMP_POSE_END_0,
    IMP_POSE_END_1,
    IMP_POSE_FOV,
    IMP_POSE_OFFSET_X,
    IMP_POSE_OFFSET_Y,
    IMP_POSE_K1,
    IMP_POSE_K2,
    IMP_POSE_P1,
    IMP_POSE_P2,
    IMP_POSE_K3,
    IMP_POSE_APERTURE,
    IMP_POSE_FOCUS,
    IMP_POSE_POSITION,
    IMP_POSE_DIRECTION,
    IMP_POSE_TURN,
    IMP_POSE_SUN,
    IMP_POSE_SUN_RADIUS,
    IMP_POSE_PICTURE, /* x_fov of a projector */
    IMP_POSE_KINDS
};

/* A centre, radius or end of a sphere or cylinder. */
static inline bool imp__pose_is_round(enum imp_pose_kind kind)
{
    return kind >= IMP_POSE_CENTER && kind <= IMP_POSE_END_1;
}

/* Six numbers of a place. */
static inline bool imp__pose_is_rigid(enum imp_pose_kind kind)
{
    return kind == IMP_POSE_RIGID || kind == IMP_POSE_RIGID_END;
}

/* A number of a camera's view (imp_sensor_ops.view): number kind - IMP_POSE_FOV. */
static inline bool imp__pose_is_view(enum imp_pose_kind kind)
{
    return kind >= IMP_POSE_FOV && kind < IMP_POSE_FOV + IMP_VIEW_NUMBERS;
}

/* One such parameter. */
struct imp_pose {
    struct imp_pose *next; /* added later */
    struct imp_scene *scene;
    enum imp_pose_kind kind;
    int shape;                   /* index; -1: no shape */
    int instance;                /* of the scene's own; -1: none */
    int group;                   /* of the scene's, with all its instances; -1: none */
    struct imp_sensor *sensor;   /* NULL: no sensor */
    struct imp_emitter *emitter; /* NULL: no light without a shape */
    struct imp_texture *texture; /* NULL: no volume */
    int param;
    size_t n;
    double *number;   /* [n] */
    double start[12]; /* of a map, centre, radius or end: as the file has it */
    imp_v3 centre;
    /* The first one of the same object has what follows. */
    struct imp_pose *object;
    bool due; /* its numbers, or another's of the object, changed since it was moved */
    /* As the file has it: the kind's object, a volume's to_world, and positions and normals of a mesh, points of a curve. */
    void *rest;
    size_t rest_size;
    double rest_area;              /* of a shape, as it was then */
    float *positions, *normals;    /* NULL: in the object, or none */
    float *control;                /* points of a curve; else NULL */
    struct imp_receiver *receiver; /* of a shape with a meter that has one; else NULL */
    struct imp__ies *table;        /* of a shape that shines by a table; else NULL */
};

/* Does it move anything that rays meet? A volume moves its values alone. */
static inline bool imp__pose_moves(const struct imp_pose *p) { return !p->texture; }

/* Its box now. False: it is no shape, and no instance. */
bool imp__pose_box(const struct imp_pose *p, imp_v3 *lo, imp_v3 *hi);

/* The last part of such a name, without its point. */
const char *imp__pose_tail(enum imp_pose_kind kind);
/* Another parameter of the same object. NULL: none. */
const struct imp_pose *imp__pose_beside(const struct imp_pose *p,
                                        enum imp_pose_kind kind);
/* The pose that is this parameter; NULL: it is none. */
static inline const struct imp_pose *imp__pose_of(const struct imp_scene *scene,
                                                  size_t param)
{
    const struct imp_pose *p = scene->poses;
    while (p && p->param != (int)param) p = p->next;
    return p;
}

/* Names of all numbers of geometry that may become parameters, one after the other: shapes',
 * sensors', lights', each with its kinds. From {0}; false: there is no further one. */
struct imp_geometry_walk {
    int next;
    char name[256];
};
bool imp__geometry_next(const struct imp_scene *scene, struct imp_geometry_walk *at);

/* Has the shape's material textures? */
bool imp__pose_looks_up(const struct imp_scene *scene, const struct imp_shape *s);

/* A large change of number e, in its unit: of a place a tenth of the scene, of a rotation half a
 * radian, of a vertex a tenth of its mesh, of a view ten degrees. */
double imp__pose_large(const struct imp_pose *p, size_t e);

/* Is its direction that of its light, which comes from far away, and not of a frame? */
static inline bool imp__pose_is_far(const struct imp_emitter *e)
{
    return e->ops->flags & (IMP_EMITTER_FAR | IMP_EMITTER_ENVIRONMENT);
}
/* Where a light is, or where it shines: the unit direction of parallel light, or a spot's axis. */
void imp__pose_aim(struct imp_emitter *e, enum imp_pose_kind kind, double v[3]);

/* Where the rays of a camera meet. False: in no point, as those of a lens with an aperture or of
 * parallel light. */
bool imp__pinhole(const struct imp_sensor *sensor, imp_v3 *centre);
/* The point of its lens that rays with these numbers go through; a pinhole has one. False: none. */
bool imp__lens_point(const struct imp_sensor *sensor, const double lens[2],
                     imp_v3 *point);
/* Is what it reads that along one ray, or one for each pixel, all from a point (radiancemeter) or
 * towards one (distant), which is the centre? No line from anywhere meets these. */
bool imp__sees_rays(const struct imp_sensor *sensor, imp_v3 *centre);
/* One of these points, or the middle of a lens whose rays to a film position meet in a point, or of the
 * film of a camera that moves and has parallel rays. False: none of these. */
bool imp__lens_middle(const struct imp_sensor *sensor, imp_v3 *centre);

/* The rotation of a vector of rotation, row by row. */
void imp__rotation_of(const double a[3], double R[9]);
/* Adds to a_bar what an adjoint of the turning at the pose, a rotation about the moved centre, is to
 * the numbers a: the transpose of the left Jacobian of the rotations. */
void imp__rotation_bar(const double a[3], imp_v3 turn_bar, double a_bar[3]);

/* ---- pose.c for pose_add.c ---- */
void imp__pose_changed(void *pose);

/* The rows of a turn. False: it is none. */
bool imp__pose_turn_of(const struct imp_pose *p, double by[12]);
/* ---- pose_lights.c for pose.c ---- */
/* Puts a light where p says. world: its to_world where that has been changed; else NULL. */
enum imp_status imp__pose_light_apply(const struct imp_pose *p,
                                      const struct imp_pose *world);
/* A large turn of a light that is far away: not beyond what its sun is wide. */
double imp__pose_turn_large(const struct imp_emitter *e, double large);

/* ---- pose_rest.c for pose.c and pose_add.c ---- */
/* Sets p->rest and what follows it. IMP_E_NOMEM. */
enum imp_status imp__pose_rest_keep(struct imp_scene *scene, struct imp_pose *p);
/* Is it turned and shifted by nothing? */
bool imp__pose_is_at_start(const struct imp_pose *p);
/* Moves what a shape, which has been moved, carries along. p: the first parameter of the object. */
struct imp_map;
void imp__pose_carry(const struct imp_pose *p, const struct imp_map *by);

/* ---- pose_why.c for pose_add.c and pose_names.c ---- */
/* Why an object has no such number; NULL: it has. Sets the middle of a sensor's lens. */
const char *imp__pose_shape_why(const struct imp_scene *scene, const struct imp_shape *s,
                                enum imp_pose_kind kind);
const char *imp__pose_sensor_why(struct imp_sensor *s, enum imp_pose_kind kind,
                                 imp_v3 *centre);
const char *imp__pose_light_why(const struct imp_scene *scene,
                                const struct imp_emitter *e, enum imp_pose_kind kind);

/* ---- pose_world.c ---- */
/* May the object's to_world be any map that does not mirror? Not where it would make another kind
 * of thing: of a sphere one that stretches it, of a camera one that does more than turn it. */
bool imp__world_is_free(const struct imp_pose *p);
/* The object's centre where it is now. */
imp_v3 imp__world_centre(const struct imp_pose *p);
/* ---- pose_world.c for pose.c and pose_add.c ---- */
/* Why an object, whose other numbers of this kind there are, has no to_world. NULL: it has. */
const char *imp__world_shape_why(const struct imp_scene *scene,
                                 const struct imp_shape *s);
const char *imp__world_instance_why(const struct imp_scene *scene, int k);
/* Where the object is now. */
void imp__world_read(const struct imp_pose *p, double to_world[12]);
/* Is it elsewhere than in the file? */
bool imp__world_is_moved(const struct imp_pose *p);
/* Puts the object, which is where the file has it, where p says. IMP_E_NUMERIC: it cannot be there. */
enum imp_status imp__world_apply(const struct imp_pose *p);

/* ---- pose_instances.c for pose.c, pose_add.c and pose_names.c ---- */
/* Instances of the scene's own; those that are listed by name, none of more than so many. */
#define IMP_POSE_INSTANCES_LISTED 1024
int imp__pose_instances(const struct imp_scene *scene);
int imp__pose_instances_listed(const struct imp_scene *scene);
/* Its id, or "instance" and its index. */
void imp__instance_name(const struct imp_scene *scene, int k, char out[200]);
/* Why it has no such number. NULL: it has one. */
const char *imp__instance_why(const struct imp_scene *scene, int k,
                              enum imp_pose_kind kind);
/* Sets the instance of this name, its centre and the size of what is kept. False: there is none. */
bool imp__instance_find(const struct imp_scene *scene, const char *name,
                        struct imp_pose *p);
/* Moves it from where the file has it. */
enum imp_status imp__instance_apply(const struct imp_pose *p, const struct imp_map *by);
/* Puts instance k there, for the sake of p. */
enum imp_status imp__instance_place(const struct imp_pose *p, int k,
                                    const struct imp_map *to_world);

/* ---- pose_groups.c, likewise ---- */
const char *imp__group_why(const struct imp_scene *scene, int k, enum imp_pose_kind kind);
bool imp__group_find(const struct imp_scene *scene, const char *name, struct imp_pose *p);
/* Is p of a group, of which this is an instance? */
bool imp__group_has(const struct imp_pose *p, int instance);
/* What a length of its first instance is in the world. */
double imp__group_size(const struct imp_pose *p);
enum imp_status imp__group_apply(const struct imp_pose *p, const struct imp_map *by);

/* ---- pose_volumes.c, likewise ---- */
/* The volume of this name that may be placed; NULL: there is none. */
struct imp_texture *imp__volume_find(const struct imp_scene *scene, const char *name);
const char *imp__volume_why(const struct imp_scene *scene, const struct imp_texture *t,
                            enum imp_pose_kind kind);
/* Where it is in the file is kept, of its first number. */
enum imp_status imp__volume_keep(struct imp_scene *scene, struct imp_pose *p);
/* It is a parameter now. */
void imp__volume_added(struct imp_scene *scene, struct imp_pose *p);
enum imp_status imp__volume_apply(const struct imp_pose *p, const struct imp_map *by);
bool imp__volume_box(const struct imp_texture *t, imp_v3 *lo, imp_v3 *hi);
/* A medium that ends at the box of this volume, where it is not 0: a derivative by its place would need
 * what is scattered there. NULL: none. */
const struct imp_medium *imp__volume_jumps(const struct imp_scene *scene,
                                           const struct imp_pose *p);
/* Is p within the box of this medium, or next to a side of it, as far as a border on that side may be? */
bool imp__medium_reaches(const struct imp_scene *scene, const struct imp_medium *m,
                         imp_v3 p);
/* Does a medium end at a side of its own box where it is not 0, within what bounds it? outside: nothing else
 * does. moves: what bounds it does, and may touch no such side. */
bool imp__medium_ends_bright(const struct imp_scene *scene, const struct imp_medium *m,
                             bool outside, bool moves);
/* One that would if the volume's cells changed but those that are held [its numbers]. NULL: none is. */
const struct imp_medium *imp__volume_may_jump(const struct imp_scene *scene,
                                              const struct imp_pose *p,
                                              const uint8_t *held);

/* ---- pose_folds.c for pose.c ---- */
/* A triangle of a mesh that its vertices' motion away from `rest` [3 n_vertices] makes vanish, or
 * turn over: *why says which in a verb. NULL: there is none. IMP_E_NOMEM. */
enum imp_status imp__mesh_folds(const struct imp_scene *scene,
                                const struct imp_triangles *t, const float *rest,
                                size_t *triangle, const char **why);

/* Moves what is due, and makes the tree of shapes again. Whoever has set parameters calls it behind
 * imp__theta_announce. IMP_E_NUMERIC where numbers are beyond what floats hold, no direction, or make a
 * triangle vanish or turn over; IMP_E_NOMEM, or what Embree says: the scene is not to be used before it
 * has succeeded. */
enum imp_status imp__poses_settle(struct imp_scene *scene);

#endif
