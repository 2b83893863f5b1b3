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

const struct imp_sensor_ops imp__orthographic = {.size = sizeof(struct imp_sensor_ops),
                                                 .name = "orthographic",
                                                 .object_size =
                                                     sizeof(struct orthographic),
                                                 .build = build,
                                                 .ray = ray};
