/* SPDX-License-Identifier: Apache-2.0
 *
 * Where files are searched (docs/scene-format.md 1.5). scene->search contains, in the
 * order of the search: <path> entries, latest first; the working folder; the caller's
 * folders; the folder of the scene file. */
#ifndef IMP_FORMAT_SEARCH_H
#define IMP_FORMAT_SEARCH_H

#include "scene/scene.h"

/* Fill scene->search; `folder` (of the scene file) may be NULL. */
enum imp_status imp__search_init(struct imp_scene *scene, const char *const *folders,
                                 size_t n, const char *folder);
/* Put a folder in front. */
enum imp_status imp__search_push(struct imp_scene *scene, const char *folder);
/* The path of an existing file or folder, in the scene's arena; `first` (may be NULL) is
 * tried before the list. @return IMP_E_IO naming the folders searched; IMP_E_NOMEM. */
enum imp_status imp__search(struct imp_scene *scene, const char *first, const char *name,
                            const char **out);
/* The folder part of a path ("." if it has none), in the scene's arena; NULL: no memory.
 */
const char *imp__folder_of(struct imp_scene *scene, const char *path);

#endif
