/* SPDX-License-Identifier: Apache-2.0
 *
 * Poses of shapes and cameras as parameters (pose.h). An object is always moved from where the
 * file has it, so that nothing depends on the order in which poses were set. */
#include "pose.h"
#include "access.h"
#include "base/arguments.h"
#include "kind/shape/shape.h"
#include "math/motion.h"
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

static struct imp_map map_of(const struct imp_pose *p)
{
    struct imp_map out;
    double R[9];
    imp__rotation_of(p->number + 3, R);
    for (int i = 0; i < 3; i++) {
        double shift = p->centre[i] + p->number[i];
        for (int j = 0; j < 3; j++) {
            out.m[4 * i + j] = R[3 * i + j];
            shift -= R[3 * i + j] * p->centre[j];
        }
        out.m[4 * i + 3] = shift;
    }
    return out;
}

static void pose_apply(struct imp_pose *p)
{
    const struct imp_map map = map_of(p);
    const double *number = p->number;
    bool rests = true;
    for (int k = 0; k < 6; k++) rests &= number[k] == 0;
    p->due = false;
    if (p->sensor) {
        memcpy(p->sensor->self, p->rest, p->rest_size);
        if (!rests) p->sensor->ops->move(p->sensor, map.m);
        return;
    }
    struct imp_shape *s = p->scene->shapes[p->shape];
    const size_t n = 3 * s->triangles.n_vertices;
    memcpy(s->self, p->rest, p->rest_size);
    if (p->positions)
        memcpy((float *)(uintptr_t)s->triangles.positions, p->positions,
               n * sizeof *p->positions);
    if (p->normals)
        memcpy((float *)(uintptr_t)((struct imp__mesh *)s->self)->normals, p->normals,
               n * sizeof *p->normals);
    s->ops->move(s, map.m); /* also at rest: frames of facets and the box follow */
}

static void bounds_update(struct imp_scene *scene)
{
    scene->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    scene->hi = -scene->lo;
    for (int k = 0; k < scene->n_shapes; k++)
        for (int i = 0; i < 3; i++) {
            scene->lo[i] = fmin(scene->lo[i], scene->shapes[k]->lo[i]);
            scene->hi[i] = fmax(scene->hi[i], scene->shapes[k]->hi[i]);
        }
    scene->lo[3] = scene->hi[3] = 0;
    scene->ball = imp__ball_around(scene);
}

static bool is_finite(const struct imp_shape *s)
{
    const imp_v3 size = s->hi - s->lo;
    return isfinite(size[0]) && isfinite(size[1]) && isfinite(size[2]);
}

static void pose_changed(void *payload)
{
    struct imp_pose *p = payload;
    p->due = true;
    p->scene->moved = true;
}

enum imp_status imp__poses_settle(struct imp_scene *scene)
{
    if (imp_likely(!scene->moved)) return IMP_OK;
    for (struct imp_pose *p = scene->poses; p; p = p->next) {
        if (!p->due) continue;
        scene->reshaped |= !p->sensor;
        pose_apply(p);
        if (!p->sensor && !is_finite(scene->shapes[p->shape]))
            return imp__error(scene->ctx, IMP_E_NUMERIC,
                              "%s moves the shape beyond what numbers hold",
                              scene->params[p->param].info.name);
    }
    if (scene->reshaped) {
        bounds_update(scene);
        imp__intersector_destroy(scene);
        const enum imp_status st = imp__intersector_create(scene);
        if (st != IMP_OK) return st;
    }
    scene->moved = scene->reshaped = false;
    return IMP_OK;
}

/* ---- Cameras ------------------------------------------------------------------------ */

/* By the rays through two corners of the film, and one through another point of the lens. */
bool imp__pinhole(const struct imp_sensor *s, imp_v3 *centre)
{
    const double w = s->film.width, h = s->film.height, lens[2] = {0.3, 0.8};
    struct imp_sensor_ray a, b;
    if (!s->ops->ray || s->shape) return false;
    s->ops->ray(s, 0, 0, lens, &a);
    s->ops->ray(s, w, h, lens, &b);
    const imp_v3 d = b.o - a.o, n = imp__cross(a.d, b.d);
    const double n2 = imp__dot(n, n), size = imp__length(d) + imp__length(a.o);
    if (!(n2 > 1e-20)) return false;
    const double ta = imp__dot(imp__cross(d, b.d), n) / n2,
                 tb = imp__dot(imp__cross(d, a.d), n) / n2;
    *centre = a.o + a.d * ta;
    const imp_v3 other = b.o + b.d * tb;
    struct imp_sensor_ray elsewhere; /* through another point of the lens */
    s->ops->ray(s, 0, 0, (const double[2]){0.9, 0.1}, &elsewhere);
    const imp_v3 apart = imp__cross(elsewhere.o - *centre, elsewhere.d);
    return imp__length(other - *centre) <= 1e-7 * size &&
           imp__length(apart) <= 1e-7 * size;
}

/* ---- Adding ------------------------------------------------------------------------- */

static enum imp_status refuse(const struct imp_scene *scene, const char *name,
                              const char *why)
{
    return imp__error(scene->ctx, IMP_E_UNSUPPORTED, "'%s' has no pose: %s", name, why);
}

/* What else is made from where shapes are, and is not made again. */
static enum imp_status shape_allowed(const struct imp_scene *scene,
                                     const struct imp_shape *s)
{
    if (!s->ops->move || s->geometry != IMP_TRIANGLES)
        return refuse(scene, s->name, "it is not made of triangles");
    if (scene->world) return refuse(scene, s->name, "the scene has instances");
    if (scene->n_media + scene->n_bodies > 0 || scene->priorities)
        return refuse(scene, s->name, "there are media");
    if (scene->light_tree)
        return refuse(scene, s->name, "lights are chosen by a tree (light_choice)");
    if (scene->aims.aimed)
        return refuse(scene, s->name, "directions are aimed at shapes");
    if (s->placed || s->by_triangle)
        return refuse(scene, s->name, "its textures need more than uv");
    return IMP_OK;
}

static enum imp_status object_find(struct imp_scene *scene, const char *name,
                                   struct imp_pose *p)
{
    for (int k = 0; k < scene->n_shapes; k++)
        if (strcmp(scene->shapes[k]->name, name) == 0) {
            const struct imp_shape *s = scene->shapes[k];
            p->shape = k;
            p->centre = (s->lo + s->hi) * 0.5;
            p->rest_size = s->ops->object_size;
            return shape_allowed(scene, s);
        }
    for (int k = 0; k < scene->n_sensors; k++)
        if (strcmp(scene->sensors[k]->name, name) == 0) {
            p->sensor = scene->sensors[k];
            p->rest_size = p->sensor->ops->object_size;
            if (!p->sensor->ops->move)
                return refuse(scene, name, "it is no perspective camera");
            if (p->sensor->medium) return refuse(scene, name, "it is in a medium");
            return imp__pinhole(p->sensor, &p->centre)
                       ? IMP_OK
                       : refuse(scene, name, "its rays meet in no point");
        }
    return imp__error(scene->ctx, IMP_E_ARG, "there is no shape or camera '%s'", name);
}

static enum imp_status rest_keep(struct imp_scene *scene, struct imp_pose *p)
{
    p->rest = imp__arena_take(&scene->arena, 1, p->rest_size);
    if (!p->rest) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    if (p->sensor) {
        memcpy(p->rest, p->sensor->self, p->rest_size);
        return IMP_OK;
    }
    const struct imp_shape *s = scene->shapes[p->shape];
    memcpy(p->rest, s->self, p->rest_size);
    const struct imp_triangles *t = &s->triangles;
    const struct imp__mesh *m = s->ops->move == imp__mesh_move ? s->self : NULL;
    if (!m) return IMP_OK; /* its positions are in the object */
    const size_t n = 3 * t->n_vertices;
    p->positions = imp__arena_take(&scene->arena, n, sizeof *p->positions);
    if (m->normals) p->normals = imp__arena_take(&scene->arena, n, sizeof *p->normals);
    if (!p->positions || (m->normals && !p->normals))
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    memcpy(p->positions, t->positions, n * sizeof *p->positions);
    if (m->normals) memcpy(p->normals, m->normals, n * sizeof *p->normals);
    return IMP_OK;
}

static enum imp_status param_add(struct imp_scene *scene, const char *object,
                                 struct imp_pose *p)
{
    const size_t length = strlen(object);
    char *name = imp__arena_take(&scene->arena, length + sizeof ".pose", 1);
    if (!name) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    memcpy(name, object, length);
    memcpy(name + length, ".pose", sizeof ".pose");
    const struct imp_param param = {.info = {.size = sizeof param.info,
                                             .name = name,
                                             .unit = "scene units, radians",
                                             .dims = {6},
                                             .n_dims = 1,
                                             .lo = -INFINITY,
                                             .hi = INFINITY,
                                             .flags = IMP_PARAM_DIFFERENTIABLE},
                                    .store = IMP_STORE_DOUBLES,
                                    .degree = IMP_DEGREE_OTHER,
                                    .doubles = p->number};
    IMP_CHECKED(imp__theta_add(scene, &param, &p->param));
    imp__theta_finish(scene);
    return imp__theta_watch(scene, p->param, pose_changed, p);
}

enum imp_status imp_scene_add_pose(imp_scene *scene, const char *object)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, object, "object");
    IMP_SETS(scene, st);
    if (st != IMP_OK) return st;
    if (!scene->committed || scene->rayless)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "a pose needs a committed scene that has geometry");
    if (scene->in_problem)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "poses are added before the scene's first problem is created");
    struct imp_pose *p = imp__arena_array(&scene->arena, 1, sizeof *p);
    if (!p) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for a pose");
    p->scene = scene;
    p->shape = -1;
    IMP_CHECKED(object_find(scene, object, p));
    for (const struct imp_pose *q = scene->poses; q; q = q->next)
        if (q->shape == p->shape && q->sensor == p->sensor) return IMP_OK;
    IMP_CHECKED(rest_keep(scene, p));
    IMP_CHECKED(param_add(scene, object, p));
    struct imp_pose **end = &scene->poses;
    while (*end) end = &(*end)->next;
    *end = p;
    return IMP_OK;
}
