/* SPDX-License-Identifier: Apache-2.0
 *
 * Conversion of colours, numbers and spectra to the one or three numbers of a
 * parameter (docs/scene-format.md 2.1). */
#include "cie.h"
#include "color_set.h"
#include "math/vec.h"
#include "rgb.h"
#include <string.h>

/* Three numbers, or one where the mode or the input has room for one only: a mode's one
 * is the luminance; an input's is the mean, as in Mitsuba (where texels are otherwise).
 */
void imp__color_rgb_set(const struct imp__color_ask *ask, const double rgb[3],
                        struct imp__color *out)
{
    const bool mono = ask->mode == IMP_MONO;
    if (ask->scalar || mono) {
        out->value = imp__spec(mono ? imp__luminance(rgb[0], rgb[1], rgb[2])
                                    : (rgb[0] + rgb[1] + rgb[2]) / 3);
        out->count = 1;
    } else {
        out->value = (imp_spec){rgb[0], rgb[1], rgb[2], 0};
        out->count = 3;
    }
}

/* One number c; as emission in rgb mode it is a colour whose three numbers are equal. */
void imp__color_number_set(const struct imp__color_ask *ask, double c,
                           struct imp__color *out)
{
    out->value = imp__spec(c);
    out->count =
        ask->role == IMP_EMISSION && !ask->scalar && ask->mode == IMP_RGB ? 3 : 1;
}

/* Equal-energy white: the colour of a constant spectrum 1 as light. */
static void equal_energy_set(const struct imp__color_ask *ask, double c,
                             struct imp__color *out)
{
    static const double white[3] = {1.204794, 0.948291, 0.908916};
    if (ask->scalar || ask->mode == IMP_MONO) {
        out->value = imp__spec(c);
        out->count = 1;
    } else {
        out->value = (imp_spec){c * white[0], c * white[1], c * white[2], 0};
        out->count = 3;
    }
}

/* ---- Spectra of spectral modes ---------------------------------------------------- */

enum imp_status imp__color_spectrum_make(const struct imp__color_ask *ask,
                                         enum imp__spectrum_form form, size_t n,
                                         const double *nm, const double *value,
                                         const struct imp_spectrum *times,
                                         struct imp__color *out)
{
    struct imp_spectrum *s = imp__spectrum_make(ask->arena, form, n, nm, value);
    if (!s) return imp__error(ask->ctx, IMP_E_NOMEM, "out of memory");
    s->times = times;
    s->emission = ask->role == IMP_EMISSION;
    s->extinction = ask->any_size;
    s->linear = ask->linear;
    imp__spectrum_update(s);
    out->spectrum = s;
    return IMP_OK;
}

/* A number of emission is so much daylight. */
static enum imp_status number_spectrum(const struct imp__color_ask *ask, double c,
                                       struct imp__color *out)
{
    if (!imp__color_wants_spectrum(ask) || ask->scalar || ask->role != IMP_EMISSION)
        return IMP_OK;
    return imp__color_spectrum_make(ask, IMP_SPECTRUM_NUMBER, 1, NULL, &c, &imp__daylight,
                                    out);
}

enum imp_status imp__color_lift(const struct imp__color_ask *ask, const double rgb[3],
                                struct imp__color *out)
{
    if (!imp__color_wants_spectrum(ask) || ask->scalar) return IMP_OK;
    if (ask->role == IMP_UNBOUNDED && !ask->any_size &&
        (rgb[0] > 1 || rgb[1] > 1 || rgb[2] > 1))
        imp__warn(ask->ctx,
                  "rgb %g %g %g is cut to [0,1] in a spectral mode, as in "
                  "Mitsuba; write a spectrum",
                  rgb[0], rgb[1], rgb[2]);
    return imp__color_spectrum_make(ask, IMP_SPECTRUM_COLOR, 3, NULL, rgb,
                                    ask->role == IMP_EMISSION ? &imp__daylight : NULL,
                                    out);
}

/* Sodium's yellow line, at which an index without a wavelength is meant. */
#define LINE_D_NM 587.56

void imp__color_preview(const struct imp_spectrum *s, enum imp_role role, bool scalar,
                        imp_spec *value)
{
    double rgb[3];
    switch (s->form) {
    case IMP_SPECTRUM_SELLMEIER:
    case IMP_SPECTRUM_CAUCHY:
        *value = imp__spec(imp__spectrum_value(s, LINE_D_NM));
        return;
    case IMP_SPECTRUM_COLOR:
        *value = (imp_spec){s->value[0], s->value[1], s->value[2], 0};
        return;
    case IMP_SPECTRUM_POINTS:
    case IMP_SPECTRUM_NUMBER:
    case IMP_SPECTRUM_BLACKBODY: break;
    }
    imp__spectrum_color(s, role != IMP_EMISSION, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] =
            role == IMP_REFLECTANCE ? imp_clamp(rgb[c], 0.0, 1.0) : imp_max(rgb[c], 0.0);
    *value = scalar ? imp__spec((rgb[0] + rgb[1] + rgb[2]) / 3)
                    : (imp_spec){rgb[0], rgb[1], rgb[2], 0};
}

/* ---- Checks ------------------------------------------------------------------------ */

static enum imp_status check_number(const struct imp__color_ask *ask,
                                    const struct imp_node *node,
                                    const struct imp_prop *prop, double c)
{
    if (!isfinite(c))
        return imp__prop_error(ask->ctx, node, prop, IMP_E_SCENE, "'%s' is not finite",
                               prop->name);
    if (ask->role == IMP_EMISSION && c < 0)
        return imp__prop_error(ask->ctx, node, prop, IMP_E_SCENE,
                               "%s = %g is outside [0, inf]", prop->name, c);
    return IMP_OK;
}

/* A colour in rgb as the role allows it. */
enum imp_status imp__color_check_rgb(const struct imp__color_ask *ask,
                                     const struct imp_node *node,
                                     const struct imp_prop *prop, const double rgb[3])
{
    for (int c = 0; c < 3; c++) {
        const enum imp_status st = check_number(ask, node, prop, rgb[c]);
        if (st != IMP_OK) return st;
        if (ask->role == IMP_REFLECTANCE && (rgb[c] < 0 || rgb[c] > 1))
            return imp__prop_error(ask->ctx, node, prop, IMP_E_SCENE,
                                   "%s = %g is outside [0, 1]", prop->name, rgb[c]);
    }
    return IMP_OK;
}

static enum imp_status check_samples(const struct imp__color_ask *ask,
                                     const struct imp_node *node,
                                     const struct imp_prop *prop, size_t n,
                                     const double *nm, const double *v)
{
    imp_context *ctx = ask->ctx;
    const char *name = prop ? prop->name : "values"; /* of an object */
    if (!prop) prop = imp__color_written(node);
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
        if (v[i] < 0 && ask->role != IMP_UNBOUNDED)
            return imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                                   "%s = %g at %g nm is outside [0, %s]", name, v[i],
                                   nm[i], ask->role == IMP_EMISSION ? "inf" : "1");
        if (v[i] > 1 && ask->role == IMP_REFLECTANCE && imp__color_wants_spectrum(ask) &&
            !ask->scalar)
            return imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                                   "%s = %g at %g nm is outside [0, 1]", name, v[i],
                                   nm[i]);
    }
    if (nm[n - 1] < IMP_LIGHT_FIRST_NM)
        return imp__prop_error(ctx, node, prop, IMP_E_SCENE,
                               "wavelengths of a spectrum are in nm: %g to %g nm is no "
                               "light (micrometres?)",
                               nm[0], nm[n - 1]);
    return IMP_OK;
}

/* Said where a colour in rgb is not what its samples are. */
static void warn_of_loss(const struct imp__color_ask *ask, const struct imp_node *node,
                         const struct imp_prop *prop, size_t n, const double *nm,
                         const double *v)
{
    char where[256];
    const char *name = prop ? prop->name : "values";
    size_t most = 0;
    if (imp__color_wants_spectrum(ask) && !ask->scalar) return;
    for (size_t i = 1; i < n; i++)
        if (v[i] > v[most]) most = i;
    imp__loc_text(prop ? prop->loc : node->loc, where, sizeof where);
    if (nm[n - 1] < IMP_CIE_FIRST_NM || nm[0] > IMP_CIE_LAST_NM)
        imp__warn(ask->ctx, "%s: %s: %g to %g nm are not visible: its colour is black",
                  where, name, nm[0], nm[n - 1]);
    else if (v[most] > 1 && ask->role == IMP_REFLECTANCE)
        imp__warn(ask->ctx,
                  "%s: %s = %g at %g nm is above 1: its colour is cut to [0,1], and "
                  "spectral modes refuse it",
                  where, name, v[most], nm[most]);
}

/* ---- Properties -------------------------------------------------------------------- */

/* Samples, checked and turned into a colour: surfaces are seen under D65, lights as they
 * are; what lies outside the gamut is clamped (docs/scene-format.md 2.1). */
enum imp_status imp__color_samples_set(const struct imp__color_ask *ask,
                                       const struct imp_node *node,
                                       const struct imp_prop *prop, size_t n,
                                       const double *nm, const double *v,
                                       struct imp__color *out)
{
    enum imp_status st = IMP_OK;
    double rgb[3];
    IMP_TRY(check_samples(ask, node, prop, n, nm, v));
    warn_of_loss(ask, node, prop, n, nm, v);
    imp__spectrum_to_rgb(n, nm, v, ask->role != IMP_EMISSION, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] = ask->role == IMP_REFLECTANCE ? imp_clamp(rgb[c], 0.0, 1.0)
                                              : imp_max(rgb[c], 0.0);
    imp__color_rgb_set(ask, rgb, out);
    if (imp__color_wants_spectrum(ask))
        IMP_TRY(imp__color_spectrum_make(ask, IMP_SPECTRUM_POINTS, n, nm, v, NULL, out));
out:
    return st;
}

enum imp_status imp__color_convert(const struct imp__color_ask *ask,
                                   const struct imp_node *node,
                                   const struct imp_prop *prop, struct imp__color *out)
{
    enum imp_status st = IMP_OK;
    struct imp__color color = {.key = "value"};
    switch (prop->type) {
    case IMP_PROP_INTEGER:
    case IMP_PROP_FLOAT: {
        const double c =
            prop->type == IMP_PROP_FLOAT ? prop->number[0] : (double)prop->integer;
        IMP_TRY(check_number(ask, node, prop, c));
        imp__color_number_set(ask, c, &color);
        IMP_TRY(number_spectrum(ask, c, &color));
        break;
    }
    case IMP_PROP_UNIFORM:
        IMP_TRY(check_number(ask, node, prop, prop->number[0]));
        if (ask->role == IMP_EMISSION && !imp__color_wants_spectrum(ask))
            equal_energy_set(ask, prop->number[0], &color);
        else imp__color_number_set(ask, prop->number[0], &color);
        break;
    case IMP_PROP_RGB:
        IMP_TRY(imp__color_check_rgb(ask, node, prop, prop->number));
        imp__color_rgb_set(ask, prop->number, &color);
        IMP_TRY(imp__color_lift(ask, prop->number, &color));
        break;
    case IMP_PROP_SPECTRUM:
        IMP_TRY(imp__color_samples_set(ask, node, prop, prop->n, prop->list,
                                       prop->list + prop->n, &color));
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
        IMP_TRY(imp__prop_error(
            ask->ctx, node, prop, IMP_E_SCENE,
            "'%s' must be a number, a colour or a texture, not a %s%s", prop->name,
            names[prop->type],
            prop->type == IMP_PROP_VECTOR ? "; three numbers of a colour are an rgb"
                                          : ""));
    }
    }
    *out = color;
out:
    return st;
}

enum imp_status imp__color_default(const struct imp__color_ask *ask, double fallback,
                                   struct imp__color *out)
{
    *out = (struct imp__color){.key = "value"};
    imp__color_number_set(ask, fallback, out);
    return number_spectrum(ask, fallback, out);
}
