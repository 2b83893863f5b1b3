/* SPDX-License-Identifier: Apache-2.0
 *
 * Other photometric files for the luminaires of a scene: one in place of what the file names,
 * or several, each a luminaire of its own at the same place. */
#ifndef IMP_FORMAT_LUMINAIRE_FILES_H
#define IMP_FORMAT_LUMINAIRE_FILES_H

#include "scene/scene.h"

/* texts [n], each "GLOB=FILE[,FILE..]": the emitters `ies` at the top of the tree whose ids the glob
 * matches. With one file the id stays, with several they are "ID:NAME", NAME the file's without
 * folder and ending. A `flux` goes, as it is of another luminaire. @return IMP_E_ARG for a text
 * that is none, a glob that matches nothing, files of one NAME. */
enum imp_status imp__luminaire_files_set(struct imp_scene *scene,
                                         const char *const *texts, size_t n);

#endif
