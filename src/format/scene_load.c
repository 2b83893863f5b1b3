/* SPDX-License-Identifier: Apache-2.0 */
#include "base/arguments.h"
#include "curved/inside.h"
#include "load.h"
#include "search.h"
#include "tree.h"
#include "xml.h"
#include <string.h>

enum imp_status imp__load_options(imp_context *ctx, const struct imp_load_options *from,
                                  struct imp_load_options *to)
{
    *to = (struct imp_load_options)IMP_LOAD_OPTIONS_INIT;
    IMP_CHECKED(imp__options_take(ctx, "load", "options", from, to, sizeof *to));
    if (to->mode != IMP_RGB && to->mode != IMP_MONO)
        return imp__error(ctx, IMP_E_ARG, "colour mode %d is not known", (int)to->mode);
    if ((to->n_defines && !to->defines) || (to->n_search && !to->search))
        return imp__error(ctx, IMP_E_ARG, "definitions or search folders are NULL");
    return IMP_OK;
}

enum imp_status imp__scene_new(imp_context *ctx, const struct imp_load_options *options,
                               const char *folder, struct imp_scene **out)
{
    struct imp_scene *scene = imp__alloc(ctx, 1, sizeof *scene);
    if (!scene) return imp__error(ctx, IMP_E_NOMEM, "scene: out of memory");
    scene->ctx = ctx;
    imp__context_hold(ctx);
    scene->mode = options->mode;
    scene->channels = options->mode == IMP_MONO ? 1 : 3;
    scene->environment = -1;
    imp__arena_init(&scene->arena, ctx);
    imp__arena_init(&scene->files, ctx);
    const enum imp_status st =
        imp__search_init(scene, options->search, options->n_search, folder);
    if (st == IMP_OK) *out = scene;
    else imp_scene_destroy(scene);
    return st;
}

void imp_scene_destroy(imp_scene *scene)
{
    if (!scene) return;
    imp_context *ctx = scene->ctx;
    imp__context_own(ctx);
    imp__access_destroy(&scene->access);
    imp__intersector_destroy(scene);
    for (int i = 0; i < scene->n_media; i++) imp__graded_destroy(scene->media[i]->graded);
    if (scene->tree) imp__tree_free(scene->tree);
    imp__release(ctx, scene->tree);
    for (size_t i = 0; i < scene->n_search; i++) imp__release(ctx, scene->search[i]);
    imp__release(ctx, scene->search);
    imp__release(ctx, scene->stack);
    imp__release(ctx, scene->build_error);
    imp__release(ctx, scene->params);
    imp__arena_free(&scene->files);
    imp__arena_free(&scene->arena);
    imp__release(ctx, scene);
    imp__context_drop(ctx);
}

/* The data of files are gone: nobody may look at them any more. */
static void files_forget(struct imp_node *node)
{
    node->mesh = NULL;
    node->image = NULL;
    for (size_t i = 0; i < node->n_children; i++)
        if (!node->children[i].ref) files_forget(node->children[i].node);
}

enum imp_status imp__scene_finish(struct imp_scene *scene)
{
    enum imp_status st = imp__files_attach(scene);
    if (st == IMP_OK) st = imp__scene_build(scene);
    if (st == IMP_OK) st = imp__graded_finish(scene);
    files_forget(scene->root);
    imp__arena_free(&scene->files);
    return st;
}

/* `name` of the scene file; its folder is the last that is searched. */
static enum imp_status load(imp_context *ctx, const struct imp_bytes *text,
                            const char *name, const char *folder,
                            const struct imp_load_options *o, imp_scene **out)
{
    enum imp_status st = IMP_OK;
    struct imp_scene *scene = NULL;
    IMP_TRY(imp__scene_new(ctx, o, folder, &scene));
    IMP_TRY(imp__xml_read(scene, text, name, o));
    IMP_TRY(imp__scene_finish(scene));
    *out = scene;
    return IMP_OK;
out:
    imp_scene_destroy(scene);
    return st;
}

enum imp_status imp_scene_load(imp_context *ctx, const char *path,
                               const struct imp_load_options *options, imp_scene **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    IMP_REQUIRE(ctx, out, "out");
    if (!*path) return imp__error(ctx, IMP_E_ARG, "no scene file is named");
    IMP_FLOAT_MODE;
    enum imp_status st = IMP_OK;
    struct imp_load_options o;
    struct imp_bytes text = {0};
    char *folder = NULL;
    IMP_TRY(imp__load_options(ctx, options, &o));
    IMP_TRY(imp__file_read(ctx, path, XML_FILE_BYTES_MAX, &text));
    folder = imp__strdup(ctx, strchr(path, '/') ? path : ".");
    if (!folder) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", path));
    char *slash = strrchr(folder, '/');
    if (slash) slash[slash == folder] = 0;
    IMP_TRY(load(ctx, &text, path, folder, &o, out));
out:
    imp__release(ctx, folder);
    imp__bytes_free(ctx, &text);
    return st;
}

enum imp_status imp_scene_load_string(imp_context *ctx, const char *xml, size_t length,
                                      const char *name,
                                      const struct imp_load_options *options,
                                      imp_scene **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, xml, "xml");
    IMP_REQUIRE(ctx, out, "out");
    IMP_FLOAT_MODE;
    struct imp_load_options o;
    const enum imp_status st = imp__load_options(ctx, options, &o);
    if (st != IMP_OK) return st;
    const struct imp_bytes text = {(unsigned char *)xml, length, length}; /* only read */
    return load(ctx, &text, name && *name ? name : "string", NULL, &o, out);
}
