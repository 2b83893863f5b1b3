/* SPDX-License-Identifier: Apache-2.0
 *
 * Builds BSDFs. Each is built once, where it first appears in document order, however many
 * references it has. */
#include "scene_build.h"

void imp__bsdf_changed(void *payload)
{
    const struct imp_bsdf *b = payload;
    b->ops->changed(b);
}

enum imp_status imp__build_bsdf(struct imp_scene *scene, struct imp_node *node,
                                const char *parent, const char *slot,
                                struct imp_bsdf **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    if (node->object) {
        *out = node->object;
        return IMP_OK;
    }
    if (node->visiting)
        return imp__node_error(ctx, node, IMP_E_SCENE, "the object contains itself");
    node->visiting = 1;
    const void *found;
    IMP_TRY(imp__kind_find(scene->ctx, IMP_CONCEPT_BSDF, node, &found));
    const struct imp_bsdf_ops *ops = found;

    struct imp_bsdf *b = imp__arena_array(&scene->arena, 1, sizeof *b);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!b || !self) IMP_TRY(imp__build_no_memory(scene));
    *b = (struct imp_bsdf){.ops = ops,
                           .self = self,
                           .flags = IMP_BSDF_SMOOTH,
                           .name = imp__build_object_name(scene, node, parent, slot)};
    if (!b->name) IMP_TRY(imp__build_no_memory(scene));

    const struct imp_build build = imp__build_make(scene, node);
    if (ops->prepare) IMP_TRY(ops->prepare(&build));
    int n_own = 0;
    while (ops->inputs && ops->inputs[n_own].name) n_own++;
    const struct imp_input **own =
        imp__arena_array(&scene->arena, (size_t)n_own + 1, sizeof *own);
    if (!own) IMP_TRY(imp__build_no_memory(scene));
    IMP_TRY(imp__build_inputs(scene, node, b->name, ops->inputs, own, &b->n_own));

    b->n_in = b->n_own;
    for (size_t i = 0; i < node->n_children && ops->max_children > 0; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "bsdf") != 0) continue;
        c->used = true;
        if (b->n_child == imp_min(ops->max_children, 2))
            IMP_TRY(imp__node_error(ctx, c->node, IMP_E_SCENE,
                                    "'%s' takes at most %d bsdfs", ops->name,
                                    ops->max_children));
        char child_slot[32];
        if (ops->max_children == 1 && !ops->child_name)
            snprintf(child_slot, sizeof child_slot, "nested_bsdf");
        else
            snprintf(child_slot, sizeof child_slot, "%s_%d",
                     ops->child_name ? ops->child_name : "bsdf", b->n_child);
        struct imp_bsdf *child;
        IMP_TRY(imp__build_bsdf(scene, c->node, b->name, child_slot, &child));
        b->child_in[b->n_child] = b->n_in;
        b->child[b->n_child++] = child;
        b->n_in += child->n_in;
        if (b->n_in > IMP_INPUTS_MAX)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "has %d inputs with all that is nested in it; at "
                                    "most %d are possible",
                                    b->n_in, IMP_INPUTS_MAX));
    }
    if (b->n_child < ops->min_children)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "a nested bsdf is missing"));
    b->input = imp__arena_array(&scene->arena, (size_t)b->n_in + 1, sizeof *b->input);
    if (!b->input) IMP_TRY(imp__build_no_memory(scene));
    memcpy(b->input, own, (size_t)b->n_own * sizeof *own);
    for (int k = 0; k < b->n_child; k++)
        if (b->child[k]->n_in)
            memcpy(b->input + b->child_in[k], b->child[k]->input,
                   (size_t)b->child[k]->n_in * sizeof *b->input);

    b->shaped = imp__build_shaped(scene, b->input, b->n_in);
    b->index_input = -1;
    for (int j = 0; j < b->n_own; j++)
        if (ops->inputs[j].flags & IMP_INPUT_INDEX) b->index_input = j;

    struct imp_mixing *mixing;
    if (ops->build) IMP_TRY(ops->build(&build, self, b));
    for (int j = 0; j < b->n_own; j++)
        if (b->fixed >> j & 1) imp__build_fix(scene, b->input[j], b->why);
    IMP_TRY(imp__mixing_read(&build, &mixing));
    IMP_TRY(imp__props_finish(ctx, node));
    if (ops->changed)
        IMP_TRY(imp__build_watch(scene, b->input, b->n_in, imp__bsdf_changed, b));
    b->index = scene->n_bsdfs;
    IMP_TRY(imp__build_list_add(scene, (void ***)&scene->bsdfs, &scene->n_bsdfs, b));
    IMP_TRY(imp__build_list_add(scene, (void ***)&scene->bsdf_mixing,
                                &scene->n_bsdf_mixing, mixing));
    node->object = b;
    *out = b;
out:
    node->visiting = 0;
    return st;
}

enum imp_status imp__build_black(struct imp_scene *scene, struct imp_bsdf **out)
{
    struct imp_bsdf *b = imp__arena_array(&scene->arena, 1, sizeof *b);
    if (!b) return imp__build_no_memory(scene);
    *b =
        (struct imp_bsdf){.ops = &imp__black, .index_input = -1, .index = -1, .name = ""};
    *out = b; /* flags 0: nothing is reflected, so no light samples and no continuation */
    return IMP_OK;
}
