/* SPDX-License-Identifier: Apache-2.0
 *
 * Where the rays of a camera meet (pose.h): in one point, or in a point of its lens; parallel rays
 * meet in none, and begin on a film. */
#include "pose.h"

extern const struct imp_sensor_ops imp__distant, imp__radiancemeter;

bool imp__sees_rays(const struct imp_sensor *s, imp_v3 *centre)
{
    struct imp_sensor_ray a, b;
    if (s->ops != &imp__distant && s->ops != &imp__radiancemeter) return false;
    s->ops->ray(s, 0, 0, (const double[2]){0.5, 0.5}, &a);
    *centre = a.o;
    if (s->ops == &imp__radiancemeter) return true;
    s->ops->ray(s, s->film.width, s->film.height * 0.5, (const double[2]){0.5, 0.5}, &b);
    const bool aimed = imp__is_zero(a.o - b.o);
    if (aimed) *centre += a.d * (2 * s->scene->radius); /* the target */
    return aimed;
}

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

/* The middle of the film of parallel rays, where they begin. */
static bool film_middle(const struct imp_sensor *s, imp_v3 *centre)
{
    const double u[4] = {0.5, 0.5, 0.5, 0.5};
    struct imp_sensor_ray ray;
    if (!s->ops->connect || !s->ops->move) return false;
    s->ops->ray(s, s->film.width * 0.5, s->film.height * 0.5, u, &ray);
    *centre = ray.o;
    return true;
}

bool imp__lens_middle(const struct imp_sensor *s, imp_v3 *centre)
{
    if (imp__sees_rays(s, centre)) return true;
    if (s->ops->flags & IMP_SENSOR_PARALLEL) return film_middle(s, centre);
    if (imp__pinhole(s, centre)) return true;
    return s->ops->connect && s->ops->lens_velocity &&
           imp__lens_point(s, (const double[2]){0.5, 0.5}, centre);
}
