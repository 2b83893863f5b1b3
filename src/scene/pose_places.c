/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the object of a number of geometry is, and where a camera sees a point. */
#include "access.h"
#include "base/arguments.h"
#include "kind/cleared.h"
#include "pose.h"
#include <math.h>

/* Radius of a camera or a light, which have no size, in parts of the scene's. */
#define SIZE_OF_POINTS 0.05

static bool box_of(const struct imp_pose *p, imp_v3 *lo, imp_v3 *hi)
{
    return p->texture ? imp__volume_box(p->texture, lo, hi) : imp__pose_box(p, lo, hi);
}

/* The middle of what moves. False: it has no place; a group has one for each instance. */
static bool middle_of(const struct imp_pose *p, imp_v3 *middle)
{
    imp_v3 lo, hi;
    const double *x = p->number;
    const bool boxed = box_of(p, &lo, &hi);
    if (p->group >= 0) return false;
    switch (p->kind) {
    case IMP_POSE_RIGID:
    case IMP_POSE_RIGID_END: *middle = p->centre + imp__v3(x[0], x[1], x[2]); return true;
    case IMP_POSE_POSITION: *middle = imp__v3(x[0], x[1], x[2]); return true;
    case IMP_POSE_WORLD:
        *middle = boxed ? (lo + hi) * 0.5 : imp__v3(x[3], x[7], x[11]);
        return true;
    default: *middle = boxed ? (lo + hi) * 0.5 : imp__v3(0, 0, 0); return boxed;
    }
}

enum imp_status imp_scene_place(const imp_scene *scene, size_t param, double middle[3],
                                double *radius)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, middle, "middle");
    IMP_REQUIRE(scene->ctx, radius, "radius");
    IMP_READS(scene);
    const struct imp_pose *p = imp__pose_of(scene, param);
    imp_v3 at, lo, hi;
    if (param >= scene->n_params)
        return imp__error(scene->ctx, IMP_E_ARG, "there is no parameter %zu", param);
    if (!p || !middle_of(p, &at))
        return imp__error(scene->ctx, IMP_E_ARG,
                          "'%s' is no number of a thing that has a place",
                          scene->params[param].info.name);
    for (int k = 0; k < 3; k++) middle[k] = at[k];
    *radius = box_of(p, &lo, &hi) ? 0.5 * imp__length(hi - lo)
                                  : SIZE_OF_POINTS * scene->ball.radius;
    return IMP_OK;
}

enum imp_status imp_scene_film_point(const imp_scene *scene, int sensor,
                                     const double point[3], double film[2])
{
    static const double lens[4] = {0.5, 0.5, 0.5, 0.5};
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, point, "point");
    IMP_REQUIRE(scene->ctx, film, "film");
    IMP_READS(scene);
    if (sensor < 0 || sensor >= scene->n_sensors)
        return imp__error(scene->ctx, IMP_E_ARG, "there is no sensor %d (there are %d)",
                          sensor, scene->n_sensors);
    const struct imp_sensor *s = scene->sensors[sensor];
    if (!s->ops->connect || !s->ops->placed || s->ops->flags & IMP_SENSOR_AREA)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "the sensor %s ('%s') has no picture in which a point is seen",
                          s->name, s->ops->name);
    struct imp_sensor_sample seen;
    const imp_v3 at = imp__v3(point[0], point[1], point[2]);
    for (int k = 0; k < 3; k++)
        if (!isfinite(point[k]))
            return imp__error(scene->ctx, IMP_E_ARG, "point[%d] = %g is not finite", k,
                              point[k]);
    film[0] = film[1] = NAN;
    if (!imp__sensor_connect(s, &at, false, lens, &seen)) return IMP_OK;
    film[0] = seen.px - s->film.crop_x;
    film[1] = seen.py - s->film.crop_y;
    return IMP_OK;
}
