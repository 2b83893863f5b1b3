/* SPDX-License-Identifier: Apache-2.0
 *
 * Edges of instances that move in time (edges.h). A rigid motion keeps lengths, and angles between faces, so
 * that edges are listed at time 0 and mapped to the time of a draw. Two bodies in relative motion must not
 * intersect while the shutter is open, since their line of intersection is an edge at some times alone:
 * swept bounding boxes of short intervals are tested. */
#include "base/context.h"
#include "edges.h"

void imp__clock_map(const struct imp_scene *scene, int instance, double time,
                    struct imp_map *there, struct imp_map *back)
{
    const struct imp_motion *m = scene->world->instance[instance].motion;
    struct imp_map at[2], now[2];
    imp__motion_at(m, 0, &at[0], &at[1]);
    imp__motion_at(m, time, &now[0], &now[1]);
    *there = imp__map_product(&now[0], &at[1]);
    *back = imp__map_product(&at[0], &now[1]);
}

void imp__edge_timed(const struct imp__edges *edges, const struct imp_map *there,
                     const struct imp__edge *e, struct imp__edge *out,
                     struct imp__edge_face *faces)
{
    *out = *e;
    out->a = imp__map_point(there, e->a);
    out->b = imp__map_point(there, e->b);
    out->first = 0;
    for (int k = 0; k < e->n_faces; k++) {
        faces[k] = edges->face[e->first + (size_t)k];
        faces[k].in = imp__normalize(imp__map_vector(there, faces[k].in));
        faces[k].n = imp__normalize(imp__map_vector(there, faces[k].n));
    }
}

/* ---- What is refused ----------------------------------------------------------------- */

static enum imp_status refuse(const struct imp_scene *scene, int shape, const char *why)
{
    return imp__error(
        scene->ctx, IMP_E_UNSUPPORTED,
        "derivatives by what moves: shape '%s' is in an instance that moves "
        "in time, and %s",
        scene->shapes[shape]->name, why);
}

#define HALF_TURN 1e-6 /* so near to half a turn, rounding chooses the way */

/* Why a body in an instance that moves in time has no edges there; NULL: it has. */
static const char *body_why(const struct imp_scene *scene, const struct imp__body *body,
                            int clock)
{
    const struct imp_shape *s = scene->shapes[body->shape];
    if (!imp__motion_is_rigid(scene->world->instance[clock].motion))
        return "is stretched by its motion";
    if (scene->world->instance[clock].motion->angle > IMP_PI - HALF_TURN)
        return "makes half a turn, which has two ways";
    if (s->geometry != IMP_TRIANGLES) return "is not made of triangles";
    if (s->smooth) return "has vertex normals (face_normals makes it flat)";
    return NULL;
}

enum imp_status imp__clocks_allowed(const struct imp__edges *edges,
                                    const struct imp_scene *scene)
{
    for (size_t k = 0; k < edges->n_bodies; k++) {
        const int clock = imp__place_clock(scene, edges->body[k].place);
        const char *why = clock < 0 ? NULL : body_why(scene, &edges->body[k], clock);
        if (why) return refuse(scene, edges->body[k].shape, why);
    }
    for (size_t k = 0; k < edges->n + edges->n_laid; k++) {
        const struct imp__edge *e =
            k < edges->n ? &edges->edge[k] : &edges->laid[k - edges->n];
        const struct imp__edge_face *f = &edges->face[e->first];
        const int clock = imp__place_clock(scene, f->place);
        for (int j = 1; j < e->n_faces; j++)
            if (imp__place_clock(scene, f[j].place) != clock)
                return refuse(scene, f[clock < 0 ? j : 0].shape,
                              "touches what does not move with it");
    }
    return IMP_OK;
}

/* ---- What is swept ------------------------------------------------------------------- */

#define SLICES 64   /* times at which a motion is looked at */
#define APART  1e-5 /* of the scene's size: boxes nearer to each other meet */

struct box {
    imp_v3 lo, hi;
};

static bool boxes_meet(const struct box *a, const struct box *b)
{
    for (int i = 0; i < 3; i++)
        if (!(a->lo[i] <= b->hi[i] && b->lo[i] <= a->hi[i])) return false;
    return true;
}

/* The box of a shape in the world, or, of what moves in time, in the space of its instance's group. */
static struct box rest_box(const struct imp_scene *scene, const struct imp__body *body,
                           int clock)
{
    const struct imp_shape *s = scene->shapes[body->shape];
    struct box box = {s->lo, s->hi};
    struct imp_map map[2];
    if (body->place == 0) return box;
    imp__place_map(scene, body->place, 0, &map[0], &map[1]);
    if (clock >= 0) {
        struct imp_map at[2];
        imp__motion_at(scene->world->instance[clock].motion, 0, &at[0], &at[1]);
        map[0] = imp__map_product(&at[1], &map[0]);
    }
    imp__map_box(&map[0], &box.lo, &box.hi);
    return box;
}

/* What a body covers between two times; apart: what is added on all sides. */
static struct box swept_box(const struct imp_scene *scene, const struct imp__body *body,
                            const double time[2], double apart)
{
    const int clock = imp__place_clock(scene, body->place);
    struct box box = rest_box(scene, body, clock);
    if (clock >= 0) {
        const struct imp_motion *whole = scene->world->instance[clock].motion;
        struct imp_map at[2], unused;
        struct imp_motion part;
        for (int k = 0; k < 2; k++) imp__motion_at(whole, time[k], &at[k], &unused);
        imp__motion_make(&at[0], &at[1], time[0], time[1], &part);
        imp__motion_box(&part, &box.lo, &box.hi);
    }
    const imp_v3 more = imp__v3(apart, apart, apart);
    return (struct box){box.lo - more, box.hi + more};
}

/* Is a triangle beside the box: by the axes, or on one side of its plane? */
static bool triangle_meets(const struct imp__corners *f, const struct box *box)
{
    struct box own = {f->p[0], f->p[0]};
    for (int k = 1; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            own.lo[i] = imp_min(own.lo[i], f->p[k][i]);
            own.hi[i] = imp_max(own.hi[i], f->p[k][i]);
        }
    if (!boxes_meet(&own, box)) return false;
    const imp_v3 n = imp__cross(f->p[1] - f->p[0], f->p[2] - f->p[0]),
                 half = (box->hi - box->lo) * 0.5;
    const double reach = imp__dot(imp__abs(n), half),
                 off = imp__dot(n, (box->lo + box->hi) * 0.5 - f->p[0]);
    return fabs(off) <= reach;
}

static bool body_meets(const struct imp_scene *scene, const struct imp__body *body,
                       const struct box *box)
{
    const struct imp_shape *s = scene->shapes[body->shape];
    if (s->geometry != IMP_TRIANGLES) return true;
    for (size_t k = 0; k < s->triangles.n_triangles; k++) {
        const struct imp__corners f =
            imp__corners(scene, body->shape, (int)k, body->place, 0);
        if (triangle_meets(&f, box)) return true;
    }
    return false;
}

/* Does body k, which moves in time, meet that between these times? */
static int slice_meets(const struct imp__edges *edges, const struct imp_scene *scene,
                       size_t k, const double time[2], const imp_v3 *beside, int *other)
{
    const double apart = APART * imp__length(scene->hi - scene->lo);
    const struct imp__body *own = &edges->body[k];
    const int clock = imp__place_clock(scene, own->place);
    const struct box box = swept_box(scene, own, time, apart);
    if (beside)
        return boxes_meet(&box, &(struct box){beside[0], beside[1]}) ? own->shape : -1;
    for (size_t j = 0; j < edges->n_bodies; j++) {
        const struct imp__body *body = &edges->body[j];
        const int its = imp__place_clock(scene, body->place);
        if (its == clock || (its >= 0 && j < k)) continue;
        const struct box there = swept_box(scene, body, time, 0);
        if (!boxes_meet(&box, &there) || (its < 0 && !body_meets(scene, body, &box)))
            continue;
        *other = body->shape;
        return own->shape;
    }
    return -1;
}

int imp__clocks_meet(const struct imp__edges *edges, const struct imp_scene *scene,
                     const double time[2], const imp_v3 *box, int *other)
{
    for (size_t k = 0; k < edges->n_bodies; k++) {
        if (imp__place_clock(scene, edges->body[k].place) < 0) continue;
        for (int i = 0; i < SLICES; i++) {
            const double step = (time[1] - time[0]) / SLICES,
                         slice[2] = {time[0] + i * step, time[0] + (i + 1) * step};
            const int met = slice_meets(edges, scene, k, slice, box, other);
            if (met >= 0) return met;
        }
    }
    return -1;
}
