/* SPDX-License-Identifier: Apache-2.0
 *
 * A pinhole: the ray through film position (px, py) runs along (docs/scene-format.md 9)
 *
 *   (t (1 - 2X), (t/a)(1 - 2Y), 1),   X = px/W + offset_x,  Y = py/H + offset_y
 *
 * unless a lens distorts the picture. */
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
                                                .build = build,
                                                .ray = ray,
                                                .connect = connect,
                                                .move = move,
                                                .view = view,
                                                .view_velocity = view_velocity};
