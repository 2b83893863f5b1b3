/* SPDX-License-Identifier: Apache-2.0
 *
 * A committed scene as bytes, and back, for those who evaluate walks and trace none. The
 * bytes are the building calls (imp_scene_begin and its like) that make it: what is read
 * passes the same checks as what a host builds. Pictures and grids are in them. Meshes are
 * not: of each one triangle across its bounds is there, and all triangles of one that is a
 * light, whose directions may count. */
#ifndef IMP_FORMAT_TREE_FILE_H
#define IMP_FORMAT_TREE_FILE_H

#include "base/file.h"
#include "scene/scene.h"

/* `theta` [n_theta]: the texels of pictures and grids. IMP_E_UNSUPPORTED names what cannot
 * do without its geometry; IMP_E_NOMEM. */
enum imp_status imp__tree_put(const struct imp_scene *scene, const double *theta,
                              struct imp_bytes *out);

/* `name` is for messages. The scene is committed, and rays meet nothing in it.
 * IMP_E_SCENE: the bytes are none of these. */
enum imp_status imp__tree_take(imp_context *ctx, const char *name,
                               const unsigned char *bytes, size_t n, imp_scene **out);

#endif
