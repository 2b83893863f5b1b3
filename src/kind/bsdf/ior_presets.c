/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials with a known index of refraction, by name, and how a BSDF reads its index. */
#include "color/color_tables.h"
#include "color/convert.h"
#include "presets.h"
#include <math.h>
#include <stdio.h>
#include <strings.h>

/* Refractive indices by name (docs/scene-format.md A.2). */
static const struct {
    const char *name;
    double n;
} indices[] = {
    {"vacuum", 1},        {"helium", 1.000036},        {"hydrogen", 1.000132},
    {"air", 1.000277},    {"carbon dioxide", 1.00045}, {"water", 1.3330},
    {"acetone", 1.36},    {"ethanol", 1.361},          {"carbon tetrachloride", 1.461},
    {"glycerol", 1.4729}, {"benzene", 1.501},          {"silicone oil", 1.52045},
    {"bromine", 1.661},   {"water ice", 1.31},         {"fused quartz", 1.458},
    {"pyrex", 1.470},     {"acrylic glass", 1.49},     {"polypropylene", 1.49},
    {"bk7", 1.5046},      {"sodium chloride", 1.544},  {"amber", 1.55},
    {"pet", 1.575},       {"diamond", 2.419},
};

/* At the d line, 587.56 nm. */
static double d_line(const struct imp__glass *g)
{
    const double l2 = 0.58756 * 0.58756;
    double n2 = 1;
    for (int k = 0; k < g->n; k++) n2 += g->number[k] * l2 / (l2 - g->number[g->n + k]);
    return sqrt(n2);
}

enum imp_status imp__ior_read(const struct imp_build *b, const char *name,
                              const char *fallback, double *ior)
{
    enum imp_status st = IMP_OK;
    const struct imp_prop *p = imp__node_prop(b->node, name);
    double n = NAN;

    if (p && p->type != IMP_PROP_STRING) {
        IMP_TRY(imp__props_float_in(b->ctx, b->node, name, 1, IMP_POSITIVE, &n));
    } else {
        const char *material;
        IMP_TRY(imp_build_string(b, name, fallback, &material));
        for (size_t i = 0; i < imp_count(indices); i++)
            if (strcasecmp(indices[i].name, material) == 0) n = indices[i].n;
        const struct imp__glass *glass = imp__glass_find(material);
        if (glass) n = d_line(glass);
        if (isnan(n)) {
            char list[1024] = "";
            size_t len = 0;
            for (size_t i = 0; i < imp_count(indices) && len < sizeof list; i++)
                len += (size_t)snprintf(list + len, sizeof list - len, "%s%s",
                                        i ? ", " : "", indices[i].name);
            for (size_t i = 0; imp__glasses[i].name && len < sizeof list; i++)
                len += (size_t)snprintf(list + len, sizeof list - len, ", %s",
                                        imp__glasses[i].name);
            IMP_TRY(imp_build_error(b, name, IMP_E_SCENE,
                                    "'%s': unknown material '%s'; known are %s", name,
                                    material, list));
        }
    }
    *ior = n;
out:
    return st;
}

/* ---- Indices that depend on the wavelength ---------------------------------------- */

/* One side of the boundary, as a colour object; NULL in *out: a number, which ior_read
 * reads. */
static enum imp_status side_node(const struct imp_build *b, const char *name,
                                 struct imp_node **out)
{
    const struct imp_prop *p = imp__node_prop(b->node, name);
    struct imp_child *child = imp__node_child(b->node, name);
    struct imp_node *node;
    *out = NULL;
    imp__node_ask(b->node, name);
    if (child) {
        child->used = true;
        if (!child->node || !imp__color_is_object(child->node))
            return imp_build_error(b, NULL, IMP_E_SCENE,
                                   "'%s' must be a number, a name or a spectrum", name);
        *out = child->node;
        return IMP_OK;
    }
    const bool glass = p && p->type == IMP_PROP_STRING && imp__glass_find(p->string);
    if (!glass && !(p && p->type == IMP_PROP_SPECTRUM)) return IMP_OK;
    node = imp__node_create(b->arena, "spectrum", glass ? "glass" : "written", NULL, name,
                            p->loc);
    struct imp_prop *copy =
        node ? imp__node_add(b->arena, node, glass ? "name" : "value", p->type, p->loc)
             : NULL;
    if (!copy) return imp__error(b->ctx, IMP_E_NOMEM, "out of memory");
    copy->string = p->string;
    copy->list = p->list;
    copy->n = p->n;
    imp__node_prop(b->node, name)->used = true;
    *out = node;
    return IMP_OK;
}

/* An index that is one number, as a node, where the other side has a spectrum. */
static enum imp_status number_node(const struct imp_build *b, const char *name,
                                   const char *fallback, struct imp_node **out)
{
    double n;
    const enum imp_status st = imp__ior_read(b, name, fallback, &n);
    if (st != IMP_OK) return st;
    struct imp_node *node =
        imp__node_create(b->arena, "spectrum", "written", NULL, name, b->node->loc);
    struct imp_prop *value =
        node ? imp__node_add(b->arena, node, "value", IMP_PROP_FLOAT, b->node->loc)
             : NULL;
    if (!value) return imp__error(b->ctx, IMP_E_NOMEM, "out of memory");
    value->number[0] = n;
    *out = node;
    return IMP_OK;
}

/* eta becomes the ratio of two spectra, if one of them is one; *made: it did. */
static enum imp_status ratio_prepare(const struct imp_build *b, const char *inside,
                                     bool *made)
{
    enum imp_status st = IMP_OK;
    struct imp_node *side[2], *ratio;
    IMP_TRY(side_node(b, "int_ior", &side[0]));
    IMP_TRY(side_node(b, "ext_ior", &side[1]));
    *made = side[0] || side[1];
    if (!*made) return IMP_OK;
    if (!side[0]) IMP_TRY(number_node(b, "int_ior", inside, &side[0]));
    if (!side[1]) IMP_TRY(number_node(b, "ext_ior", "air", &side[1]));
    ratio =
        imp__node_create(b->arena, "spectrum", "index_ratio", NULL, "eta", b->node->loc);
    for (int k = 0; k < 2 && ratio; k++)
        if (!imp__node_add_child(b->arena, ratio, side[k], k ? "outside" : "inside",
                                 side[k]->loc))
            ratio = NULL;
    if (!ratio || !imp__node_add_child(b->arena, b->node, ratio, "eta", b->node->loc))
        IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "out of memory"));
out:
    return st;
}

enum imp_status imp__ior_prepare(const struct imp_build *b, const char *inside,
                                 bool may_be_equal)
{
    enum imp_status st = IMP_OK;
    double n_inside, n_outside;
    if (imp_build_has(b, "eta"))
        IMP_TRY(imp_build_error(b, "eta", IMP_E_SCENE,
                                "give 'int_ior' and 'ext_ior' instead of 'eta'"));
    bool spectra;
    IMP_TRY(ratio_prepare(b, inside, &spectra));
    if (spectra) return IMP_OK;
    IMP_TRY(imp__ior_read(b, "int_ior", inside, &n_inside));
    IMP_TRY(imp__ior_read(b, "ext_ior", "air", &n_outside));
    if (n_inside == n_outside && !may_be_equal)
        IMP_TRY(imp_build_error(b, "int_ior", IMP_E_SCENE,
                                "int_ior and ext_ior are equal (%g): there is no "
                                "boundary to be rough",
                                n_inside));
    IMP_TRY(imp_build_set(b, "eta", 1, &(double){n_inside / n_outside}));
    struct imp_prop *eta = imp__node_prop(b->node, "eta");
    const struct imp_prop *in = imp__node_prop(b->node, "int_ior"),
                          *out = imp__node_prop(b->node, "ext_ior");
    eta->of = in && out ? "int_ior/ext_ior" : out ? "1/ext_ior" : "int_ior";
    if (in || out) eta->loc = in ? in->loc : out->loc;
out:
    return st;
}
