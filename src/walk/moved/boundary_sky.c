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

void imp__draw_sky_film(struct imp__edge_draw *d)
{
    const struct imp_tracer *tracer = d->b->tracer;
    const struct imp_sensor *sensor = tracer->sensor;
    const struct imp_sky_circle *c = &d->item->circle;
    const double psi = IMP_2PI * d->u;
    const double sine = sqrt(imp_max(1 - imp__sqr(c->cosine), 0.0));
    const struct imp_frame f = imp__frame_from_normal(c->axis);
    const imp_v3 w = c->axis * c->cosine + (f.s * cos(psi) + f.t * sin(psi)) * sine;
    struct imp_sensor_sample to;
    struct imp__line line;
    if (d->b->fog) return; /* none of it comes through */
    if (!sensor->ops->connect || !imp__sensor_connect(sensor, &w, true, d->lens, &to) ||
        !imp__light_on_film(sensor, &to) || !imp__edge_line(d, to.p, w, INFINITY, &line))
        return;
    d->along = f.t * cos(psi) - f.s * sin(psi);
    d->inv_pdf = IMP_2PI * sine / d->chance;
    d->p = d->eye + w;
    imp__film_jump(d, &to, line.T);
}
