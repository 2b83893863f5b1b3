/* SPDX-License-Identifier: Apache-2.0
 *
 * Parameters by other names than their own. */
#ifndef IMP_SCENE_THETA_ALIAS_H
#define IMP_SCENE_THETA_ALIAS_H

#include "scene.h"

/* A parameter by its name, of which a final ".value" may be missing (theta.c). */
bool imp__theta_exact(const struct imp_scene *scene, const char *name, size_t *index);
/* By a path of Mitsuba's traverse(). */
bool imp__theta_alias(const struct imp_scene *scene, const char *path, size_t *index);

#endif
