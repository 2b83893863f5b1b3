/* SPDX-License-Identifier: Apache-2.0
 *
 * Warnings where watts and lumens meet in one scene. */
#ifndef IMP_FORMAT_LIGHT_UNITS_H
#define IMP_FORMAT_LIGHT_UNITS_H

#include "scene/scene.h"

/* Where a scene file has Radiance files without efficacy. */
void imp__light_units_mixed(const struct imp_scene *scene, const struct imp_node *root);
/* Names meters without units. */
void imp__light_units_unsaid(const struct imp_scene *scene);

#endif
