/* SPDX-License-Identifier: Apache-2.0
 *
 * Circles across which a sky jumps, as the camera sees them (boundary.h): the border of the sun, and
 * the horizon of skies that are dark below it. They are infinitely far away and stay in the world;
 * their pictures move with the camera. */
#include "boundary_parts.h"
#include "kind/cleared.h"
#include "math/warp.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

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
