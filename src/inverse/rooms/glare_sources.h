/* SPDX-License-Identifier: Apache-2.0
 *
 * The luminaires that an observer sees, as sources of glare. */
#ifndef IMP_INVERSE_GLARE_SOURCES_H
#define IMP_INVERSE_GLARE_SOURCES_H

#include "scene/scene.h"
#include <importon/rooms.h>

/* A luminaire from a point at distance r along -w: what it sends there. */
struct imp__glare_seen {
    struct imp_glare_source source;
    double direct; /* illuminance on the observer's plane, lx */
};
/* False: it is no luminaire, behind the observer, hidden, or dark in this direction. */
bool imp__glare_look(const struct imp_scene *scene, const struct imp_emitter *e,
                     imp_v3 eye, imp_v3 sight, imp_v3 up, struct imp__glare_seen *out);
/* IMP_E_ARG with its name for a source without a luminous area. */
enum imp_status imp__glare_area_check(const struct imp_scene *scene,
                                      const struct imp_emitter *e,
                                      const struct imp__glare_seen *s);
/* IMP_E_ARG for a sensor without a line of sight. */
enum imp_status imp__glare_sight_check(const struct imp_scene *scene,
                                       const struct imp_sensor *s);

#endif
