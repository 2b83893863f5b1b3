/* SPDX-License-Identifier: Apache-2.0
 *
 * Surfaces that see from one side of them and are no surfaces to light: the near plane of a camera, and a
 * meter that is absent. What moves through one is cut by it, along a line that is no edge of anything:
 * refused by name. */
#include "base/arguments.h"
#include "boundary_allowed.h"
#include "kind/sensor/receiver.h"

enum { CORNERS = 4 };
/* A convex polygon in a plane, of 3 or 4 corners in order. */
struct cut {
    imp_v3 p[CORNERS], n;
    int corners;
};

static struct cut cut_of(const imp_v3 *p, int corners)
{
    struct cut cut = {.corners = corners};
    for (int k = 0; k < corners; k++) cut.p[k] = p[k];
    cut.n = imp__normalize(imp__cross(p[1] - p[0], p[2] - p[0]));
    return cut;
}

/* Does the segment, which lies in the plane, have a part inside the polygon? */
static bool segment_meets(const struct cut *cut, imp_v3 a, imp_v3 b, double apart)
{
    double from = 0, to = 1;
    for (int k = 0; k < cut->corners; k++) {
        const imp_v3 at = cut->p[k], in = imp__normalize(imp__cross(
                                         cut->n, cut->p[(k + 1) % cut->corners] - at));
        const double da = imp__dot(a - at, in) - apart, db = imp__dot(b - at, in) - apart;
        if (da < 0 && db < 0) return false;
        if (da < 0) from = imp_max(from, da / (da - db));
        if (db < 0) to = imp_min(to, da / (da - db));
    }
    return from < to;
}

/* Does the polygon cut this triangle? What lies in its plane, or ends there, is not cut. */
static bool triangle_cut(const struct cut *cut, const imp_v3 p[3], double apart)
{
    double off[3];
    imp_v3 end[3];
    int n = 0;
    for (int k = 0; k < 3; k++) {
        off[k] = imp__dot(p[k] - cut->p[0], cut->n);
        if (fabs(off[k]) < apart) off[k] = 0;
    }
    for (int k = 0; k < 3; k++) {
        const int next = (k + 1) % 3;
        if (off[k] * off[next] < 0)
            end[n++] = p[k] + (p[next] - p[k]) * (off[k] / (off[k] - off[next]));
    }
    for (int k = 0; k < 3 && n == 1; k++)
        if (off[k] == 0) end[n++] = p[k];
    return n == 2 && segment_meets(cut, end[0], end[1], apart);
}

/* The box of a body that has no triangles, as twelve. */
static bool box_cut(const struct cut *cut, const imp_v3 lo_hi[2], double apart)
{
    for (int axis = 0; axis < 3; axis++)
        for (int side = 0; side < 2; side++) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            imp_v3 p[4];
            for (int k = 0; k < 4; k++) {
                p[k][axis] = lo_hi[side][axis];
                p[k][u] = lo_hi[k == 1 || k == 2][u];
                p[k][v] = lo_hi[k >= 2][v];
            }
            if (triangle_cut(cut, (const imp_v3[]){p[0], p[1], p[2]}, apart) ||
                triangle_cut(cut, (const imp_v3[]){p[0], p[2], p[3]}, apart))
                return true;
        }
    return false;
}

static bool body_cut(const struct imp_scene *scene, const struct imp__body *body,
                     const struct cut *cut)
{
    const struct imp_shape *s = scene->shapes[body->shape];
    const double apart = 1e-6 * imp__length(scene->hi - scene->lo);
    if (s->geometry != IMP_TRIANGLES) {
        imp_v3 box[2] = {s->lo, s->hi};
        struct imp_map map[2];
        if (body->place != 0) {
            imp__place_map(scene, body->place, 0, &map[0], &map[1]);
            imp__map_box(&map[0], &box[0], &box[1]);
        }
        return box_cut(cut, box, apart);
    }
    for (size_t k = 0; k < s->triangles.n_triangles; k++) {
        const struct imp__corners f =
            imp__corners(scene, body->shape, (int)k, body->place, 0);
        if (triangle_cut(cut, f.p, apart)) return true;
    }
    return false;
}

static enum imp_status cut_allowed(const struct imp__boundary *b, const struct cut *cut,
                                   bool moves, const char *what)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (size_t j = 0; j < b->edges->n_bodies; j++) {
        const struct imp__body *body = &b->edges->body[j];
        const int carrier = imp__carrier(scene, body->shape, body->place);
        if (!moves && !imp__moves_place(b->moves, carrier)) continue;
        if (!body_cut(scene, body, cut)) continue;
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "derivatives by what moves: shape '%s' passes through %s of "
                          "sensor '%s', which cuts it",
                          scene->shapes[body->shape]->name, what,
                          b->tracer->sensor->name);
    }
    return IMP_OK;
}

bool imp__near_plane(const struct imp_sensor *s, imp_v3 p[4])
{
    static const double lens[2] = {.5, .5};
    for (int k = 0; k < CORNERS; k++) {
        struct imp_sensor_ray ray;
        s->ops->ray(s, k == 1 || k == 2 ? s->film.width : 0, k >= 2 ? s->film.height : 0,
                    lens, &ray);
        p[k] = ray.o + ray.d * ray.t_near;
        if (!imp__is_finite(p[k])) return false;
    }
    return imp__length(imp__cross(p[1] - p[0], p[2] - p[0])) > 0;
}

enum imp_status imp__cuts_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_sensor *s = b->tracer->sensor;
    imp_v3 p[CORNERS];
    if (!s->shape) {
        if (b->rays || !imp__near_plane(s, p)) return IMP_OK;
        const struct cut cut = cut_of(p, CORNERS);
        return cut_allowed(b, &cut, imp__moves_shape(b->moves, IMP_MOVE_CAMERA, NULL),
                           "the near plane");
    }
    if (!imp__shape_is_absent(s->shape) || s->shape->geometry != IMP_TRIANGLES)
        return IMP_OK;
    int shape = 0;
    while (scene->shapes[shape] != s->shape) shape++;
    for (size_t k = 0; k < s->shape->triangles.n_triangles; k++) {
        const struct imp__corners f = imp__corners(scene, shape, (int)k, 0, 0);
        const struct cut cut = cut_of(f.p, 3);
        IMP_CHECKED(
            cut_allowed(b, &cut, imp__moves_place(b->moves, shape), "the surface"));
    }
    return IMP_OK;
}
