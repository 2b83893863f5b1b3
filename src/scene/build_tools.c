/* SPDX-License-Identifier: Apache-2.0
 *
 * Names, lists and watches that all builders share. */
#include "scene_build.h"

enum imp_status imp__build_no_memory(struct imp_scene *scene)
{
    return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the scene");
}

char *imp__build_name(struct imp_scene *scene, const char *parent, const char *key)
{
    const size_t n = strlen(parent) + strlen(key) + 2;
    char *s = imp__arena_take(&scene->arena, n, 1);
    if (s) snprintf(s, n, "%s.%s", parent, key);
    return s;
}

const char *imp__build_object_name(struct imp_scene *scene, const struct imp_node *node,
                                   const char *parent, const char *slot)
{
    return node->id ? node->id : imp__build_name(scene, parent, slot);
}

enum imp_status imp__build_list_add(struct imp_scene *scene, void ***list, int *n,
                                    void *object)
{
    const size_t count = (size_t)*n;
    if ((count & (count - 1)) == 0) { /* 0, 1, 2, 4, 8: full */
        void **grown =
            imp__arena_take(&scene->arena, count ? 2 * count : 1, sizeof *grown);
        if (!grown) return imp__build_no_memory(scene);
        if (count) memcpy(grown, *list, count * sizeof *grown);
        *list = grown;
    }
    (*list)[(*n)++] = object;
    return IMP_OK;
}

enum imp_status imp__build_watch(struct imp_scene *scene,
                                 const struct imp_input *const *input, int n,
                                 void (*changed)(void *payload), void *payload)
{
    enum imp_status st = IMP_OK;
    for (int j = 0; j < n; j++) {
        const struct imp_texture *t = input[j]->texture;
        const int param = t ? t->param : input[j]->param;
        if (param >= 0) IMP_TRY(imp__theta_watch(scene, param, changed, payload));
        if (t) IMP_TRY(imp__build_watch(scene, t->input, t->n_in, changed, payload));
    }
out:
    return st;
}
