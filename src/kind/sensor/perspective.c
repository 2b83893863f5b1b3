/* SPDX-License-Identifier: Apache-2.0
 *
 * A pinhole: the ray through film position (px, py) runs along (docs/scene-format.md 9)
 *
 *   (t (1 - 2X), (t/a)(1 - 2Y), 1),   X = px/W + offset_x,  Y = py/H + offset_y
 *
 * unless a lens distorts the picture. */
#include "kind/kind_lanes.h"
#include "projection.h"

struct perspective {
    struct imp_projection projection;
    struct imp_film_plane film;
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s)
{
    enum imp_status st = IMP_OK;
    struct perspective *p = self;

    IMP_TRY(imp__projection_build(b, true, &p->projection));
    IMP_TRY(imp__film_plane_build(b, true, &s->film, &p->film));
out:
    return st;
}

static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    (void)lens;
    const struct perspective *p = s->self;
    imp__projection_ray(&p->projection, imp__v3(0, 0, 0),
                        imp__film_plane_at(&p->film, px, py), out);
}

static bool connect(const struct imp_sensor *s, const imp_v3 *ref, bool far,
                    const double u[4], struct imp_sensor_sample *out)
{
    (void)u;
    const struct perspective *p = s->self;
    return imp__projection_connect(&p->projection, &p->film, imp__v3(0, 0, 0), 1, *ref,
                                   far, out);
}

static void move(struct imp_sensor *s, const double to_world[12])
{
    struct perspective *p = s->self;
    imp__projection_move(&p->projection, to_world);
}

static bool placed(struct imp_sensor *s, double to_world[12], bool set)
{
    struct perspective *p = s->self;
    return imp__projection_placed(&p->projection, true, to_world, set);
}

static bool view(struct imp_sensor *s, double number[IMP_VIEW_NUMBERS], bool set)
{
    struct perspective *p = s->self;
    return imp__film_plane_view(&p->film, number, set);
}

static void view_velocity(const struct imp_sensor *s, int k, const imp_v3 *r, imp_v3 *out)
{
    const struct perspective *p = s->self;
    const imp_v3 q = imp__vector(&p->projection.to_local, *r);
    const double at[2] = {q[0] / q[2], q[1] / q[2]};
    double v[2];
    imp__film_plane_velocity(&p->film, k, at, v);
    *out = imp__vector(&p->projection.to_world, imp__v3(v[0] * q[2], v[1] * q[2], 0));
}

const struct imp_sensor_ops imp__perspective = {.size = sizeof(struct imp_sensor_ops),
                                                .name = "perspective",
                                                .object_size = sizeof(struct perspective),
                                                .flags = IMP_SENSOR_PINHOLE,
                                                .build = build,
                                                .ray = ray,
                                                .connect = connect,
                                                .move = move,
                                                .view = view,
                                                .view_velocity = view_velocity,
                                                .placed = placed};

/* ---- In lanes: without a lens ------------------------------------------------------------- */

static bool covers(const struct imp_sensor *s)
{
    return !((const struct perspective *)s->self)->film.lens;
}

static imp_wide3 vectors(const double m[16], imp_wide3 v)
{
    return (imp_wide3){m[0] * v.x + m[1] * v.y + m[2] * v.z,
                       m[4] * v.x + m[5] * v.y + m[6] * v.z,
                       m[8] * v.x + m[9] * v.y + m[10] * v.z};
}
static imp_wide3 points(const double m[16], imp_wide3 v)
{
    return (imp_wide3){m[0] * v.x + m[1] * v.y + m[2] * v.z + m[3],
                       m[4] * v.x + m[5] * v.y + m[6] * v.z + m[7],
                       m[8] * v.x + m[9] * v.y + m[10] * v.z + m[11]};
}

static void rays(const struct imp_sensor *s, imp_wide px, imp_wide py,
                 struct imp_wide_ray *out)
{
    const struct perspective *p = s->self;
    const double *m = p->projection.to_world.m, near = p->projection.near_clip;
    const imp_wide3 v = {p->film.x0 + px * p->film.dx, p->film.y0 + py * p->film.dy,
                         imp__wide(1)};
    const imp_wide3 d = vectors(m, v), begin = imp__wide3_times(v, imp__wide(near));
    const imp_wide length = imp__wide3_norm(d), zero = imp__wide(0);
    out->o = points(m, (imp_wide3){zero + begin.x, zero + begin.y, zero + begin.z});
    out->d = imp__wide3_times(d, 1 / length);
    out->near = zero;
    out->far = (p->projection.far_clip - near) * length;
}

/* imp__projection_connect. */
static void connects(const struct imp_sensor *s, const imp_wide3 *ref,
                     struct imp_wide_seen *out)
{
    const struct perspective *p = s->self;
    const struct imp_film_plane *film = &p->film;
    const imp_wide zero = imp__wide(0);
    const imp_wide3 q = points(p->projection.to_local.m, *ref);
    out->drawn = (q.z > imp__wide(p->projection.near_clip)) &
                 (q.z < imp__wide(p->projection.far_clip)) &
                 ~(q.x < film->x_least * q.z) & ~(q.x > film->x_most * q.z) &
                 ~(q.y < film->y_least * q.z) & ~(q.y > film->y_most * q.z);
    if (!imp__wide_bits(out->drawn)) return;
    const imp_wide3 v = imp__wide3_times(q, 1 / q.z);
    const imp_wide length = imp__wide3_norm(v);
    out->wo = imp__wide3_opposite(imp__wide3_unit(vectors(p->projection.to_world.m, v)));
    out->p = points(p->projection.to_world.m,
                    imp__wide3_times(v, imp__wide(p->projection.near_clip)));
    out->px = (zero + v.x - film->x0) / film->dx;
    out->py = (zero + v.y - film->y0) / film->dy;
    out->weight =
        length * length * length / (fabs(film->dx * film->dy) * imp__wide3_inner(q, q));
}

static const struct imp_sensor_lanes lanes = {
    .covers = covers, .ray = rays, .connect = connects};

const struct imp_sensor_lanes *imp__sensor_lanes(const struct imp_sensor *s)
{
    return s->ops == &imp__perspective && covers(s) ? &lanes : NULL;
}
