/* SPDX-License-Identifier: Apache-2.0
 *
 * Textures and volumes: made where they are first used. */
#include "scene_build.h"

/* The data of a picture in a slot that is called data are that slot: sky.data. */
static const char *bulk_name(struct imp_scene *scene, const char *texture,
                             const char *key)
{
    const char *slot = strrchr(texture, '.');
    return !*key || (slot && strcmp(slot + 1, key) == 0)
               ? texture
               : imp__build_name(scene, texture, key);
}

/* dims as imp_build_texels has them. */
static void set_dims(struct imp_param_info *info, int n_dims, const size_t *dims)
{
    const size_t *from = dims;
    if (info->flags & IMP_PARAM_VOLUME) info->layers = dims[0];
    info->n_dims = imp_min(n_dims, 3);
    if (n_dims > 3) from++;
    for (int d = 0; d < info->n_dims; d++) info->dims[d] = from[d];
    if (n_dims > 3) info->dims[0] *= dims[0];
}

static enum imp_status add_bulk(const struct imp_build *b, const char *key, float *data,
                                int n_dims, const size_t *dims, unsigned flags, double lo,
                                double hi, int *param)
{
    struct imp_scene *scene = b->scene;
    const struct imp_texture *t = b->node->object; /* set before build is called */
    struct imp_param p = {.store = IMP_STORE_BULK, .bulk = data};
    if (imp__is_spectral(scene->mode) && !scene->linear_colors && n_dims > 0 &&
        dims[n_dims - 1] == 3) /* colours that are lifted to spectra */
        p.degree = t->asked && t->asked->flags & IMP_INPUT_DAYLIGHT ? IMP_DEGREE_FIRST
                                                                    : IMP_DEGREE_OTHER;
    p.info.name = bulk_name(scene, t->name, key);
    if (!p.info.name) return imp__build_no_memory(scene);
    p.info.unit = "1";
    p.info.flags = flags;
    set_dims(&p.info, n_dims, dims);
    if (flags & IMP_PARAM_VOLUME && b->node->grid)
        memcpy(p.box, b->node->grid->box, sizeof p.box);
    p.info.lo = lo;
    p.info.hi = hi;
    return imp__theta_add(scene, &p, param);
}

struct imp_build imp__build_make(struct imp_scene *scene, struct imp_node *node)
{
    return (struct imp_build){.ctx = scene->ctx,
                              .node = node,
                              .arena = &scene->arena,
                              .mode = scene->mode,
                              .linear_colors = scene->linear_colors,
                              .add_bulk = add_bulk,
                              .scene = scene};
}

static void texture_changed(void *payload)
{
    const struct imp_texture *t = payload;
    t->ops->changed(t);
}

/* Do two inputs want the same spectra of a texture's colours? */
static bool same_spectra(const struct imp_input_desc *a, const struct imp_input_desc *b)
{
    const bool reflect[2] = {a->role == IMP_REFLECTANCE, b->role == IMP_REFLECTANCE};
    return ((a->flags ^ b->flags) & IMP_INPUT_DAYLIGHT) == 0 &&
           (!((a->flags | b->flags) & IMP_INPUT_VOLUME) || reflect[0] == reflect[1]);
}

enum imp_status imp__build_texture(struct imp_scene *scene, struct imp_node *node,
                                   const char *parent, const char *slot,
                                   const struct imp_input_desc *asked,
                                   struct imp_texture **out)
{
    enum imp_status st = IMP_OK;
    struct imp_texture *t = node->object;
    if (t) {
        if (!t->asked) {
            t->asked = asked;
            if (t->ops->changed) t->ops->changed(t);
        } else if (asked && imp__is_spectral(scene->mode) &&
                   !same_spectra(t->asked, asked)) {
            return imp__node_error(
                scene->ctx, node, IMP_E_UNSUPPORTED,
                "is the value of '%s' and of '%s', which are different "
                "spectra of the same colours: it must be written twice",
                t->asked->name, asked->name);
        }
        *out = t;
        return IMP_OK;
    }
    if (node->visiting)
        return imp__node_error(scene->ctx, node, IMP_E_SCENE,
                               "the object contains itself");
    node->visiting = 1;
    const void *found;
    const bool volume = strcmp(node->tag, "volume") == 0;
    IMP_TRY(imp__kind_find(scene->ctx, volume ? IMP_CONCEPT_VOLUME : IMP_CONCEPT_TEXTURE,
                           node, &found));
    const struct imp_texture_ops *ops = found;

    t = imp__arena_array(&scene->arena, 1, sizeof *t);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!t || !self) IMP_TRY(imp__build_no_memory(scene));
    *t = (struct imp_texture){.ops = ops,
                              .self = self,
                              .param = -1,
                              .name = imp__build_object_name(scene, node, parent, slot),
                              .asked = asked};
    if (!t->name) IMP_TRY(imp__build_no_memory(scene));
    node->object = t;
    int n = 0;
    while (ops->inputs && ops->inputs[n].name) n++;
    const struct imp_input **input =
        imp__arena_array(&scene->arena, (size_t)n + 1, sizeof *input);
    if (!input) IMP_TRY(imp__build_no_memory(scene));
    IMP_TRY(imp__build_inputs(scene, node, t->name, ops->inputs, input, &t->n_in));
    t->input = input;
    for (int k = 0; k < t->n_in; k++)
        IMP_TRY(imp__build_spectrum(scene, t->input[k], ops->inputs[k].role));
    const struct imp_build b = imp__build_make(scene, node);
    if (ops->build) IMP_TRY(ops->build(&b, self, t));
    IMP_TRY(imp__props_finish(scene->ctx, node));
    if (ops->changed) {
        IMP_TRY(imp__build_watch(scene, t->input, t->n_in, texture_changed, t));
        if (t->param >= 0) IMP_TRY(imp__theta_watch(scene, t->param, texture_changed, t));
    }
    IMP_TRY(
        imp__build_list_add(scene, (void ***)&scene->textures, &scene->n_textures, t));
    *out = t;
out:
    node->visiting = 0;
    return st;
}
