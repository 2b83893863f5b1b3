/* SPDX-License-Identifier: Apache-2.0
 *
 * A second scene with the same objects and values, in which walks of the first one are
 * evaluated at other parameters. It has no geometry (tree_file.h). */
#ifndef IMP_FORMAT_TWIN_SCENE_H
#define IMP_FORMAT_TWIN_SCENE_H

#include "base/file.h"
#include "scene/scene.h"

/* As of imp_scene.twin. IMP_E_UNSUPPORTED names what cannot do without its geometry. */
enum imp_status imp__scene_twin(const struct imp_scene *scene, struct imp_scene **out);
/* From the scene's bytes (imp__tree_put) at theta [n_theta]. IMP_E_UNSUPPORTED: they make
 * another scene. */
enum imp_status imp__twin_take(const struct imp_scene *scene, const double *theta,
                               const struct imp_bytes *bytes, struct imp_scene **out);

#endif
