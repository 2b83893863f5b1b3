/* SPDX-License-Identifier: Apache-2.0
 *
 * Media that no straight line leaves for a light: closed surfaces that bend or stop light bound
 * them, and all lights are outside. Light samples from their points are hidden, so that none is
 * drawn there. */
#ifndef IMP_SCENE_SEALED_H
#define IMP_SCENE_SEALED_H

#include "scene.h"

/* scene->sealed [n_media], NULL in a scene without media. */
enum imp_status imp__sealed_create(struct imp_scene *scene);
/* ... as shapes and lights are now. */
void imp__sealed_renew(struct imp_scene *scene);

/* Does a closed mesh stay closed whichever of its vertices move? */
bool imp__is_welded(const struct imp_triangles *m);

static inline bool imp__is_sealed(const struct imp_scene *scene,
                                  const struct imp_medium *m)
{
    return scene->sealed && scene->sealed[m->index];
}

#endif
