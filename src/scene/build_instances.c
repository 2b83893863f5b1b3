/* SPDX-License-Identifier: Apache-2.0
 *
 * Groups and instances from nodes. The shapes of groups follow those of the scene itself
 * in its list, where `n_shapes` counts only the latter; rays meet them through instances
 * only. */
#include "instances.h"
#include "scene_build.h"
#include <stdlib.h>

#define NESTED_MAX 8 /* each costs a query of Embree inside another */

bool imp__is_group(const struct imp_node *node)
{
    return strcmp(node->tag, "shape") == 0 && strcmp(node->type, "shapegroup") == 0;
}
bool imp__is_instance(const struct imp_node *node)
{
    return strcmp(node->tag, "shape") == 0 && strcmp(node->type, "instance") == 0;
}

static enum imp_status group_build(struct imp_scene *scene, struct imp_node *node,
                                   const char *name, int depth,
                                   const struct imp_group **out);

/* ---- Shapes of a group -------------------------------------------------------------- */

static enum imp_status member_check(struct imp_scene *scene, const struct imp_group *g,
                                    const struct imp_node *node)
{
    imp_context *ctx = scene->ctx;
    if (strcmp(node->tag, "shape") != 0)
        return imp__node_error(ctx, node, IMP_E_SCENE,
                               "shapegroup '%s' holds shapes and instances only",
                               g->name);
    if (imp__is_group(node))
        return imp__node_error(ctx, node, IMP_E_SCENE,
                               "a shapegroup inside shapegroup '%s': put an "
                               "instance of it there",
                               g->name);
    if (node->object)
        return imp__node_error(ctx, node, IMP_E_SCENE,
                               "the shape is in the scene or in another group "
                               "already");
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "emitter") == 0 || strcmp(c->node->tag, "sensor") == 0)
            return imp__node_error(ctx, c->node, IMP_E_UNSUPPORTED,
                                   "a shape of shapegroup '%s' has no %s: lights and "
                                   "sensors have one place",
                                   g->name, c->node->tag);
        if (strcmp(c->node->tag, "medium") == 0 && strcmp(c->node->type, "graded") == 0)
            return imp__node_error(ctx, c->node, IMP_E_UNSUPPORTED,
                                   "a shape of shapegroup '%s' is filled by no graded "
                                   "index: its field has one place",
                                   g->name);
        if (imp__is_proxy(c))
            return imp__node_error(ctx, c->node, IMP_E_UNSUPPORTED,
                                   "a shape of shapegroup '%s' has no proxy: walks aim "
                                   "at what has one place",
                                   g->name);
    }
    return IMP_OK;
}

static enum imp_status members_build(struct imp_scene *scene, struct imp_node *node,
                                     struct imp_group *g)
{
    enum imp_status st = IMP_OK;
    const imp_v3 lo = scene->lo, hi = scene->hi;
    g->first = scene->n_shapes;
    scene->lo = g->lo;
    scene->hi = g->hi;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        c->used = true;
        if (imp__is_instance(c->node)) continue;
        char slot[32];
        snprintf(slot, sizeof slot, "shape%zu", i);
        IMP_TRY(member_check(scene, g, c->node));
        const char *name =
            imp__build_object_name(scene, c->node, g->name, c->name ? c->name : slot);
        if (!name) IMP_TRY(imp__build_no_memory(scene));
        IMP_TRY(imp__build_shape(scene, c->node, name));
    }
    g->n_shapes = scene->n_shapes - g->first;
    g->lo = scene->lo;
    g->hi = scene->hi;
out:
    scene->lo = lo;
    scene->hi = hi;
    return st;
}

/* All shapes that can be met in the group, without repeats. */
static int by_index(const void *a, const void *b)
{
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}
static enum imp_status within_list(struct imp_scene *scene, struct imp_group *g)
{
    size_t most = (size_t)g->n_shapes, n = 0;
    for (int i = 0; i < g->n_instances; i++) { /* those of one group are adjacent */
        const struct imp_group *in = g->instance[i].group;
        if (i == 0 || in != g->instance[i - 1].group) most += (size_t)in->n_within;
    }
    int *all = imp__arena_take(&scene->arena, most + 1, sizeof *all);
    if (!all) return imp__build_no_memory(scene);
    for (int k = 0; k < g->n_shapes; k++) all[n++] = g->first + k;
    for (int i = 0; i < g->n_instances; i++) {
        const struct imp_group *in = g->instance[i].group;
        if (i > 0 && in == g->instance[i - 1].group) continue;
        for (int k = 0; k < in->n_within; k++) all[n++] = in->within[k];
    }
    qsort(all, n, sizeof *all, by_index);
    for (size_t k = 0; k < n; k++)
        if (g->n_within == 0 || all[g->n_within - 1] != all[k])
            all[g->n_within++] = all[k];
    g->within = all;
    for (int k = 0; k < g->n_within; k++)
        g->bumped |= imp__is_bumped(scene, scene->shapes[all[k]]->bsdf);
    for (int i = 0; i < g->n_instances; i++) {
        const struct imp_instance *p = &g->instance[i];
        g->bumped |=
            p->group->bumped || (p->covered && imp__is_bumped(scene, p->covered->bsdf));
        g->stretched |= p->group->stretched || imp__instance_stretches(p);
    }
    return IMP_OK;
}

/* ---- Materials by instance ------------------------------------------------------------ */

static enum imp_status covered_make(struct imp_scene *scene, const struct imp_node *node,
                                    const struct imp_group *g, int bsdf,
                                    const struct imp_covered **out)
{
    enum imp_status st = IMP_OK;
    for (int k = 0; k < scene->n_covered; k++)
        if (scene->covered[k]->group == g && scene->covered[k]->bsdf == bsdf) {
            *out = scene->covered[k];
            return IMP_OK;
        }
    struct imp_covered *c = imp__arena_array(&scene->arena, 1, sizeof *c);
    if (!c) return imp__build_no_memory(scene);
    *c = (struct imp_covered){g, bsdf, scene->n_shapes};
    for (int k = 0; k < g->n_within; k++) {
        struct imp_shape *s = imp__arena_array(&scene->arena, 1, sizeof *s);
        if (!s) return imp__build_no_memory(scene);
        *s = *scene->shapes[g->within[k]];
        s->bsdf = bsdf;
        s->index = scene->n_shapes;
        IMP_TRY(imp__build_bumps_survey(scene, node, s));
        IMP_TRY(
            imp__build_list_add(scene, (void ***)&scene->shapes, &scene->n_shapes, s));
    }
    IMP_TRY(imp__build_list_add(scene, (void ***)&scene->covered, &scene->n_covered, c));
    *out = c;
out:
    return st;
}

/* ---- Instances ------------------------------------------------------------------------ */

static enum imp_status place_read(struct imp_scene *scene, struct imp_node *node,
                                  const char *key, struct imp_map *map,
                                  struct imp_map *inverse)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const struct imp_prop *p = imp__node_prop(node, key);
    struct imp_mat4 m;
    IMP_TRY(imp__props_transform(ctx, node, key, m.m));
    if (!imp__mat4_is_finite(&m))
        IMP_TRY(imp__prop_error(ctx, node, p, IMP_E_SCENE, "%s is not finite", key));
    if (!imp__mat4_is_affine(&m))
        IMP_TRY(imp__prop_error(ctx, node, p, IMP_E_SCENE,
                                "%s is not affine: its last row must be 0 0 0 1", key));
    *map = imp__map_of(&m);
    if (!imp__map_inverse(map, inverse))
        IMP_TRY(imp__prop_error(ctx, node, p, IMP_E_SCENE,
                                "%s is singular: it flattens the group", key));
out:
    return st;
}

static enum imp_status motion_read(struct imp_scene *scene, struct imp_node *node,
                                   struct imp_instance *p)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    struct imp_map end, inverse;
    double from, to;
    if (!imp__props_has(node, "to_world_end")) return IMP_OK;
    IMP_TRY(place_read(scene, node, "to_world_end", &end, &inverse));
    IMP_TRY(imp__props_float(ctx, node, "time_start", 0, &from));
    IMP_TRY(imp__props_float(ctx, node, "time_end", 1, &to));
    if (!(from < to))
        IMP_TRY(imp__prop_error(
            ctx, node,
            imp__node_prop(node,
                           imp__props_has(node, "time_end") ? "time_end" : "time_start"),
            IMP_E_SCENE, "time_end = %g is outside (time_start = %g, inf]", to, from));
    struct imp_motion *m = imp__arena_array(&scene->arena, 1, sizeof *m);
    if (!m) IMP_TRY(imp__build_no_memory(scene));
    if (!imp__motion_make(&p->to_world, &end, from, to, m))
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "of to_world and to_world_end one mirrors the group and "
                                "the other does not: between them it would be flat"));
    p->motion = m;
out:
    return st;
}

static bool is_placed(const struct imp_group *g, const struct imp_instance *p, imp_v3 *lo,
                      imp_v3 *hi)
{
    imp__instance_box(p, lo, hi);
    bool fits = g->lo[0] <= g->hi[0];
    for (int k = 0; k < 3; k++)
        fits &= (*lo)[k] > -IMP_REACH_MAX && (*hi)[k] < IMP_REACH_MAX;
    return fits;
}

static enum imp_status instance_build(struct imp_scene *scene, struct imp_node *node,
                                      const char *name, int depth, struct imp_instance *p)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    struct imp_node *group = NULL, *bsdf = NULL;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        const bool is_group = imp__is_group(c->node);
        if (!is_group && strcmp(c->node->tag, "bsdf") != 0) continue;
        struct imp_node **slot = is_group ? &group : &bsdf;
        if (*slot)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "has two %ss",
                                    is_group ? "shapegroup" : "bsdf"));
        *slot = c->node;
        c->used = true;
    }
    if (!group)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "an instance has a shapegroup, or a ref to one"));
    IMP_TRY(group_build(scene, group, group->id ? group->id : name, depth, &p->group));
    IMP_TRY(place_read(scene, node, "to_world", &p->to_world, &p->to_local));
    IMP_TRY(motion_read(scene, node, p));
    imp_v3 lo, hi;
    if (!is_placed(p->group, p, &lo, &hi))
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "reaches further out than %g",
                                IMP_REACH_MAX));
    if (bsdf) {
        struct imp_bsdf *made;
        IMP_TRY(imp__build_bsdf(scene, bsdf, name, "bsdf", &made));
        IMP_TRY(covered_make(scene, node, p->group, made->index, &p->covered));
    }
    IMP_TRY(imp__props_finish(ctx, node));
out:
    return st;
}

/* The instances among the children of a node; with them the group is whole. */
static enum imp_status instances_build(struct imp_scene *scene, struct imp_node *node,
                                       int depth, struct imp_group *g)
{
    enum imp_status st = IMP_OK;
    size_t n = 0, kept = 0;
    for (size_t i = 0; i < node->n_children; i++)
        n += imp__is_instance(node->children[i].node);
    if (n > INT32_MAX)
        return imp__node_error(scene->ctx, node, IMP_E_SCENE,
                               "has %zu instances; at most %d are possible", n,
                               INT32_MAX);
    g->instance = imp__arena_array(&scene->arena, n + 1, sizeof *g->instance);
    if (!g->instance) return imp__build_no_memory(scene);
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (!imp__is_instance(c->node)) {
            node->children[kept++] = *c;
            continue;
        }
        struct imp_instance *p = &g->instance[g->n_instances];
        char name[64];
        snprintf(name, sizeof name, "%.40s%d", *g->name ? g->name : "instance",
                 g->n_instances);
        c->used = true;
        IMP_TRY(
            instance_build(scene, c->node, c->node->id ? c->node->id : name, depth, p));
        if (depth == 0) IMP_TRY(imp__bumps_place(scene, c->node, p));
        if (depth == 0 && c->node->id) {
            p->name = imp__arena_strdup(&scene->arena, c->node->id);
            if (!p->name) return imp__build_no_memory(scene);
        }
        p->before = g->n_places;
        if (__builtin_add_overflow(g->n_places, 1 + p->group->n_places, &g->n_places))
            IMP_TRY(imp__node_error(scene->ctx, c->node, IMP_E_SCENE,
                                    "with what is in it there are more than 2^63 "
                                    "places"));
        imp_v3 lo, hi;
        imp__instance_box(p, &lo, &hi);
        for (int k = 0; k < 3; k++) {
            g->lo[k] = imp_min(lo[k], g->lo[k]);
            g->hi[k] = imp_max(hi[k], g->hi[k]);
        }
        g->n_instances++;
    }
    /* Their nodes are many, and go with the files (format/tree.c). */
    if (n > 0) {
        struct imp_child *rest = imp__arena_array(&scene->arena, kept + 1, sizeof *rest);
        if (!rest) IMP_TRY(imp__build_no_memory(scene));
        memcpy(rest, node->children, kept * sizeof *rest);
        node->children = rest;
        node->n_children = node->cap_children = kept;
    }
out:
    return st;
}

static enum imp_status group_build(struct imp_scene *scene, struct imp_node *node,
                                   const char *name, int depth,
                                   const struct imp_group **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    if (node->object) {
        *out = node->object;
        return IMP_OK;
    }
    if (depth == NESTED_MAX)
        return imp__node_error(ctx, node, IMP_E_SCENE,
                               "instances are nested deeper than %d", NESTED_MAX);
    struct imp_group *g = imp__arena_array(&scene->arena, 1, sizeof *g);
    if (!g) return imp__build_no_memory(scene);
    g->name = imp__arena_strdup(&scene->arena, name);
    if (!g->name) return imp__build_no_memory(scene);
    g->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    g->hi = -g->lo;
    /* Groups in it come first: their shapes are not between its own. */
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_node *child = node->children[i].node;
        if (!imp__is_instance(child)) continue;
        for (size_t k = 0; k < child->n_children; k++) {
            struct imp_node *in = child->children[k].node;
            const struct imp_group *made;
            if (imp__is_group(in))
                IMP_TRY(group_build(scene, in, in->id ? in->id : name, depth + 1, &made));
        }
    }
    IMP_TRY(members_build(scene, node, g));
    IMP_TRY(instances_build(scene, node, depth + 1, g));
    if (!(g->lo[0] <= g->hi[0]))
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "no shape is in it"));
    IMP_TRY(within_list(scene, g));
    IMP_TRY(imp__props_finish(ctx, node));
    IMP_TRY(imp__build_list_add(scene, (void ***)&scene->groups, &scene->n_groups, g));
    node->object = g;
    *out = g;
out:
    return st;
}

enum imp_status imp__instances_build(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    struct imp_node *root = scene->root;
    const int n_shapes = scene->n_shapes;
    bool any = false;
    for (size_t i = 0; i < root->n_children; i++) {
        struct imp_node *node = root->children[i].node;
        const struct imp_group *g;
        any |= imp__is_instance(node);
        if (imp__is_group(node))
            IMP_TRY(group_build(scene, node, node->id ? node->id : "shapegroup", 0, &g));
    }
    if (any) {
        struct imp_group *world = imp__arena_array(&scene->arena, 1, sizeof *world);
        if (!world) IMP_TRY(imp__build_no_memory(scene));
        world->name = "";
        world->n_shapes = n_shapes;
        world->lo = scene->lo;
        world->hi = scene->hi;
        IMP_TRY(instances_build(scene, root, 0, world));
        scene->lo = world->lo;
        scene->hi = world->hi;
        scene->world = world;
    }
    scene->n_all_shapes = scene->n_shapes;
    scene->n_shapes = n_shapes;
out:
    return st;
}
