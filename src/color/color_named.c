/* SPDX-License-Identifier: Apache-2.0
 *
 * Lights and indices by name and by formula (docs/scene-format.md 2.4). */
#include "cie.h"
#include "color_objects.h"
#include "color_tables.h"
#include "rgb.h"
#include <string.h>
#include <strings.h>

static enum imp_status fixed_points(const struct imp__color_ask *ask, int n,
                                    const double *nm, const double *value,
                                    const struct imp_spectrum **out)
{
    struct imp__color c = {.count = 1};
    const enum imp_status st = imp__color_spectrum_make(ask, IMP_SPECTRUM_POINTS,
                                                        (size_t)n, nm, value, NULL, &c);
    *out = c.spectrum;
    return st;
}

enum imp_status imp__color_illuminant(const struct imp__color_ask *ask,
                                      struct imp_node *node, struct imp__color *out)
{
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    const struct imp_spectrum *shape = &imp__daylight;
    const struct imp__illuminant *light;
    const char *name;
    double scale, rgb[3], nm[IMP_CIE_N], value[IMP_CIE_N];
    int n = IMP_CIE_N;
    IMP_TRY(imp__color_require(ctx, node, "name"));
    IMP_TRY(imp__props_string(ctx, node, "name", "", &name));
    IMP_TRY(imp__props_float_in(ctx, node, "scale", 1, IMP_NOT_NEGATIVE, &scale));
    light = imp__illuminant_find(name);
    if (strcasecmp(name, "D65") == 0) {
        memcpy(value, imp__cie_d65, sizeof value);
    } else if (strcasecmp(name, "E") == 0) {
        for (int q = 0; q < n; q++) value[q] = 1;
    } else if (light) {
        n = light->n;
        memcpy(value, light->value, (size_t)n * sizeof *value);
    } else {
        IMP_TRY(
            imp__prop_error(ctx, node, imp__node_prop(node, "name"), IMP_E_SCENE,
                            "name: there is no illuminant '%s'; there are A, B, C, D50, "
                            "D55, D65, D75, E, F1 to F12 and G173",
                            name));
    }
    for (int q = 0; q < n; q++)
        nm[q] = (light ? light->first_nm : IMP_CIE_FIRST_NM) + IMP_CIE_STEP_NM * q;
    double Y = 0;
    for (int q = 0; q < n; q++)
        Y += value[q] * imp__cie_lookup(imp__cie_xyz[1], nm[q]) * IMP_CIE_STEP_NM /
             IMP_CIE_Y_INTEGRAL;
    for (int q = 0; q < n; q++) value[q] /= Y;
    imp__spectrum_to_rgb((size_t)n, nm, value, ask->role != IMP_EMISSION, rgb);
    for (int c = 0; c < 3; c++) rgb[c] = imp_max(scale * rgb[c], 0.0);
    imp__color_rgb_set(ask, rgb, out);
    if (imp__color_wants_spectrum(ask)) {
        IMP_TRY(fixed_points(ask, n, nm, value, &shape));
        IMP_TRY(imp__color_spectrum_make(ask, IMP_SPECTRUM_NUMBER, 1, NULL, &scale, shape,
                                         out));
        out->key = "scale";
    }
out:
    return st;
}

/* tau(l) by
 *   hansen_travis  .008569 l^-4 (1 + .0113 l^-2 + .00013 l^-4), l in um (Hansen and Travis
 *                  1974, Eq. 2.30)
 *   power          8000 m times 1.24062e-6 l^-4 m^-1, the constant of graphics; 11 % more
 *                  at 550 nm */
enum imp_status imp__color_rayleigh(const struct imp__color_ask *ask,
                                    struct imp_node *node, struct imp__color *out)
{
    static const double fourth[3] = {0, 0, 1};
    static const struct {
        const char *name;
        double cauchy[3]; /* tau l^4 */
    } laws[] = {{"hansen_travis", {.008569, .008569 * .0113, .008569 * .00013}},
                {"power", {1.24062e-6 * 8000, 0, 0}}};
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    struct imp__color part = {.count = 1};
    const char *name;
    double scale, rgb[3];
    size_t law = 0;
    IMP_TRY(imp__props_string(ctx, node, "law", laws[0].name, &name));
    IMP_TRY(imp__props_float_in(ctx, node, "scale", 1, IMP_NOT_NEGATIVE, &scale));
    while (law < imp_count(laws) && strcmp(name, laws[law].name) != 0) law++;
    if (law == imp_count(laws))
        IMP_TRY(imp__prop_error(ctx, node, imp__node_prop(node, "law"), IMP_E_SCENE,
                                "there is no law '%s'; there are hansen_travis and power",
                                name));
    IMP_TRY(
        imp__color_spectrum_make(ask, IMP_SPECTRUM_CAUCHY, 3, NULL, fourth, NULL, &part));
    IMP_TRY(imp__color_spectrum_make(ask, IMP_SPECTRUM_CAUCHY, 3, NULL, laws[law].cauchy,
                                     part.spectrum, &part));
    IMP_TRY(imp__color_spectrum_make(ask, IMP_SPECTRUM_NUMBER, 1, NULL, &scale,
                                     part.spectrum, out));
    imp__spectrum_color(out->spectrum, ask->role != IMP_EMISSION, rgb);
    for (int c = 0; c < 3; c++) rgb[c] = imp_max(rgb[c], 0.0);
    imp__color_rgb_set(ask, rgb, out);
    if (imp__color_wants_spectrum(ask)) out->key = "scale";
    else out->spectrum = NULL;
out:
    return st;
}

/* An index by a formula; in modes without wavelengths it is that of the yellow d line. */
static enum imp_status index_set(const struct imp__color_ask *ask, struct imp_node *node,
                                 enum imp__spectrum_form form, size_t n,
                                 const double *number, struct imp__color *out)
{
    enum imp_status st = imp__color_spectrum_make(ask, form, n, NULL, number, NULL, out);
    if (st != IMP_OK) return st;
    for (double nm = IMP_CIE_FIRST_NM; nm <= IMP_CIE_LAST_NM; nm += IMP_CIE_STEP_NM) {
        const double index = imp__spectrum_value(out->spectrum, nm);
        if (!(index > 0) || !isfinite(index))
            return imp__node_error(ask->ctx, node, IMP_E_SCENE,
                                   "the index at %g nm is %g", nm, index);
    }
    imp__color_preview(out->spectrum, ask->role, ask->scalar, &out->value);
    out->count = 1;
    out->key = form == IMP_SPECTRUM_CAUCHY ? "cauchy" : "sellmeier";
    if (!imp__color_wants_spectrum(ask)) {
        out->spectrum = NULL;
        out->key = "value";
    }
    return IMP_OK;
}

enum imp_status imp__color_glass(const struct imp__color_ask *ask, struct imp_node *node,
                                 struct imp__color *out)
{
    enum imp_status st = IMP_OK;
    const char *name;
    IMP_TRY(imp__color_require(ask->ctx, node, "name"));
    IMP_TRY(imp__props_string(ask->ctx, node, "name", "", &name));
    const struct imp__glass *g = imp__glass_find(name);
    if (!g)
        IMP_TRY(imp__prop_error(
            ask->ctx, node, imp__node_prop(node, "name"), IMP_E_SCENE,
            "name: there is no glass '%s'; there are N-BK7, N-SF6, N-SF10, "
            "N-SF11, fused silica and others (the manual lists them)",
            name));
    IMP_TRY(
        index_set(ask, node, IMP_SPECTRUM_SELLMEIER, 2 * (size_t)g->n, g->number, out));
out:
    return st;
}

enum imp_status imp__color_formula(const struct imp__color_ask *ask,
                                   struct imp_node *node, bool cauchy,
                                   struct imp__color *out)
{
    imp_context *ctx = ask->ctx;
    enum imp_status st = IMP_OK;
    double *first = NULL, *second = NULL, number[IMP_SPECTRUM_NUMBERS] = {0};
    size_t n = 0, m = 0;
    if (cauchy) {
        IMP_TRY(imp__color_list(ctx, node, "coefficients", &first, &n));
        if (n < 1 || n > 3)
            IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                    "'coefficients' has %zu numbers; 1 to 3 are possible",
                                    n));
        memcpy(number, first, n * sizeof *number);
        IMP_TRY(index_set(ask, node, IMP_SPECTRUM_CAUCHY, 3, number, out));
        goto out;
    }
    IMP_TRY(imp__color_list(ctx, node, "B", &first, &n));
    IMP_TRY(imp__color_list(ctx, node, "C", &second, &m));
    if (n != m || n < 1 || n > IMP_SPECTRUM_NUMBERS / 2)
        IMP_TRY(imp__node_error(ctx, node, IMP_E_SCENE,
                                "'B' has %zu numbers and 'C' %zu; both have the same, 1 "
                                "to %d",
                                n, m, IMP_SPECTRUM_NUMBERS / 2));
    memcpy(number, first, n * sizeof *number);
    memcpy(number + n, second, n * sizeof *number);
    IMP_TRY(index_set(ask, node, IMP_SPECTRUM_SELLMEIER, 2 * n, number, out));
out:
    imp__release(ctx, first);
    imp__release(ctx, second);
    return st;
}
