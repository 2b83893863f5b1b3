/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of geometry become parameters (pose.h), or are refused by name. */
#include "access.h"
#include "base/arguments.h"
#include "instances.h"
#include "kind/emitter/projector.h"
#include "kind/emitter/sky_sun.h"
#include "kind/sensor/receiver.h"
#include "kind/shape/shape.h"
#include "pose.h"
#include "theta_near.h"
#include <stdio.h>
#include <string.h>

/* ---- Adding ------------------------------------------------------------------------- */

static enum imp_status refuse(const struct imp_scene *scene, const char *name,
                              enum imp_pose_kind kind, const char *why)
{
    return imp__error(scene->ctx, IMP_E_UNSUPPORTED, "'%s' has no %s: %s",
                      name ? name : "", imp__pose_tail(kind), why);
}

static enum imp_status found(const struct imp_scene *scene, const char *name,
                             const struct imp_pose *p, const char *why)
{
    return why ? refuse(scene, name, p->kind, why) : IMP_OK;
}

static enum imp_status shape_find(struct imp_scene *scene, int k, struct imp_pose *p)
{
    const struct imp_shape *s = scene->shapes[k];
    p->shape = k;
    p->centre = (s->lo + s->hi) * 0.5;
    p->rest_size = s->ops->object_size;
    return found(scene, s->name, p, imp__pose_shape_why(scene, s, p->kind));
}

static enum imp_status sensor_find(struct imp_scene *scene, int k, struct imp_pose *p)
{
    struct imp_sensor *s = scene->sensors[k];
    p->sensor = s;
    p->rest_size = s->ops->object_size;
    return found(scene, s->name, p, imp__pose_sensor_why(s, p->kind, &p->centre));
}

static enum imp_status light_find(struct imp_scene *scene, int k, struct imp_pose *p)
{
    struct imp_emitter *e = scene->emitters[k];
    p->emitter = e;
    p->rest_size = e->ops->object_size;
    if (p->kind == IMP_POSE_FOV) p->kind = IMP_POSE_PICTURE; /* by the same name */
    return found(scene, e->name, p, imp__pose_light_why(scene, e, p->kind));
}

static enum imp_status volume_find(struct imp_scene *scene, struct imp_texture *t,
                                   struct imp_pose *p)
{
    p->texture = t;
    return found(scene, t->name, p, imp__volume_why(scene, t, p->kind));
}

static enum imp_status object_find(struct imp_scene *scene, const char *name,
                                   struct imp_pose *p)
{
    for (int k = 0; k < scene->n_shapes; k++)
        if (strcmp(scene->shapes[k]->name, name) == 0) return shape_find(scene, k, p);
    for (int k = 0; k < scene->n_sensors; k++)
        if (strcmp(scene->sensors[k]->name, name) == 0) return sensor_find(scene, k, p);
    for (int k = 0; k < scene->n_emitters; k++)
        if (!scene->emitters[k]->shape && strcmp(scene->emitters[k]->name, name) == 0)
            return light_find(scene, k, p);
    if (imp__instance_find(scene, name, p))
        return found(scene, name, p, imp__instance_why(scene, p->instance, p->kind));
    if (imp__group_find(scene, name, p))
        return found(scene, name, p, imp__group_why(scene, p->group, p->kind));
    struct imp_texture *volume = imp__volume_find(scene, name);
    if (volume) return volume_find(scene, volume, p);
    char whole[256];
    snprintf(whole, sizeof whole, "%s.%s", name, imp__pose_tail(p->kind));
    return imp__error(scene->ctx, IMP_E_ARG, "there is no %s '%s'%s",
                      p->kind >= IMP_POSE_POSITION ? "light"
                                                   : "shape, instance or camera",
                      name, imp__theta_near(scene, whole).text);
}

static void round_numbers(const struct imp_shape *s, enum imp_pose_kind kind,
                          double out[3])
{
    struct imp_round round;
    imp__shape_round(s, &round);
    const double length = s->area / (IMP_2PI * round.radius);
    const imp_v3 at = round.centre + round.axis * (kind == IMP_POSE_END_1 ? length : 0);
    for (int i = 0; i < 3; i++) out[i] = at[i];
    if (kind == IMP_POSE_RADIUS) out[0] = round.radius;
}

/* Numbers, and what they are where the file has the object. */
static enum imp_status numbers_make(struct imp_scene *scene, struct imp_pose *p)
{
    const struct imp_triangles *t =
        p->shape >= 0 ? &scene->shapes[p->shape]->triangles : NULL;
    double view[IMP_VIEW_NUMBERS], aim[3], rate;
    struct imp__sky_sun sun;
    if (imp__pose_is_view(p->kind)) p->sensor->ops->view(p->sensor, view, false);
    const bool rows = p->kind == IMP_POSE_VERTICES || p->kind == IMP_POSE_NORMALS;
    const struct imp_curves *curve =
        p->kind == IMP_POSE_CONTROL ? &scene->shapes[p->shape]->curves : NULL;
    const bool place = (p->kind >= IMP_POSE_POSITION && p->kind <= IMP_POSE_SUN) ||
                       (imp__pose_is_round(p->kind) && p->kind != IMP_POSE_RADIUS);
    p->n = imp__pose_is_rigid(p->kind) ? 6
           : p->kind == IMP_POSE_WORLD ? 12
           : rows                      ? 3 * t->n_vertices
           : curve                     ? 4 * curve->n_points
           : place                     ? 3
                                       : 1;
    p->number = imp__arena_array(&scene->arena, p->n, sizeof *p->number);
    if (!p->number) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    switch (p->kind) {
    case IMP_POSE_SCALE: p->number[0] = 1; break;
    case IMP_POSE_WORLD:
        imp__world_read(p, p->start);
        if (p->emitter) p->centre = imp__v3(p->start[3], p->start[7], p->start[11]);
        memcpy(p->number, p->start, sizeof p->start);
        break;
    case IMP_POSE_VERTICES:
        for (size_t k = 0; k < p->n; k++) p->number[k] = t->positions[k];
        break;
    case IMP_POSE_CONTROL:
        for (size_t k = 0; k < p->n; k++) p->number[k] = curve->points[k];
        break;
    case IMP_POSE_NORMALS: {
        const struct imp__mesh *m = scene->shapes[p->shape]->self;
        for (size_t k = 0; k < p->n; k++) p->number[k] = m->normals[k];
        break;
    }
    case IMP_POSE_POSITION:
    case IMP_POSE_DIRECTION:
        imp__pose_aim(p->emitter, p->kind, aim);
        memcpy(p->number, aim, sizeof aim);
        break;
    case IMP_POSE_SUN:
    case IMP_POSE_SUN_RADIUS:
        imp__sky_sun_read(p->emitter, &sun);
        for (int i = 0; i < 3; i++) p->start[i] = sun.towards[i];
        if (p->kind == IMP_POSE_SUN_RADIUS) p->start[0] = sun.radius;
        if (p->kind == IMP_POSE_SUN_RADIUS && imp__sun_radius_at(p->emitter)) {
            p->number = imp__sun_radius_at(p->emitter); /* one number by two names */
            p->start[0] = p->number[0];
        }
        memcpy(p->number, p->start, p->n * sizeof *p->number);
        break;
    case IMP_POSE_PICTURE:
        p->number[0] = p->start[0] = imp__projector_fov(p->emitter, &rate);
        break;
    case IMP_POSE_CENTER:
    case IMP_POSE_RADIUS:
    case IMP_POSE_END_0:
    case IMP_POSE_END_1:
        round_numbers(scene->shapes[p->shape], p->kind, p->start);
        memcpy(p->number, p->start, p->n * sizeof *p->number);
        break;
    default:
        if (imp__pose_is_view(p->kind)) p->number[0] = view[p->kind - IMP_POSE_FOV];
    }
    return IMP_OK;
}

static const struct tail {
    const char *name, *unit;
    double lo, hi;
} tails[IMP_POSE_KINDS] = {
    [IMP_POSE_RIGID] = {"pose", "scene units, radians", -INFINITY, INFINITY},
    [IMP_POSE_RIGID_END] = {"pose_end", "scene units, radians", -INFINITY, INFINITY},
    [IMP_POSE_SCALE] = {"scale", "1", 1e-3, INFINITY},
    [IMP_POSE_WORLD] = {"to_world", "1, scene units", -INFINITY, INFINITY},
    [IMP_POSE_VERTICES] = {"vertex_positions", "scene units", -INFINITY, INFINITY},
    [IMP_POSE_NORMALS] = {"vertex_normals", "1", -INFINITY, INFINITY},
    [IMP_POSE_CONTROL] = {"control_points", "scene units", -INFINITY, INFINITY},
    [IMP_POSE_CENTER] = {"center", "scene units", -INFINITY, INFINITY},
    [IMP_POSE_RADIUS] = {"radius", "scene units", 1e-6, INFINITY},
    [IMP_POSE_END_0] = {"p0", "scene units", -INFINITY, INFINITY},
    [IMP_POSE_END_1] = {"p1", "scene units", -INFINITY, INFINITY},
    [IMP_POSE_FOV] = {"x_fov", "degree", 0.1, 179},
    [IMP_POSE_OFFSET_X] = {"principal_point_offset_x", "film width", -INFINITY, INFINITY},
    [IMP_POSE_OFFSET_Y] = {"principal_point_offset_y", "film height", -INFINITY,
                           INFINITY},
    [IMP_POSE_K1] = {"opencv_k1", "1", -INFINITY, INFINITY},
    [IMP_POSE_K2] = {"opencv_k2", "1", -INFINITY, INFINITY},
    [IMP_POSE_P1] = {"opencv_p1", "1", -INFINITY, INFINITY},
    [IMP_POSE_P2] = {"opencv_p2", "1", -INFINITY, INFINITY},
    [IMP_POSE_K3] = {"opencv_k3", "1", -INFINITY, INFINITY},
    [IMP_POSE_APERTURE] = {"aperture_radius", "scene units", 0, INFINITY},
    [IMP_POSE_FOCUS] = {"focus_distance", "scene units", 1e-6, INFINITY},
    [IMP_POSE_POSITION] = {"position", "scene units", -INFINITY, INFINITY},
    [IMP_POSE_DIRECTION] = {"direction", "1", -INFINITY, INFINITY},
    [IMP_POSE_TURN] = {"turn", "radians", -INFINITY, INFINITY},
    [IMP_POSE_SUN] = {"sun_direction", "1", -INFINITY, INFINITY},
    [IMP_POSE_SUN_RADIUS] = {"sun_radius", "radians", 1e-6, 1.5},
    [IMP_POSE_PICTURE] = {"x_fov", "degree", 0.1, 179}};

const char *imp__pose_tail(enum imp_pose_kind kind) { return tails[kind].name; }

static enum imp_status param_add(struct imp_scene *scene, const char *object,
                                 struct imp_pose *p)
{
    const struct tail *tail = &tails[p->kind];
    const size_t length = strlen(object) + strlen(tail->name) + 2;
    char *name = imp__arena_take(&scene->arena, length, 1);
    if (!name) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    snprintf(name, length, "%s.%s", object, tail->name);
    const bool map = p->kind == IMP_POSE_WORLD;
    const size_t row = p->kind == IMP_POSE_CONTROL                                   ? 4
                       : p->kind == IMP_POSE_VERTICES || p->kind == IMP_POSE_NORMALS ? 3
                                                                                     : 0;
    const struct imp_param param = {
        .info = {.size = sizeof param.info,
                 .name = name,
                 .unit = tail->unit,
                 .dims = {map       ? 3
                          : row > 0 ? p->n / row
                                    : p->n,
                          map ? 4 : row},
                 .n_dims = map || row > 0 ? 2 : 1,
                 .lo = tail->lo,
                 .hi = tail->hi,
                 .flags = IMP_PARAM_DIFFERENTIABLE | (row > 0 ? IMP_PARAM_LIST : 0u)},
        .store = IMP_STORE_DOUBLES,
        .degree = IMP_DEGREE_OTHER,
        .doubles = p->number};
    IMP_CHECKED(imp__theta_add(scene, &param, &p->param));
    imp__theta_finish(scene);
    return imp__theta_watch(scene, p->param, imp__pose_changed, p);
}

/* Is it there already? Else *object is the first parameter of the same object, or p. */
static bool is_there(const struct imp_scene *scene, struct imp_pose *p)
{
    p->object = p;
    for (struct imp_pose *q = scene->poses; q; q = q->next) {
        if (q->shape != p->shape || q->sensor != p->sensor || q->emitter != p->emitter ||
            q->texture != p->texture || q->instance != p->instance ||
            q->group != p->group)
            continue;
        if (q->kind == p->kind) return true;
        p->object = q->object;
        if (p->kind != IMP_POSE_RIGID_END && q->object->kind != IMP_POSE_RIGID_END)
            p->centre = q->object->centre;
    }
    return false;
}

/* Numbers that say where the same points are, which may not be set beside each other. The view of a
 * camera or projector goes with all of them. */
static int family(enum imp_pose_kind kind)
{
    const bool view = imp__pose_is_view(kind) || kind == IMP_POSE_PICTURE;
    return view                        ? 0
           : kind == IMP_POSE_VERTICES ? 2
           : kind == IMP_POSE_CONTROL  ? 6
           : kind == IMP_POSE_NORMALS  ? 5
           : imp__pose_is_round(kind)  ? 3
           : kind == IMP_POSE_WORLD    ? 4
                                       : 1;
}
static const char *beside_why(const struct imp_pose *p)
{
    const int own = family(p->kind);
    for (int k = 0; k < 2; k++)
        if ((p->kind == IMP_POSE_TURN &&
             imp__pose_beside(p, k ? IMP_POSE_SUN : IMP_POSE_SUN_RADIUS)) ||
            (p->kind == (k ? IMP_POSE_SUN : IMP_POSE_SUN_RADIUS) &&
             imp__pose_beside(p, IMP_POSE_TURN)))
            return "a turn of the sky takes its sun along";
    for (const struct imp_pose *q = p->scene->poses; q; q = q->next)
        if ((p->instance >= 0 && imp__group_has(q, p->instance)) ||
            (q->instance >= 0 && imp__group_has(p, q->instance)))
            return "a group moves, or instances of it do";
    for (const struct imp_pose *q = p->object != p ? p->object : NULL; q; q = q->next) {
        const int other = family(q->kind);
        if (q->object != p->object || other == own || !own || !other) continue;
        if (own == 5 || other == 5)
            return own + other == 7
                       ? "vertex normals follow vertex_positions"
                       : "single normals turn, and the whole turns with them";
        if (own == 2 || other == 2)
            return "single vertices move, and the whole moves with them";
        if (own == 6 || other == 6)
            return "single points move, and the whole moves with them";
        return own == 4 || other == 4
                   ? "to_world says where it is, or other numbers"
                   : "pose and scale say where it is, or center, p0, p1 and radius";
    }
    return NULL;
}

static enum imp_status geometry_add(struct imp_scene *scene, const char *object,
                                    enum imp_pose_kind kind)
{
    if (!scene->committed || scene->rayless)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "%s needs a committed scene that has geometry",
                          imp__pose_tail(kind));
    if (scene->in_problem)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "what moves is added before the scene's first problem is "
                          "created");
    struct imp_pose *p = imp__arena_array(&scene->arena, 1, sizeof *p);
    if (!p) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    p->scene = scene;
    p->kind = kind;
    p->shape = p->instance = p->group = -1;
    IMP_CHECKED(object_find(scene, object, p));
    if (is_there(scene, p)) return IMP_OK;
    const char *beside = beside_why(p);
    if (beside) return refuse(scene, object, kind, beside);
    if (p->object == p)
        IMP_CHECKED(p->texture ? imp__volume_keep(scene, p)
                               : imp__pose_rest_keep(scene, p));
    IMP_CHECKED(numbers_make(scene, p));
    IMP_CHECKED(param_add(scene, object, p));
    struct imp_pose **end = &scene->poses;
    while (*end) end = &(*end)->next;
    *end = p;
    if (p->texture) {
        imp__volume_added(scene, p);
        return imp__poses_settle(scene);
    }
    scene->light_tree = NULL; /* that of grids alone: it would have to be made again */
    if (kind != IMP_POSE_VERTICES || !p->normals) return IMP_OK;
    imp__pose_changed(p); /* normals follow vertices from now on */
    return imp__poses_settle(scene);
}

enum imp_status imp_scene_add_pose(imp_scene *scene, const char *object)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, object, "object");
    IMP_SETS(scene, st);
    return st == IMP_OK ? geometry_add(scene, object, IMP_POSE_RIGID) : st;
}

enum imp_status imp_scene_add_geometry(imp_scene *scene, const char *name)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, name, "name");
    IMP_SETS(scene, st);
    if (st != IMP_OK) return st;
    const char *dot = strrchr(name, '.');
    for (int k = 0; dot && k < IMP_POSE_KINDS; k++) {
        if (strcmp(dot + 1, tails[k].name) != 0) continue;
        char object[256];
        const size_t length = (size_t)(dot - name);
        if (length >= sizeof object) break;
        memcpy(object, name, length);
        object[length] = 0;
        return geometry_add(scene, object, (enum imp_pose_kind)k);
    }
    return imp__error(
        scene->ctx, IMP_E_ARG,
        "'%s' names no number of geometry: NAME.pose, pose_end, scale, to_world, "
        "vertex_positions, vertex_normals, control_points, center, radius, p0, p1, "
        "x_fov, "
        "principal_point_offset_x, _y, "
        "opencv_k1, k2, p1, p2, k3, aperture_radius, "
        "focus_distance, position, direction, turn, sun_direction or sun_radius",
        name);
}
