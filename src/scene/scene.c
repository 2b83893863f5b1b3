/* SPDX-License-Identifier: Apache-2.0
 *
 * A scene begins empty and ends with everything that it owns. */
#include "scene.h"

enum imp_status imp__scene_new(imp_context *ctx, enum imp_color_mode mode,
                               enum imp_upsampling upsampling, struct imp_scene **out)
{
    struct imp_scene *scene = imp__alloc(ctx, 1, sizeof *scene);
    if (!scene) return imp__error(ctx, IMP_E_NOMEM, "scene: out of memory");
    scene->ctx = ctx;
    imp__context_hold(ctx);
    imp__context_own(ctx);
    pthread_mutex_lock(&ctx->lock);
    ctx->has_scenes = true;
    pthread_mutex_unlock(&ctx->lock);
    scene->mode = mode;
    scene->linear_colors = upsampling == IMP_UPSAMPLING_LINEAR;
    scene->channels = mode == IMP_MONO ? 1 : 3;
    scene->lanes = imp__is_spectral(mode) ? 4 : scene->channels;
    scene->environment = -1;
    imp__arena_init(&scene->arena, ctx);
    imp__arena_init(&scene->files, ctx);
    imp__arena_init(&scene->settings_arena, ctx);
    *out = scene;
    return IMP_OK;
}

enum imp_status imp__scene_own(struct imp_scene *scene, void *object,
                               void (*destroy)(void *object))
{
    struct imp_owned *o = imp__arena_array(&scene->arena, 1, sizeof *o);
    if (!o) {
        destroy(object);
        return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    }
    *o = (struct imp_owned){scene->owned, object, destroy};
    scene->owned = o;
    return IMP_OK;
}

/* Meshes and pictures of the nodes below lie in the files' arena. */
static void files_detach(struct imp_node *node)
{
    node->mesh = NULL;
    node->image = NULL;
    for (size_t i = 0; i < node->n_children; i++)
        if (!node->children[i].ref) files_detach(node->children[i].node);
}

void imp__scene_release_files(struct imp_scene *scene)
{
    files_detach(scene->root);
    imp__arena_free(&scene->files);
}

void imp_scene_destroy(imp_scene *scene)
{
    if (!scene) return;
    imp_context *ctx = scene->ctx;
    imp__context_own(ctx);
    imp__access_destroy(&scene->access);
    imp__intersector_destroy(scene);
    for (const struct imp_owned *o = scene->owned; o; o = o->next) o->destroy(o->object);
    for (size_t i = 0; i < scene->n_search; i++) imp__release(ctx, scene->search[i]);
    imp__release(ctx, scene->search);
    imp__release(ctx, scene->stack);
    imp__release(ctx, scene->build_error);
    imp__release(ctx, scene->params);
    imp__arena_free(&scene->settings_arena);
    imp__arena_free(&scene->files);
    imp__arena_free(&scene->arena);
    imp__release(ctx, scene);
    imp__context_drop(ctx);
}
