/* SPDX-License-Identifier: Apache-2.0
 *
 * Attributes of shapes: textures that a mesh_attribute looks up by name on the shape at
 * hand. Which these are is known when the scene is whole; they then become the inputs of
 * the mesh_attribute, so that they are found among what an object depends on. */
#include "kind/texture/mesh_attribute.h"
#include "scene_build.h"

enum imp_status imp__build_shape_attributes(struct imp_scene *scene,
                                            struct imp_node *node, struct imp_shape *s)
{
    static const struct imp_input_desc asked = {.name = "mesh_attribute",
                                                .role = IMP_UNBOUNDED};
    enum imp_status st = IMP_OK;
    struct imp_attribute *list =
        imp__arena_array(&scene->arena, node->n_children + 1, sizeof *list);
    if (!list) IMP_TRY(imp__build_no_memory(scene));
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        struct imp_texture *t;
        if (strcmp(c->node->tag, "texture") != 0 || !c->name ||
            !imp__attribute_name(c->name))
            continue;
        IMP_TRY(imp__build_texture(scene, c->node, s->name, c->name, &asked, &t));
        list[s->n_attributes++] = (struct imp_attribute){c->name, t};
        s->by_triangle |= c->node->attribute != NULL;
    }
    s->attribute = list;
out:
    return st;
}

bool imp__is_bumped(const struct imp_scene *scene, int bsdf)
{
    const struct imp_bsdf *b = bsdf >= 0 ? scene->bsdfs[bsdf] : NULL;
    for (int j = 0; b && j < b->n_in; j++)
        if (b->input[j]->bump) return true;
    return false;
}

/* Vertices keep uv as floats (decision.h): of so many segments the last ones' v has steps of
 * 1/16 of a segment, and a point next to a segment's end may be taken for one of the next. */
#define BUMPED_SEGMENTS ((size_t)1 << 20)

enum imp_status imp__build_bumps_survey(struct imp_scene *scene,
                                        const struct imp_node *node, struct imp_shape *s)
{
    const bool bump = imp__is_bumped(scene, s->bsdf);
    if (bump && !s->ops->place)
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "a %s cannot have a bumpmap: one uv belongs to "
                               "several of its points",
                               s->ops->name);
    if (bump && s->geometry == IMP_CURVES && s->curves.n_segments > BUMPED_SEGMENTS)
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "has %zu segments, and with a bumpmap at most %zu: uv in "
                               "single precision separates no more of them; make "
                               "it several shapes",
                               s->curves.n_segments, BUMPED_SEGMENTS);
    s->by_triangle |= bump && s->ops->flags & IMP_SHAPE_TRIANGLES;
    return IMP_OK;
}

/* The textures of the scene's shapes, also of those in groups, that a mesh_attribute looks
 * up become its inputs. */
static enum imp_status link_inputs(struct imp_scene *scene, struct imp_texture *t)
{
    enum imp_status st = IMP_OK;
    int n = 0;
    for (int i = 0; i < scene->n_all_shapes; i++) n += scene->shapes[i]->n_attributes;
    const struct imp_input **input =
        imp__arena_array(&scene->arena, (size_t)n + 1, sizeof *input);
    if (!input) IMP_TRY(imp__build_no_memory(scene));
    t->n_in = 0;
    for (int i = 0; i < scene->n_all_shapes; i++)
        for (int k = 0; k < scene->shapes[i]->n_attributes; k++) {
            const struct imp_attribute *a = &scene->shapes[i]->attribute[k];
            if (!imp__attribute_asked(t, a->name)) continue;
            struct imp_input *in = imp__arena_array(&scene->arena, 1, sizeof *in);
            if (!in) IMP_TRY(imp__build_no_memory(scene));
            *in = (struct imp_input){.texture = a->texture, .param = -1, .count = 1};
            input[t->n_in++] = in;
        }
    t->input = input;
out:
    return st;
}

/* Bounds that an input sets to its texture's values also apply to those of attributes. */
static void inputs_bound(struct imp_scene *scene, const struct imp_input *const *input,
                         const struct imp_input_desc *desc, uint64_t fixed,
                         const char *why)
{
    for (int j = 0; desc && desc[j].name; j++) {
        if (desc[j].flags & IMP_INPUT_FIXED || fixed >> j & 1)
            imp__build_fix(scene, input[j], why);
        const struct imp_texture *t = input[j]->texture;
        const double scale = t ? imp__attribute_scale(t) : 0;
        struct imp_input_desc d = desc[j];
        if (!(scale > 0)) continue;
        d.lo /= scale;
        d.hi /= scale;
        for (int k = 0; k < t->n_in; k++)
            if (t->input[k]->texture)
                imp__build_texels_bound(scene, t->input[k]->texture->param, &d);
    }
}

enum imp_status imp__build_attributes(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    bool any = false;
    for (int i = 0; i < scene->n_all_shapes; i++)
        any |= scene->shapes[i]->n_attributes > 0;
    if (!any) return IMP_OK;
    for (int i = 0; i < scene->n_textures; i++)
        if (strcmp(scene->textures[i]->ops->name, "mesh_attribute") == 0)
            IMP_TRY(link_inputs(scene, scene->textures[i]));
    for (int i = 0; i < scene->n_bsdfs; i++) {
        const struct imp_bsdf *b = scene->bsdfs[i];
        inputs_bound(scene, b->input, b->ops->inputs, b->fixed, b->why);
        if (b->ops->changed)
            IMP_TRY(
                imp__build_watch(scene, b->input, b->n_in, imp__bsdf_changed, (void *)b));
    }
    for (int i = 0; i < scene->n_emitters; i++) {
        const struct imp_emitter *e = scene->emitters[i];
        inputs_bound(scene, e->input, e->ops->inputs, e->fixed, NULL);
        if (e->ops->changed)
            IMP_TRY(imp__build_watch(scene, e->input, e->n_in, imp__emitter_changed,
                                     (void *)e));
    }
out:
    return st;
}
