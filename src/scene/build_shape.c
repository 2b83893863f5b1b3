/* SPDX-License-Identifier: Apache-2.0
 *
 * Builds shapes, with what is nested in them: a material, media on both sides, a light or a
 * sensor. Each is built once, where it first appears in document order. */
#include "base/arguments.h"
#include "kind/shape/shape.h"
#include "kind/texture/mesh_attribute.h"
#include "priorities.h"
#include "scene_build.h"

enum imp_status imp__build_shape_bare(struct imp_scene *scene, struct imp_node *node,
                                      const char *name, struct imp_shape **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const void *found;
    IMP_TRY(imp__kind_find(ctx, IMP_CONCEPT_SHAPE, node, &found));
    const struct imp_shape_ops *ops = found;
    struct imp_shape *s = imp__arena_array(&scene->arena, 1, sizeof *s);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!s || !self) IMP_TRY(imp__build_no_memory(scene));
    *s = (struct imp_shape){
        .ops = ops, .self = self, .index = -1, .bsdf = -1, .emitter = -1, .name = name};
    /* Affects gradients of geometry only; there are none yet. */
    double silhouette;
    IMP_TRY(imp__props_float(ctx, node, "silhouette_sampling_weight", 1, &silhouette));
    const struct imp_build b = imp__build_make(scene, node);
    IMP_TRY(ops->build(&b, self, s));
    IMP_TRY(imp__props_finish(ctx, node));
    for (int k = 0; k < 3; k++)
        if (!(s->lo[k] > -IMP_REACH_MAX && s->hi[k] < IMP_REACH_MAX))
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "reaches further out than %g",
                                    IMP_REACH_MAX));
    *out = s;
out:
    return st;
}

/* What is nested in a shape; NULL: nothing of that tag. */
struct nested {
    struct imp_node *bsdf, *emitter, *sensor;
    struct imp_node *side[2]; /* media: interior, exterior */
};

static enum imp_status only_child(imp_context *ctx, const struct imp_node *shape,
                                  struct imp_child *c, struct imp_node **out)
{
    if (*out)
        return imp__node_error(ctx, shape, IMP_E_SCENE, "has two %ss", c->node->tag);
    *out = c->node;
    return IMP_OK;
}

static enum imp_status medium_side(imp_context *ctx, struct imp_child *c,
                                   struct imp_node *side[2])
{
    const bool out = c->name && strcmp(c->name, "exterior") == 0;
    if (!out && (!c->name || strcmp(c->name, "interior") != 0))
        return imp__node_error(ctx, c->node, IMP_E_SCENE,
                               "a shape's medium is named interior or "
                               "exterior");
    if (side[out])
        return imp__node_error(ctx, c->node, IMP_E_SCENE, "the shape has another %s",
                               c->name);
    side[out] = c->node;
    return IMP_OK;
}

static enum imp_status nested_take(imp_context *ctx, struct imp_node *node,
                                   struct nested *in)
{
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        const char *tag = c->node->tag;
        if (strcmp(tag, "bsdf") == 0) IMP_CHECKED(only_child(ctx, node, c, &in->bsdf));
        else if (strcmp(tag, "emitter") == 0)
            IMP_CHECKED(only_child(ctx, node, c, &in->emitter));
        else if (strcmp(tag, "medium") == 0) IMP_CHECKED(medium_side(ctx, c, in->side));
        else if (strcmp(tag, "sensor") == 0)
            IMP_CHECKED(only_child(ctx, node, c, &in->sensor));
        else if (strcmp(tag, "texture") != 0 || !c->name || !imp__attribute_name(c->name))
            continue;
        c->used = true;
    }
    return IMP_OK;
}

/* The material; without one and without an emitter, as if <bsdf type="diffuse"/> had been
 * written. */
static enum imp_status shape_material(struct imp_scene *scene,
                                      const struct imp_node *node, const char *name,
                                      struct nested *in, struct imp_shape *s)
{
    struct imp_bsdf *made;
    if (!in->bsdf && !in->emitter) {
        in->bsdf =
            imp__node_create(&scene->arena, "bsdf", "diffuse", NULL, NULL, node->loc);
        if (!in->bsdf) return imp__build_no_memory(scene);
    }
    s->bsdf = -2;
    if (!in->bsdf) return IMP_OK;
    IMP_CHECKED(imp__build_bsdf(scene, in->bsdf, name, "bsdf", &made));
    s->bsdf = made->index;
    return IMP_OK;
}

static bool is_graded(const struct imp_node *medium)
{
    return medium && strcmp(medium->type, "graded") == 0;
}

/* The media on both sides; a graded index inside is a body. */
static enum imp_status shape_media(struct imp_scene *scene, const struct imp_node *node,
                                   const char *name, const struct nested *in,
                                   struct imp_shape *s)
{
    imp_context *ctx = scene->ctx;
    struct imp_node *const *side = in->side;
    if ((side[0] || side[1] || s->priority) && s->geometry == IMP_CURVES)
        return imp__prop_error(ctx, node, imp__node_prop(node, "priority"),
                               IMP_E_UNSUPPORTED,
                               "a medium, and a priority, needs a surface that is met "
                               "from both sides, and curves are met from outside alone");
    if (is_graded(side[1]))
        return imp__node_error(ctx, side[1], IMP_E_UNSUPPORTED,
                               "a graded medium fills the interior of a shape");
    if (is_graded(side[0])) {
        if (in->bsdf &&
            (imp__props_has(in->bsdf, "int_ior") || imp__props_has(in->bsdf, "ext_ior")))
            return imp__node_error(ctx, node, IMP_E_SCENE,
                                   "the index inside is its medium's, the one outside "
                                   "the medium's outside_index: the bsdf has no "
                                   "int_ior and no ext_ior");
        IMP_CHECKED(imp__build_body(scene, side[0], name, &s->body));
    } else if (side[0]) {
        IMP_CHECKED(imp__build_medium(scene, side[0], name, "interior", &s->interior));
    }
    return side[1] ? imp__build_medium(scene, side[1], name, "exterior", &s->exterior)
                   : IMP_OK;
}

/* The light that the shape is, or the sensor on it. */
static enum imp_status shape_ends(struct imp_scene *scene, const struct imp_node *node,
                                  const char *name, const struct nested *in,
                                  struct imp_shape *s)
{
    imp_context *ctx = scene->ctx;
    if (in->emitter || in->sensor) IMP_CHECKED(imp__shape_measure(ctx, &scene->arena, s));
    if (in->emitter) {
        if (!(s->area > 0))
            return imp__node_error(ctx, node, IMP_E_SCENE,
                                   "has an emitter, but no area to emit from");
        IMP_CHECKED(imp__build_emitter(scene, in->emitter, name, "emitter", s));
    }
    if (!in->sensor) return IMP_OK;
    if (in->emitter)
        return imp__node_error(ctx, node, IMP_E_SCENE,
                               "has an emitter and a sensor; put them on two shapes");
    const char *sensor_name = imp__build_object_name(scene, in->sensor, name, "sensor");
    if (!sensor_name) return imp__build_no_memory(scene);
    return imp__build_sensor(scene, in->sensor, sensor_name, s);
}

enum imp_status imp__build_shape(struct imp_scene *scene, struct imp_node *node,
                                 const char *name)
{
    imp_context *ctx = scene->ctx;
    struct imp_shape *s;
    struct nested in = {0};
    int64_t priority;
    IMP_CHECKED(imp__proxies_take(scene, node, name));
    IMP_CHECKED(imp__props_int(ctx, node, "priority", 0, 0, IMP_PRIORITY_MAX, &priority));
    IMP_CHECKED(nested_take(ctx, node, &in));
    IMP_CHECKED(imp__build_shape_bare(scene, node, name, &s));
    IMP_CHECKED(imp__build_shape_attributes(scene, node, s));
    s->index = scene->n_shapes;
    s->priority = (int)priority;
    node->object = s;
    IMP_CHECKED(shape_material(scene, node, name, &in, s));
    IMP_CHECKED(imp__build_bumps_survey(scene, node, s));
    IMP_CHECKED(shape_media(scene, node, name, &in, s));
    IMP_CHECKED(shape_ends(scene, node, name, &in, s));
    IMP_CHECKED(
        imp__build_list_add(scene, (void ***)&scene->shapes, &scene->n_shapes, s));
    scene->lo = (imp_v3){fmin(scene->lo[0], s->lo[0]), fmin(scene->lo[1], s->lo[1]),
                         fmin(scene->lo[2], s->lo[2]), 0};
    scene->hi = (imp_v3){fmax(scene->hi[0], s->hi[0]), fmax(scene->hi[1], s->hi[1]),
                         fmax(scene->hi[2], s->hi[2]), 0};
    return IMP_OK;
}
