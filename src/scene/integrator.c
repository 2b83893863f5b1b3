/* SPDX-License-Identifier: Apache-2.0
 *
 * Integrators of a scene file, and those nested in them, made from the list of kinds. */
#include "integrator.h"
#include "scene_build.h"

/* Others in it; those without a name are called _arg_0, _arg_1, ... as Mitsuba does. */
static enum imp_status inner_build(struct imp_scene *scene, struct imp_node *node,
                                   const struct imp_integrator_ops *const *kinds,
                                   struct imp_integrator *out)
{
    enum imp_status st = IMP_OK;
    out->inner =
        imp__arena_array(&scene->arena, node->n_children + 1, sizeof *out->inner);
    if (!out->inner) return imp__build_no_memory(scene);
    int nameless = 0;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "integrator") != 0) continue;
        c->used = true;
        struct imp_integrator *inner = &out->inner[out->n_inner];
        IMP_TRY(imp__integrator_build(scene, c->node, kinds, inner));
        if (!(inner->ops->flags & IMP_INTEGRATOR_INNER))
            IMP_TRY(imp__node_error(scene->ctx, c->node, IMP_E_UNSUPPORTED,
                                    "an integrator of this type cannot be nested"));
        char slot[] = "_arg_0";
        slot[5] = (char)('0' + nameless % 10);
        if (!c->name) nameless++;
        inner->name = c->name ? c->name : imp__arena_strdup(&scene->arena, slot);
        if (!inner->name) IMP_TRY(imp__build_no_memory(scene));
        out->n_inner++;
    }
out:
    return st;
}

static const void *listed_at(const void *payload, size_t i)
{
    const struct imp_integrator_ops *const *kinds = payload;
    return kinds[i];
}

enum imp_status imp__integrator_build(struct imp_scene *scene, struct imp_node *node,
                                      const struct imp_integrator_ops *const *kinds,
                                      struct imp_integrator *out)
{
    imp_context *ctx = scene->ctx;
    enum imp_status st = IMP_OK;
    const void *found;
    IMP_TRY(imp__kind_choose(ctx, node, listed_at, kinds, &found));
    const struct imp_integrator_ops *ops = found;
    *out = (struct imp_integrator){.ops = ops, .max_depth = -1};
    out->self = imp__arena_array(&scene->arena, 1, imp_max(ops->object_size, (size_t)1));
    if (!out->self) IMP_TRY(imp__build_no_memory(scene));

    /* Accepted, and without meaning here: work is cut and timed by the caller. */
    int64_t block, passes;
    double timeout;
    IMP_TRY(imp__props_int(ctx, node, "block_size", 0, 0, INT32_MAX, &block));
    IMP_TRY(imp__props_int(ctx, node, "samples_per_pass", 0, 0, INT32_MAX, &passes));
    IMP_TRY(imp__props_float(ctx, node, "timeout", -1, &timeout));

    if (ops->flags & IMP_INTEGRATOR_CONTAINS)
        IMP_TRY(inner_build(scene, node, kinds, out));
    const struct imp_build build = imp__build_make(scene, node);
    if (ops->build) IMP_TRY(ops->build(&build, out));
    IMP_TRY(imp__props_finish(ctx, node));
out:
    return st;
}

enum imp_status imp__integrator_ready(struct imp_scene *scene,
                                      const struct imp_integrator *i)
{
    enum imp_status st = IMP_OK;
    for (int k = 0; k < i->n_inner; k++)
        IMP_TRY(imp__integrator_ready(scene, &i->inner[k]));
    if (i->ops->ready) IMP_TRY(i->ops->ready(scene, i));
out:
    return st;
}
