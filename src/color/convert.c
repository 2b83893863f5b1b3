/* SPDX-License-Identifier: Apache-2.0
 *
 * Conversion of colours, numbers and spectra to the one or three numbers of a
 * parameter (docs/scene-format.md 2.1). */
#include "convert.h"
#include "base/number.h"
#include "math/vec.h"
#include "rgb.h"
#include <string.h>

/* Three numbers, or one where the mode or the input has room for one only: a mode's one
 * is the luminance; an input's is the mean, as in Mitsuba (where texels are otherwise).
 */
static void color_set(const double rgb[3], bool scalar, enum imp_color_mode mode,
                      imp_spec *value, int *count)
{
    if (scalar || mode == IMP_MONO) {
        *value = imp__spec(mode == IMP_MONO ? imp__luminance(rgb[0], rgb[1], rgb[2])
                                            : (rgb[0] + rgb[1] + rgb[2]) / 3);
        *count = 1;
    } else {
        *value = (imp_spec){rgb[0], rgb[1], rgb[2], 0};
        *count = 3;
    }
}

/* One number c; as emission in rgb mode it is a colour whose three numbers are equal. */
static void number_set(double c, enum imp_role role, bool scalar,
                       enum imp_color_mode mode, imp_spec *value, int *count)
{
    *value = imp__spec(c);
    *count = role == IMP_EMISSION && !scalar && mode == IMP_RGB ? 3 : 1;
}

/* Equal-energy white: what a constant spectrum 1 looks like as light. */
static void equal_energy_set(double c, bool scalar, enum imp_color_mode mode,
                             imp_spec *value, int *count)
{
    static const double white[3] = {1.204794, 0.948291, 0.908916};
    if (scalar || mode == IMP_MONO) {
        *value = imp__spec(c);
        *count = 1;
    } else {
        *value = (imp_spec){c * white[0], c * white[1], c * white[2], 0};
        *count = 3;
    }
}

static enum imp_status check_number(imp_context *ctx, const struct imp_node *node,
                                    const struct imp_prop *prop, enum imp_role role,
                                    double c)
{
    if (!isfinite(c))
        return imp__prop_error(ctx, node, prop, IMP_E_SCENE, "'%s' is not finite",
                               prop->name);
    if (role == IMP_EMISSION && c < 0)
        return imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                               "'%s': emission %g is negative", prop->name, c);
    return IMP_OK;
}

/* A colour in rgb as the role allows it. */
static enum imp_status check_rgb(imp_context *ctx, const struct imp_node *node,
                                 const struct imp_prop *prop, enum imp_role role,
                                 const double rgb[3])
{
    for (int c = 0; c < 3; c++) {
        const enum imp_status st = check_number(ctx, node, prop, role, rgb[c]);
        if (st != IMP_OK) return st;
        if (role == IMP_REFLECTANCE && (rgb[c] < 0 || rgb[c] > 1))
            return imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                                   "'%s': reflectance %g is outside [0, 1]", prop->name,
                                   rgb[c]);
    }
    return IMP_OK;
}

/* Samples, checked and turned into a colour: surfaces are seen under D65, lights as they
 * are; what lies outside the gamut is clamped (docs/scene-format.md 2.1). */
static enum imp_status spectrum_set(imp_context *ctx, const struct imp_node *node,
                                    const struct imp_prop *prop, enum imp_role role,
                                    size_t n, const double *nm, const double *v,
                                    bool scalar, enum imp_color_mode mode,
                                    imp_spec *value, int *count, struct imp_arena *arena,
                                    const struct imp_spectrum **kept)
{
    if (n < 2)
        return imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                               "a spectrum needs at least two samples");
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(nm[i]) || !isfinite(v[i]))
            return imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                                   "sample %zu of the spectrum is not finite", i);
        if (i && nm[i] <= nm[i - 1])
            return imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                                   "wavelengths must increase (%g nm after %g nm)", nm[i],
                                   nm[i - 1]);
    }
    double rgb[3];
    imp__spectrum_to_rgb(n, nm, v, role != IMP_EMISSION, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] =
            role == IMP_REFLECTANCE ? imp_clamp(rgb[c], 0.0, 1.0) : imp_max(rgb[c], 0.0);
    color_set(rgb, scalar, mode, value, count);
    *kept = imp__spectrum_keep(arena, n, nm, v);
    return *kept ? IMP_OK : imp__error(ctx, IMP_E_NOMEM, "out of memory");
}

enum imp_status imp__color_convert(imp_context *ctx, const struct imp_node *node,
                                   const struct imp_prop *prop, enum imp_role role,
                                   bool scalar, enum imp_color_mode mode, imp_spec *value,
                                   int *count, struct imp_arena *arena,
                                   const struct imp_spectrum **kept)
{
    enum imp_status st = IMP_OK;
    switch (prop->type) {
    case IMP_PROP_INTEGER:
    case IMP_PROP_FLOAT: {
        const double c =
            prop->type == IMP_PROP_FLOAT ? prop->number[0] : (double)prop->integer;
        IMP_TRY(check_number(ctx, node, prop, role, c));
        number_set(c, role, scalar, mode, value, count);
        break;
    }
    case IMP_PROP_UNIFORM:
        IMP_TRY(check_number(ctx, node, prop, role, prop->number[0]));
        if (role == IMP_EMISSION)
            equal_energy_set(prop->number[0], scalar, mode, value, count);
        else number_set(prop->number[0], role, scalar, mode, value, count);
        break;
    case IMP_PROP_RGB:
        IMP_TRY(check_rgb(ctx, node, prop, role, prop->number));
        color_set(prop->number, scalar, mode, value, count);
        break;
    case IMP_PROP_SPECTRUM:
        IMP_TRY(spectrum_set(ctx, node, prop, role, prop->n, prop->list,
                             prop->list + prop->n, scalar, mode, value, count, arena,
                             kept));
        break;
    case IMP_PROP_BOOL:
    case IMP_PROP_STRING:
    case IMP_PROP_VECTOR:
    case IMP_PROP_TRANSFORM:
    case IMP_PROP_REF: {
        static const char *const names[] = {[IMP_PROP_BOOL] = "boolean",
                                            [IMP_PROP_STRING] = "string",
                                            [IMP_PROP_VECTOR] = "vector",
                                            [IMP_PROP_TRANSFORM] = "transform",
                                            [IMP_PROP_REF] = "reference"};
        IMP_TRY(imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                                "'%s' must be a number, a colour or a texture, not a %s",
                                prop->name, names[prop->type]));
    }
    }
out:
    return st;
}

void imp__color_default(double fallback, enum imp_role role, enum imp_color_mode mode,
                        imp_spec *value, int *count)
{
    number_set(fallback, role, false, mode, value, count);
}

/* ---- Colours written as objects ------------------------------------------------ */

enum object { UNIFORM, SRGB, RAWCONSTANT, D65, REGULAR, IRREGULAR, BLACKBODY, N_OBJECTS };
static const char *const object_names[N_OBJECTS] = {
    "uniform", "srgb", "rawconstant", "d65", "regular", "irregular", "blackbody"};

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

/* Numbers separated by commas and blanks; *list is released by the caller. */
static enum imp_status list_read(imp_context *ctx, struct imp_node *node,
                                 const char *name, double **list, size_t *n)
{
    enum imp_status st = IMP_OK;
    const char *text = NULL;
    double *values = NULL;
    size_t cap = 0, len = 0;

    IMP_TRY(imp__props_string(ctx, node, name, NULL, &text));
    if (!text) IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "'%s' is required", name));
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

static enum imp_status require(imp_context *ctx, struct imp_node *node, const char *name)
{
    if (imp__props_has(node, name)) return IMP_OK;
    return imp__node_error(ctx, node, IMP_E_SCENE, "'%s' is required", name);
}

static enum imp_status spectrum_object(imp_context *ctx, struct imp_node *node,
                                       bool regular, enum imp_role role, bool scalar,
                                       enum imp_color_mode mode, imp_spec *value,
                                       int *count, struct imp_arena *arena,
                                       const struct imp_spectrum **kept)
{
    enum imp_status st = IMP_OK;
    double *nm = NULL, *v = NULL;
    size_t n = 0, n_nm = 0;

    IMP_TRY(list_read(ctx, node, "values", &v, &n));
    if (regular) {
        double lo, hi;
        IMP_TRY(require(ctx, node, "wavelength_min"));
        IMP_TRY(require(ctx, node, "wavelength_max"));
        IMP_TRY(imp__props_float(ctx, node, "wavelength_min", 0, &lo));
        IMP_TRY(imp__props_float(ctx, node, "wavelength_max", 0, &hi));
        nm = imp__alloc(ctx, n ? n : 1, sizeof *nm);
        if (!nm) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "out of memory"));
        for (size_t i = 0; i < n; i++) nm[i] = n > 1 ? lo + (hi - lo) * i / (n - 1) : lo;
    } else {
        IMP_TRY(list_read(ctx, node, "wavelengths", &nm, &n_nm));
        if (n_nm != n)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "%zu wavelengths, but %zu values", n_nm, n));
    }
    IMP_TRY(spectrum_set(ctx, node, NULL, role, n, nm, v, scalar, mode, value, count,
                         arena, kept));
out:
    imp__release(ctx, nm);
    imp__release(ctx, v);
    return st;
}

/* A number or a vector, as it is. */
static enum imp_status raw_object(imp_context *ctx, struct imp_node *node, bool scalar,
                                  enum imp_color_mode mode, imp_spec *value, int *count)
{
    static const double one[3] = {1, 1, 1};
    enum imp_status st = IMP_OK;
    const struct imp_prop *p = imp__node_prop(node, "value");
    double v[3];
    if (p && p->type == IMP_PROP_VECTOR) {
        IMP_TRY(imp__props_vector(ctx, node, "value", one, v));
    } else {
        IMP_TRY(require(ctx, node, "value"));
        IMP_TRY(imp__props_float(ctx, node, "value", 1, &v[0]));
        v[1] = v[2] = v[0];
    }
    for (int c = 0; c < 3; c++)
        if (!isfinite(v[c]))
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "'value' is not finite"));
    if (p && p->type == IMP_PROP_VECTOR) {
        color_set(v, scalar, mode, value, count);
    } else {
        *value = imp__spec(v[0]);
        *count = 1;
    }
out:
    return st;
}

/* The property's colour, or white. */
static enum imp_status d65_object(imp_context *ctx, struct imp_node *node,
                                  enum imp_role role, bool scalar,
                                  enum imp_color_mode mode, imp_spec *value, int *count,
                                  struct imp_arena *arena)
{
    static const double white[3] = {1, 1, 1};
    enum imp_status st = IMP_OK;
    const struct imp_spectrum *inner = NULL; /* daylight times it is another one */
    double scale;
    imp_spec v;
    int n;

    IMP_TRY(imp__props_float(ctx, node, "scale", 1, &scale));
    if (!isfinite(scale) || scale < 0)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "'scale' must be finite and not negative"));
    struct imp_prop *color = imp__node_prop(node, "color");
    if (color) {
        color->used = true;
        if (color->type != IMP_PROP_RGB)
            IMP_TRY(
                imp__prop_error(ctx, node, color, IMP_E_SCENE, "'color' must be an rgb"));
        IMP_TRY(check_rgb(ctx, node, color, IMP_EMISSION, color->number));
        color_set(color->number, scalar, mode, &v, &n);
    } else if (node->n_children) {
        struct imp_child *child = &node->children[0];
        const char *key;
        child->used = true;
        if (!child->node || !imp__color_is_object(child->node))
            IMP_TRY(imp__node_error(ctx, node, IMP_E_UNSUPPORTED,
                                    "d65 around a texture cannot be nested"));
        IMP_TRY(imp__color_object(ctx, child->node, role, scalar, mode, &v, &n, &key,
                                  arena, &inner));
    } else {
        color_set(white, scalar, mode, &v, &n);
    }
    *value = v * scale;
    *count = n;
out:
    return st;
}

enum imp_status imp__color_object(imp_context *ctx, struct imp_node *node,
                                  enum imp_role role, bool scalar,
                                  enum imp_color_mode mode, imp_spec *value, int *count,
                                  const char **key, struct imp_arena *arena,
                                  const struct imp_spectrum **kept)
{
    enum imp_status st = IMP_OK;
    imp_spec v = imp__spec(0);
    int n = 1;

    switch (object_kind(node)) {
    case UNIFORM: {
        double c, ignored;
        IMP_TRY(imp__props_float(ctx, node, "value", 1, &c));
        /* The range matters in a spectral mode only. */
        IMP_TRY(imp__props_float(ctx, node, "wavelength_min", 360, &ignored));
        IMP_TRY(imp__props_float(ctx, node, "wavelength_max", 830, &ignored));
        if (!isfinite(c) || (role == IMP_EMISSION && c < 0))
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "'value' %g is not allowed here", c));
        number_set(c, role, scalar, mode, &v, &n);
        break;
    }
    case SRGB: {
        struct imp_prop *color = imp__node_prop(node, "color");
        IMP_TRY(require(ctx, node, "color"));
        if (!color || color->type != IMP_PROP_RGB)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "'color' must be an rgb"));
        color->used = true;
        IMP_TRY(check_rgb(ctx, node, color, IMP_REFLECTANCE, color->number));
        color_set(color->number, scalar, mode, &v, &n);
        break;
    }
    case RAWCONSTANT: IMP_TRY(raw_object(ctx, node, scalar, mode, &v, &n)); break;
    case D65: IMP_TRY(d65_object(ctx, node, role, scalar, mode, &v, &n, arena)); break;
    case REGULAR:
    case IRREGULAR:
        IMP_TRY(spectrum_object(ctx, node, object_kind(node) == REGULAR, role, scalar,
                                mode, &v, &n, arena, kept));
        break;
    case BLACKBODY:
        IMP_TRY(imp__node_error(
            ctx, node, IMP_E_UNSUPPORTED,
            "blackbody exists in spectral mode only; this version has rgb "
            "and mono"));
        break;
    case N_OBJECTS: IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE, "is not a colour"));
    }
    IMP_TRY(imp__props_finish(ctx, node));
    *value = v;
    *count = n;
    *key = "value";
out:
    return st;
}
