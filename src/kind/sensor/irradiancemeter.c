/* SPDX-License-Identifier: Apache-2.0
 *
 * The irradiance on the front of a shape, in units of radiance times steradian:
 *
 *     E = 1/A int int L cos(theta) dw dA
 *
 * A film of more than one pixel is spread over a rectangle by its uv: a pixel is the mean
 * over its part, or the value in the middle of it (receiver.h, with other receivers). Other
 * flat shapes have points within their outline (receiver_outline.h). */
#include "kind/shape/shape.h"
#include "math/offset.h"
#include "math/warp.h"
#include "receiver.h"

static enum imp_status build(const struct imp_build *b, void *self, struct imp_sensor *s)
{
    (void)self;
    const struct imp_film_desc *f = &s->film;
    if (!s->shape)
        return imp_build_error(b, NULL, IMP_E_SCENE, "it must be inside a shape");
    if (!s->shape->ops->sample_area || !(s->shape->area > 0))
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "points of its shape '%s' (%s) cannot be drawn",
                               s->shape->name, s->shape->ops->name);
    enum imp_status st = imp__receiver_build(b, s);
    if (st != IMP_OK) return st;
    if ((f->width != 1 || f->height != 1) && !imp__has_grid(s))
        return imp_build_error(b, NULL, IMP_E_SCENE,
                               "its film has %d x %d pixels; on a %s it has 1 x 1, or "
                               "more for points ('at') on a disk or a flat mesh",
                               f->width, f->height, s->shape->ops->name);
    s->scale = IMP_PI;
    return IMP_OK;
}

static void ray(const struct imp_sensor *s, double px, double py, const double lens[2],
                struct imp_sensor_ray *out)
{
    const struct imp_receiver *r = s->receiver;
    struct imp_surface at;
    double u[2];
    imp__receiver_uv(s, px, py, u);
    s->shape->ops->sample_area(s->shape, u, &at);
    const struct imp_frame frame = imp__frame_from_normal(at.ng);
    out->d = imp__normalize(imp__to_world(&frame, r ? imp__receiver_direction(r, lens)
                                                    : imp__cosine_hemisphere(lens)));
    out->o = imp__offset(at.p, at.ng, at.ng);
    out->t_near = 0;
    out->t_far = INFINITY;
}

static bool connect(const struct imp_sensor *s, const imp_v3 *ref, bool far,
                    const double u[4], struct imp_sensor_sample *out)
{
    const struct imp_receiver *r = s->receiver;
    const double px = u[0] * s->film.width, py = u[1] * s->film.height;
    struct imp_surface at;
    double on[2] = {u[0], u[1]};
    if (r) imp__receiver_uv(s, px, py, on);
    at.located.prim = -1;
    s->shape->ops->sample_area(s->shape, on, &at);
    const imp_v3 d = far ? *ref : *ref - at.p;
    const double r2 = imp__dot(d, d), dist = sqrt(r2);
    if (!(dist > 0)) return false;
    const imp_v3 w = d * (1 / dist);
    const double c = r ? IMP_PI * imp__receiver_density(r, imp__to_local(&r->frame, w))
                       : imp__dot(w, at.ng);
    const double pixels = (double)s->film.width * s->film.height;
    if (!(c > 0)) return false;
    *out = (struct imp_sensor_sample){
        .wo = -w,
        .p = at.p,
        .dist = far ? INFINITY : dist,
        .px = px,
        .py = py,
        .weight = pixels * c / (far ? 1 : r2),
        .ng = at.ng,
        .cos_sensor = c,
        .located = imp__located_drawn(s->shape, &at.located, at.uv)};
    return true;
}

const struct imp_sensor_ops imp__irradiancemeter = {.size = sizeof(struct imp_sensor_ops),
                                                    .name = "irradiancemeter",
                                                    .build = build,
                                                    .ray = ray,
                                                    .flags = IMP_SENSOR_AREA,
                                                    .connect = connect};
