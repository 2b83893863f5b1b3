/* SPDX-License-Identifier: Apache-2.0
 *
 * The medium at a point, found by a ray to the next boundary. */
#ifndef IMP_SCENE_MEDIA_AROUND_H
#define IMP_SCENE_MEDIA_AROUND_H

#include "scene.h"

/* The medium at p, by the next boundary along d; `otherwise` if there is none. */
const struct imp_medium *imp__medium_around(const struct imp_scene *scene, imp_v3 p,
                                            imp_v3 d, const struct imp_medium *otherwise);

#endif
