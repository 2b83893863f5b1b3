/* SPDX-License-Identifier: Apache-2.0
 *
 * Objects are moved to where their parameters say (pose.h): always from where the file has them, so
 * that nothing depends on the order in which numbers were set. */
#include "pose.h"
#include "access.h"
#include "base/arguments.h"
#include "instances.h"
#include "kind/shape/shape.h"
#include "math/motion.h"
#include "sealed.h"
#include <string.h>

/* ---- Rotations --------------------------------------------------------------------- */

/* sin(t)/t, (1 - cos t)/t^2, (t - sin t)/t^3 with t = |a|. */
static void rotation_factors(const double a[3], double *s, double *c, double *d)
{
    const double t2 = a[0] * a[0] + a[1] * a[1] + a[2] * a[2], t = sqrt(t2);
    if (t < 1e-2) { /* series; the next terms are below 1e-16 */
        *s = 1 - t2 / 6 * (1 - t2 / 20 * (1 - t2 / 42));
        *c = 0.5 - t2 / 24 * (1 - t2 / 30 * (1 - t2 / 56));
        *d = 1. / 6 - t2 / 120 * (1 - t2 / 42 * (1 - t2 / 72));
        return;
    }
    *s = sin(t) / t;
    *c = (1 - cos(t)) / t2;
    *d = (t - sin(t)) / (t2 * t);
}

void imp__rotation_of(const double a[3], double R[9])
{
    double s, c, d;
    rotation_factors(a, &s, &c, &d);
    const double t2 = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            R[3 * i + j] = c * a[i] * a[j] + (i == j ? 1 - c * t2 : 0);
    R[1] -= s * a[2], R[3] += s * a[2];
    R[2] += s * a[1], R[6] -= s * a[1];
    R[5] -= s * a[0], R[7] += s * a[0];
}

/* J = 1 + c [a] + d [a]^2. */
void imp__rotation_bar(const double a[3], imp_v3 turn_bar, double a_bar[3])
{
    double s, c, d;
    rotation_factors(a, &s, &c, &d);
    const imp_v3 v = imp__v3(a[0], a[1], a[2]), once = imp__cross(v, turn_bar);
    const imp_v3 sum = turn_bar - once * c + imp__cross(v, once) * d;
    for (int i = 0; i < 3; i++) a_bar[i] += sum[i];
}

/* ---- Moving ------------------------------------------------------------------------- */

const struct imp_pose *imp__pose_beside(const struct imp_pose *p, enum imp_pose_kind kind)
{
    for (const struct imp_pose *q = p->object; q; q = q->next)
        if (q->object == p->object && q->kind == kind) return q;
    return NULL;
}

/* By the pose and the scale, or a sphere's centre and radius, which may be absent. */
static struct imp_map map_of(const struct imp_pose *object)
{
    const struct imp_pose *rigid = imp__pose_beside(object, IMP_POSE_RIGID);
    const struct imp_pose *scale = imp__pose_beside(object, IMP_POSE_SCALE);
    const double rest[6] = {0}, *number = rigid ? rigid->number : rest;
    const struct imp_pose *center = imp__pose_beside(object, IMP_POSE_CENTER);
    const struct imp_pose *radius = imp__pose_beside(object, IMP_POSE_RADIUS);
    const double s = scale    ? scale->number[0]
                     : radius ? radius->number[0] / radius->start[0]
                              : 1;
    double shifted[6] = {0};
    for (int i = 0; center && i < 3; i++)
        shifted[i] = center->number[i] - center->start[i];
    if (center) number = shifted;
    struct imp_map out;
    double R[9];
    imp__rotation_of(number + 3, R);
    for (int i = 0; i < 3; i++) {
        double shift = object->centre[i] + number[i];
        for (int j = 0; j < 3; j++) {
            out.m[4 * i + j] = s * R[3 * i + j];
            shift -= s * R[3 * i + j] * object->centre[j];
        }
        out.m[4 * i + 3] = shift;
    }
    return out;
}

/* Its to_world where that has been changed; else NULL. */
static const struct imp_pose *world_of(const struct imp_pose *object)
{
    const struct imp_pose *world = imp__pose_beside(object, IMP_POSE_WORLD);
    return world && imp__world_is_moved(world) ? world : NULL;
}

bool imp__pose_turn_of(const struct imp_pose *p, double by[12])
{
    double R[9];
    imp__rotation_of(p->number, R);
    for (int k = 0; k < 12; k++) by[k] = k % 4 == 3 ? 0 : R[3 * (k / 4) + k % 4];
    return p->number[0] != 0 || p->number[1] != 0 || p->number[2] != 0;
}

static enum imp_status sensor_apply(const struct imp_pose *p)
{
    struct imp_sensor *s = p->sensor;
    double number[IMP_VIEW_NUMBERS];
    bool any = false;
    memcpy(s->self, p->rest, p->rest_size);
    if (s->ops->view) s->ops->view(s, number, false);
    for (int k = 0; k < IMP_VIEW_NUMBERS; k++) {
        const struct imp_pose *q =
            imp__pose_beside(p, (enum imp_pose_kind)(IMP_POSE_FOV + k));
        if (q) number[k] = q->number[0];
        any |= q != NULL;
    }
    if (any && !s->ops->view(s, number, true))
        return imp__error(
            p->scene->ctx, IMP_E_NUMERIC,
            "the lens of camera '%s' folds its picture with k1, k2, p1, p2, "
            "k3 = %g, %g, %g, %g, %g",
            s->name, number[3], number[4], number[5], number[6], number[7]);
    const struct imp_pose *world = world_of(p),
                          *turn = imp__pose_beside(p, IMP_POSE_TURN);
    if (world) return imp__world_apply(world);
    double by[12];
    if (turn && imp__pose_turn_of(turn, by)) s->ops->move(s, by);
    if (!imp__pose_is_at_start(p)) s->ops->move(s, map_of(p).m);
    return IMP_OK;
}

/* The points of a curve, before its pose. */
static enum imp_status control_apply(const struct imp_pose *p, struct imp_shape *s)
{
    const struct imp_pose *set = imp__pose_beside(p, IMP_POSE_CONTROL);
    float *points = (float *)(uintptr_t)s->curves.points;
    const size_t n = 4 * s->curves.n_points;
    memcpy(points, p->object->control, n * sizeof *points);
    for (size_t k = 0; set && k < n; k++) {
        points[k] = (float)set->number[k];
        if (k % 4 == 3 ? !(points[k] >= 0 && points[k] < 1e18f)
                       : !(fabsf(points[k]) < 1e18f))
            return imp__error(
                p->scene->ctx, IMP_E_NUMERIC, "%s holds %s of point %zu that is %g",
                p->scene->params[set->param].info.name,
                k % 4 == 3 ? "a radius" : "a coordinate", k / 4, set->number[k]);
    }
    return IMP_OK;
}

/* False: it is no cylinder with numbers of its own. */
static bool ends_apply(const struct imp_pose *p, struct imp_shape *s)
{
    const struct imp_pose *end[2] = {imp__pose_beside(p, IMP_POSE_END_0),
                                     imp__pose_beside(p, IMP_POSE_END_1)},
                          *radius = imp__pose_beside(p, IMP_POSE_RADIUS);
    struct imp_round round;
    imp_v3 at[2];
    if (!(end[0] || end[1] || radius) || !imp__shape_round(s, &round) ||
        imp__is_zero(round.axis))
        return false;
    at[0] = round.centre;
    at[1] = round.centre + round.axis * (s->area / (IMP_2PI * round.radius));
    for (int k = 0; k < 2; k++)
        if (end[k])
            at[k] = imp__v3(end[k]->number[0], end[k]->number[1], end[k]->number[2]);
    imp__cylinder_set(s, at[0], at[1], radius ? radius->number[0] : round.radius);
    return true;
}

static enum imp_status shape_apply(const struct imp_pose *p)
{
    struct imp_shape *s = p->scene->shapes[p->shape];
    const struct imp_pose *vertices = imp__pose_beside(p, IMP_POSE_VERTICES),
                          *turned = imp__pose_beside(p, IMP_POSE_NORMALS);
    const size_t n = 3 * s->triangles.n_vertices;
    float *positions = (float *)(uintptr_t)s->triangles.positions;
    if (p->rest_size > 0) memcpy(s->self, p->rest, p->rest_size);
    if (s->geometry == IMP_CURVES) IMP_CHECKED(control_apply(p, s));
    s->area = p->rest_area;
    const struct imp_map by = map_of(p);
    const struct imp_pose *world = world_of(p);
    if (world && s->geometry != IMP_TRIANGLES) return imp__world_apply(world);
    if (s->geometry != IMP_TRIANGLES) {
        if (!ends_apply(p, s)) s->ops->move(s, by.m);
        imp__pose_carry(p->object, &by);
        return IMP_OK;
    }
    if (p->positions) memcpy(positions, p->positions, n * sizeof *p->positions);
    for (size_t k = 0; vertices && k < n; k++) positions[k] = (float)vertices->number[k];
    float *normals =
        p->normals ? (float *)(uintptr_t)((struct imp__mesh *)s->self)->normals : NULL;
    if (normals && !vertices) memcpy(normals, p->normals, n * sizeof *normals);
    for (size_t k = 0; turned && k < n; k++) normals[k] = (float)turned->number[k];
    if (normals && vertices)
        IMP_CHECKED(imp__mesh_normals(p->scene->ctx, s->triangles.n_vertices,
                                      s->triangles.n_triangles, positions,
                                      s->triangles.indices, normals));
    if (world) return imp__world_apply(world);
    s->ops->move(s, by.m); /* also at rest: frames of facets and the box follow */
    imp__pose_carry(p->object, &by);
    return IMP_OK;
}

static enum imp_status pose_apply(struct imp_pose *p)
{
    p->due = false;
    if (p->shape >= 0) return shape_apply(p);
    if (p->instance >= 0) {
        const struct imp_pose *world = world_of(p);
        const struct imp_map by = map_of(p);
        return world ? imp__world_apply(world) : imp__instance_apply(p, &by);
    }
    if (p->group >= 0 || p->texture) {
        const struct imp_map by = map_of(p);
        return p->texture ? imp__volume_apply(p, &by) : imp__group_apply(p, &by);
    }
    return p->sensor ? sensor_apply(p) : imp__pose_light_apply(p, world_of(p));
}

double imp__pose_large(const struct imp_pose *p, size_t e)
{
    const double scene = imp__length(p->scene->hi - p->scene->lo);
    switch (p->kind) {
    case IMP_POSE_WORLD:
        return e % 4 == 3 ? 0.1 * scene
                          : 0.3 * hypot(hypot(p->start[e % 4], p->start[4 + e % 4]),
                                        p->start[8 + e % 4]);
    case IMP_POSE_TURN: return p->emitter ? imp__pose_turn_large(p->emitter, 0.5) : 0.5;
    case IMP_POSE_RIGID:
    case IMP_POSE_RIGID_END:
        if (e >= 3) return 0.5;
        return 0.1 * scene / (p->group >= 0 ? imp__group_size(p) : 1);
    case IMP_POSE_SUN_RADIUS:
    case IMP_POSE_SCALE:
    case IMP_POSE_RADIUS: return 0.3 * p->number[0];
    case IMP_POSE_NORMALS: return 0.3;
    case IMP_POSE_CONTROL:
    case IMP_POSE_VERTICES: {
        const struct imp_shape *s = p->scene->shapes[p->shape];
        const double size = imp__length(s->hi - s->lo);
        if (p->kind == IMP_POSE_CONTROL && e % 4 == 3) /* a tip has none */
            return imp_max(0.3 * p->number[e], 1e-2 * size);
        return 0.1 * size;
    }
    case IMP_POSE_PICTURE:
    case IMP_POSE_FOV: return 10;
    case IMP_POSE_OFFSET_X:
    case IMP_POSE_OFFSET_Y:
    case IMP_POSE_K1:
    case IMP_POSE_K2:
    case IMP_POSE_K3: return 0.1;
    case IMP_POSE_P1:
    case IMP_POSE_P2: return 0.02;
    case IMP_POSE_APERTURE: return 0.3 * p->number[0] + 1e-3 * scene;
    case IMP_POSE_FOCUS: return 0.2 * p->number[0];
    case IMP_POSE_SUN:
    case IMP_POSE_DIRECTION:
        return imp__pose_turn_large(p->emitter, 0.3) *
               imp__length(imp__v3(p->number[0], p->number[1], p->number[2]));
    default: return 0.1 * scene;
    }
}

static void box_add(struct imp_scene *scene, imp_v3 lo, imp_v3 hi)
{
    for (int i = 0; i < 3; i++) {
        scene->lo[i] = imp_min(lo[i], scene->lo[i]);
        scene->hi[i] = imp_max(hi[i], scene->hi[i]);
    }
}

static void bounds_update(struct imp_scene *scene)
{
    struct imp_group *world = scene->world;
    scene->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    scene->hi = -scene->lo;
    for (int k = 0; k < imp__shapes_outside(scene); k++)
        box_add(scene, scene->shapes[k]->lo, scene->shapes[k]->hi);
    for (int k = 0; world && k < world->n_instances; k++) {
        imp_v3 lo, hi;
        imp__instance_box(&world->instance[k], &lo, &hi);
        box_add(scene, lo, hi);
    }
    scene->lo[3] = scene->hi[3] = 0;
    if (world) {
        world->lo = scene->lo;
        world->hi = scene->hi;
    }
    scene->ball = imp__ball_around(scene);
}

/* Triangles of a mesh whose vertices are set singly. */
static enum imp_status folds_refuse(const struct imp_pose *p)
{
    const struct imp_pose *vertices = imp__pose_beside(p, IMP_POSE_VERTICES);
    const char *why = NULL;
    size_t triangle = 0;
    if (!vertices || !p->positions) return IMP_OK;
    IMP_CHECKED(imp__mesh_folds(p->scene, &p->scene->shapes[p->shape]->triangles,
                                p->positions, &triangle, &why));
    return why ? imp__error(p->scene->ctx, IMP_E_NUMERIC,
                            "%s makes triangle %zu of the shape %s",
                            p->scene->params[vertices->param].info.name, triangle, why)
               : IMP_OK;
}

static bool is_finite(const struct imp_shape *s)
{
    const imp_v3 size = s->hi - s->lo;
    return isfinite(size[0]) && isfinite(size[1]) && isfinite(size[2]);
}

static bool normals_are_directions(const struct imp_pose *p)
{
    for (size_t k = 0; k < p->n; k += 3) {
        const double length = imp__length(imp__v3(
            (float)p->number[k], (float)p->number[k + 1], (float)p->number[k + 2]));
        if (!(length > 0) || !isfinite(length)) return false;
    }
    return true;
}

void imp__pose_changed(void *payload)
{
    struct imp_pose *p = payload;
    p->object->due = true;
    p->scene->moved = true;
}

enum imp_status imp__poses_settle(struct imp_scene *scene)
{
    if (imp_likely(!scene->moved)) return IMP_OK;
    for (struct imp_pose *p = scene->poses; p; p = p->next) {
        if (!p->due) continue;
        imp_v3 lo, hi;
        scene->reshaped |= imp__pose_box(p, &lo, &hi);
        const char *wrong = NULL;
        const enum imp_status st = pose_apply(p);
        if (st != IMP_OK) {
            p->due = true;
            return st;
        }
        if (p->shape >= 0 && !is_finite(scene->shapes[p->shape]))
            wrong = "moves the shape beyond what numbers hold";
        if (p->kind == IMP_POSE_NORMALS && !normals_are_directions(p))
            wrong = "holds a normal without a direction";
        if (imp__pose_is_round(p->kind) && !(scene->shapes[p->shape]->area > 0))
            wrong = "makes the shape vanish";
        const struct imp_pose *to = imp__pose_beside(p, IMP_POSE_DIRECTION);
        if (to &&
            !(imp__length(imp__v3(to->number[0], to->number[1], to->number[2])) > 0))
            wrong = "is no direction";
        if (!wrong && p->shape >= 0) {
            const enum imp_status folds = folds_refuse(p);
            if (folds == IMP_OK) continue;
            p->due = true;
            return folds;
        }
        if (!wrong) continue;
        p->due = true;
        return imp__error(scene->ctx, IMP_E_NUMERIC, "%s %s",
                          scene->params[to ? to->param : p->param].info.name, wrong);
    }
    if (scene->reshaped) {
        bounds_update(scene);
        const enum imp_status st = imp__intersector_renew(scene);
        if (st != IMP_OK) return st;
    }
    imp__sealed_renew(scene);
    scene->moved = scene->reshaped = false;
    return IMP_OK;
}
