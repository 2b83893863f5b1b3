/* SPDX-License-Identifier: Apache-2.0
 *
 * The list of all integrators, and the three that this room defines: `depth`, `aov` and
 * `moment`. */
#include "film_integrator.h"
#include "base/required.h"
#include "elements/elements_integrator.h"
#include "walk/core/walk_integrator.h"
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

const char *const imp__aov_channels[][3] = {
    [IMP_AOV_ALBEDO] = {"R", "G", "B"},     [IMP_AOV_DEPTH] = {"T"},
    [IMP_AOV_POSITION] = {"X", "Y", "Z"},   [IMP_AOV_UV] = {"U", "V"},
    [IMP_AOV_GEO_NORMAL] = {"X", "Y", "Z"}, [IMP_AOV_SH_NORMAL] = {"X", "Y", "Z"},
    [IMP_AOV_DP_DU] = {"X", "Y", "Z"},      [IMP_AOV_DP_DV] = {"X", "Y", "Z"},
    [IMP_AOV_DUV_DX] = {"U", "V"},          [IMP_AOV_DUV_DY] = {"U", "V"},
    [IMP_AOV_PRIM_INDEX] = {"I"},           [IMP_AOV_SHAPE_INDEX] = {"I"}};

/* "name:type, name:type" */
static enum imp_status aovs_read(const struct imp_build *build, const char *text,
                                 struct imp_channels *out)
{
    size_t n = 1;
    for (const char *c = text; *c; c++) n += *c == ',';
    out->aovs = imp__arena_array(build->arena, n, sizeof *out->aovs);
    char *copy = imp__arena_strdup(build->arena, text), *save = NULL;
    if (!out->aovs || !copy)
        return imp__error(build->ctx, IMP_E_NOMEM, "no memory for the integrator");
    const struct imp_prop *prop = imp__node_prop(build->node, "aovs");
    for (char *item = strtok_r(copy, ", \t\n", &save); item;
         item = strtok_r(NULL, ", \t\n", &save)) {
        char *type = strchr(item, ':');
        if (!type || type == item || !type[1])
            return imp__prop_error(build->ctx, build->node, prop, IMP_E_SCENE,
                                   "aovs: '%s' is not of the form name:type", item);
        *type++ = 0;
        size_t k = 0;
        while (k < imp_count(aov_types) && strcmp(aov_types[k].name, type) != 0) k++;
        if (k == imp_count(aov_types))
            return imp__prop_error(
                build->ctx, build->node, prop, IMP_E_SCENE,
                "aovs: unknown type '%s' (albedo, depth, position, uv, "
                "geo_normal, sh_normal, dp_du, dp_dv, duv_dx, duv_dy, "
                "prim_index, shape_index)",
                type);
        out->aovs[out->n_aovs++] = (struct imp_aov){item, aov_types[k].type};
    }
    return IMP_OK;
}

/* Accepted for Mitsuba's sake, without effect. */
static enum imp_status depth_build(const struct imp_build *build,
                                   struct imp_integrator *i)
{
    bool hide;
    (void)i;
    return imp__props_bool(build->ctx, build->node, "hide_emitters", false, &hide);
}

static enum imp_status aov_build(const struct imp_build *build, struct imp_integrator *i)
{
    enum imp_status st = IMP_OK;
    const char *text;
    IMP_TRY(depth_build(build, i));
    if (!imp__props_has(build->node, "aovs"))
        IMP_TRY(imp__node_missing(build->ctx, build->node, "aovs"));
    IMP_TRY(imp__props_string(build->ctx, build->node, "aovs", "", &text));
    IMP_TRY(aovs_read(build, text, i->self));
out:
    return st;
}

static enum imp_status moment_build(const struct imp_build *build,
                                    struct imp_integrator *i)
{
    struct imp_channels *c = i->self;
    c->moments = true;
    if (i->n_inner == 0)
        return imp__node_error(build->ctx, build->node, IMP_E_SCENE,
                               "no nested integrator");
    return depth_build(build, i);
}

static const struct imp_integrator_ops depth = {.size = sizeof depth,
                                                .name = "depth",
                                                .flags = IMP_INTEGRATOR_INNER,
                                                .build = depth_build};
static const struct imp_integrator_ops aov = {.size = sizeof aov,
                                              .name = "aov",
                                              .object_size = sizeof(struct imp_channels),
                                              .flags = IMP_INTEGRATOR_CONTAINS,
                                              .build = aov_build};
static const struct imp_integrator_ops moment = {.size = sizeof moment,
                                                 .name = "moment",
                                                 .object_size =
                                                     sizeof(struct imp_channels),
                                                 .flags = IMP_INTEGRATOR_CONTAINS,
                                                 .build = moment_build};

const struct imp_integrator_ops *const imp__integrator_kinds[] = {
    &imp__integrator_path.ops,
    &imp__integrator_direct.ops,
    &depth,
    &aov,
    &moment,
    &imp__integrator_stam.ops,
    &imp__integrator_photons.ops,
    &imp__integrator_elements,
    &imp__integrator_volpath.ops,
    &imp__integrator_volpathmis.ops,
    &imp__integrator_prbvolpath.ops,
    &imp__integrator_prb.ops,
    &imp__integrator_prb_basic.ops,
    &imp__integrator_prb_projective.ops,
    &imp__integrator_direct_projective.ops,
    &imp__integrator_bdpt.ops,
    &imp__integrator_ptracer.ops,
    NULL};
