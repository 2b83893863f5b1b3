/* SPDX-License-Identifier: Apache-2.0
 *
 * Inputs of objects: constants, which become parameters, and textures. Names and tools
 * that all builders share stand first. */
#include "color/convert.h"
#include "color/rgb.h"
#include "scene_build.h"

enum imp_status imp__build_no_memory(struct imp_scene *scene)
{
    return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the scene");
}

char *imp__build_name(struct imp_scene *scene, const char *parent, const char *key)
{
    const size_t n = strlen(parent) + strlen(key) + 2;
    char *s = imp__arena_take(&scene->arena, n, 1);
    if (s) snprintf(s, n, "%s.%s", parent, key);
    return s;
}

/* The name of an object: its id, else the slot below the parent. */
const char *imp__build_object_name(struct imp_scene *scene, const struct imp_node *node,
                                   const char *parent, const char *slot)
{
    return node->id ? node->id : imp__build_name(scene, parent, slot);
}

/* Append to one of the scene's lists; they live in the arena and double. */
enum imp_status imp__build_list_add(struct imp_scene *scene, void ***list, int *n,
                                    void *object)
{
    const size_t count = (size_t)*n;
    if ((count & (count - 1)) == 0) { /* 0, 1, 2, 4, 8: full */
        void **grown =
            imp__arena_take(&scene->arena, count ? 2 * count : 1, sizeof *grown);
        if (!grown) return imp__build_no_memory(scene);
        if (count) memcpy(grown, *list, count * sizeof *grown);
        *list = grown;
    }
    (*list)[(*n)++] = object;
    return IMP_OK;
}

static enum imp_status add_bulk(const struct imp_build *b, const char *key, float *data,
                                int n_dims, const size_t dims[3], unsigned flags,
                                double lo, double hi, int *param);

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

/* ---- Inputs and textures ------------------------------------------------------- */

/* The data of a picture in a slot that is called data are that slot: sky.data. */
static const char *bulk_name(struct imp_scene *scene, const char *texture,
                             const char *key)
{
    const char *slot = strrchr(texture, '.');
    return slot && strcmp(slot + 1, key) == 0 ? texture
                                              : imp__build_name(scene, texture, key);
}

static enum imp_status add_bulk(const struct imp_build *b, const char *key, float *data,
                                int n_dims, const size_t dims[3], unsigned flags,
                                double lo, double hi, int *param)
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
    p.info.n_dims = n_dims;
    for (int d = 0; d < n_dims; d++) p.info.dims[d] = dims[d];
    p.info.flags = flags;
    p.info.lo = lo;
    p.info.hi = hi;
    return imp__theta_add(scene, &p, param);
}

enum imp_status imp__build_watch(struct imp_scene *scene,
                                 const struct imp_input *const *input, int n,
                                 void (*changed)(void *payload), void *payload)
{
    enum imp_status st = IMP_OK;
    for (int j = 0; j < n; j++) {
        const struct imp_texture *t = input[j]->texture;
        const int param = t ? t->param : input[j]->param;
        if (param >= 0) IMP_TRY(imp__theta_watch(scene, param, changed, payload));
        if (t) IMP_TRY(imp__build_watch(scene, t->input, t->n_in, changed, payload));
    }
out:
    return st;
}

static enum imp_status colour_prepare(struct imp_scene *scene, const struct imp_input *in,
                                      enum imp_role role);

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
        } else if (imp__is_spectral(scene->mode) && !same_spectra(t->asked, asked)) {
            return imp__node_error(
                scene->ctx, node, IMP_E_UNSUPPORTED,
                "stands for '%s' and for '%s', which are different "
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
        IMP_TRY(colour_prepare(scene, t->input[k], ops->inputs[k].role));
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

/* A spectrum whose numbers are set. */
struct spectrum_of {
    struct imp_spectrum *spectrum;
    struct imp_input *input;
    enum imp_role role;
};
static void spectrum_changed(void *payload)
{
    const struct spectrum_of *s = payload;
    imp__spectrum_update(s->spectrum);
    imp__color_preview(s->spectrum, s->role, s->input->scalar, &s->input->value);
}

/* Coefficients of an index, which have no bounds of their own. */
static bool formula(const struct imp_spectrum *s)
{
    return s && (s->form == IMP_SPECTRUM_SELLMEIER || s->form == IMP_SPECTRUM_CAUCHY);
}

/* A spectrum that may be asked for as a colour, or as one number: what its numbers do to
 * that. */
static enum imp_status colour_prepare(struct imp_scene *scene, const struct imp_input *in,
                                      enum imp_role role)
{
    struct imp_spectrum *s = (struct imp_spectrum *)in->spectrum; /* the scene's own */
    struct imp_input *own = (struct imp_input *)in;
    if (!s || formula(s) || s->form == IMP_SPECTRUM_BLACKBODY) return IMP_OK;
    if (!imp__spectrum_color_prepare(&scene->arena, role != IMP_EMISSION, s))
        return imp__build_no_memory(scene);
    imp__color_preview(s, role, in->scalar, &own->value);
    return IMP_OK;
}

static enum imp_degree degree_of(const struct imp_spectrum *s)
{
    if (!s || s->form == IMP_SPECTRUM_POINTS || s->form == IMP_SPECTRUM_NUMBER ||
        (s->form == IMP_SPECTRUM_COLOR && s->linear))
        return IMP_DEGREE_LINEAR;
    return s->form == IMP_SPECTRUM_COLOR && s->emission ? IMP_DEGREE_FIRST
                                                        : IMP_DEGREE_OTHER;
}

/* color: what it was made of; its numbers live in the input, or in its spectrum. */
static enum imp_status param_add(struct imp_scene *scene, const char *name,
                                 const struct imp_input_desc *d,
                                 const struct imp__color *color, struct imp_input *in)
{
    char path[512];
    struct imp_spectrum *spectrum = color->spectrum;
    const bool points = spectrum && spectrum->form == IMP_SPECTRUM_POINTS;
    const size_t count = spectrum ? spectrum->n : (size_t)color->count;
    snprintf(path, sizeof path, "%s.%s", d->name, points ? "values" : color->key);
    struct imp_param p = {
        .degree = degree_of(spectrum), .store = IMP_STORE_LANES, .lanes = &in->value};
    if (spectrum) {
        p.store = IMP_STORE_DOUBLES;
        p.doubles = spectrum->own;
        p.info.wavelengths_nm = spectrum->nm;
    }
    p.info.name = imp__build_name(scene, name, path);
    if (!p.info.name) return imp__build_no_memory(scene);
    p.info.unit = d->unit ? d->unit : "1";
    p.info.n_dims = count > 1;
    p.info.dims[0] = count;
    const bool unbounded = d->lo == 0 && d->hi == 0;
    p.info.lo = d->lo;
    p.info.hi = unbounded ? INFINITY : d->hi;
    for (size_t k = 0; k < count && d->flags & IMP_INPUT_SOFT; k++)
        if (imp__param_get(&p, k) > d->hi) p.info.hi = INFINITY;
    if (spectrum && spectrum->form == IMP_SPECTRUM_BLACKBODY) {
        p.info.unit = "K";
        p.info.lo = 1;
        p.info.hi = INFINITY;
    }
    if (formula(spectrum)) {
        p.info.lo = -INFINITY;
        p.info.hi = INFINITY;
    }
    if (!(d->flags & IMP_INPUT_FIXED)) p.info.flags |= IMP_PARAM_DIFFERENTIABLE;
    if (d->flags & (IMP_INPUT_EDGES | IMP_INPUT_FIXED))
        p.info.flags |= IMP_PARAM_DISCONTINUOUS;
    if (count > 1 && !points) p.info.flags |= IMP_PARAM_COLOR;
    const enum imp_status st = imp__theta_add(scene, &p, &in->param);
    if (st != IMP_OK || !spectrum) return st;
    struct spectrum_of *of = imp__arena_array(&scene->arena, 1, sizeof *of);
    if (!of) return imp__build_no_memory(scene);
    *of = (struct spectrum_of){spectrum, in, d->role};
    return imp__theta_watch(scene, in->param, spectrum_changed, of);
}

/* Texels that stand for an input stay within its bounds, if they are there to begin with:
 * a search may not raise a reflectance above 1. */
static void texels_bound(struct imp_scene *scene, int param,
                         const struct imp_input_desc *d)
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

/* Values of a volume are in the bounds of what it stands for. */
static enum imp_status volume_check(struct imp_scene *scene, const struct imp_node *node,
                                    const struct imp_texture *t,
                                    const struct imp_input_desc *d)
{
    const double hi =
        (d->lo == 0 && d->hi == 0) || d->flags & IMP_INPUT_SOFT ? INFINITY : d->hi;
    for (int k = 0; k < t->n_in; k++)
        for (int c = 0; !t->input[k]->texture && c < t->input[k]->count; c++) {
            const double v = t->input[k]->value[c];
            if (v < d->lo || v > hi)
                return imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                       "%s = %g is outside [%g, %g]", d->name, v, d->lo,
                                       hi);
        }
    if (t->param < 0 || scene->params[t->param].store != IMP_STORE_BULK) return IMP_OK;
    const struct imp_param *p = &scene->params[t->param];
    size_t n = 1;
    for (int k = 0; k < p->info.n_dims; k++) n *= p->info.dims[k];
    for (size_t k = 0; k < n; k++)
        if (!(p->bulk[k] >= d->lo && p->bulk[k] <= hi))
            return imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                   "%s: value %zu, %g, is outside [%g, %g]", d->name, k,
                                   (double)p->bulk[k], d->lo, hi);
    return IMP_OK;
}

/* May it be written as <spectrum>, around a texture? */
static bool is_spectrum(const imp_context *ctx, const struct imp_node *node)
{
    const struct imp_texture_ops *t;
    for (size_t k = 0; (t = imp__kind_at(ctx, IMP_CONCEPT_TEXTURE, k)); k++)
        if (strcmp(t->name, node->type) == 0) return t->flags & IMP_TEXTURE_SPECTRUM;
    return false;
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
    struct imp__color color = {.count = 1};
    bool absent_here = false;
    const struct imp__color_ask ask = {.ctx = ctx,
                                       .arena = &scene->arena,
                                       .mode = scene->mode,
                                       .role = d->role,
                                       .scalar = scalar,
                                       .any_size = d->flags & IMP_INPUT_EXTINCTION,
                                       .linear = scene->linear_colors ||
                                                 d->flags & IMP_INPUT_LINEAR};
    imp__node_ask(node, d->name);
    *in = (struct imp_input){.param = -1, .scalar = scalar};
    if (d->flags & IMP_INPUT_LUMINANCE) {
        in->count = 1;
        return IMP_OK;
    }

    if (d->flags & IMP_INPUT_VECTOR &&
        (prop || (child && imp__color_is_object(child->node))))
        IMP_TRY(imp__prop_error(ctx, node, prop, IMP_E_SCENE, "'%s' must be a texture",
                                d->name));
    if (prop) {
        prop->used = true;
        IMP_TRY(imp__color_convert(&ask, node, prop, &color));
    } else if (child && imp__color_is_object(child->node)) {
        child->used = true;
        IMP_TRY(imp__color_object(&ask, child->node, &color));
    } else if (child) {
        struct imp_texture *t;
        child->used = true;
        const bool spectrum = is_spectrum(ctx, child->node);
        if (spectrum && child->node->n_children)
            child->node->children[0].name = "nested_texture";
        const bool volume = d->flags & IMP_INPUT_VOLUME;
        if (strcmp(child->node->tag, volume ? "volume" : "texture") != 0 && !spectrum)
            IMP_TRY(imp__node_error(ctx, child->node, IMP_E_SCENE,
                                    "'%s' must be a number, a colour or a %s", d->name,
                                    volume ? "volume" : "texture"));
        if (d->flags & IMP_INPUT_NUMBER)
            IMP_TRY(imp__node_error(ctx, child->node, IMP_E_SCENE,
                                    "'%s' must be a %s, not a texture", d->name,
                                    scalar ? "number" : "number or a colour"));
        in->vector = d->flags & IMP_INPUT_VECTOR;
        if (child->node->object && in->vector != child->node->vector &&
            scene->mode == IMP_MONO)
            IMP_TRY(imp__node_error(ctx, child->node, IMP_E_SCENE,
                                    "is a colour in one place and a vector in another: "
                                    "in mono mode each needs a texture of its own"));
        if (!child->node->object) child->node->vector = in->vector;
        IMP_TRY(imp__build_texture(scene, child->node, name, d->name, d, &t));
        in->texture = t;
        if (d->flags & IMP_INPUT_FIXED) imp__build_fix(scene, in);
        texels_bound(scene, t->param, d);
        if (volume) IMP_TRY(volume_check(scene, child->node, t, d));
        return IMP_OK;
    } else if (d->flags & IMP_INPUT_REQUIRED) {
        IMP_TRY(
            imp__node_error(ctx, node, IMP_E_SCENE, "property '%s' is missing", d->name));
    } else {
        struct imp__color_ask absent = ask;
        if (scalar) absent.role = IMP_REFLECTANCE;
        IMP_TRY(imp__color_default(&absent, d->fallback, &color));
        absent_here = d->flags & IMP_INPUT_OPTIONAL;
    }
    in->value = color.value;
    in->count = color.count;
    in->spectrum = color.spectrum;
    if (absent_here) return IMP_OK;
    const size_t n_numbers = formula(color.spectrum) ? 0
                             : color.spectrum        ? color.spectrum->n
                                                     : (size_t)color.count;
    for (size_t k = 0; k < n_numbers; k++) {
        const bool unbounded = (d->lo == 0 && d->hi == 0) || d->flags & IMP_INPUT_SOFT;
        const double v = color.spectrum ? color.spectrum->value[k] : in->value[k];
        const double hi = unbounded ? INFINITY : d->hi;
        if (!isfinite(v) || v < d->lo || v > hi)
            IMP_TRY(imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                                    "%s = %g is outside [%g, %g]", d->name, v, d->lo,
                                    hi));
    }
    IMP_TRY(param_add(scene, name, d, &color, in));
    if (prop) prop->theta = true;
    else if (child) child->theta = true;
out:
    return st;
}

enum imp_status imp__build_inputs(struct imp_scene *scene, struct imp_node *node,
                                  const char *name, const struct imp_input_desc *desc,
                                  const struct imp_input **out, int *n)
{
    enum imp_status st = IMP_OK;
    static const imp_spec luminance = {IMP_LUM_R, IMP_LUM_G, IMP_LUM_B, 0};
    int count = 0;
    for (const struct imp_input_desc *d = desc; d && d->name; d++) {
        struct imp_input *in = imp__arena_array(&scene->arena, 1, sizeof *in);
        if (!in) IMP_TRY(imp__build_no_memory(scene));
        IMP_TRY(input_build(scene, node, name, d, in));
        if (d->flags & IMP_INPUT_LUMINANCE) {
            in->weight = scene->mode == IMP_MONO ? (imp_spec){1} : luminance;
            for (in->luminance = 1; in->luminance < count; in->luminance++)
                if (strcmp(desc[count - in->luminance].name, d->name) == 0) break;
            const int colour = count - in->luminance;
            IMP_TRY(colour_prepare(scene, out[colour], desc[colour].role));
        }
        in->plain = !in->texture && !in->luminance && !(in->scalar && in->count == 3);
        out[count++] = in;
    }
    *n = count;
out:
    return st;
}

void imp__build_fix(struct imp_scene *scene, const struct imp_input *input)
{
    const struct imp_texture *t = input->texture;
    const int param = t ? t->param : input->param;
    if (param >= 0) {
        struct imp_param_info *info = &scene->params[param].info;
        info->flags &= ~(unsigned)IMP_PARAM_DIFFERENTIABLE;
        info->flags |= IMP_PARAM_DISCONTINUOUS;
    }
    for (int k = 0; t && k < t->n_in; k++) imp__build_fix(scene, t->input[k]);
}

bool imp__build_shaped(const struct imp_scene *scene,
                       const struct imp_input *const *input, int n)
{
    bool any = false;
    for (int j = 0; j < n; j++) any |= input[j]->scalar && input[j]->spectrum;
    return any && scene->mode == IMP_SPECTRAL;
}
