/* SPDX-License-Identifier: Apache-2.0
 *
 * Parameters that somebody may have meant: suggestions in messages. */
#ifndef IMP_SCENE_THETA_NEAR_H
#define IMP_SCENE_THETA_NEAR_H

#include "scene.h"

/* "; the nearest are A, B, C", of the names that are next to `name`, or to a
 * pattern's part before its first wildcard. Empty if none is near. */
struct imp_near_names {
    char text[512];
};
IMP_COLD struct imp_near_names imp__theta_near(const struct imp_scene *scene,
                                               const char *name);

#endif
