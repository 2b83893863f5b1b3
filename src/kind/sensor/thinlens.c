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

static void move(struct imp_sensor *s, const double to_world[12])
{
    struct thinlens *p = s->self;
    imp__projection_move(&p->projection, to_world);
}

static bool placed(struct imp_sensor *s, double to_world[12], bool set)
{
    struct thinlens *p = s->self;
    return imp__projection_placed(&p->projection, true, to_world, set);
}

enum { APERTURE = 8, FOCUS };

static bool view(struct imp_sensor *s, double number[IMP_VIEW_NUMBERS], bool set)
{
    struct thinlens *p = s->self;
    if (set) {
        p->aperture_radius = number[APERTURE];
        p->projection.focus_distance = number[FOCUS];
    } else {
        number[APERTURE] = p->aperture_radius;
        number[FOCUS] = p->projection.focus_distance;
    }
    return imp__film_plane_view(&p->film, number, set);
}

/* A ray goes from o, a times a point of the unit disk, through F = f v, v by the film position alone.
 * At the depth z it is at  o (1 - z/f) + z v. */
static void lens_velocity(const struct imp_sensor *s, int k, const imp_v3 *r,
                          const imp_v3 *other, imp_v3 *out)
{
    const struct thinlens *p = s->self;
    const imp_v3 q = imp__vector(&p->projection.to_local, *r),
                 on = imp__vector(&p->projection.to_local, *other);
    const imp_v3 o = q - (q - on) * (q[2] / (q[2] - on[2]));
    const double z = q[2], f = p->projection.focus_distance, left = 1 - z / f;
    imp_v3 u = {0};
    if (k == APERTURE) {
        if (p->aperture_radius > 0) u = o * (left / p->aperture_radius);
    } else if (k == FOCUS) {
        u = o * (z / (f * f));
    } else if (z != 0) {
        const double at[2] = {(q[0] - o[0] * left) / z, (q[1] - o[1] * left) / z};
        double v[2];
        imp__film_plane_velocity(&p->film, k, at, v);
        u = imp__v3(v[0] * z, v[1] * z, 0);
    }
    *out = imp__vector(&p->projection.to_world, u);
}

const struct imp_sensor_ops imp__thinlens = {.size = sizeof(struct imp_sensor_ops),
                                             .name = "thinlens",
                                             .object_size = sizeof(struct thinlens),
                                             .build = build,
                                             .ray = ray,
                                             .connect = connect,
                                             .move = move,
                                             .view = view,
                                             .lens_velocity = lens_velocity,
                                             .placed = placed};
