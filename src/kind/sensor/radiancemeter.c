/* SPDX-License-Identifier: Apache-2.0
 *
 * The radiance that arrives along one ray. */
#include "kind/build.h"
#include "projection.h"

struct radiancemeter {
    imp_v3 o, d;
};

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s)
{
    enum imp_status st = IMP_OK;
    struct radiancemeter *r = self;
    struct imp_mat4 m, inverse;
    double o[3], d[3];
    const bool by_ray = imp_build_has(b, "origin") || imp_build_has(b, "direction");

    if (s->film.width != 1 || s->film.height != 1)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "its film has %d x %d pixels; it measures one ray: 1 x 1",
                                s->film.width, s->film.height));
    if (by_ray && imp_build_has(b, "to_world"))
        IMP_TRY(imp_build_error(b, "to_world", IMP_E_SCENE,
                                "give origin and direction, or to_world, not both"));
    if (by_ray && !(imp_build_has(b, "origin") && imp_build_has(b, "direction")))
        IMP_TRY(imp_build_error(b, imp_build_has(b, "origin") ? "origin" : "direction",
                                IMP_E_SCENE,
                                "give both origin and direction, or to_world"));
    IMP_TRY(imp_build_vector(b, "origin", (double[3]){0, 0, 0}, o));
    IMP_TRY(imp_build_vector(b, "direction", (double[3]){0, 0, 1}, d));
    IMP_TRY(imp__sensor_place(b, &m, &inverse));
    r->o = imp__point(&m, imp__v3(o[0], o[1], o[2]));
    r->d = imp__vector(&m, imp__v3(d[0], d[1], d[2]));
    const double length = imp__length(r->d);
    if (!(length > 0) || !isfinite(length) || !imp__is_finite(r->o))
        IMP_TRY(imp_build_error(b, by_ray ? "direction" : "to_world", IMP_E_SCENE,
                                "its direction has length %g", length));
    r->d *= imp__spec(1 / length);
out:
    return st;
}

static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    (void)px, (void)py, (void)lens;
    const struct radiancemeter *r = s->self;
    *out = (struct imp_sensor_ray){r->o, r->d, 0, INFINITY};
}

const struct imp_sensor_ops imp__radiancemeter = {.size = sizeof(struct imp_sensor_ops),
                                                  .name = "radiancemeter",
                                                  .object_size =
                                                      sizeof(struct radiancemeter),
                                                  .build = build,
                                                  .ray = ray};
