/* SPDX-License-Identifier: Apache-2.0
 *
 * Surfaces from decisions: where a vertex lies, and the point of its light sample. */
#include "decision.h"
#include "scene/located.h"

static bool surface_of(const struct imp_scene *scene, const struct imp_shape *shape,
                       const struct imp_located *x, uint32_t place, double time,
                       struct imp_surface *out)
{
    return shape && place != IMP_PLACE_MOST &&
           imp__located_surface(scene, shape->index, x, place, time, out);
}

bool imp__decided_surface(const struct imp_scene *scene, const struct imp_decision *d,
                          double time, struct imp_surface *out)
{
    const struct imp_shape *shape = NULL;
    switch ((enum imp_scatterer)d->scatterer) {
    case IMP_AT_SURFACE:
    case IMP_AT_BOUNDARY: shape = scene->shapes[d->shape]; break;
    case IMP_AT_LIGHT: shape = scene->emitters[d->met.emitter]->shape; break;
    case IMP_AT_SKY:
    case IMP_IN_MEDIUM:
    case IMP_AT_SENSOR: break;
    }
    return surface_of(scene, shape, &d->located, d->place, time, out);
}

bool imp__decided_light(const struct imp_scene *scene, const struct imp_sensor *sensor,
                        const struct imp_decision *d, double time,
                        struct imp_surface *out)
{
    const struct imp_light *l = &d->light;
    const struct imp_shape *shape = NULL;
    if (d->connection == IMP_NOT_CONNECTED) return false;
    if (l->emitter >= 0) shape = scene->emitters[l->emitter]->shape;
    else if (sensor) shape = sensor->shape;
    return surface_of(scene, shape, &l->located, 0, time, out);
}
