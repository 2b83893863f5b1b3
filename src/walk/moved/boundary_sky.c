/* SPDX-License-Identifier: Apache-2.0
 *
 * Circles across which a sky jumps, as the camera sees them (boundary.h): the border of the sun, and
 * the horizon of skies that are dark below it. They are infinitely far away and stay in the world;
 * their pictures move with the camera. */
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "math/warp.h"
#include "moved_sky.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

/* Directions are exact here, and a sky may be as steep as the root of the angle beside its circle: next to
 * the horizon a hundred-thousandth away would be .3 % of its light. */
#define BESIDE 1e-10
imp_spec imp__sky_jump(const struct imp__edge_draw *d, imp_v3 w, imp_v3 m)
{
    const struct imp_tracer *t = d->b->tracer;
    imp_spec L[2];
    if (t->integrator->max_depth == 0) return imp__spec(0);
    for (int k = 0; k < 2; k++)
        L[k] = imp__sky_radiance_from(t->scene, d->item->sky,
                                      imp__normalize(w + m * (k ? BESIDE : -BESIDE)),
                                      imp__edge_waves(d));
    return L[0] - L[1];
}

imp_v3 imp__sky_circle_draw(struct imp__edge_draw *d)
{
    const struct imp_sky_circle *c = &d->item->circle;
    const double psi = IMP_2PI * d->u;
    const double sine = sqrt(imp_max(1 - imp__sqr(c->cosine), 0.0));
    const struct imp_frame f = imp__frame_from_normal(c->axis);
    d->along = f.t * cos(psi) - f.s * sin(psi);
    d->inv_pdf = IMP_2PI * sine / d->chance;
    return c->axis * c->cosine + (f.s * cos(psi) + f.t * sin(psi)) * sine;
}

void imp__draw_sky_film(struct imp__edge_draw *d)
{
    const struct imp_sensor *sensor = d->b->tracer->sensor;
    const imp_v3 w = imp__sky_circle_draw(d);
    struct imp_sensor_sample to;
    struct imp__line line;
    if (d->b->fog) return; /* none of it comes through */
    if (!sensor->ops->connect || !imp__sensor_connect(sensor, &w, true, d->lens, &to) ||
        !imp__light_on_film(sensor, &to) || !imp__edge_line(d, to.p, w, INFINITY, &line))
        return;
    d->p = d->eye + w;
    imp__film_jump(d, &to, line.T);
}

void imp__draw_sky_mirrored(struct imp__edge_draw *d)
{
    const int max = d->b->tracer->integrator->max_depth;
    const imp_v3 w = imp__sky_circle_draw(d), m = imp__cross(d->along, w);
    struct imp__sight s;
    struct imp__line line;
    if (!d->b->tracer->sensor->ops->connect || !imp__sight_draw(d, 0, &s) ||
        !imp__sight_reach_far(d, &s, w))
        return;
    const struct imp_surface *at = &s.mirrors.first->at;
    const imp_v3 o = imp__offset(at->p, at->ng, w);
    if (!imp__edge_line(d, o, w, INFINITY, &line) ||
        (max >= 0 && s.bounces + line.bounces >= max))
        return;
    struct imp__flux *f = imp__jump_add(d, &s.to,
                                        s.T * line.T * imp__sky_jump(d, w, m) *
                                            (s.to.weight * d->inv_pdf / s.chance),
                                        2 + 2 * s.n);
    if (!f) return;
    /* The ray turns by (u(e + w) - u(e)), e the eye's image. */
    imp_v3 p[2] = {s.eye, s.eye + w}, bar[2] = {m, -m};
    for (int k = 0; k < 2; k++)
        bar[k] = imp__mirrors_bar(&s.mirrors, &p[k], bar[k], f->end, &f->n_ends);
    for (int k = 0; k < 2; k++) {
        const struct imp__glued seen = {.p = p[k]};
        f->end[f->n_ends] = imp__flux_camera(d, &seen, bar[k]);
        f->end[f->n_ends++].eye = p[1 - k]; /* another point of the ray */
    }
}
