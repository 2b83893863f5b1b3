/* SPDX-License-Identifier: Apache-2.0
 *
 * The radiance that leaves the scene against one direction, towards a sensor far away: the
 * mean over the cross section of the ball around the scene, or of one ray through
 * `target`. A film of more than one pixel is spread over the cross section. */
#include "kind/build.h"
#include "math/warp.h"
#include "projection.h"

struct distant {
    struct imp_frame frame; /* n: of its rays */
    imp_v3 target;
    bool aimed;
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s)
{
    enum imp_status st = IMP_OK;
    struct distant *p = self;
    struct imp_mat4 m, inverse;
    double d[3], target[3];

    if (imp_build_has(b, "direction") && imp_build_has(b, "to_world"))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "give direction or to_world, not both"));
    IMP_TRY(imp_build_vector(b, "direction", (double[3]){0, 0, 1}, d));
    IMP_TRY(imp__sensor_place(b, &m, &inverse));
    const imp_v3 n = imp__vector(&m, imp__v3(d[0], d[1], d[2]));
    const double length = imp__length(n);
    if (!(length > 0) || !isfinite(length))
        IMP_TRY(imp_build_error(b, "direction", IMP_E_SCENE,
                                "its direction has length %g", length));
    p->frame = imp__frame_from_normal(n * (1 / length));
    p->aimed = imp_build_has(b, "target");
    IMP_TRY(imp_build_vector(b, "target", (double[3]){0, 0, 0}, target));
    p->target = imp__v3(target[0], target[1], target[2]);
    if (p->aimed && (s->film.width != 1 || s->film.height != 1))
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "its film has %d x %d pixels; with a target it measures "
                                "one ray: 1 x 1",
                                s->film.width, s->film.height));
out:
    return st;
}

static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    (void)lens;
    const struct distant *p = s->self;
    const struct imp_frame *f = &p->frame;
    const struct imp_ball *ball = s->scene;
    double xy[2];
    imp__concentric_disk((double[2]){px / s->film.width, py / s->film.height}, xy);
    out->d = f->n;
    out->o = p->aimed
                 ? p->target - f->n * (2 * ball->radius)
                 : ball->centre + (f->s * xy[0] + f->t * xy[1] - f->n) * ball->radius;
    out->t_near = 0;
    out->t_far = INFINITY;
}

static bool connect(const struct imp_sensor *s, const imp_v3 *ref, bool far,
                    const double u[4], struct imp_sensor_sample *out)
{
    (void)u;
    const struct distant *p = s->self;
    const struct imp_ball *ball = s->scene;
    const double R = ball->radius;
    if (p->aimed || far || !(R > 0)) return false;
    const imp_v3 q = imp__to_local(&p->frame, (*ref - ball->centre) * (1 / R));
    double w[2];
    if (!(q[0] * q[0] + q[1] * q[1] <= 1)) return false;
    imp__concentric_disk_inverse((double[2]){q[0], q[1]}, w);
    *out = (struct imp_sensor_sample){.wo = -p->frame.n,
                                      .p = *ref - p->frame.n * ((q[2] + 1) * R),
                                      .dist = (q[2] + 1) * R,
                                      .px = w[0] * s->film.width,
                                      .py = w[1] * s->film.height,
                                      .weight = (double)s->film.width * s->film.height /
                                                (IMP_PI * R * R),
                                      .cos_sensor = 1};
    return true;
}

static void move(struct imp_sensor *s, const double to_world[12])
{
    struct distant *p = s->self;
    p->frame = (struct imp_frame){imp__rows_vector(to_world, p->frame.s),
                                  imp__rows_vector(to_world, p->frame.t),
                                  imp__rows_vector(to_world, p->frame.n)};
}

const struct imp_sensor_ops imp__distant = {.size = sizeof(struct imp_sensor_ops),
                                            .name = "distant",
                                            .object_size = sizeof(struct distant),
                                            .build = build,
                                            .ray = ray,
                                            .flags = IMP_SENSOR_PARALLEL,
                                            .connect = connect,
                                            .move = move};
