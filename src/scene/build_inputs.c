/* SPDX-License-Identifier: Apache-2.0
 *
 * Inputs of objects: constants, which become parameters, and textures. */
#include "base/arguments.h"
#include "base/required.h"
#include "color/convert.h"
#include "color/rgb.h"
#include "scene_build.h"

/* A spectrum whose values are set. */
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

enum imp_status imp__build_spectrum(struct imp_scene *scene, const struct imp_input *in,
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

/* Texels of an input are bounded by its bounds, if they are within them at the start: a
 * search may not raise a reflectance above 1. */
void imp__build_texels_bound(struct imp_scene *scene, int param,
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

/* Values of a volume are in the bounds of its input. */
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

/* A number of a colour that is written as an object. */
static enum imp_status outside_of(imp_context *ctx, const struct imp_node *object,
                                  const struct imp_input_desc *d, double v, double hi)
{
    const struct imp_prop *p = imp__color_written(object);
    return imp__prop_error(ctx, object, p, IMP_E_SCENE, "%s%s%s = %g is outside [%g, %g]",
                           p ? p->name : "", p ? ": " : "", d->name, v, d->lo, hi);
}

/* Tags and flags of a child that is to be the texture of an input. */
static enum imp_status texture_allowed(imp_context *ctx, const struct imp_node *child,
                                       bool spectrum, const struct imp_input_desc *d)
{
    const bool volume = d->flags & IMP_INPUT_VOLUME;
    if (strcmp(child->tag, volume ? "volume" : "texture") != 0 && !spectrum)
        return imp__node_error(ctx, child, IMP_E_SCENE,
                               "'%s' must be a number, a colour or a %s", d->name,
                               volume ? "volume" : "texture");
    if (d->flags & IMP_INPUT_NUMBER)
        return imp__node_error(
            ctx, child, IMP_E_SCENE, "'%s' must be a %s, not a texture", d->name,
            d->flags & IMP_INPUT_SCALAR ? "number" : "number or a colour");
    return IMP_OK;
}

/* An input that is looked up: the texture is made, and its texels are kept in bounds. */
static enum imp_status texture_input(struct imp_scene *scene, struct imp_node *node,
                                     struct imp_node *child, const char *name,
                                     const struct imp_input_desc *d, struct imp_input *in)
{
    imp_context *ctx = scene->ctx;
    const bool bump = d->flags & IMP_INPUT_BUMP, spectrum = is_spectrum(ctx, child);
    struct imp_texture *t;
    if (spectrum && child->n_children) child->children[0].name = "nested_texture";
    IMP_CHECKED(texture_allowed(ctx, child, spectrum, d));
    in->vector = d->flags & IMP_INPUT_VECTOR;
    in->bump = bump;
    if (bump) {
        double scale;
        IMP_CHECKED(imp__props_float(ctx, node, "scale", 1, &scale));
        in->value = imp__spec(scale);
    }
    if (child->object && in->vector != child->vector && scene->mode == IMP_MONO)
        return imp__node_error(ctx, child, IMP_E_SCENE,
                               "is a colour in one place and a vector in another: "
                               "in mono mode each needs a texture of its own");
    if (!child->object) child->vector = in->vector;
    IMP_CHECKED(imp__build_texture(scene, child, name, d->name, d, &t));
    in->texture = t;
    if (bump && !t->ops->slope)
        return imp__node_error(ctx, child, IMP_E_UNSUPPORTED,
                               "the slope of such a texture is not known: it raises "
                               "nothing");
    if (d->flags & IMP_INPUT_FIXED) imp__build_fix(scene, in, NULL);
    else if (bump && !t->ops->slope_scatter)
        imp__build_fix(scene, in, "the slope of such a texture has no derivative");
    imp__build_texels_bound(scene, t->param, d);
    return d->flags & IMP_INPUT_VOLUME ? volume_check(scene, child, t, d) : IMP_OK;
}

/* A constant input as the scene writes it: a property, or an object that is a colour. */
struct written {
    struct imp_node *node;
    struct imp_prop *prop;   /* NULL: none */
    struct imp_child *child; /* NULL: none */
    bool object;             /* the child is a colour */
};

/* The numbers of a constant are within the bounds of its input; those of a formula have
 * none. */
static enum imp_status numbers_check(imp_context *ctx, const struct written *w,
                                     const struct imp_input_desc *d,
                                     const struct imp__color *color)
{
    const size_t n = formula(color->spectrum) ? 0
                     : color->spectrum        ? color->spectrum->n
                                              : (size_t)color->count;
    const bool unbounded = (d->lo == 0 && d->hi == 0) || d->flags & IMP_INPUT_SOFT;
    const double hi = unbounded ? INFINITY : d->hi;
    for (size_t k = 0; k < n; k++) {
        const double v = color->spectrum ? color->spectrum->value[k] : color->value[k];
        if (isfinite(v) && v >= d->lo && v <= hi) continue;
        if (w->object) return outside_of(ctx, w->child->node, d, v, hi);
        return imp__prop_error(
            ctx, w->node, w->prop, IMP_E_SCENE, "%s = %g is outside [%g, %g]",
            w->prop && w->prop->of ? w->prop->of : d->name, v, d->lo, hi);
    }
    return IMP_OK;
}

/* A constant, written or by default; it becomes a parameter, unless it is an optional one
 * that is not there. */
static enum imp_status constant_input(struct imp_scene *scene, const struct written *w,
                                      const char *name, const struct imp_input_desc *d,
                                      struct imp_input *in)
{
    imp_context *ctx = scene->ctx;
    struct imp__color color = {.count = 1};
    struct imp__color_ask ask = {.ctx = ctx,
                                 .arena = &scene->arena,
                                 .mode = in->vector ? IMP_RGB : scene->mode,
                                 .role = d->role,
                                 .scalar = in->scalar,
                                 .any_size = d->flags & IMP_INPUT_EXTINCTION,
                                 .linear =
                                     scene->linear_colors || d->flags & IMP_INPUT_LINEAR};
    if (w->prop) {
        w->prop->used = true;
        IMP_CHECKED(imp__color_convert(&ask, w->node, w->prop, &color));
    } else if (w->object) {
        w->child->used = true;
        IMP_CHECKED(imp__color_object(&ask, w->child->node, &color));
    } else if (d->flags & IMP_INPUT_REQUIRED) {
        return imp__node_missing(ctx, w->node, d->name);
    } else {
        if (in->scalar) ask.role = IMP_REFLECTANCE;
        IMP_CHECKED(imp__color_default(&ask, d->fallback, &color));
    }
    in->value = color.value;
    in->count = color.count;
    in->spectrum = color.spectrum;
    const bool there = w->prop || w->object;
    if (!there && d->flags & IMP_INPUT_OPTIONAL) return IMP_OK;
    IMP_CHECKED(numbers_check(ctx, w, d, &color));
    IMP_CHECKED(param_add(scene, name, d, &color, in));
    if (w->prop) w->prop->theta = true;
    else if (w->object) w->child->theta = true;
    return IMP_OK;
}

static enum imp_status input_build(struct imp_scene *scene, struct imp_node *node,
                                   const char *name, const struct imp_input_desc *d,
                                   struct imp_input *in)
{
    *in = (struct imp_input){.param = -1, .scalar = d->flags & IMP_INPUT_SCALAR};
    if (d->flags & (IMP_INPUT_LUMINANCE | IMP_INPUT_WAVELENGTH | IMP_INPUT_COMPONENT)) {
        in->count = 1;
        if (d->flags & IMP_INPUT_WAVELENGTH) in->spectrum = &imp__wavelength;
        return IMP_OK;
    }
    struct written w = {.node = node,
                        .prop = imp__node_prop(node, d->name),
                        .child = imp__node_child(node, d->name)};
    imp__node_ask(node, d->name);
    w.object = w.child && imp__color_is_object(w.child->node);
    in->vector = d->flags & IMP_INPUT_VECTOR && w.object && !w.prop &&
                 imp__color_is_raw(w.child->node);
    if (d->flags & (IMP_INPUT_BUMP | IMP_INPUT_VECTOR) && (w.prop || w.object) &&
        !in->vector)
        return imp__prop_error(
            scene->ctx, node, w.prop, IMP_E_SCENE, "'%s' must be a texture%s", d->name,
            d->flags & IMP_INPUT_VECTOR ? ", a rawconstant or srgb" : "");
    if (!w.prop && w.child && !w.object) {
        w.child->used = true;
        return texture_input(scene, node, w.child->node, name, d, in);
    }
    w.object &= !w.prop;
    return constant_input(scene, &w, name, d, in);
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
            IMP_TRY(imp__build_spectrum(scene, out[colour], desc[colour].role));
        }
        if (d->flags & IMP_INPUT_COMPONENT) {
            in->weight = scene->mode == IMP_MONO ? (imp_spec){1} : (imp_spec){1, 1, 1, 0};
            in->component = count > 0 ? imp_max(out[count - 1]->component, 0) + 1 : 1;
        }
        in->plain = !in->texture && !in->luminance && !in->component &&
                    !(in->scalar && in->count == 3);
        out[count++] = in;
    }
    *n = count;
out:
    return st;
}

void imp__build_fix(struct imp_scene *scene, const struct imp_input *input,
                    const char *why)
{
    const struct imp_texture *t = input->texture;
    const int param = t ? t->param : input->param;
    if (param >= 0) {
        struct imp_param_info *info = &scene->params[param].info;
        info->flags &= ~(unsigned)IMP_PARAM_DIFFERENTIABLE;
        info->flags |= IMP_PARAM_DISCONTINUOUS;
        if (!info->why) info->why = why;
    }
    for (int k = 0; t && k < t->n_in; k++) imp__build_fix(scene, t->input[k], why);
}

bool imp__build_shaped(const struct imp_scene *scene,
                       const struct imp_input *const *input, int n)
{
    bool any = false;
    for (int j = 0; j < n; j++) any |= input[j]->scalar && input[j]->spectrum;
    return any && scene->mode == IMP_SPECTRAL;
}
