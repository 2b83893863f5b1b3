/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the rays of a camera meet (pose.h): in one point, or in a point of its lens; parallel rays
 * meet in none, and begin on a film. */
#include "pose.h"

extern const struct imp_sensor_ops imp__distant;

/* By the rays through two corners of the film. */
bool imp__lens_point(const struct imp_sensor *s, const double lens[2], imp_v3 *point)
{
    struct imp_sensor_ray a, b;
    if (!s->ops->ray || s->shape) return false;
    s->ops->ray(s, 0, 0, lens, &a);
    s->ops->ray(s, s->film.width, s->film.height, lens, &b);
    const imp_v3 d = b.o - a.o, n = imp__cross(a.d, b.d);
    const double n2 = imp__dot(n, n), size = imp__length(d) + imp__length(a.o);
    if (!(n2 > 1e-20)) return false;
    const double ta = imp__dot(imp__cross(d, b.d), n) / n2,
                 tb = imp__dot(imp__cross(d, a.d), n) / n2;
    *point = a.o + a.d * ta;
    return imp__length(b.o + b.d * tb - *point) <= 1e-7 * size;
}

bool imp__pinhole(const struct imp_sensor *s, imp_v3 *centre)
{
    struct imp_sensor_ray elsewhere; /* through another point of the lens */
    if (!imp__lens_point(s, (const double[2]){0.3, 0.8}, centre)) return false;
    s->ops->ray(s, 0, 0, (const double[2]){0.9, 0.1}, &elsewhere);
    const imp_v3 r = elsewhere.o - *centre, apart = imp__cross(r, elsewhere.d);
    return imp__length(apart) <= 1e-7 * (imp__length(r) + imp__length(elsewhere.o));
}

/* The middle of the film of parallel rays, where they begin. A single ray has no film. */
static bool film_middle(const struct imp_sensor *s, imp_v3 *centre)
{
    const double u[4] = {0.5, 0.5, 0.5, 0.5};
    struct imp_sensor_ray ray;
    struct imp_sensor_sample back;
    if (!s->ops->connect || !s->ops->move) return false;
    s->ops->ray(s, s->film.width * 0.5, s->film.height * 0.5, u, &ray);
    *centre = ray.o;
    const imp_v3 on =
        ray.o + ray.d * imp_min(1e-3 * imp__length(ray.o) + 1e-3, ray.t_far / 2);
    return s->ops != &imp__distant || s->ops->connect(s, &on, false, u, &back);
}

bool imp__lens_middle(const struct imp_sensor *s, imp_v3 *centre)
{
    if (s->ops->flags & IMP_SENSOR_PARALLEL) return film_middle(s, centre);
    if (imp__pinhole(s, centre)) return true;
    return s->ops->connect && s->ops->lens_velocity &&
           imp__lens_point(s, (const double[2]){0.5, 0.5}, centre);
}
