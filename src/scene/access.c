/* SPDX-License-Identifier: Apache-2.0
 *
 * Many readers or one setter of a scene's parameters, per process: a forked child
 * begins with no calls in flight. */
#include "access.h"
#include "base/pool.h"
#include "scene.h"
#include <unistd.h>

/* The scene that a call of this thread holds, the outermost one; NULL: none. */
static _Thread_local const struct imp_scene *holding;
static _Thread_local bool holding_sets;

/* The context's lock is held. Scenes are const to those who read their parameters. */
static struct imp__access *access_of(const struct imp_scene *scene)
{
    struct imp__access *a = &((struct imp_scene *)(uintptr_t)scene)->access;
    if (a->process != (long)getpid()) {
        *a = (struct imp__access){.process = (long)getpid()};
        pthread_cond_init(&a->changed, NULL);
    }
    return a;
}

static struct imp__access_held enter(const struct imp_scene *scene, bool sets)
{
    const struct imp__access_held held = {scene, holding, holding_sets, sets};
    imp_context *ctx = scene->ctx;
    imp__context_own(ctx);
    pthread_mutex_lock(&ctx->lock);
    struct imp__access *a = access_of(scene);
    while (a->setting || (sets && a->readers > 0))
        pthread_cond_wait(&a->changed, &ctx->lock);
    if (sets) a->setting = true;
    else a->readers++;
    pthread_mutex_unlock(&ctx->lock);
    holding = scene;
    holding_sets = sets;
    return held;
}

/* In a call of this thread, or in a callback that a worker makes for one. */
static bool inside(const struct imp_scene *scene)
{
    return holding == scene || imp__pool_inside(scene->ctx);
}

struct imp__access_held imp__access_read(const struct imp_scene *scene)
{
    if (inside(scene)) return (struct imp__access_held){0};
    return enter(scene, false);
}

struct imp__access_held imp__access_set(const struct imp_scene *scene,
                                        enum imp_status *status)
{
    if (!inside(scene)) return enter(scene, true);
    imp_context *ctx = scene->ctx;
    pthread_mutex_lock(&ctx->lock);
    const bool allowed = holding == scene ? holding_sets : access_of(scene)->setting;
    pthread_mutex_unlock(&ctx->lock);
    if (!allowed)
        *status = imp__error(ctx, IMP_E_ARG,
                             "a callback cannot set the parameters of a scene that its "
                             "call reads");
    return (struct imp__access_held){0};
}

void imp__access_leave(const struct imp__access_held *held)
{
    if (!held->scene) return;
    imp_context *ctx = held->scene->ctx;
    holding = held->outer;
    holding_sets = held->outer_sets;
    imp__context_own(ctx); /* the process may have been forked in a callback */
    pthread_mutex_lock(&ctx->lock);
    struct imp__access *a = access_of(held->scene);
    if (held->sets) a->setting = false;
    else if (a->readers > 0) a->readers--;
    pthread_cond_broadcast(&a->changed);
    pthread_mutex_unlock(&ctx->lock);
}

void imp__access_destroy(struct imp__access *a)
{
    if (a->process == (long)getpid()) pthread_cond_destroy(&a->changed);
}
