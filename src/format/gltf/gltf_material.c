/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials: metallic and roughness as `principled`, behind what their alpha cuts. */
#include "gltf.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* What the file says of a material, with the specification's defaults (5.19, 5.22). */
struct look {
    const json_t *base_info, *rough_info, *normal_info, *emitted_info;
    double base[4], metallic, roughness, emitted[3], normal_scale, cutoff, ior,
        transmission, coat, coat_roughness;
    bool thin; /* what transmits is a sheet */
    const char *alpha;
};

static enum imp_status strangers(struct gltf *g, const json_t *object)
{
    static const char *const read[] = {"KHR_materials_emissive_strength",
                                       "KHR_materials_ior",
                                       "KHR_materials_clearcoat",
                                       "KHR_materials_transmission",
                                       "KHR_materials_volume",
                                       "KHR_materials_unlit"};
    const char *name;
    json_t *value;
    json_object_foreach(json_object_get(object, "extensions"), name, value)
    {
        bool known = false;
        for (size_t i = 0; i < imp_count(read); i++) known |= strcmp(read[i], name) == 0;
        if (!known)
            IMP_CHECKED(
                imp__gltf_unread(g, "it is left out", "%s: %.60s", g->where, name));
    }
    if (imp__gltf_extension(object, "KHR_materials_unlit"))
        imp__warn(g->ctx, "%s: %s: KHR_materials_unlit: it is lit as all others",
                  g->in->name, g->where);
    return IMP_OK;
}

/* Factors of extensions are read, their textures and colours are not. */
static enum imp_status extensions(struct gltf *g, const json_t *object, struct look *l)
{
    static const struct {
        const char *extension, *member;
    } unread[] = {
        {"KHR_materials_transmission", "transmissionTexture"},
        {"KHR_materials_volume", "thicknessTexture"},
        {"KHR_materials_volume", "attenuationDistance"},
        {"KHR_materials_clearcoat", "clearcoatTexture"},
        {"KHR_materials_clearcoat", "clearcoatRoughnessTexture"},
        {"KHR_materials_clearcoat", "clearcoatNormalTexture"},
    };
    double strength = 1, thickness = 0;
    IMP_CHECKED(strangers(g, object));
    for (size_t i = 0; i < imp_count(unread); i++)
        if (json_object_get(imp__gltf_extension(object, unread[i].extension),
                            unread[i].member))
            IMP_CHECKED(imp__gltf_unread(g, "it is left out", "%s: %s", g->where,
                                         unread[i].member));
    const json_t *e = imp__gltf_extension(object, "KHR_materials_emissive_strength");
    IMP_CHECKED(imp__gltf_number(g, e, "emissiveStrength", 0, 1e12, &strength));
    for (int k = 0; k < 3; k++) l->emitted[k] *= strength * g->efficacy;
    e = imp__gltf_extension(object, "KHR_materials_ior");
    IMP_CHECKED(imp__gltf_number(g, e, "ior", 0, 10, &l->ior));
    if (l->ior > 0 && l->ior < 1) return imp__gltf_error(g, "ior is %g, below 1", l->ior);
    if (l->ior == 0)
        imp__warn(g->ctx, "%s: %s: ior 0 (all is reflected) is taken as 10", g->in->name,
                  g->where);
    e = imp__gltf_extension(object, "KHR_materials_transmission");
    IMP_CHECKED(imp__gltf_number(g, e, "transmissionFactor", 0, 1, &l->transmission));
    e = imp__gltf_extension(object, "KHR_materials_volume");
    IMP_CHECKED(imp__gltf_number(g, e, "thicknessFactor", 0, 1e12, &thickness));
    l->thin = !(thickness > 0);
    e = imp__gltf_extension(object, "KHR_materials_clearcoat");
    IMP_CHECKED(imp__gltf_number(g, e, "clearcoatFactor", 0, 1, &l->coat));
    IMP_CHECKED(
        imp__gltf_number(g, e, "clearcoatRoughnessFactor", 0, 1, &l->coat_roughness));
    const json_t *pbr = json_object_get(object, "pbrMetallicRoughness");
    const bool sheet = l->transmission > 0 && l->thin;
    if (sheet && l->coat > 0)
        imp__warn(g->ctx, "%s: %s: the clear coat of a sheet that transmits is not read",
                  g->in->name, g->where);
    if (sheet && json_object_get(pbr, "metallicFactor") && l->metallic > 0)
        imp__warn(g->ctx,
                  "%s: %s: the metallic part of a sheet that transmits is not read",
                  g->in->name, g->where);
    return IMP_OK;
}

static enum imp_status look_read(struct gltf *g, const json_t *object, struct look *l)
{
    const json_t *pbr = json_object_get(object, "pbrMetallicRoughness");
    *l = (struct look){.base = {1, 1, 1, 1},
                       .metallic = 1,
                       .roughness = 1,
                       .normal_scale = 1,
                       .cutoff = .5,
                       .ior = 1.5};
    l->base_info = json_object_get(pbr, "baseColorTexture");
    l->rough_info = json_object_get(pbr, "metallicRoughnessTexture");
    l->normal_info = json_object_get(object, "normalTexture");
    l->emitted_info = json_object_get(object, "emissiveTexture");
    l->alpha = imp__gltf_text(object, "alphaMode");
    IMP_CHECKED(imp__gltf_numbers(g, pbr, "baseColorFactor", 4, l->base));
    IMP_CHECKED(imp__gltf_number(g, pbr, "metallicFactor", 0, 1, &l->metallic));
    IMP_CHECKED(imp__gltf_number(g, pbr, "roughnessFactor", 0, 1, &l->roughness));
    IMP_CHECKED(imp__gltf_numbers(g, object, "emissiveFactor", 3, l->emitted));
    IMP_CHECKED(imp__gltf_number(g, object, "alphaCutoff", 0, 1e6, &l->cutoff));
    IMP_CHECKED(
        imp__gltf_number(g, l->normal_info, "scale", -1e3, 1e3, &l->normal_scale));
    if (l->alpha && strcmp(l->alpha, "OPAQUE") != 0 && strcmp(l->alpha, "MASK") != 0 &&
        strcmp(l->alpha, "BLEND") != 0)
        return imp__gltf_error(g, "alphaMode is '%.20s'", l->alpha);
    for (int k = 0; k < 4; k++)
        if (!(l->base[k] >= 0 && l->base[k] <= 1))
            return imp__gltf_error(g, "baseColorFactor is %g, not in [0, 1]", l->base[k]);
    for (int k = 0; k < 3; k++)
        if (!(l->emitted[k] >= 0 && l->emitted[k] <= 1e12))
            return imp__gltf_error(g, "emissiveFactor is %g", l->emitted[k]);
    return extensions(g, object, l);
}

/* One set of uvs a mesh: that of the textures, if they agree. */
static enum imp_status texcoord(struct gltf *g, const struct look *l, int *out,
                                bool *textured)
{
    const json_t *const infos[] = {l->base_info, l->rough_info, l->normal_info,
                                   l->emitted_info};
    int set = -1, of;
    for (size_t i = 0; i < imp_count(infos); i++) {
        if (!infos[i]) continue;
        IMP_CHECKED(imp__gltf_texcoord(g, infos[i], &of));
        if (set >= 0 && of != set)
            IMP_CHECKED(imp__gltf_unread(g, "the first is used for all",
                                         "%s: textures with different sets of uvs",
                                         g->where));
        if (set < 0) set = of;
    }
    *out = imp_max(set, 0);
    *textured = set >= 0;
    return IMP_OK;
}

/* ---- Nodes -------------------------------------------------------------------------------- */

/* A texture in a slot, or where there is none a number. */
static enum imp_status scalar(struct gltf *g, struct imp_node *node, const char *slot,
                              const json_t *info, enum gltf_use use, double value)
{
    const char *id;
    IMP_CHECKED(imp__gltf_texture(g, info, use, (double[3]){value, value, value}, &id));
    if (id) return imp__tree_ref(g->in->tree, node, id, slot, g->loc);
    return imp__import_float(g->in, node, slot, value, g->loc);
}

static enum imp_status color(struct gltf *g, struct imp_node *node, const char *slot,
                             const json_t *info, const double value[3])
{
    const char *id;
    IMP_CHECKED(imp__gltf_texture(g, info, GLTF_COLOR, value, &id));
    if (id) return imp__tree_ref(g->in->tree, node, id, slot, g->loc);
    return imp__import_rgb(g->in, node, slot, value, g->loc);
}

static enum imp_status open(struct gltf *g, struct imp_node **at, const char *type,
                            const char **id)
{
    const enum imp_status st =
        imp__tree_open(g->in->tree, *at, "bsdf", type, *id, NULL, g->loc, at);
    *id = NULL; /* the outermost has it */
    return st;
}

/* Alpha as an opacity: the texture's, times the factor; cut at a value in the mode MASK. */
static enum imp_status opacity(struct gltf *g, const struct look *l, struct imp_node **at,
                               const char **id)
{
    const bool cut = l->alpha && strcmp(l->alpha, "MASK") == 0,
               blend = l->alpha && strcmp(l->alpha, "BLEND") == 0;
    if (!cut && !blend) return IMP_OK;
    /* alpha a >= cutoff where the texel is at least cutoff/a */
    const double factor = !cut             ? l->base[3]
                          : l->base[3] > 0 ? l->cutoff / l->base[3]
                                           : INFINITY;
    const char *texture;
    IMP_CHECKED(imp__gltf_texture(g, l->base_info, cut ? GLTF_CUT : GLTF_ALPHA,
                                  (double[3]){factor, 1, 1}, &texture));
    const double whole = !cut ? l->base[3] : l->base[3] >= l->cutoff;
    if (!texture && whole == 1) return IMP_OK;
    IMP_CHECKED(open(g, at, "mask", id));
    if (texture) return imp__tree_ref(g->in->tree, *at, texture, "opacity", g->loc);
    return imp__import_float(g->in, *at, "opacity", whole, g->loc);
}

static enum imp_status principled(struct gltf *g, const struct look *l,
                                  struct imp_node *at, const char *id)
{
    const bool sheet = l->transmission > 0 && l->thin;
    IMP_CHECKED(open(g, &at, sheet ? "principledthin" : "principled", &id));
    IMP_CHECKED(color(g, at, "base_color", l->base_info, l->base));
    IMP_CHECKED(scalar(g, at, "roughness", l->rough_info, GLTF_GREEN, l->roughness));
    if (!sheet && l->metallic > 0)
        IMP_CHECKED(scalar(g, at, "metallic", l->rough_info, GLTF_BLUE, l->metallic));
    if (l->transmission > 0)
        IMP_CHECKED(imp__import_float(g->in, at, "spec_trans", l->transmission, g->loc));
    if (l->ior != 1.5 || l->transmission > 0) /* index 0: as if it had no limit */
        IMP_CHECKED(
            imp__import_float(g->in, at, "eta", l->ior >= 1 ? l->ior : 10, g->loc));
    if (l->coat > 0 && !sheet) {
        IMP_CHECKED(imp__import_float(g->in, at, "clearcoat", l->coat, g->loc));
        IMP_CHECKED(imp__import_float(g->in, at, "clearcoat_gloss", 1 - l->coat_roughness,
                                      g->loc));
    }
    return IMP_OK;
}

static enum imp_status bsdf(struct gltf *g, const struct look *l, const char *id)
{
    const char *texture;
    struct imp_node *at = g->in->parent;
    IMP_CHECKED(opacity(g, l, &at, &id));
    if (!(l->transmission > 0)) IMP_CHECKED(open(g, &at, "twosided", &id));
    const double scale[3] = {l->normal_scale, 1, 1};
    IMP_CHECKED(imp__gltf_texture(g, l->normal_info, GLTF_DIRECTION, scale, &texture));
    if (texture) {
        IMP_CHECKED(open(g, &at, "normalmap", &id));
        IMP_CHECKED(imp__tree_ref(g->in->tree, at, texture, "normalmap", g->loc));
    }
    return principled(g, l, at, id);
}

enum imp_status imp__gltf_material(struct gltf *g, int material,
                                   struct gltf_material **out)
{
    const size_t index = material < 0 ? g->n_materials : (size_t)material;
    struct gltf_material *m = *out = &g->material[index];
    const json_t *object = NULL;
    struct look l;
    char where[sizeof g->where];
    if (m->id) return IMP_OK;
    memcpy(where, g->where, sizeof where);
    if (material >= 0) IMP_CHECKED(imp__gltf_item(g, "materials", index, &object));
    m->id = imp__gltf_id(g, object, "material", index);
    if (!m->id) return imp__gltf_memory(g);
    IMP_CHECKED(look_read(g, object, &l));
    IMP_CHECKED(texcoord(g, &l, &m->texcoord, &m->textured));
    IMP_CHECKED(bsdf(g, &l, m->id));
    memcpy(m->emitted, l.emitted, sizeof m->emitted);
    if (l.emitted[0] > 0 || l.emitted[1] > 0 || l.emitted[2] > 0)
        IMP_CHECKED(imp__gltf_texture(g, l.emitted_info, GLTF_COLOR, l.emitted,
                                      &m->emitted_texture));
    memcpy(g->where, where, sizeof where);
    return IMP_OK;
}
