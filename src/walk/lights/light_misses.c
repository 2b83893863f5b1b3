/* SPDX-License-Identifier: Apache-2.0
 *
 * What light walks cannot find: light that a mirror or a lens sends straight to a
 * sensor that is no surface. */
#include "light_walk.h"

const struct imp_bsdf *imp__delta_bsdf(const struct imp_scene *scene)
{
    for (int b = 0; b < scene->n_bsdfs; b++)
        if (scene->bsdfs[b]->flags & IMP_BSDF_DELTA &&
            !(scene->bsdfs[b]->flags & IMP_BSDF_NULL))
            return scene->bsdfs[b];
    return NULL;
}

const struct imp_bsdf *imp__light_walks_miss(const struct imp_scene *scene,
                                             const struct imp_sensor *sensor,
                                             const struct imp_walk_integrator *integrator)
{
    if (!integrator->from_lights || integrator->both || sensor->shape) return NULL;
    return imp__delta_bsdf(scene);
}

void imp__light_walks_tell(const struct imp_scene *scene, const struct imp_sensor *sensor,
                           const struct imp_walk_integrator *integrator)
{
    const struct imp_bsdf *b = imp__light_walks_miss(scene, sensor, integrator);
    if (b)
        imp__warn(
            scene->ctx,
            "light walks: light that material '%s' (%s) mirrors or refracts "
            "straight to sensor '%s' (%s) is missing; let walks begin at the sensor, "
            "or at both ends (bdpt)",
            b->name, b->ops->name, sensor->name, sensor->ops->name);
}
