/* SPDX-License-Identifier: Apache-2.0
 *
 * Luminaires of a scene by their number. */
#ifndef IMP_SCENE_LUMINAIRES_H
#define IMP_SCENE_LUMINAIRES_H

#include "scene.h"

/* The emitter `ies` with this number among them; NULL: there is none. */
const struct imp_emitter *imp__luminaire_at(const struct imp_scene *scene, int luminaire);

#endif
