/* SPDX-License-Identifier: Apache-2.0
 *
 * Builds the tree of nodes: objects, properties, references and aliases; resolves the
 * references and refuses cycles when all nodes are there. */
#include "tree.h"
#include "base/nearest.h"
#include <stdio.h>
#include <string.h>

void imp__tree_init(struct imp_tree *t, struct imp_scene *scene)
{
    *t = (struct imp_tree){.ctx = scene->ctx,
                           .arena = &scene->arena,
                           .brief = &scene->files,
                           .ids.ctx = scene->ctx,
                           .slots.ctx = scene->ctx};
}

void imp__tree_free(struct imp_tree *t)
{
    imp__names_free(&t->ids);
    imp__names_free(&t->slots);
    imp__release(t->ctx, t->nodes);
    t->nodes = NULL;
}

static enum imp_status no_memory(imp_context *ctx)
{
    return imp__error(ctx, IMP_E_NOMEM, "scene: out of memory");
}

enum imp_status imp__loc_error(imp_context *ctx, struct imp_loc loc,
                               enum imp_status status, const char *format, ...)
{
    char where[512], text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__error(ctx, status, "%s: %s", imp__loc_text(loc, where, sizeof where),
                      text);
}

bool imp__is_object_tag(const char *tag)
{
    static const char *const tags[] = {
        "scene",  "bsdf",     "emitter", "film",    "integrator", "medium",
        "phase",  "rfilter",  "sampler", "sensor",  "shape",      "texture",
        "volume", "spectrum", "rays",    "surface", "target"}; /* of bent rays */
    for (size_t i = 0; i < imp_count(tags); i++)
        if (strcmp(tags[i], tag) == 0) return true;
    return false;
}

/* One name, one thing: `name` (already in the arena) must be free inside `node`. */
static enum imp_status slot_take(struct imp_tree *t, struct imp_node *node,
                                 const char *name, struct imp_loc loc)
{
    char where[512];
    const struct imp_name *old = imp__names_find(&t->slots, node, name);
    if (old)
        return imp__loc_error(t->ctx, loc, IMP_E_SCENE,
                              "%s: '%s' is given twice (first at %s)", node->tag, name,
                              imp__loc_text(old->loc, where, sizeof where));
    return imp__names_add(&t->slots, node, name, NULL, loc) ? IMP_OK : no_memory(t->ctx);
}

static enum imp_status id_take(struct imp_tree *t, const char *id, struct imp_node *node,
                               struct imp_loc loc)
{
    char where[512];
    const struct imp_name *old = imp__names_find(&t->ids, NULL, id);
    if (old)
        return imp__loc_error(t->ctx, loc, IMP_E_SCENE,
                              "id '%s' is used twice (first at %s)", id,
                              imp__loc_text(old->loc, where, sizeof where));
    return imp__names_add(&t->ids, NULL, id, node, loc) ? IMP_OK : no_memory(t->ctx);
}

static enum imp_status empty_refused(struct imp_tree *t, const char *what,
                                     const char *text, struct imp_loc loc)
{
    if (!text || *text) return IMP_OK;
    return imp__loc_error(t->ctx, loc, IMP_E_SCENE, "empty %s", what);
}

static struct imp_arena *arena_of(const struct imp_tree *t, const char *tag,
                                  const char *type)
{
    const bool many = type && strcmp(tag, "shape") == 0 && strcmp(type, "instance") == 0;
    return many ? t->brief : t->arena;
}

/* Instances are taken out of the tree once they are built, and what they were read from is
 * released: elsewhere they are not used. */
static enum imp_status place_check(const struct imp_tree *t,
                                   const struct imp_node *parent, const char *type,
                                   struct imp_loc loc)
{
    const char *in = parent->type ? parent->type : "";
    const bool group = strcmp(in, "shapegroup") == 0 || strcmp(in, "merge") == 0;
    if (strcmp(parent->tag, "scene") == 0 || (strcmp(parent->tag, "shape") == 0 && group))
        return IMP_OK;
    return imp__loc_error(t->ctx, loc, IMP_E_SCENE,
                          "shape (%s): it is inside a %s (%s); instances belong in the "
                          "scene, or in a shapegroup",
                          type, parent->tag, in);
}

enum imp_status imp__tree_open(struct imp_tree *t, struct imp_node *parent,
                               const char *tag, const char *type, const char *id,
                               const char *name, struct imp_loc loc,
                               struct imp_node **out)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(empty_refused(t, "id", id, loc));
    IMP_TRY(empty_refused(t, "name", name, loc));
    struct imp_node **nodes =
        imp__grow(t->ctx, t->nodes, &t->cap_nodes, t->n_nodes + 1, sizeof *nodes);
    if (nodes) t->nodes = nodes;
    struct imp_node *node =
        imp__node_create(arena_of(t, tag, type), tag, type, id, name, loc);
    if (!nodes || !node) IMP_TRY(no_memory(t->ctx));
    if (id) IMP_TRY(id_take(t, node->id, node, loc));
    if (parent) {
        const bool many = arena_of(t, tag, type) == t->brief;
        if (many) IMP_TRY(place_check(t, parent, type, loc));
        struct imp_arena *list = many ? t->brief : arena_of(t, parent->tag, parent->type);
        if (!imp__node_add_child(list, parent, node, name, loc))
            IMP_TRY(no_memory(t->ctx));
        if (name) IMP_TRY(slot_take(t, parent, node->name, loc));
    } else t->root = node;
    t->nodes[t->n_nodes++] = node;
    *out = node;
out:
    return st;
}

enum imp_status imp__tree_prop(struct imp_tree *t, struct imp_node *node,
                               const char *name, enum imp_prop_type type,
                               struct imp_loc loc, struct imp_prop **out)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(empty_refused(t, "name", name, loc));
    struct imp_arena *arena = arena_of(t, node->tag, node->type);
    const char *copy = imp__arena_strdup(arena, name);
    if (!copy) IMP_TRY(no_memory(t->ctx));
    IMP_TRY(slot_take(t, node, copy, loc));
    struct imp_prop *p = imp__node_add(arena, node, name, type, loc);
    if (!p) IMP_TRY(no_memory(t->ctx));
    *out = p;
out:
    return st;
}

enum imp_status imp__tree_ref(struct imp_tree *t, struct imp_node *parent, const char *id,
                              const char *name, struct imp_loc loc)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(empty_refused(t, "id", id, loc));
    IMP_TRY(empty_refused(t, "name", name, loc));
    struct imp_arena *arena = arena_of(t, parent->tag, parent->type);
    struct imp_child *c = imp__node_add_child(arena, parent, NULL, name, loc);
    if (!c) IMP_TRY(no_memory(t->ctx));
    c->ref = imp__arena_strdup(arena, id);
    if (!c->ref) IMP_TRY(no_memory(t->ctx));
    if (name) IMP_TRY(slot_take(t, parent, c->name, loc));
out:
    return st;
}

/* "; did you mean 'x'?" if an id is near, else "". */
static const char *suggestion(const struct imp_tree *t, const char *id, char *text,
                              size_t size)
{
    struct imp_nearest n = imp__nearest(id);
    for (size_t i = 0; i < t->ids.capacity; i++)
        if (t->ids.slots[i].name) imp__nearest_try(&n, t->ids.slots[i].name);
    text[0] = 0;
    if (n.best) snprintf(text, size, "; did you mean '%s'?", n.best);
    return text;
}

enum imp_status imp__tree_alias(struct imp_tree *t, const char *id, const char *as,
                                struct imp_loc loc)
{
    enum imp_status st = IMP_OK;
    char near[160];
    IMP_TRY(empty_refused(t, "id", as, loc));
    const struct imp_name *source = imp__names_find(&t->ids, NULL, id);
    if (!source)
        IMP_TRY(imp__loc_error(t->ctx, loc, IMP_E_SCENE, "alias of unknown id '%s'%s", id,
                               suggestion(t, id, near, sizeof near)));
    struct imp_node *node = source->value;
    const char *copy = imp__arena_strdup(t->arena, as);
    if (!copy) IMP_TRY(no_memory(t->ctx));
    IMP_TRY(id_take(t, copy, node, loc));
out:
    return st;
}

/* Longest chain of objects below, this one counted, kept in node->visiting; -1 while on
 * the way, so meeting -1 again is a cycle. Recursion is as deep as chains may be. */
static enum imp_status height(struct imp_tree *t, struct imp_node *node,
                              struct imp_loc loc, int depth)
{
    if (depth > IMP_DEPTH_MAX)
        return imp__loc_error(t->ctx, loc, IMP_E_SCENE,
                              "objects are nested deeper than %d", IMP_DEPTH_MAX);
    int most = 0;
    node->visiting = -1;
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_child *c = &node->children[i];
        if (c->node->visiting < 0)
            return imp__loc_error(t->ctx, c->loc, IMP_E_SCENE,
                                  "reference to '%s' makes a cycle", c->ref);
        if (c->node->visiting == 0) {
            const enum imp_status st = height(t, c->node, c->loc, depth + 1);
            if (st != IMP_OK) return st;
        }
        most = imp_max(most, c->node->visiting);
        if (depth + most > IMP_DEPTH_MAX)
            return imp__loc_error(t->ctx, c->loc, IMP_E_SCENE,
                                  "objects are nested deeper than %d", IMP_DEPTH_MAX);
    }
    node->visiting = most + 1;
    return IMP_OK;
}

enum imp_status imp__tree_resolve(struct imp_tree *t)
{
    for (size_t i = 0; i < t->n_nodes; i++)
        for (size_t k = 0; k < t->nodes[i]->n_children; k++) {
            struct imp_child *c = &t->nodes[i]->children[k];
            if (c->node) continue;
            const struct imp_name *target = imp__names_find(&t->ids, NULL, c->ref);
            char near[160];
            if (!target)
                return imp__loc_error(t->ctx, c->loc, IMP_E_SCENE,
                                      "reference to unknown id '%s'%s", c->ref,
                                      suggestion(t, c->ref, near, sizeof near));
            c->node = target->value;
        }
    if (!t->root) return IMP_OK;
    const enum imp_status st = height(t, t->root, t->root->loc, 1);
    for (size_t i = 0; i < t->n_nodes; i++) t->nodes[i]->visiting = 0;
    return st;
}
