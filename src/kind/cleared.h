/* SPDX-License-Identifier: Apache-2.0
 *
 * Calls of kinds that fill a struct which may grow (kinds.h, the first list of
 * IMP_KINDS_STRUCTS): it is cleared before, so that fields which a plug-in of an older
 * header does not have are zero, and a triangle is not known (prim -1). All of the engine
 * calls them so. */
#ifndef IMP_KIND_CLEARED_H
#define IMP_KIND_CLEARED_H

#include <importon/kinds.h>

static inline void imp__sensor_ray(const struct imp_sensor *s, double px, double py,
                                   const double lens[2], struct imp_sensor_ray *out)
{
    *out = (struct imp_sensor_ray){.t_near = 0};
    s->ops->ray(s, px, py, lens, out);
}

/* The sensor has `connect`. */
static inline bool imp__sensor_connect(const struct imp_sensor *s, const imp_v3 *ref,
                                       bool far, const double u[4],
                                       struct imp_sensor_sample *out)
{
    *out = (struct imp_sensor_sample){.located = {.prim = -1}};
    return s->ops->connect(s, ref, far, u, out);
}

/* The emitter has `sample_emission`. */
static inline bool imp__emission_sample(const struct imp_emitter *e,
                                        const struct imp_ball *scene, const double u[4],
                                        struct imp_emission_sample *out)
{
    *out = (struct imp_emission_sample){.located = {.prim = -1}};
    return e->ops->sample_emission(e, scene, u, out);
}

#endif
