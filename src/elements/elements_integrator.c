/* SPDX-License-Identifier: Apache-2.0
 *
 * The plugin `elements` of a scene file: its properties, checked by the ranges of
 * imp_elements_create. */
#include "elements_integrator.h"

/* Ranges are those of imp_elements_create, which has the defaults too. */
static enum imp_status elements_build(const struct imp_build *build,
                                      struct imp_integrator *i)
{
    static const char *const images[] = {"flat", "gouraud", "gather"};
    imp_context *ctx = build->ctx;
    struct imp_node *node = build->node;
    struct imp_elements_integrator *e = i->self;
    enum imp_status st = IMP_OK;
    int64_t order, rays, level, links;
    int image;
    bool importance;
    double megabytes;
    IMP_TRY(imp__props_choice(ctx, node, "image", images, 3, 1, &image));
    IMP_TRY(imp__props_bool(ctx, node, "importance", true, &importance));
    IMP_TRY(imp__props_int(ctx, node, "order", 0, 0, 12, &order));
    IMP_TRY(imp__props_int(ctx, node, "rays", 0, 0, 64, &rays));
    IMP_TRY(imp__props_int(ctx, node, "max_level", 0, 0, 10, &level));
    IMP_TRY(imp__props_int(ctx, node, "max_links", 0, 0, UINT32_MAX - 1, &links));
    IMP_TRY(imp__props_float_in(ctx, node, "max_memory", 0,
                                (struct imp_interval){0, 1e12, IMP_OPEN_HI}, &megabytes));
    IMP_TRY(imp__props_float_in(ctx, node, "stop", 0.01, IMP_NOT_NEGATIVE, &e->stop));
    IMP_TRY(imp__props_float_in(ctx, node, "eps", 0, IMP_NOT_NEGATIVE, &e->eps));
    if (order == 1)
        IMP_TRY(imp__prop_error(ctx, node, imp__node_prop(node, "order"), IMP_E_SCENE,
                                "order = 1 is outside [2, 12], and not 0, the default"));
    if (e->stop == 0) e->stop = -1;
    e->image = (enum imp_elements_image)image;
    e->no_importance = !importance;
    e->order = (int)order;
    e->rays = (int)rays;
    e->max_level = (int)level;
    e->max_links = (size_t)links;
    e->max_bytes = (size_t)(megabytes * 1e6);
out:
    return st;
}

const struct imp_integrator_ops imp__integrator_elements = {
    .size = sizeof(struct imp_integrator_ops),
    .name = "elements",
    .object_size = sizeof(struct imp_elements_integrator),
    .flags = IMP_INTEGRATOR_SOLVES,
    .build = elements_build};
