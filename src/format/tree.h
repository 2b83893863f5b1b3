/* SPDX-License-Identifier: Apache-2.0
 *
 * Growing the tree of nodes of a scene, for the XML reader and the building calls alike:
 * no property and no id twice, references resolved at the end, cycles refused. */
#ifndef IMP_FORMAT_TREE_H
#define IMP_FORMAT_TREE_H

#include "names.h"
#include "scene/scene.h"

#define IMP_DEPTH_MAX 200 /* objects inside objects, references counted */

struct imp_tree {
    imp_context *ctx;
    struct imp_arena *arena;
    struct imp_arena
        *brief;             /* of instances' nodes and lists of them, which are not needed
                                once the scene is built, and which are long */
    struct imp_node *root;  /* tag "scene" */
    struct imp_names ids;   /* owner NULL; value: the node */
    struct imp_names slots; /* owner: a node */
    struct imp_node **nodes; /* all of them, in the order they were opened */
    size_t n_nodes, cap_nodes;
};

void imp__tree_init(struct imp_tree *t, struct imp_scene *scene);
void imp__tree_free(struct imp_tree *t);

/* "file:line:column: message" ("scene: message" for building calls). */
IMP_COLD enum imp_status imp__loc_error(imp_context *ctx, struct imp_loc loc,
                                        enum imp_status status, const char *format, ...)
    IMP_PRINTF(4, 5);

bool imp__is_object_tag(const char *tag);
/* type_tags.c: what an object of this type is ("diffuse": "bsdf"), for dictionaries, which
 * name types alone. @return IMP_E_UNSUPPORTED, with the nearest type, if there is none. */
enum imp_status imp__tag_of_type(imp_context *ctx, const char *type, const char **tag);
/* A new object under `parent`; parent NULL: the root of the scene. */
enum imp_status imp__tree_open(struct imp_tree *t, struct imp_node *parent,
                               const char *tag, const char *type, const char *id,
                               const char *name, struct imp_loc loc,
                               struct imp_node **out);
enum imp_status imp__tree_prop(struct imp_tree *t, struct imp_node *node,
                               const char *name, enum imp_prop_type type,
                               struct imp_loc loc, struct imp_prop **out);
enum imp_status imp__tree_ref(struct imp_tree *t, struct imp_node *parent, const char *id,
                              const char *name, struct imp_loc loc);
enum imp_status imp__tree_alias(struct imp_tree *t, const char *id, const char *as,
                                struct imp_loc loc);
/* Set children[].node of every reference. @return IMP_E_SCENE at the line of a reference
 * to an unknown id, of one that closes a cycle, or of what is nested too deeply. */
enum imp_status imp__tree_resolve(struct imp_tree *t);

#endif
