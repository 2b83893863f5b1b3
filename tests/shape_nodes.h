/* SPDX-License-Identifier: Apache-2.0
 *
 * Shapes for tests, made from nodes as the scene builder makes them, and scenes that are
 * nothing but a list of shapes. */
#ifndef IMP_TEST_SHAPE_NODES_H
#define IMP_TEST_SHAPE_NODES_H

#include "kind/shape/shape.h"
#include "scene/scene.h"
#include <stdlib.h>

static struct imp_scene world;
static struct imp_bsdf world_bsdf = {.flags = IMP_BSDF_SMOOTH};

static inline void world_begin(imp_context *ctx)
{
    world = (struct imp_scene){.ctx = ctx, .default_bsdf = &world_bsdf};
    imp__arena_init(&world.arena, ctx);
}
static inline void world_end(void)
{
    imp__intersector_destroy(&world);
    imp__arena_free(&world.arena);
    free(world.shapes);
    world = (struct imp_scene){0};
}

static inline struct imp_node *node_new(const char *tag, const char *type)
{
    return imp__node_create(&world.arena, tag, type, NULL, NULL, (struct imp_loc){0});
}
static inline struct imp_prop *node_float(struct imp_node *n, const char *name, double v)
{
    struct imp_prop *p = imp__node_add(&world.arena, n, name, IMP_PROP_FLOAT, n->loc);
    p->number[0] = v;
    return p;
}
static inline void node_bool(struct imp_node *n, const char *name, bool v)
{
    imp__node_add(&world.arena, n, name, IMP_PROP_BOOL, n->loc)->integer = v;
}
static inline void node_int(struct imp_node *n, const char *name, int64_t v)
{
    imp__node_add(&world.arena, n, name, IMP_PROP_INTEGER, n->loc)->integer = v;
}
static inline void node_string(struct imp_node *n, const char *name, const char *v)
{
    imp__node_add(&world.arena, n, name, IMP_PROP_STRING, n->loc)->string = v;
}
static inline void node_vector(struct imp_node *n, const char *name, imp_v3 v)
{
    struct imp_prop *p = imp__node_add(&world.arena, n, name, IMP_PROP_VECTOR, n->loc);
    for (int i = 0; i < 3; i++) p->number[i] = v[i];
}
static inline void node_transform(struct imp_node *n, struct imp_mat4 m)
{
    struct imp_prop *p =
        imp__node_add(&world.arena, n, "to_world", IMP_PROP_TRANSFORM, n->loc);
    memcpy(p->number, m.m, sizeof m.m);
}

static inline const struct imp_shape_ops *shape_kind(const char *type)
{
    for (int i = 0; imp__shape_kinds[i]; i++)
        if (strcmp(imp__shape_kinds[i]->name, type) == 0) return imp__shape_kinds[i];
    return NULL;
}
/* Build the shape; NULL on failure, with *status set. Appended to world.shapes. */
static inline struct imp_shape *shape_build(struct imp_node *node,
                                            enum imp_status *status)
{
    const struct imp_shape_ops *ops = shape_kind(node->type);
    struct imp_shape *s = imp__arena_array(&world.arena, 1, sizeof *s);
    void *self = imp__arena_array(&world.arena, 1, ops->object_size);
    const struct imp_build b = {.ctx = world.ctx, .node = node, .arena = &world.arena};
    if (!s || !self) {
        if (status) *status = IMP_E_NOMEM;
        return NULL;
    }
    *s = (struct imp_shape){.ops = ops,
                            .self = self,
                            .index = world.n_shapes,
                            .bsdf = -1,
                            .emitter = -1,
                            .name = node->type};
    enum imp_status st = ops->build(&b, self, s);
    if (st == IMP_OK) st = imp__props_finish(world.ctx, node);
    if (st == IMP_OK) st = imp__shape_measure(world.ctx, &world.arena, s);
    if (status) *status = st;
    if (st != IMP_OK) return NULL;
    world.shapes =
        realloc(world.shapes, (size_t)(world.n_shapes + 1) * sizeof *world.shapes);
    world.shapes[world.n_shapes++] = s;
    return s;
}

/* Every registered kind with some mesh where it wants one: a closed octahedron with
 * unequal axes. */
static const float octa_positions[6 * 3 + 4] = {1, 0,     0, -1, 0, 0,    0, 0.8f, 0,
                                                0, -0.8f, 0, 0,  0, 1.5f, 0, 0,    -1.5f};
static const uint32_t octa_indices[8 * 3] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                             2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
static const struct imp_mesh_data octahedron = {.n_vertices = 6,
                                                .n_triangles = 8,
                                                .positions = octa_positions,
                                                .indices = octa_indices};

/* A tube along x. */
static const float tube_points[16] = {-1.2f, 0, 0, .4f, -.4f, 0, 0, .4f,
                                      .4f,   0, 0, .4f, 1.2f, 0, 0, .4f};
static const uint32_t tube_first[2] = {0, 4};
static const struct imp_curve_data tube_curves = {4, 1, tube_points, tube_first};

static inline struct imp_node *kind_node(const struct imp_shape_ops *ops)
{
    struct imp_node *n = node_new("shape", ops->name);
    if (strcmp(ops->name, "mesh") == 0 || strcmp(ops->name, "obj") == 0 ||
        strcmp(ops->name, "ply") == 0 || strcmp(ops->name, "serialized") == 0)
        n->mesh = &octahedron;
    if (strcmp(ops->name, "bsplinecurve") == 0 || strcmp(ops->name, "linearcurve") == 0)
        n->curves = &tube_curves;
    return n;
}

#endif
