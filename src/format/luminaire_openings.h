/* SPDX-License-Identifier: Apache-2.0
 *
 * Luminaires that glow where their photometric files say: at the luminous opening. */
#ifndef IMP_FORMAT_LUMINAIRE_OPENINGS_H
#define IMP_FORMAT_LUMINAIRE_OPENINGS_H

#include "scene/scene.h"

/* Emitters `ies` at the top of the tree, with their tables, whose property `opening` is true become
 * black shapes with them as area light: a rectangle, where the opening is flat and the table has no light
 * behind it, else a box that hangs from the place of the luminaire along nadir. A shape is named after its luminaire, with
 * "_opening" behind. @return IMP_E_SCENE, if a file says nothing about its opening. */
enum imp_status imp__luminaire_openings_make(struct imp_scene *scene);

#endif
