/* SPDX-License-Identifier: Apache-2.0
 *
 * From nodes to objects. Every object is made once, at its first place in document order,
 * whoever refers to it; its parameters get their names here (scene-format 12.2): by its own
 * id, else below its parent's name. */
#include <stdio.h>
#include <string.h>
#include "color/convert.h"
#include "kind/sensor/film.h"
#include "scene.h"

static enum imp_status no_memory(struct imp_scene *scene)
{
    return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the scene");
}

static char *name_join(struct imp_scene *scene, const char *parent, const char *key)
{
    const size_t n = strlen(parent) + strlen(key) + 2;
    char *s = imp__arena_take(&scene->arena, n, 1);
    if (s) snprintf(s, n, "%s.%s", parent, key);
    return s;
}

/* The name of an object: its id, else the slot below the parent. */
static const char *object_name(struct imp_scene *scene, const struct imp_node *node,
                               const char *parent, const char *slot)
{
    return node->id ? node->id : name_join(scene, parent, slot);
}

/* Append to one of the scene's lists; they live in the arena and double. */
static enum imp_status list_add(struct imp_scene *scene, void ***list, int *n, void *object)
{
    const size_t count = (size_t)*n;
    if ((count & (count - 1)) == 0) { /* 0, 1, 2, 4, 8: full */
        void **grown = imp__arena_take(&scene->arena, count ? 2 * count : 1, sizeof *grown);
        if (!grown) return no_memory(scene);
        if (count) memcpy(grown, *list, count * sizeof *grown);
        *list = grown;
    }
    (*list)[(*n)++] = object;
    return IMP_OK;
}

/* What a concept supports, for "there is no such plugin". */
#define KIND_LIST(table, buffer)                                                           \
    do {                                                                                   \
        (buffer)[0] = 0;                                                                   \
        for (size_t k_ = 0; (table)[k_]; k_++) {                                           \
            const size_t n_ = strlen(buffer);                                              \
            snprintf((buffer) + n_, sizeof(buffer) - n_, "%s%s", k_ ? ", " : "",           \
                     (table)[k_]->name);                                                   \
        }                                                                                  \
    } while (0)
/* The kind of this node's type, or an error that says what there is. */
#define KIND_FIND(scene, node, table, out)                                                 \
    do {                                                                                   \
        size_t i_ = 0;                                                                     \
        while ((table)[i_] && strcmp((table)[i_]->name, (node)->type) != 0) i_++;          \
        (out) = (table)[i_];                                                               \
        if (!(out)) {                                                                      \
            char list_[1024];                                                              \
            KIND_LIST(table, list_);                                                       \
            IMP_TRY(imp__node_error((scene)->ctx, node, IMP_E_UNSUPPORTED,                 \
                                    "this version has no such %s; it has %s", (node)->tag, \
                                    list_));                                               \
        }                                                                                  \
    } while (0)

static enum imp_status add_bulk(const struct imp_build *b, const char *key, float *data,
                                int n_dims, const size_t dims[3], unsigned flags, double lo,
                                double hi, int *param);

static struct imp_build build_make(struct imp_scene *scene, struct imp_node *node)
{
    return (struct imp_build){.ctx = scene->ctx, .node = node, .arena = &scene->arena,
                              .mode = scene->mode, .add_bulk = add_bulk, .scene = scene};
}

/* ---- Inputs and textures ------------------------------------------------------------ */

static enum imp_status inputs_build(struct imp_scene *scene, struct imp_node *node,
                                    const char *name, const struct imp_input_desc *desc,
                                    const struct imp_input **out, int *n);

static enum imp_status add_bulk(const struct imp_build *b, const char *key, float *data,
                                int n_dims, const size_t dims[3], unsigned flags, double lo,
                                double hi, int *param)
{
    struct imp_scene *scene = b->scene;
    const struct imp_texture *t = b->node->object; /* set before build is called */
    struct imp_param p = {.store = IMP_STORE_BULK, .bulk = data};
    p.info.name = name_join(scene, t->name, key);
    if (!p.info.name) return no_memory(scene);
    p.info.unit = "1";
    p.info.n_dims = n_dims;
    for (int d = 0; d < n_dims; d++) p.info.dims[d] = dims[d];
    p.info.flags = flags;
    p.info.lo = lo;
    p.info.hi = hi;
    return imp__theta_add(scene, &p, param);
}

static enum imp_status texture_build(struct imp_scene *scene, struct imp_node *node,
                                     const char *parent, const char *slot,
                                     struct imp_texture **out)
{
    enum imp_status st = IMP_OK;
    struct imp_texture *t = node->object;
    if (t) {
        *out = t;
        return IMP_OK;
    }
    if (node->visiting)
        return imp__node_error(scene->ctx, node, IMP_E_SCENE, "the object contains itself");
    node->visiting = 1;
    const struct imp_texture_ops *ops;
    KIND_FIND(scene, node, imp__texture_kinds, ops);

    t = imp__arena_array(&scene->arena, 1, sizeof *t);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!t || !self) IMP_TRY(no_memory(scene));
    *t = (struct imp_texture){.ops = ops, .self = self, .param = -1,
                              .name = object_name(scene, node, parent, slot)};
    if (!t->name) IMP_TRY(no_memory(scene));
    node->object = t;
    int n = 0;
    while (ops->inputs && ops->inputs[n].name) n++;
    const struct imp_input **input = imp__arena_array(&scene->arena, (size_t)n + 1, sizeof *input);
    if (!input) IMP_TRY(no_memory(scene));
    IMP_TRY(inputs_build(scene, node, t->name, ops->inputs, input, &t->n_in));
    t->input = input;
    const struct imp_build b = build_make(scene, node);
    if (ops->build) IMP_TRY(ops->build(&b, self, t));
    IMP_TRY(imp__props_finish(scene->ctx, node));
    IMP_TRY(list_add(scene, (void ***)&scene->textures, &scene->n_textures, t));
    *out = t;
out:
    node->visiting = 0;
    return st;
}

static enum imp_status param_add(struct imp_scene *scene, const char *name, const char *key,
                                 const struct imp_input_desc *d, struct imp_input *in,
                                 int count)
{
    char path[512];
    snprintf(path, sizeof path, "%s.%s", d->name, key);
    struct imp_param p = {.store = IMP_STORE_LANES, .lanes = &in->value};
    p.info.name = name_join(scene, name, path);
    if (!p.info.name) return no_memory(scene);
    in->count = count;
    p.info.unit = d->unit ? d->unit : "1";
    p.info.n_dims = count > 1;
    p.info.dims[0] = (size_t)count;
    const bool unbounded = d->lo == 0 && d->hi == 0;
    p.info.lo = d->lo;
    p.info.hi = unbounded ? INFINITY : d->hi;
    if (!(d->flags & IMP_INPUT_FIXED)) p.info.flags |= IMP_PARAM_DIFFERENTIABLE;
    if (d->flags & (IMP_INPUT_EDGES | IMP_INPUT_FIXED)) p.info.flags |= IMP_PARAM_DISCONTINUOUS;
    if (count > 1) p.info.flags |= IMP_PARAM_COLOR;
    return imp__theta_add(scene, &p, &in->param);
}

/* Texels that stand for an input stay within its bounds, if they are there to begin with:
 * a search may not raise a reflectance above 1. */
static void texels_bound(struct imp_scene *scene, int param, const struct imp_input_desc *d)
{
    if (param < 0 || scene->params[param].store != IMP_STORE_BULK) return;
    struct imp_param *p = &scene->params[param];
    const double hi = d->lo == 0 && d->hi == 0 ? INFINITY : d->hi;
    size_t n = 1;
    for (int k = 0; k < p->info.n_dims; k++) n *= p->info.dims[k];
    for (size_t k = 0; k < n; k++)
        if (p->bulk[k] < d->lo || p->bulk[k] > hi) return;
    p->info.lo = imp_max(p->info.lo, d->lo);
    p->info.hi = imp_min(p->info.hi, hi);
}

static enum imp_status input_build(struct imp_scene *scene, struct imp_node *node,
                                   const char *name, const struct imp_input_desc *d,
                                   struct imp_input *in)
{
    imp_context *ctx = scene->ctx;
    enum imp_status st = IMP_OK;
    const bool scalar = d->flags & IMP_INPUT_SCALAR;
    struct imp_prop *prop = imp__node_prop(node, d->name);
    struct imp_child *child = imp__node_child(node, d->name);
    const char *key = "value";
    int count = 1;
    *in = (struct imp_input){.param = -1, .scalar = scalar};

    if (prop) {
        prop->used = true;
        IMP_TRY(imp__color_convert(ctx, node, prop, d->role, scalar, scene->mode, &in->value,
                                   &count));
    } else if (child && imp__color_is_object(child->node)) {
        child->used = true;
        IMP_TRY(imp__color_object(ctx, child->node, d->role, scalar, scene->mode, &in->value,
                                  &count, &key));
    } else if (child) {
        struct imp_texture *t;
        child->used = true;
        if (strcmp(child->node->tag, "texture") != 0)
            IMP_TRY(imp__node_error(ctx, child->node, IMP_E_SCENE,
                                    "'%s' must be a number, a colour or a texture", d->name));
        IMP_TRY(texture_build(scene, child->node, name, d->name, &t));
        in->texture = t;
        texels_bound(scene, t->param, d);
        return IMP_OK;
    } else if (d->flags & IMP_INPUT_REQUIRED) {
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "property '%s' is missing", d->name));
    } else {
        imp__color_default(d->fallback, scalar ? IMP_REFLECTANCE : d->role, scene->mode,
                           &in->value, &count);
        in->count = count;
        if (d->flags & IMP_INPUT_OPTIONAL) return IMP_OK;
    }
    in->count = count;
    for (int k = 0; k < count; k++) {
        const double v = in->value[k], hi = d->lo == 0 && d->hi == 0 ? INFINITY : d->hi;
        if (!isfinite(v) || v < d->lo || v > hi)
            IMP_TRY(imp__prop_error(ctx, node, prop, IMP_E_SCENE, "%s = %g is outside [%g, %g]",
                                    d->name, v, d->lo, hi));
    }
    IMP_TRY(param_add(scene, name, key, d, in, count));
out:
    return st;
}

static enum imp_status inputs_build(struct imp_scene *scene, struct imp_node *node,
                                    const char *name, const struct imp_input_desc *desc,
                                    const struct imp_input **out, int *n)
{
    enum imp_status st = IMP_OK;
    int count = 0;
    for (const struct imp_input_desc *d = desc; d && d->name; d++) {
        struct imp_input *in = imp__arena_array(&scene->arena, 1, sizeof *in);
        if (!in) IMP_TRY(no_memory(scene));
        IMP_TRY(input_build(scene, node, name, d, in));
        out[count++] = in;
    }
    *n = count;
out:
    return st;
}

/* ---- BSDFs --------------------------------------------------------------------------- */

static enum imp_status bsdf_build(struct imp_scene *scene, struct imp_node *node,
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
    const struct imp_bsdf_ops *ops;
    KIND_FIND(scene, node, imp__bsdf_kinds, ops);

    struct imp_bsdf *b = imp__arena_array(&scene->arena, 1, sizeof *b);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!b || !self) IMP_TRY(no_memory(scene));
    *b = (struct imp_bsdf){.ops = ops, .self = self, .flags = IMP_BSDF_SMOOTH,
                           .name = object_name(scene, node, parent, slot)};
    if (!b->name) IMP_TRY(no_memory(scene));

    const struct imp_build build = build_make(scene, node);
    if (ops->prepare) IMP_TRY(ops->prepare(&build));
    int n_own = 0;
    while (ops->inputs && ops->inputs[n_own].name) n_own++;
    const struct imp_input **own = imp__arena_array(&scene->arena, (size_t)n_own + 1, sizeof *own);
    if (!own) IMP_TRY(no_memory(scene));
    IMP_TRY(inputs_build(scene, node, b->name, ops->inputs, own, &b->n_own));

    b->n_in = b->n_own;
    for (size_t i = 0; i < node->n_children && ops->max_children > 0; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, "bsdf") != 0) continue;
        c->used = true;
        if (b->n_child == imp_min(ops->max_children, 2))
            IMP_TRY(imp__node_error(ctx, c->node, IMP_E_SCENE, "'%s' takes at most %d bsdfs",
                                    ops->name, ops->max_children));
        char child_slot[32];
        snprintf(child_slot, sizeof child_slot,
                 strcmp(ops->name, "twosided") == 0 ? "brdf_%d"
                 : ops->max_children == 1           ? "nested_bsdf"
                                                    : "bsdf_%d", b->n_child);
        struct imp_bsdf *child;
        IMP_TRY(bsdf_build(scene, c->node, b->name, child_slot, &child));
        b->child_in[b->n_child] = b->n_in;
        b->child[b->n_child++] = child;
        b->n_in += child->n_in;
    }
    if (b->n_child < ops->min_children)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "a nested bsdf is missing"));
    b->input = imp__arena_array(&scene->arena, (size_t)b->n_in + 1, sizeof *b->input);
    if (!b->input) IMP_TRY(no_memory(scene));
    memcpy(b->input, own, (size_t)b->n_own * sizeof *own);
    for (int k = 0; k < b->n_child; k++)
        if (b->child[k]->n_in)
            memcpy(b->input + b->child_in[k], b->child[k]->input,
                   (size_t)b->child[k]->n_in * sizeof *b->input);

    if (ops->build) IMP_TRY(ops->build(&build, self, b));
    IMP_TRY(imp__props_finish(ctx, node));
    b->index = scene->n_bsdfs;
    IMP_TRY(list_add(scene, (void ***)&scene->bsdfs, &scene->n_bsdfs, b));
    node->object = b;
    *out = b;
out:
    node->visiting = 0;
    return st;
}

/* A diffuse of this reflectance that has no parameter: emitters' default material. */
static enum imp_status black_build(struct imp_scene *scene, struct imp_bsdf **out)
{
    const struct imp_bsdf_ops *ops = NULL;
    for (size_t k = 0; imp__bsdf_kinds[k]; k++)
        if (strcmp(imp__bsdf_kinds[k]->name, "diffuse") == 0) ops = imp__bsdf_kinds[k];
    struct imp_bsdf *b = imp__arena_array(&scene->arena, 1, sizeof *b);
    struct imp_input *in = imp__arena_array(&scene->arena, 1, sizeof *in);
    if (!b || !in || !ops) return no_memory(scene);
    *in = (struct imp_input){.param = -1, .count = 1};
    *b = (struct imp_bsdf){.ops = ops, .n_own = 1, .n_in = 1, .index = -1, .name = "",
                           .self = imp__arena_array(&scene->arena, 1, ops->object_size + 1),
                           .input = imp__arena_array(&scene->arena, 1, sizeof *b->input)};
    if (!b->self || !b->input) return no_memory(scene);
    b->input[0] = in;
    *out = b; /* flags 0: nothing is reflected, so no light samples and no continuation */
    return IMP_OK;
}

/* ---- Emitters, shapes, sensors -------------------------------------------------------- */

static enum imp_status emitter_build(struct imp_scene *scene, struct imp_node *node,
                                     const char *parent, const char *slot,
                                     struct imp_shape *shape)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const struct imp_emitter_ops *ops;
    KIND_FIND(scene, node, imp__emitter_kinds, ops);
    const bool area = ops->flags & IMP_EMITTER_AREA;
    if (area && !shape) return IMP_OK; /* declared only; used where a shape refers to it */
    if (!area && shape)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "cannot be attached to a shape"));
    if (node->object)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "is attached to a second shape; each needs its own"));

    struct imp_emitter *e = imp__arena_array(&scene->arena, 1, sizeof *e);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!e || !self) IMP_TRY(no_memory(scene));
    *e = (struct imp_emitter){.ops = ops, .self = self, .shape = shape,
                              .index = scene->n_emitters,
                              .name = object_name(scene, node, parent, slot)};
    if (!e->name) IMP_TRY(no_memory(scene));
    node->object = e;
    int n = 0;
    while (ops->inputs && ops->inputs[n].name) n++;
    const struct imp_input **input = imp__arena_array(&scene->arena, (size_t)n + 1, sizeof *input);
    if (!input) IMP_TRY(no_memory(scene));
    IMP_TRY(inputs_build(scene, node, e->name, ops->inputs, input, &e->n_in));
    e->input = input;
    IMP_TRY(imp__props_float(ctx, node, "sampling_weight", 1, &e->weight));
    if (e->weight < 0)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "sampling_weight is negative"));
    const struct imp_build b = build_make(scene, node);
    if (ops->build) IMP_TRY(ops->build(&b, self, e));
    IMP_TRY(imp__props_finish(ctx, node));
    if (ops->flags & IMP_EMITTER_ENVIRONMENT) {
        if (scene->environment >= 0)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "a second environment emitter"));
        scene->environment = e->index;
    }
    if (shape) shape->emitter = e->index;
    IMP_TRY(list_add(scene, (void ***)&scene->emitters, &scene->n_emitters, e));
out:
    return st;
}

static enum imp_status shape_build(struct imp_scene *scene, struct imp_node *node,
                                   const char *name)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const struct imp_shape_ops *ops;
    KIND_FIND(scene, node, imp__shape_kinds, ops);
    struct imp_shape *s = imp__arena_array(&scene->arena, 1, sizeof *s);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!s || !self) IMP_TRY(no_memory(scene));
    *s = (struct imp_shape){.ops = ops, .self = self, .index = scene->n_shapes, .bsdf = -1,
                            .emitter = -1, .name = name};
    node->object = s;
    /* Has a say in gradients of geometry only; there are none yet. */
    double silhouette;
    IMP_TRY(imp__props_float(ctx, node, "silhouette_sampling_weight", 1, &silhouette));

    struct imp_node *bsdf = NULL, *emitter = NULL;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        const char *tag = c->node->tag;
        if (strcmp(tag, "bsdf") == 0) {
            if (bsdf) IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "has two bsdfs"));
            bsdf = c->node;
        } else if (strcmp(tag, "emitter") == 0) {
            if (emitter) IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "has two emitters"));
            emitter = c->node;
        } else if (strcmp(tag, "medium") == 0 || strcmp(tag, "sensor") == 0) {
            IMP_TRY(imp__node_error(ctx, c->node, IMP_E_UNSUPPORTED,
                                    "this version has no %s inside a shape", tag));
        } else {
            continue;
        }
        c->used = true;
    }
    const struct imp_build b = build_make(scene, node);
    IMP_TRY(ops->build(&b, self, s));
    IMP_TRY(imp__props_finish(ctx, node));

    if (!bsdf && !emitter) { /* as if <bsdf type="diffuse"/> had been written */
        bsdf = imp__node_create(&scene->arena, "bsdf", "diffuse", NULL, NULL, node->loc);
        if (!bsdf) IMP_TRY(no_memory(scene));
    }
    if (bsdf) {
        struct imp_bsdf *made;
        IMP_TRY(bsdf_build(scene, bsdf, name, "bsdf", &made));
        s->bsdf = made->index;
    } else {
        s->bsdf = -2;
    }
    if (emitter) {
        if (!(s->area > 0))
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "has an emitter, but no area to emit from"));
        IMP_TRY(emitter_build(scene, emitter, name, "emitter", s));
    }
    IMP_TRY(list_add(scene, (void ***)&scene->shapes, &scene->n_shapes, s));
    scene->lo = (imp_v3){fmin(scene->lo[0], s->lo[0]), fmin(scene->lo[1], s->lo[1]),
                         fmin(scene->lo[2], s->lo[2]), 0};
    scene->hi = (imp_v3){fmax(scene->hi[0], s->hi[0]), fmax(scene->hi[1], s->hi[1]),
                         fmax(scene->hi[2], s->hi[2]), 0};
out:
    return st;
}

/* The child of this tag, or a default one of the given type. */
static enum imp_status child_or_default(struct imp_scene *scene, struct imp_node *node,
                                        const char *tag, const char *type,
                                        struct imp_node **out)
{
    *out = NULL;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (strcmp(c->node->tag, tag) != 0) continue;
        if (*out) return imp__node_error(scene->ctx, node, IMP_E_SCENE, "has two %ss", tag);
        c->used = true;
        *out = c->node;
    }
    if (!*out) *out = imp__node_create(&scene->arena, tag, type, NULL, NULL, node->loc);
    return *out ? IMP_OK : no_memory(scene);
}

static enum imp_status sensor_build(struct imp_scene *scene, struct imp_node *node,
                                    const char *name)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const struct imp_sensor_ops *ops;
    KIND_FIND(scene, node, imp__sensor_kinds, ops);
    struct imp_sensor *s = imp__arena_array(&scene->arena, 1, sizeof *s);
    void *self = imp__arena_array(&scene->arena, 1, ops->object_size);
    if (!s || !self) IMP_TRY(no_memory(scene));
    *s = (struct imp_sensor){.ops = ops, .self = self, .name = name};
    node->object = s;

    struct imp_node *film, *sampler;
    IMP_TRY(child_or_default(scene, node, "film", "hdrfilm", &film));
    IMP_TRY(child_or_default(scene, node, "sampler", "independent", &sampler));
    const struct imp_build film_build = build_make(scene, film);
    const struct imp_build sampler_build = build_make(scene, sampler);
    const struct imp_build b = build_make(scene, node);
    IMP_TRY(imp__film_desc_build(&film_build, &s->film));
    IMP_TRY(imp__sampler_build(&sampler_build, &s->spp));
    IMP_TRY(ops->build(&b, self, s)); /* needs the film's shape */
    IMP_TRY(imp__props_finish(ctx, node));
    IMP_TRY(list_add(scene, (void ***)&scene->sensors, &scene->n_sensors, s));
out:
    return st;
}

/* ---- The scene ------------------------------------------------------------------------ */

/* Top-level objects without id: <tag><n>, counted per tag. */
static const char *top_name(struct imp_scene *scene, const struct imp_node *node, size_t index)
{
    if (node->id) return node->id;
    const struct imp_child *children = scene->root->children;
    size_t n = 0;
    for (size_t i = 0; i < index; i++)
        n += children[i].node && !children[i].node->id &&
             strcmp(children[i].node->tag, node->tag) == 0;
    char text[64];
    snprintf(text, sizeof text, "%.40s%zu", node->tag, n);
    return imp__arena_strdup(&scene->arena, text);
}

static enum imp_status top_build(struct imp_scene *scene, struct imp_child *child,
                                 size_t index)
{
    enum imp_status st = IMP_OK;
    struct imp_node *node = child->node;
    const char *tag = node->tag, *name = top_name(scene, node, index);
    if (!name) return no_memory(scene);
    child->used = true;
    if (strcmp(tag, "shape") == 0) {
        if (!node->object) IMP_TRY(shape_build(scene, node, name));
    } else if (strcmp(tag, "sensor") == 0) {
        if (!node->object) IMP_TRY(sensor_build(scene, node, name));
    } else if (strcmp(tag, "bsdf") == 0) {
        struct imp_bsdf *b;
        node->id = name;
        IMP_TRY(bsdf_build(scene, node, "", "", &b));
    } else if (strcmp(tag, "texture") == 0 || strcmp(tag, "spectrum") == 0) {
        struct imp_texture *t;
        if (strcmp(tag, "texture") == 0 && !imp__color_is_object(node)) {
            node->id = name;
            IMP_TRY(texture_build(scene, node, "", "", &t));
        }
    } else if (strcmp(tag, "emitter") == 0) {
        const bool had_id = node->id;
        node->id = name;
        if (!node->object) IMP_TRY(emitter_build(scene, node, "", "", NULL));
        if (!had_id && !node->object)
            IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                    "an area emitter must be inside a shape"));
    } else if (strcmp(tag, "integrator") == 0) {
        if (scene->has_integrator)
            IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_SCENE, "a second integrator"));
        IMP_TRY(imp__integrator_build(scene, node, &scene->integrator));
        scene->has_integrator = true;
    } else if (strcmp(tag, "film") != 0 && strcmp(tag, "sampler") != 0 &&
               strcmp(tag, "rfilter") != 0) { /* those are declared for sensors */
        IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                                "this version has no <%s>", tag));
    }
out:
    return st;
}

/* Emitters are chosen by sampling_weight; all zero is as good as none. */
static enum imp_status lights_build(struct imp_scene *scene)
{
    double total = 0;
    for (int i = 0; i < scene->n_emitters; i++) total += scene->emitters[i]->weight;
    scene->light_cdf = imp__arena_array(&scene->arena, (size_t)scene->n_emitters + 1,
                                        sizeof *scene->light_cdf);
    if (!scene->light_cdf) return no_memory(scene);
    double sum = 0;
    for (int i = 0; i < scene->n_emitters; i++) {
        sum += scene->emitters[i]->weight;
        scene->light_cdf[i] = total > 0 ? sum / total : 0;
    }
    if (scene->n_emitters && total > 0) scene->light_cdf[scene->n_emitters - 1] = 1;
    return IMP_OK;
}

enum imp_status imp__scene_build(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    scene->channels = scene->mode == IMP_MONO ? 1 : 3;
    scene->environment = -1;
    scene->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    scene->hi = -scene->lo;
    IMP_TRY(black_build(scene, &scene->black_bsdf));
    scene->default_bsdf = scene->black_bsdf;
    for (size_t i = 0; i < scene->root->n_children; i++)
        IMP_TRY(top_build(scene, &scene->root->children[i], i));
    IMP_TRY(imp__props_finish(scene->ctx, scene->root));
    if (!scene->has_integrator)
        scene->integrator = (struct imp_integrator){
            .kind = IMP_INTEGRATOR_PATH, .max_depth = -1, .rr_depth = 5,
            .emitter_samples = 1, .bsdf_samples = 1};
    IMP_TRY(lights_build(scene));
    imp__theta_finish(scene);
    IMP_TRY(imp__intersector_create(scene));
    scene->committed = true;
out:
    return st;
}
