/* SPDX-License-Identifier: Apache-2.0
 *
 * Shared by the files that make objects from nodes: build.c (the scene), build_objects.c
 * (materials, lights, shapes, sensors), build_inputs.c (their inputs, and textures). */
#ifndef IMP_SCENE_BUILD_H
#define IMP_SCENE_BUILD_H

#include "base/nearest.h"
#include "color/convert.h"
#include "scene.h"
#include <stdio.h>
#include <string.h>

enum imp_status imp__build_no_memory(struct imp_scene *scene);
/* "parent.key"; NULL: no memory. */
char *imp__build_name(struct imp_scene *scene, const char *parent, const char *key);
/* The name of an object: its id, else the slot below the parent. */
const char *imp__build_object_name(struct imp_scene *scene, const struct imp_node *node,
                                   const char *parent, const char *slot);
/* Append to one of the scene's lists; they live in the arena and double. */
enum imp_status imp__build_list_add(struct imp_scene *scene, void ***list, int *n,
                                    void *object);
/* The argument of a kind's build function. */
struct imp_build imp__build_make(struct imp_scene *scene, struct imp_node *node);

/* Read the declared inputs of a node into out [as many as desc has]; *n how many. */
enum imp_status imp__build_inputs(struct imp_scene *scene, struct imp_node *node,
                                  const char *name, const struct imp_input_desc *desc,
                                  const struct imp_input **out, int *n);
enum imp_status imp__build_texture(struct imp_scene *scene, struct imp_node *node,
                                   const char *parent, const char *slot,
                                   struct imp_texture **out);

enum imp_status imp__build_bsdf(struct imp_scene *scene, struct imp_node *node,
                                const char *parent, const char *slot,
                                struct imp_bsdf **out);
/* A material of reflectance 0 that has no parameter: emitters' default. */
enum imp_status imp__build_black(struct imp_scene *scene, struct imp_bsdf **out);
/* An area light without a shape is only declared, and nothing is made. */
enum imp_status imp__build_emitter(struct imp_scene *scene, struct imp_node *node,
                                   const char *parent, const char *slot,
                                   struct imp_shape *shape);
enum imp_status imp__build_shape(struct imp_scene *scene, struct imp_node *node,
                                 const char *name);
enum imp_status imp__build_sensor(struct imp_scene *scene, struct imp_node *node,
                                  const char *name);

/* Names of all kinds of a concept, for the message "there is no such plugin". */
#define KIND_LIST(table, buffer)                                                         \
    do {                                                                                 \
        (buffer)[0] = 0;                                                                 \
        for (size_t k_ = 0; (table)[k_]; k_++) {                                         \
            const size_t n_ = strlen(buffer);                                            \
            if (k_ && strcmp((table)[k_]->name, (table)[k_ - 1]->name) == 0) continue;   \
            snprintf((buffer) + n_, sizeof(buffer) - n_, "%s%s", k_ ? ", " : "",         \
                     (table)[k_]->name);                                                 \
        }                                                                                \
    } while (0)
/* The kind of this node's type, or an error that says what there is. */
#define KIND_FIND(scene, node, table, out)                                               \
    do {                                                                                 \
        size_t i_ = 0;                                                                   \
        while ((table)[i_] && strcmp((table)[i_]->name, (node)->type) != 0) i_++;        \
        (out) = (table)[i_];                                                             \
        if (!(out)) {                                                                    \
            char list_[1024];                                                            \
            struct imp_nearest near_ = imp__nearest((node)->type);                       \
            KIND_LIST(table, list_);                                                     \
            for (i_ = 0; (table)[i_]; i_++) imp__nearest_try(&near_, (table)[i_]->name); \
            IMP_TRY(imp__node_error(                                                     \
                (scene)->ctx, node, IMP_E_UNSUPPORTED,                                   \
                "this version has no such %s; it has %s%s%s%s", (node)->tag, list_,      \
                near_.best ? "; did you mean '" : "", near_.best ? near_.best : "",      \
                near_.best ? "'?" : ""));                                                \
        }                                                                                \
    } while (0)

#endif
