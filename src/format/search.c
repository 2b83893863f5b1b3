/* SPDX-License-Identifier: Apache-2.0
 *
 * The list of folders that files are searched in, and the search. */
#include "search.h"
#include "base/file.h"
#include <limits.h>
#include <stdio.h>
#include <string.h>

static enum imp_status no_memory(imp_context *ctx)
{
    return imp__error(ctx, IMP_E_NOMEM, "search path: out of memory");
}

enum imp_status imp__search_init(struct imp_scene *scene, const char *const *folders,
                                 size_t n, const char *folder)
{
    imp_context *ctx = scene->ctx;
    scene->search = imp__alloc(ctx, n + 2, sizeof *scene->search);
    if (!scene->search) return no_memory(ctx);
    for (size_t i = 0; i < n + 2; i++) {
        const char *text = i == 0 ? "." : i <= n ? folders[i - 1] : folder;
        if (!text) {
            if (i == n + 1) break;
            return imp__error(ctx, IMP_E_ARG, "search folder %zu is NULL", i - 1);
        }
        char *copy = imp__strdup(ctx, text);
        if (!copy) return no_memory(ctx);
        scene->search[scene->n_search++] = copy;
    }
    return IMP_OK;
}

enum imp_status imp__search_push(struct imp_scene *scene, const char *folder)
{
    char **grown = imp__alloc(scene->ctx, scene->n_search + 1, sizeof *grown);
    char *copy = imp__strdup(scene->ctx, folder);
    if (!grown || !copy) {
        imp__release(scene->ctx, grown);
        imp__release(scene->ctx, copy);
        return no_memory(scene->ctx);
    }
    grown[0] = copy;
    if (scene->n_search)
        memcpy(grown + 1, scene->search, scene->n_search * sizeof *grown);
    imp__release(scene->ctx, scene->search);
    scene->search = grown;
    scene->n_search++;
    return IMP_OK;
}

const char *imp__folder_of(struct imp_scene *scene, const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = imp__arena_strdup(&scene->arena, slash ? path : ".");
    if (folder && slash) folder[slash == path ? 1 : slash - path] = 0;
    return folder;
}

enum imp_status imp__search(struct imp_scene *scene, const char *first, const char *name,
                            const char **out)
{
    imp_context *ctx = scene->ctx;
    char path[PATH_MAX], tried[768] = "";
    if (!*name) return imp__error(ctx, IMP_E_SCENE, "empty file name");
    for (size_t i = 0; i < scene->n_search + 1; i++) {
        const char *folder = i == 0 ? first : scene->search[i - 1];
        const bool absolute = *name == '/';
        if (!folder && !absolute) continue;
        const bool plain = absolute || strcmp(folder, ".") == 0;
        const int n = snprintf(path, sizeof path, "%s%s%s", plain ? "" : folder,
                               plain ? "" : "/", name);
        if (n < 0 || (size_t)n >= sizeof path)
            return imp__error(ctx, IMP_E_IO, "file name is too long");
        if (imp__file_exists(ctx, path)) {
            *out = imp__arena_strdup(&scene->arena, path);
            return *out ? IMP_OK : no_memory(ctx);
        }
        if (absolute) return imp__error(ctx, IMP_E_IO, "cannot find '%s'", name);
        bool again = i > 0 && first && strcmp(folder, first) == 0;
        for (size_t k = 1; k < i && !again; k++)
            again = strcmp(folder, scene->search[k - 1]) == 0;
        if (again) continue;
        const size_t used = strlen(tried);
        snprintf(tried + used, sizeof tried - used, "%s%s", used ? ", " : "", folder);
    }
    return imp__error(ctx, IMP_E_IO, "cannot find '%s' (looked in: %s)", name, tried);
}
