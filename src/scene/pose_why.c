/* SPDX-License-Identifier: Apache-2.0
 *
 * Which numbers of geometry (pose.h) an object has, and why it has not the others. */
#include "instances.h"
#include "kind/emitter/from_point.h"
#include "kind/emitter/ies.h"
#include "kind/emitter/sky_sun.h"
#include "kind/shape/shape.h"
#include "media_around.h"
#include "pose.h"

extern const struct imp_sensor_ops imp__distant;
extern const struct imp_emitter_ops imp__projector;

bool imp__pose_looks_up(const struct imp_scene *scene, const struct imp_shape *s)
{
    const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
    for (int k = 0; k < b->n_in; k++)
        if (b->input[k]->texture) return true;
    return false;
}

/* What else is made from where shapes are, and is not made again. NULL: nothing is in the way, as
 * below. */
static const char *shape_why(const struct imp_scene *scene, const struct imp_shape *s)
{
    if (!s->ops->move)
        return "it is not made of triangles, and no sphere, disk, cylinder or "
               "bsplinecurve";
    if (s->index >= imp__shapes_outside(scene))
        return "it is in a shape group: its instances have poses";
    if (scene->n_bodies > 0) return "there are media of graded index";
    if (scene->priorities) return "shapes have priorities";
    if (s->interior && !imp__is_border(scene, s))
        return "it bounds a medium, with a surface that is not null";
    if (scene->lights_in_tree) return "lights are chosen by a tree (light_choice)";
    if (scene->aims.aimed) return "directions are aimed at shapes";
    if (s->placed || s->by_triangle) return "its textures need more than uv";
    if (s->geometry == IMP_CURVES && imp__pose_looks_up(scene, s))
        return "its texture would turn about its line, by where z is";
    return NULL;
}

/* What a scale or single vertices change beside places. */
static const char *size_why(const struct imp_scene *scene, const struct imp_shape *s,
                            enum imp_pose_kind kind)
{
    const bool is_mesh =
        s->geometry == IMP_TRIANGLES && s->ops->surface == imp__mesh_surface;
    for (int k = 0; k < scene->n_emitters; k++)
        if (scene->emitters[k]->shape == s)
            return "it is a light, whose points are drawn by areas that stay";
    for (int k = 0; k < scene->n_sensors; k++)
        if (scene->sensors[k]->shape == s) return "it is a sensor";
    if (kind == IMP_POSE_VERTICES && !is_mesh) return "it is no mesh";
    if (kind == IMP_POSE_CONTROL && s->geometry != IMP_CURVES)
        return "it is no bsplinecurve";
    if (kind == IMP_POSE_NORMALS && !(is_mesh && s->smooth))
        return "it is no mesh with vertex normals";
    return NULL;
}

/* A sphere, or a circular cylinder, and which of their numbers this is. */
static const char *round_why(const struct imp_scene *scene, const struct imp_shape *s,
                             enum imp_pose_kind kind)
{
    struct imp_round round;
    const bool is_round = imp__shape_round(s, &round);
    const bool has_axis = is_round && !imp__is_zero(round.axis);
    if (!is_round || (kind == IMP_POSE_CENTER && has_axis) ||
        ((kind == IMP_POSE_END_0 || kind == IMP_POSE_END_1) && !has_axis))
        return "it is none of sphere (center, radius) and circular cylinder (p0, p1, "
               "radius)";
    if (has_axis && imp__pose_looks_up(scene, s))
        return "its texture would turn about its axis";
    return kind == IMP_POSE_CENTER ? NULL : size_why(scene, s, kind);
}

const char *imp__pose_shape_why(const struct imp_scene *scene, const struct imp_shape *s,
                                enum imp_pose_kind kind)
{
    if (kind >= IMP_POSE_FOV) return "it is a shape";
    const char *why = shape_why(scene, s);
    if (why || kind == IMP_POSE_RIGID) return why;
    if (kind == IMP_POSE_RIGID_END) return "it is no instance that moves in time";
    if (kind == IMP_POSE_WORLD) return imp__world_shape_why(scene, s);
    return imp__pose_is_round(kind) ? round_why(scene, s, kind)
                                    : size_why(scene, s, kind);
}

const char *imp__pose_sensor_why(struct imp_sensor *s, enum imp_pose_kind kind,
                                 imp_v3 *centre)
{
    const bool whole = kind == IMP_POSE_RIGID || kind == IMP_POSE_WORLD,
               distant = s->ops == &imp__distant;
    if (!whole && kind != IMP_POSE_TURN && !imp__pose_is_view(kind))
        return "it is a sensor";
    if (distant != (kind == IMP_POSE_TURN))
        return distant ? "it is far away: it has a turn" : "it is no distant sensor";
    double number[IMP_VIEW_NUMBERS];
    double rows[12];
    if (!s->ops->move)
        return "it is no perspective or orthographic camera, thin lens or radiancemeter";
    if (!imp__lens_middle(s, centre)) return "its rays meet in no point";
    if (distant) return NULL;
    if (kind == IMP_POSE_WORLD)
        return s->ops->placed && s->ops->placed(s, rows, false) ? NULL : "it has none";
    if (whole) return NULL;
    number[kind - IMP_POSE_FOV] = NAN;
    if (!s->ops->view || !s->ops->view(s, number, false))
        return "it has no field of view";
    return isnan(number[kind - IMP_POSE_FOV]) ? "it is no thin lens" : NULL;
}

const char *imp__pose_light_why(const struct imp_scene *scene,
                                const struct imp_emitter *e, enum imp_pose_kind kind)
{
    const bool spot = imp__light_frame_of(e) != NULL, far = imp__pose_is_far(e);
    struct imp__sky_sun sun;
    const bool sunny = imp__sky_sun_read(e, &sun);
    if (kind == IMP_POSE_PICTURE)
        return e->ops != &imp__projector ? "it is no camera and no projector"
               : scene->lights_in_tree   ? "lights are chosen by a tree (light_choice)"
                                         : NULL;
    if (kind == IMP_POSE_SUN && !(sunny && !sun.alone))
        return "it is none of sunsky by day, and ciesky and perezsky that depend on "
               "their sun";
    if (kind == IMP_POSE_SUN_RADIUS && !(sunny && sun.radius > 0))
        return "it is neither sun nor sunsky by day";
    const bool has = kind == IMP_POSE_POSITION ? e->ops->aim && !far
                     : kind == IMP_POSE_DIRECTION
                         ? e->ops->aim && (far || spot || e->ops == &imp__ies_light)
                     : kind == IMP_POSE_TURN
                         ? e->ops->move != NULL
                         : kind >= IMP_POSE_SUN || (kind == IMP_POSE_WORLD && spot);
    if (!has)
        return "it is none of point, spot, projector and ies without a shape (position), "
               "directional, sun, spot, projector and ies (direction), spot and "
               "projector "
               "(to_world), and envmap, sunsky, ciesky and perezsky (turn)";
    if (scene->lights_in_tree) return "lights are chosen by a tree (light_choice)";
    return NULL;
}
