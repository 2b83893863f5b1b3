/* SPDX-License-Identifier: Apache-2.0
 *
 * Receivers of illuminance: densities of directions, draws, and places on the shape. */
#include "receiver.h"
#include "math/transform.h"
#include "math/warp.h"

void imp__receiver_uv(const struct imp_sensor *s, double px, double py, double uv[2])
{
    const struct imp_receiver *r = s->receiver;
    const double at[2] = {px, py}, size[2] = {s->film.width, s->film.height};
    if (r && r->place) {
        const int x = (int)imp_clamp(px, 0.0, size[0] - 1);
        uv[0] = r->place[x][0];
        uv[1] = r->place[x][1];
        return;
    }
    for (int k = 0; k < 2; k++) {
        double x = at[k];
        if (r && r->points) x = imp_clamp(floor(x), 0.0, size[k] - 1) + 0.5;
        uv[k] = imp_clamp(x / size[k], 0.0, 0x1.fffffffffffffp-1);
        if (r) uv[k] = r->first[k] + r->span[k] * uv[k];
    }
}

double imp__receiver_density(const struct imp_receiver *r, imp_v3 w)
{
    if (r->kind == IMP_PLANAR) return imp_max(imp__dot(w, r->facing), 0.0) * IMP_INV_PI;
    const double across = sqrt(w[0] * w[0] + w[1] * w[1]);
    const double towards = r->kind == IMP_CYLINDRICAL ? 0 : imp__dot(w, r->facing);
    return imp_max(across + towards, 0.0) * (IMP_INV_PI * IMP_INV_PI);
}

void imp__receiver_turn(struct imp_receiver *r, const struct imp_receiver *rest,
                        const struct imp_shape *s, const double map[12])
{
    struct imp_surface at;
    const double middle[2] = {0.5, 0.5};
    *r = *rest;
    s->ops->sample_area(s, middle, &at);
    r->frame = imp__frame_from_normal(at.ng);
    if (r->kind == IMP_CYLINDRICAL || (r->kind == IMP_PLANAR && !r->turned)) return;
    const imp_v3 f = imp__rows_vector(map, imp__to_world(&rest->frame, rest->facing));
    imp_v3 facing = imp__to_local(&r->frame, f);
    if (r->kind != IMP_PLANAR) facing[2] = 0;
    r->facing = imp__normalize(facing);
}

/* y in [0, 2 pi] with y - sin y = 2 pi u: Newton's method inside a bracket. Below 1e-5 the
 * difference is y^3/6 to its last bit but few. */
static double kepler(double u)
{
    const double m = IMP_2PI * u;
    double lo = 0, hi = IMP_2PI,
           y = m < IMP_PI ? cbrt(6 * m) : IMP_2PI - cbrt(6 * (IMP_2PI - m));
    for (int k = 0; k < 60; k++) {
        const double f = y - sin(y) - m, slope = 1 - cos(y);
        if (f > 0) hi = y;
        else lo = y;
        double next = slope > 0 ? y - f / slope : 0.5 * (lo + hi);
        if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
        if (fabs(next - y) <= 1e-15 * (1 + y)) return next;
        y = next;
    }
    return y;
}

/* sin(e) dw = sin^2(e) de da: the distribution of e is (2 e - sin 2 e)/2 pi. Of the azimuth
 * from f, (1 + cos a)/2 pi: with y = a + pi it is (y - sin y)/2 pi, the same function. */
imp_v3 imp__receiver_direction(const struct imp_receiver *r, const double u[2])
{
    if (r->kind == IMP_PLANAR) {
        const struct imp_frame about = imp__frame_from_normal(r->facing);
        return imp__to_world(&about, imp__cosine_hemisphere(u));
    }
    const bool half = r->kind == IMP_SEMICYLINDRICAL;
    const double e = kepler(u[0]) / 2, a = half ? kepler(u[1]) - IMP_PI : IMP_2PI * u[1];
    const imp_v3 x = half ? r->facing : imp__v3(1, 0, 0);
    const imp_v3 y = imp__v3(-x[1], x[0], 0);
    return (x * cos(a) + y * sin(a)) * sin(e) + imp__v3(0, 0, cos(e));
}
