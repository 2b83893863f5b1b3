/* SPDX-License-Identifier: Apache-2.0
 *
 * A thin lens: rays of one film position start anywhere on the aperture and meet where
 * the pinhole's ray reaches z = focus_distance (docs/scene-format.md 9). */
#include "base/required.h"
#include "math/warp.h"
#include "projection.h"

struct thinlens {
    struct imp_projection projection;
    double aperture_radius;
    struct imp_film_plane film; /* the pinhole's directions */
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s)
{
    enum imp_status st = IMP_OK;
    struct thinlens *p = self;

    IMP_TRY(imp__projection_build(b, true, &p->projection));
    IMP_TRY(imp__film_plane_build(b, false, &s->film, &p->film));
    if (!imp_build_has(b, "aperture_radius"))
        IMP_TRY(imp__node_missing(b->ctx, b->node, "aperture_radius"));
    IMP_TRY(imp__props_float_in(b->ctx, b->node, "aperture_radius", 0, IMP_NOT_NEGATIVE,
                                &p->aperture_radius));
out:
    return st;
}

static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    const struct thinlens *p = s->self;
    double xy[2];
    imp__concentric_disk(lens, xy);
    const imp_v3 o = imp__v3(p->aperture_radius * xy[0], p->aperture_radius * xy[1], 0);
    const imp_v3 focus =
        imp__film_plane_at(&p->film, px, py) * p->projection.focus_distance;
    imp__projection_ray(&p->projection, o, focus - o, out);
}

static bool connect(const struct imp_sensor *s, const imp_v3 *ref, bool far,
                    const double u[4], struct imp_sensor_sample *out)
{
    const struct thinlens *p = s->self;
    double xy[2];
    imp__concentric_disk(u, xy);
    const imp_v3 o = imp__v3(p->aperture_radius * xy[0], p->aperture_radius * xy[1], 0);
    return imp__projection_connect(&p->projection, &p->film, o,
                                   p->projection.focus_distance, *ref, far, out);
}

const struct imp_sensor_ops imp__thinlens = {.size = sizeof(struct imp_sensor_ops),
                                             .name = "thinlens",
                                             .object_size = sizeof(struct thinlens),
                                             .build = build,
                                             .ray = ray,
                                             .connect = connect};
