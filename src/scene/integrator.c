/* SPDX-License-Identifier: Apache-2.0
 *
 * Integrators: what a picture holds. path, direct and stam are settings of the one walk
 * engine; depth and aov look at the first hit; moment and aov contain others; elements is
 * the other solver, and makes no walks. */
#include "base/nearest.h"
#include "scene.h"
#include <string.h>

static const struct {
    const char *name;
    enum imp_aov_type type;
} aov_types[] = {
    {"albedo", IMP_AOV_ALBEDO},         {"depth", IMP_AOV_DEPTH},
    {"position", IMP_AOV_POSITION},     {"uv", IMP_AOV_UV},
    {"geo_normal", IMP_AOV_GEO_NORMAL}, {"sh_normal", IMP_AOV_SH_NORMAL},
    {"dp_du", IMP_AOV_DP_DU},           {"dp_dv", IMP_AOV_DP_DV},
    {"duv_dx", IMP_AOV_DUV_DX},         {"duv_dy", IMP_AOV_DUV_DY},
    {"prim_index", IMP_AOV_PRIM_INDEX}, {"shape_index", IMP_AOV_SHAPE_INDEX},
};

static enum imp_status aovs_parse(struct imp_scene *scene, struct imp_node *node,
                                  const char *text, struct imp_integrator *out)
{
    size_t n = 1;
    for (const char *c = text; *c; c++) n += *c == ',';
    out->aovs = imp__arena_array(&scene->arena, n, sizeof *out->aovs);
    char *copy = imp__arena_strdup(&scene->arena, text), *save = NULL;
    if (!out->aovs || !copy)
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the integrator");
    const struct imp_prop *prop = imp__node_prop(node, "aovs");
    for (char *item = strtok_r(copy, ", \t\n", &save); item;
         item = strtok_r(NULL, ", \t\n", &save)) {
        char *type = strchr(item, ':');
        if (!type || type == item || !type[1])
            return imp__prop_error(scene->ctx, node, prop, IMP_E_SCENE,
                                   "aovs: '%s' is not of the form name:type", item);
        *type++ = 0;
        size_t k = 0;
        while (k < imp_count(aov_types) && strcmp(aov_types[k].name, type) != 0) k++;
        if (k == imp_count(aov_types))
            return imp__prop_error(
                scene->ctx, node, prop, IMP_E_SCENE,
                "aovs: unknown type '%s' (albedo, depth, position, uv, "
                "geo_normal, sh_normal, dp_du, dp_dv, duv_dx, duv_dy, "
                "prim_index, shape_index)",
                type);
        out->aovs[out->n_aovs++] = (struct imp_aov){item, aov_types[k].type};
    }
    return IMP_OK;
}

static enum imp_status nested_build(struct imp_scene *scene, struct imp_node *node,
                                    struct imp_integrator *out)
{
    enum imp_status st = IMP_OK;
    out->nested =
        imp__arena_array(&scene->arena, node->n_children + 1, sizeof *out->nested);
    if (!out->nested) return imp__error(scene->ctx, IMP_E_NOMEM, "no memory");
    int nameless = 0;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "integrator") != 0) continue;
        c->used = true;
        struct imp_integrator *inner = &out->nested[out->n_nested];
        IMP_TRY(imp__integrator_build(scene, c->node, inner));
        if (inner->kind == IMP_INTEGRATOR_AOV || inner->kind == IMP_INTEGRATOR_MOMENT ||
            inner->kind == IMP_INTEGRATOR_ELEMENTS)
            IMP_TRY(imp__node_error(scene->ctx, c->node, IMP_E_UNSUPPORTED,
                                    "an integrator of this type cannot be nested"));
        char slot[] = "_arg_0";
        slot[5] = (char)('0' + nameless % 10);
        if (!c->name) nameless++;
        inner->name = c->name ? c->name : imp__arena_strdup(&scene->arena, slot);
        if (!inner->name) IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "no memory"));
        out->n_nested++;
    }
out:
    return st;
}

/* Ranges are those of imp_elements_create, which has the defaults too. */
static enum imp_status elements_parse(imp_context *ctx, struct imp_node *node,
                                      struct imp_integrator_elements *e)
{
    static const char *const images[] = {"flat", "gouraud", "gather"};
    enum imp_status st = IMP_OK;
    int64_t order, rays, level, links;
    bool importance;
    double megabytes;
    IMP_TRY(imp__props_choice(ctx, node, "image", images, 3, 1, &e->image));
    IMP_TRY(imp__props_bool(ctx, node, "importance", true, &importance));
    IMP_TRY(imp__props_int(ctx, node, "order", 0, 0, 12, &order));
    IMP_TRY(imp__props_int(ctx, node, "rays", 0, 0, 64, &rays));
    IMP_TRY(imp__props_int(ctx, node, "max_level", 0, 0, 10, &level));
    IMP_TRY(imp__props_int(ctx, node, "max_links", 0, 0, UINT32_MAX - 1, &links));
    IMP_TRY(imp__props_float(ctx, node, "max_memory", 0, &megabytes));
    IMP_TRY(imp__props_float(ctx, node, "stop", 0.01, &e->stop));
    IMP_TRY(imp__props_float(ctx, node, "eps", 0, &e->eps));
    if (order == 1 || !(e->stop >= 0) || !(e->eps >= 0) ||
        !(megabytes >= 0 && megabytes < 1e12))
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "a property is outside its range: order 2..12, and stop, "
                                "eps, max_memory not negative"));
    if (e->stop == 0) e->stop = -1;
    e->no_importance = !importance;
    e->order = (int)order;
    e->rays = (int)rays;
    e->max_level = (int)level;
    e->max_links = (size_t)links;
    e->max_bytes = (size_t)(megabytes * 1e6);
out:
    return st;
}

enum imp_status imp__integrator_build(struct imp_scene *scene, struct imp_node *node,
                                      struct imp_integrator *out)
{
    imp_context *ctx = scene->ctx;
    enum imp_status st = IMP_OK;
    static const char *const types[] = {"path",   "direct", "depth",   "aov",
                                        "moment", "stam",   "elements"};
    static const enum imp_integrator_kind kinds[] = {
        IMP_INTEGRATOR_PATH,    IMP_INTEGRATOR_DIRECT, IMP_INTEGRATOR_DEPTH,
        IMP_INTEGRATOR_AOV,     IMP_INTEGRATOR_MOMENT, IMP_INTEGRATOR_STAM,
        IMP_INTEGRATOR_ELEMENTS};
    size_t k = 0;
    while (k < imp_count(types) && strcmp(types[k], node->type) != 0) k++;
    if (k == imp_count(types)) {
        struct imp_nearest near = imp__nearest(node->type);
        for (size_t i = 0; i < imp_count(types); i++) imp__nearest_try(&near, types[i]);
        return imp__node_error(
            ctx, node, IMP_E_UNSUPPORTED,
            "this version has no such integrator; it has path, direct, "
            "depth, aov, moment, stam and elements%s%s%s",
            near.best ? "; did you mean '" : "", near.best ? near.best : "",
            near.best ? "'?" : "");
    }
    *out = (struct imp_integrator){.kind = kinds[k],
                                   .max_depth = -1,
                                   .rr_depth = 5,
                                   .emitter_samples = 1,
                                   .bsdf_samples = 1};

    /* Accepted, and without meaning here: work is cut and timed by the caller. */
    int64_t block, passes, depth = -1, rr = 5;
    double timeout;
    IMP_TRY(imp__props_int(ctx, node, "block_size", 0, 0, INT32_MAX, &block));
    IMP_TRY(imp__props_int(ctx, node, "samples_per_pass", 0, 0, INT32_MAX, &passes));
    IMP_TRY(imp__props_float(ctx, node, "timeout", -1, &timeout));
    if (out->kind != IMP_INTEGRATOR_ELEMENTS) /* depth, aov, moment: without effect */
        IMP_TRY(imp__props_bool(ctx, node, "hide_emitters", false, &out->hide_emitters));

    switch (out->kind) {
    case IMP_INTEGRATOR_PATH:
        IMP_TRY(imp__props_int(ctx, node, "rr_depth", 5, 1, INT32_MAX, &rr));
        IMP_TRY(imp__props_int(ctx, node, "max_depth", -1, -1, INT32_MAX, &depth));
        break;
    case IMP_INTEGRATOR_STAM: {
        static const char *const words[] = {"detached", "attached", "paper"};
        int choice;
        IMP_TRY(imp__props_int(ctx, node, "max_depth", 64, -1, INT32_MAX, &depth));
        IMP_TRY(imp__props_choice(ctx, node, "alpha_gradient", words, 3, 0, &choice));
        out->alpha_gradient = (enum imp_stam_alpha)choice;
        if (out->alpha_gradient == IMP_ALPHA_PAPER)
            imp__warn(
                ctx, "alpha_gradient=paper: derivatives of exponents are those of Stam's "
                     "App. C, which are wrong (docs/stam.md, E9)");
        break;
    }
    case IMP_INTEGRATOR_DIRECT: {
        int64_t shading, emitter, bsdf;
        depth = 2;
        if (imp__props_has(node, "shading_samples") &&
            (imp__props_has(node, "emitter_samples") ||
             imp__props_has(node, "bsdf_samples")))
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "shading_samples cannot be given together with "
                                    "emitter_samples or bsdf_samples"));
        IMP_TRY(imp__props_int(ctx, node, "shading_samples", 1, 1, 1 << 20, &shading));
        IMP_TRY(
            imp__props_int(ctx, node, "emitter_samples", shading, 0, 1 << 20, &emitter));
        IMP_TRY(imp__props_int(ctx, node, "bsdf_samples", shading, 0, 1 << 20, &bsdf));
        if (emitter + bsdf == 0)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "emitter_samples and bsdf_samples are both 0"));
        out->emitter_samples = (int)emitter;
        out->bsdf_samples = (int)bsdf;
        break;
    }
    case IMP_INTEGRATOR_AOV: {
        const char *text;
        if (!imp__props_has(node, "aovs"))
            IMP_TRY(
                imp__node_error(ctx, node, IMP_E_SCENE, "property 'aovs' is missing"));
        IMP_TRY(imp__props_string(ctx, node, "aovs", "", &text));
        IMP_TRY(aovs_parse(scene, node, text, out));
        IMP_TRY(nested_build(scene, node, out));
        break;
    }
    case IMP_INTEGRATOR_MOMENT:
        IMP_TRY(nested_build(scene, node, out));
        if (out->n_nested == 0)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "no nested integrator"));
        break;
    case IMP_INTEGRATOR_ELEMENTS:
        IMP_TRY(elements_parse(ctx, node, &out->elements));
        break;
    case IMP_INTEGRATOR_DEPTH: break;
    }
    out->max_depth = (int)depth;
    out->rr_depth = (int)rr;
    IMP_TRY(imp__props_finish(ctx, node));
out:
    return st;
}
