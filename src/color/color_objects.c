/* SPDX-License-Identifier: Apache-2.0
 *
 * Colours written as objects (docs/scene-format.md 2.4). */
#include "color_objects.h"
#include "base/number.h"
#include "base/required.h"
#include "cie.h"
#include "math/vec.h"
#include <string.h>

enum object {
    UNIFORM,
    SRGB,
    RAWCONSTANT,
    D65,
    REGULAR,
    IRREGULAR,
    BLACKBODY,
    ILLUMINANT,
    GLASS,
    SELLMEIER,
    CAUCHY,
    RAYLEIGH,
    INDEX_RATIO, /* these two are made by imp__ior_prepare */
    WRITTEN,     /* its property `value` */
    N_OBJECTS
};
static const char *const object_names[N_OBJECTS] = {
    "uniform",   "srgb",      "rawconstant", "d65",    "regular",
    "irregular", "blackbody", "illuminant",  "glass",  "sellmeier",
    "cauchy",    "rayleigh",  "index_ratio", "written"};

static enum object object_kind(const struct imp_node *node)
{
    for (int i = 0; i < N_OBJECTS; i++)
        if (strcmp(node->type, object_names[i]) == 0) return (enum object)i;
    return N_OBJECTS;
}

bool imp__color_is_object(const struct imp_node *node)
{
    const enum object kind = object_kind(node);
    if (kind == D65 && imp__node_prop(node, "nested_texture")) return false;
    if (kind == D65 && node->n_children && node->children[0].node) /* around a texture? */
        return object_kind(node->children[0].node) != N_OBJECTS;
    return kind != N_OBJECTS;
}

bool imp__color_is_raw(const struct imp_node *node)
{
    const enum object kind = object_kind(node);
    return kind == RAWCONSTANT || kind == SRGB;
}

enum imp_status imp__color_list(imp_context *ctx, struct imp_node *node, const char *name,
                                double **list, size_t *n)
{
    enum imp_status st = IMP_OK;
    const char *text = NULL;
    double *values = NULL;
    size_t cap = 0, len = 0;

    IMP_TRY(imp__props_string(ctx, node, name, NULL, &text));
    if (!text) IMP_TRY(imp__node_missing(ctx, node, name));
    const char *s = text, *end = text + strlen(text);
    while (*(s += strspn(s, ", \t\r\n"))) {
        const char *start = s;
        double v;
        if (!imp__number(&s, end, &v) || (*s && !strchr(", \t\r\n", *s)) || !isfinite(v))
            IMP_TRY(imp__prop_error(ctx, node, imp__node_prop(node, name), IMP_E_SCENE,
                                    "'%s': '%.20s' is not a number", name, start));
        if (len == cap) {
            double *grown = imp__grow(ctx, values, &cap, len + 1, sizeof *values);
            if (!grown) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "out of memory"));
            values = grown;
        }
        values[len++] = v;
    }
    *list = values;
    *n = len;
    values = NULL;
out:
    imp__release(ctx, values);
    return st;
}

enum imp_status imp__color_require(imp_context *ctx, struct imp_node *node,
                                   const char *name)
{
    if (imp__props_has(node, name)) return IMP_OK;
    return imp__node_missing(ctx, node, name);
}

/* wavelength_min and wavelength_max, in nm. */
static enum imp_status range_read(imp_context *ctx, struct imp_node *node, double *lo,
                                  double *hi)
{
    enum imp_status st = IMP_OK;
    IMP_TRY(imp__props_float_in(ctx, node, "wavelength_min", IMP_CIE_FIRST_NM,
                                IMP_NOT_NEGATIVE, lo));
    IMP_TRY(imp__props_float_in(ctx, node, "wavelength_max", IMP_CIE_LAST_NM,
                                IMP_POSITIVE, hi));
    if (!(*lo < *hi)) {
        const struct imp_prop *p = imp__node_prop(node, "wavelength_max");
        if (p)
            IMP_TRY(
                imp__prop_error(ctx, node, p, IMP_E_SCENE,
                                "wavelength_max = %g is outside (wavelength_min = %g, "
                                "inf]",
                                *hi, *lo));
        IMP_TRY(imp__prop_error(
            ctx, node, imp__node_prop(node, "wavelength_min"), IMP_E_SCENE,
            "wavelength_min = %g is outside [0, wavelength_max = %g)", *lo, *hi));
    }
out:
    return st;
}

const struct imp_prop *imp__color_written(const struct imp_node *node)
{
    static const char *const names[] = {"value", "values", "color", "coefficients", "B"};
    const struct imp_prop *p = NULL;
    for (size_t k = 0; k < imp_count(names) && !p; k++)
        p = imp__node_prop(node, names[k]);
    return p;
}

static enum imp_status samples_object(const struct imp__color_ask *ask,
                                      struct imp_node *node, bool regular,
                                      struct imp__color *out)
{
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    double *nm = NULL, *v = NULL;
    size_t n = 0, n_nm = 0;

    IMP_TRY(imp__color_list(ctx, node, "values", &v, &n));
    if (regular) {
        double lo, hi;
        IMP_TRY(imp__color_require(ctx, node, "wavelength_min"));
        IMP_TRY(imp__color_require(ctx, node, "wavelength_max"));
        IMP_TRY(range_read(ctx, node, &lo, &hi));
        nm = imp__alloc(ctx, n ? n : 1, sizeof *nm);
        if (!nm) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "out of memory"));
        for (size_t i = 0; i < n; i++) nm[i] = n > 1 ? lo + (hi - lo) * i / (n - 1) : lo;
    } else {
        IMP_TRY(imp__color_list(ctx, node, "wavelengths", &nm, &n_nm));
        if (n_nm != n)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "%zu wavelengths, but %zu values", n_nm, n));
    }
    IMP_TRY(imp__color_samples_set(ask, node, NULL, n, nm, v, out));
out:
    imp__release(ctx, nm);
    imp__release(ctx, v);
    return st;
}

/* A number or a vector, as it is. */
static enum imp_status raw_object(const struct imp__color_ask *ask, struct imp_node *node,
                                  struct imp__color *out)
{
    static const double one[3] = {1, 1, 1};
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    const struct imp_prop *p = imp__node_prop(node, "value");
    double v[3];
    if (p && p->type == IMP_PROP_VECTOR) {
        if (imp__color_wants_spectrum(ask) && !ask->scalar)
            IMP_TRY(imp__prop_error(ctx, node, p, IMP_E_UNSUPPORTED,
                                    "three numbers are no spectrum: in a spectral mode "
                                    "'value' is one"));
        IMP_TRY(imp__props_vector(ctx, node, "value", one, v));
    } else {
        IMP_TRY(imp__color_require(ctx, node, "value"));
        IMP_TRY(imp__props_float(ctx, node, "value", 1, &v[0]));
        v[1] = v[2] = v[0];
    }
    for (int c = 0; c < 3; c++)
        if (!isfinite(v[c]))
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "'value' is not finite"));
    if (p && p->type == IMP_PROP_VECTOR) {
        imp__color_rgb_set(ask, v, out);
    } else {
        out->value = imp__spec(v[0]);
        out->count = 1;
    }
out:
    return st;
}

/* Daylight times another spectrum: its numbers times `scale`. */
static enum imp_status in_daylight(const struct imp__color_ask *ask, double scale,
                                   struct imp__color *c)
{
    struct imp_spectrum *s = c->spectrum;
    const double number = scale * c->value[0];
    if (!imp__color_wants_spectrum(ask) || ask->scalar) return IMP_OK;
    if (!s)
        return imp__color_spectrum_make(ask, IMP_SPECTRUM_NUMBER, 1, NULL, &number,
                                        &imp__daylight, c);
    for (size_t i = 0; i < s->n; i++) s->own[i] *= scale;
    s->times = &imp__daylight;
    imp__spectrum_update(s);
    return IMP_OK;
}

/* The property's colour, or white. */
static enum imp_status d65_object(const struct imp__color_ask *ask, struct imp_node *node,
                                  struct imp__color *out)
{
    static const double white[3] = {1, 1, 1};
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    double scale;

    IMP_TRY(imp__props_float_in(ctx, node, "scale", 1, IMP_NOT_NEGATIVE, &scale));
    struct imp_prop *color = imp__node_prop(node, "color");
    if (color) {
        struct imp__color_ask light = *ask;
        light.role = IMP_EMISSION;
        color->used = true;
        if (color->type != IMP_PROP_RGB)
            IMP_TRY(
                imp__prop_error(ctx, node, color, IMP_E_SCENE, "'color' must be an rgb"));
        IMP_TRY(imp__color_check_rgb(&light, node, color, color->number));
        imp__color_rgb_set(ask, color->number, out);
        IMP_TRY(imp__color_lift(&light, color->number, out));
    } else if (node->n_children) {
        struct imp_child *child = &node->children[0];
        child->used = true;
        if (!child->node || !imp__color_is_object(child->node))
            IMP_TRY(imp__node_error(ctx, node, IMP_E_UNSUPPORTED,
                                    "d65 around a texture cannot be nested"));
        IMP_TRY(imp__color_object(ask, child->node, out));
    } else {
        imp__color_rgb_set(ask, white, out);
    }
    IMP_TRY(in_daylight(ask, scale, out));
    out->value *= scale;
out:
    return st;
}

static enum imp_status uniform_object(const struct imp__color_ask *ask,
                                      struct imp_node *node, struct imp__color *out)
{
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    double c, lo, hi;
    const double least = ask->role == IMP_EMISSION ? 0 : -INFINITY;
    IMP_TRY(imp__props_float_in(ctx, node, "value", 1,
                                (struct imp_interval){least, INFINITY, IMP_CLOSED}, &c));
    IMP_TRY(range_read(ctx, node, &lo, &hi));
    imp__color_number_set(ask, c, out);
    /* The range matters in spectral modes only. */
    if (!imp__color_wants_spectrum(ask) ||
        (lo <= IMP_CIE_FIRST_NM && hi >= IMP_CIE_LAST_NM))
        goto out;
    IMP_TRY(imp__color_spectrum_make(ask, IMP_SPECTRUM_NUMBER, 1, NULL, &c, NULL, out));
    out->spectrum->lo = lo;
    out->spectrum->hi = hi;
out:
    return st;
}

/* Radiance of a black body, in W m^-2 sr^-1 nm^-1, times `scale`; in modes without spectra
 * its colour, as that of any list of wavelengths. */
static enum imp_status blackbody_object(const struct imp__color_ask *ask,
                                        struct imp_node *node, struct imp__color *out)
{
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    double T, scale, lo, hi;
    IMP_TRY(imp__color_require(ctx, node, "temperature"));
    IMP_TRY(imp__props_float_in(ctx, node, "temperature", 0, IMP_POSITIVE, &T));
    IMP_TRY(imp__props_float_in(ctx, node, "scale", 1, IMP_NOT_NEGATIVE, &scale));
    IMP_TRY(range_read(ctx, node, &lo, &hi));
    IMP_TRY(
        imp__color_spectrum_make(ask, IMP_SPECTRUM_BLACKBODY, 1, NULL, &T, NULL, out));
    out->spectrum->lo = lo;
    out->spectrum->hi = hi;
    if (scale != 1) {
        struct imp__color factor = {.count = 1};
        IMP_TRY(imp__color_spectrum_make(ask, IMP_SPECTRUM_NUMBER, 1, NULL, &scale, NULL,
                                         &factor));
        out->spectrum->times = factor.spectrum;
    }
    imp__color_preview(out->spectrum, ask->role, ask->scalar, &out->value);
    out->count = 3;
    out->key = "temperature";
    if (!imp__color_wants_spectrum(ask)) {
        const double rgb[3] = {out->value[0], out->value[1], out->value[2]};
        *out = (struct imp__color){.key = "value", .count = 1};
        imp__color_rgb_set(ask, rgb, out);
    }
out:
    return st;
}

/* Index behind a surface over the index before it. */
static enum imp_status ratio_object(const struct imp__color_ask *ask,
                                    struct imp_node *node, struct imp__color *out)
{
    enum imp_status st = IMP_OK;
    struct imp__color side[2];
    for (size_t k = 0; k < 2; k++) {
        node->children[k].used = true;
        IMP_TRY(imp__color_object(ask, node->children[k].node, &side[k]));
        if (!side[k].spectrum && imp__color_wants_spectrum(ask))
            IMP_TRY(imp__color_spectrum_make(ask, IMP_SPECTRUM_NUMBER, 1, NULL,
                                             &(double){side[k].value[0]}, NULL,
                                             &side[k]));
    }
    *out = side[0];
    if (out->spectrum) out->spectrum->over = side[1].spectrum;
    out->value /= side[1].value;
    out->count = 1;
out:
    return st;
}

enum imp_status imp__color_object(const struct imp__color_ask *ask, struct imp_node *node,
                                  struct imp__color *out)
{
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    struct imp__color color = {.key = "value", .count = 1};

    switch (object_kind(node)) {
    case UNIFORM: IMP_TRY(uniform_object(ask, node, &color)); break;
    case SRGB: {
        struct imp_prop *p = imp__node_prop(node, "color");
        struct imp__color_ask surface = *ask;
        surface.role = IMP_REFLECTANCE;
        IMP_TRY(imp__color_require(ctx, node, "color"));
        if (!p || (p->type != IMP_PROP_RGB && p->type != IMP_PROP_VECTOR))
            IMP_TRY(imp__prop_error(ctx, node, p, IMP_E_SCENE, "'color' must be an rgb"));
        p->used = true;
        IMP_TRY(imp__color_check_rgb(&surface, node, p, p->number));
        imp__color_rgb_set(ask, p->number, &color);
        IMP_TRY(imp__color_lift(&surface, p->number, &color));
        break;
    }
    case RAWCONSTANT: IMP_TRY(raw_object(ask, node, &color)); break;
    case D65: IMP_TRY(d65_object(ask, node, &color)); break;
    case REGULAR:
    case IRREGULAR:
        IMP_TRY(samples_object(ask, node, object_kind(node) == REGULAR, &color));
        break;
    case BLACKBODY: IMP_TRY(blackbody_object(ask, node, &color)); break;
    case ILLUMINANT: IMP_TRY(imp__color_illuminant(ask, node, &color)); break;
    case GLASS: IMP_TRY(imp__color_glass(ask, node, &color)); break;
    case SELLMEIER:
    case CAUCHY:
        IMP_TRY(imp__color_formula(ask, node, object_kind(node) == CAUCHY, &color));
        break;
    case RAYLEIGH: IMP_TRY(imp__color_rayleigh(ask, node, &color)); break;
    case INDEX_RATIO: IMP_TRY(ratio_object(ask, node, &color)); break;
    case WRITTEN: {
        struct imp_prop *p = imp__node_prop(node, "value");
        IMP_TRY(imp__color_require(ctx, node, "value"));
        p->used = true;
        IMP_TRY(imp__color_convert(ask, node, p, &color));
        break;
    }
    case N_OBJECTS: IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "is not a colour"));
    }
    IMP_TRY(imp__props_finish(ctx, node));
    *out = color;
out:
    return st;
}
