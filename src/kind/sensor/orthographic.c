/* SPDX-License-Identifier: Apache-2.0
 *
 * Parallel rays along +z from (1 - 2 px/W, (1 - 2 py/H)/a, near): the picture spans [-1,
 * 1] across, and to_world may scale that (docs/scene-format.md 9). */
#include "projection.h"

struct orthographic {
    struct imp_projection projection;
    double dx, y0, dy; /* start at (1 + px dx, y0 + py dy) */
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s)
{
    struct orthographic *p = self;
    const double w = s->film.width, h = s->film.height;
    p->dx = -2 / w;
    p->y0 = h / w;
    p->dy = -2 / w;
    return imp__projection_build(b, false, &p->projection);
}

static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    (void)lens;
    const struct orthographic *p = s->self;
    imp__projection_ray(&p->projection, imp__v3(1 + px * p->dx, p->y0 + py * p->dy, 0),
                        imp__v3(0, 0, 1), out);
}

/* Film area over area across the rays. */
static bool connect(const struct imp_sensor *s, const imp_v3 *ref, bool far,
                    const double u[4], struct imp_sensor_sample *out)
{
    (void)u;
    const struct orthographic *p = s->self;
    const struct imp_projection *j = &p->projection;
    if (far) return false;
    const imp_v3 q = imp__point(&j->to_local, *ref);
    if (!(q[2] > j->near_clip && q[2] < j->far_clip)) return false;
    const imp_v3 x = imp__vector(&j->to_world, imp__v3(1, 0, 0));
    const imp_v3 y = imp__vector(&j->to_world, imp__v3(0, 1, 0));
    const imp_v3 d = imp__normalize(imp__vector(&j->to_world, imp__v3(0, 0, 1)));
    const double across = fabs(imp__dot(imp__cross(x, y), d));
    *out = (struct imp_sensor_sample){
        .wo = -d,
        .p = imp__point(&j->to_world, imp__v3(q[0], q[1], j->near_clip)),
        .px = (q[0] - 1) / p->dx,
        .py = (q[1] - p->y0) / p->dy,
        .weight = 1 / (fabs(p->dx * p->dy) * across),
        .cos_sensor = 1};
    out->dist = imp__length(out->p - *ref);
    return true;
}

static void move(struct imp_sensor *s, const double to_world[12])
{
    struct orthographic *p = s->self;
    imp__projection_move(&p->projection, to_world);
}

static bool placed(struct imp_sensor *s, double to_world[12], bool set)
{
    struct orthographic *p = s->self;
    return imp__projection_placed(&p->projection, false, to_world, set);
}

const struct imp_sensor_ops imp__orthographic = {.size = sizeof(struct imp_sensor_ops),
                                                 .name = "orthographic",
                                                 .object_size =
                                                     sizeof(struct orthographic),
                                                 .build = build,
                                                 .ray = ray,
                                                 .flags = IMP_SENSOR_PARALLEL,
                                                 .connect = connect,
                                                 .move = move,
                                                 .placed = placed};
