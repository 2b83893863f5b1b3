/* SPDX-License-Identifier: Apache-2.0
 *
 * From files to a scene that is ready: the part that file and building calls share. */
#ifndef IMP_FORMAT_LOAD_H
#define IMP_FORMAT_LOAD_H

#include "base/file.h"
#include "scene/scene.h"

/* The caller's options, complete for any `size`. @return IMP_E_ARG if malformed. */
enum imp_status imp__load_options(imp_context *ctx, const struct imp_load_options *from,
                                  struct imp_load_options *to);
/* What is loaded: complete options, a text, its name in messages, and its folder (NULL: none),
 * the last that is searched. */
struct imp__load_file {
    struct imp_load_options options;
    struct imp_bytes text;
    const char *name;
    char *folder;
};
/* @return IMP_E_ARG without a path. To be closed also after a failure. */
enum imp_status imp__load_open(imp_context *ctx, const char *path,
                               const struct imp_load_options *options,
                               struct imp__load_file *out);
void imp__load_close(imp_context *ctx, struct imp__load_file *file);
/* A text of the caller's, which is only read: not to be closed. */
enum imp_status imp__load_text(imp_context *ctx, const char *xml, size_t length,
                               const char *name, const struct imp_load_options *options,
                               struct imp__load_file *out);
/* graded.c: attach the field of a <medium type="graded">; when the scene is built, make
 * ready to trace. */
enum imp_status imp__graded_attach(struct imp_scene *scene, struct imp_node *node);
enum imp_status imp__graded_finish(struct imp_scene *scene);
/* survey.c: IMP_E_UNSUPPORTED if two or more plugins do not exist, with all of them; a
 * lenient scene goes on without. References are resolved. */
enum imp_status imp__survey(struct imp_scene *scene);
/* survey.c: one line of what a lenient scene goes on without (imp_scene_info); copied. */
enum imp_status imp__lost_add(struct imp_scene *scene, const char *text);
/* survey.c: when objects are made, a warning for what is declared and used nowhere, and for
 * what was not read of a lenient scene. */
enum imp_status imp__survey_finish(struct imp_scene *scene);
/* resolve.c: attach meshes and pictures to the nodes that name files. */
enum imp_status imp__files_attach(struct imp_scene *scene);
/* Attach files, make objects, release what only they needed. References are resolved. */
enum imp_status imp__scene_finish(struct imp_scene *scene);

#endif
