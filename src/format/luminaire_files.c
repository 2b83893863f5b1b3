/* SPDX-License-Identifier: Apache-2.0
 *
 * Other photometric files for the luminaires of a scene. */
#include "luminaire_files.h"
#include "inverse/problem/match.h"
#include <string.h>

static const struct imp_loc nowhere = {NULL, 0, 0};

static enum imp_status no_memory(struct imp_scene *scene)
{
    return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the scene");
}

/* The name of a file without its folder and its ending. */
static void base_of(const char *file, size_t length, const char **name, size_t *n)
{
    size_t from = length, to = length;
    while (from > 0 && file[from - 1] != '/') from--;
    for (size_t i = from + 1; i < length; i++)
        if (file[i] == '.') to = i;
    *name = file + from;
    *n = to - from;
}

static enum imp_status file_set(struct imp_scene *scene, struct imp_node *node,
                                const char *file, size_t length)
{
    struct imp_prop *p = imp__node_prop(node, "filename");
    if (!p) p = imp__node_add(&scene->arena, node, "filename", IMP_PROP_STRING, nowhere);
    char *text = imp__arena_array(&scene->arena, length + 1, 1);
    if (!p || !text) return no_memory(scene);
    memcpy(text, file, length);
    p->type = IMP_PROP_STRING;
    p->string = text;
    imp__node_remove(node, "flux");
    return IMP_OK;
}

/* Copies at one place are alternatives, and their black shapes would stand in each other. */
static bool has_opening(const struct imp_node *node)
{
    const struct imp_prop *p = imp__node_prop(node, "opening");
    return p && !(p->type == IMP_PROP_BOOL && !p->integer);
}

/* A copy at the end of the scene, with the id "ID:NAME". */
static enum imp_status node_copy(struct imp_scene *scene, const struct imp_node *from,
                                 const char *file, size_t length)
{
    const char *name;
    size_t n;
    base_of(file, length, &name, &n);
    char *id = imp__arena_array(&scene->arena, strlen(from->id) + n + 2, 1);
    if (!id) return no_memory(scene);
    strcpy(id, from->id);
    strcat(id, ":");
    strncat(id, name, n);
    for (size_t i = 0; i < scene->root->n_children; i++) {
        const struct imp_node *other = scene->root->children[i].node;
        if (other && other->id && !strcmp(other->id, id))
            return imp__error(scene->ctx, IMP_E_ARG,
                              "luminaires: '%s' is there twice; files of one luminaire "
                              "differ in their names",
                              id);
    }
    struct imp_node *node =
        imp__node_create(&scene->arena, from->tag, from->type, id, from->name, from->loc);
    if (!node || !imp__node_add_child(&scene->arena, scene->root, node, NULL, from->loc))
        return no_memory(scene);
    for (size_t k = 0; k < from->n_props; k++) {
        const struct imp_prop *p = &from->props[k];
        struct imp_prop *own =
            imp__node_add(&scene->arena, node, p->name, p->type, p->loc);
        if (!own) return no_memory(scene);
        *own = *p;
    }
    return file_set(scene, node, file, length);
}

static enum imp_status node_take(struct imp_scene *scene, struct imp_node *node,
                                 const char *files)
{
    if (node->n_children > 0)
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "luminaires: it has a texture or another object in it");
    if (!strchr(files, ',')) return file_set(scene, node, files, strlen(files));
    if (has_opening(node))
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "luminaires: several files at one place need points, as "
                               "black shapes hide each other: set its opening to false");
    for (const char *file = files;;) {
        const size_t n = strcspn(file, ",");
        const enum imp_status st = node_copy(scene, node, file, n);
        if (st != IMP_OK) return st;
        if (!file[n]) return IMP_OK;
        file += n + 1;
    }
}

static enum imp_status text_set(struct imp_scene *scene, const char *text)
{
    char glob[256];
    const char *equals = text ? strchr(text, '=') : NULL;
    const size_t length = equals ? (size_t)(equals - text) : 0;
    const char *files = equals ? equals + 1 : "";
    size_t met = 0, kept = 0;
    if (length == 0 || length >= sizeof glob || !*files || *files == ',' ||
        strstr(files, ",,") || files[strlen(files) - 1] == ',')
        return imp__error(scene->ctx, IMP_E_ARG,
                          "luminaires '%s': expected NAME=FILE or NAME=FILE,FILE",
                          text ? text : "");
    memcpy(glob, text, length);
    glob[length] = 0;
    const size_t n = scene->root->n_children;
    for (size_t i = 0; i < n; i++) {
        struct imp_child child = scene->root->children[i];
        struct imp_node *node = child.node;
        const bool match = node && !strcmp(node->tag, "emitter") &&
                           !strcmp(node->type, "ies") && node->id &&
                           imp__glob(glob, node->id);
        if (match) {
            const enum imp_status st = node_take(scene, node, files);
            if (st != IMP_OK) return st;
            met++;
        }
        if (!match || !strchr(files, ',')) scene->root->children[kept++] = child;
    }
    if (met == 0)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "luminaires: no emitter 'ies' at the top of the scene is named "
                          "'%s'",
                          glob);
    /* Copies follow what was there. */
    memmove(scene->root->children + kept, scene->root->children + n,
            (scene->root->n_children - n) * sizeof *scene->root->children);
    scene->root->n_children -= n - kept;
    return IMP_OK;
}

enum imp_status imp__luminaire_files_set(struct imp_scene *scene,
                                         const char *const *texts, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const enum imp_status st = text_set(scene, texts[i]);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}
