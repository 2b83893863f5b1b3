/* SPDX-License-Identifier: Apache-2.0
 *
 * Colours: the published numbers of docs/scene-format.md 16, the table of conversions
 * (2.1) line by line, colour objects (2.4), and what is refused. */
#include "base/arena.h"
#include "color/cie.h"
#include "color/convert.h"
#include "color/rgb.h"
#include "imp_tap.h"
#include <stdlib.h>

static imp_context *ctx;
static struct imp_arena arena;

static struct imp_node *node_make(const char *type)
{
    return imp__node_create(&arena, "spectrum", type, NULL, NULL,
                            (struct imp_loc){"a.xml", 3, 5});
}
static struct imp_prop *prop_add(struct imp_node *n, const char *name,
                                 enum imp_prop_type type)
{
    return imp__node_add(&arena, n, name, type, (struct imp_loc){"a.xml", 4, 9});
}
static void list_add(struct imp_node *n, size_t count, const double *list)
{
    struct imp_prop *p = prop_add(n, "c", IMP_PROP_SPECTRUM);
    double *copy = imp__arena_take(&arena, 2 * count, sizeof *copy);
    memcpy(copy, list, 2 * count * sizeof *copy);
    p->list = copy;
    p->n = count;
}

struct expected {
    int count; /* 0: refused */
    double v[3];
};
static void check(const struct imp_node *node, enum imp_role role, bool scalar,
                  enum imp_color_mode mode, struct expected e, double tolerance,
                  const char *what)
{
    const struct imp__color_ask ask = {
        .ctx = ctx, .arena = &arena, .mode = mode, .role = role, .scalar = scalar};
    struct imp__color c = {.value = {-7, -7, -7, -7}, .count = -7};
    const enum imp_status st =
        imp__color_convert(&ask, node, imp__node_prop(node, "c"), &c);
    if (e.count == 0) {
        const char *message = imp_last_error(ctx);
        tap_ok(st == IMP_E_SCENE && c.count == -7 && c.value[0] == -7 &&
                   strncmp(message, "a.xml:4:9: ", 11) == 0,
               "%s: refused with its place # %s", what, message);
        return;
    }
    bool ok = st == IMP_OK && c.count == e.count && !c.spectrum;
    for (int k = 0; k < 3; k++)
        ok &= fabs(c.value[k] - e.v[e.count == 1 ? 0 : k]) <= tolerance;
    tap_ok(ok, "%s # %d: %.6f %.6f %.6f", what, c.count, c.value[0], c.value[1],
           c.value[2]);
}

static const double four[8] = {400, 500, 600, 700, 0.1, 0.2, 0.8, 0.9};

static void published(void)
{
    struct imp_node *n = node_make("");
    list_add(n, 4, four);
    check(n, IMP_REFLECTANCE, false, IMP_RGB,
          (struct expected){3, {0.958689, 0.446356, 0.105710}}, 6e-7,
          "list as reflectance");
    check(n, IMP_EMISSION, false, IMP_RGB,
          (struct expected){3, {1.103547, 0.428732, 0.088722}}, 6e-7, "list as light");
    check(n, IMP_REFLECTANCE, false, IMP_MONO, (struct expected){1, {0.530730}}, 6e-7,
          "list as reflectance, mono");
    check(n, IMP_EMISSION, false, IMP_MONO, (struct expected){1, {0.547707}}, 6e-7,
          "list as light, mono");
    check(n, IMP_REFLECTANCE, true, IMP_RGB,
          (struct expected){1, {(0.958689 + 0.446356 + 0.105710) / 3}}, 6e-7,
          "list as one number: the mean");
    check(n, IMP_REFLECTANCE, true, IMP_MONO, (struct expected){1, {0.530730}}, 6e-7,
          "list as one number, mono: the luminance");
    /* A line at 500 nm lies outside the gamut, on the far side of red. */
    struct imp_node *line = node_make("");
    list_add(line, 3, (double[]){495, 500, 505, 0, 1, 0});
    double raw[3];
    imp__spectrum_to_rgb(3, (double[]){495, 500, 505}, (double[]){0, 1, 0}, 0, raw);
    check(line, IMP_EMISSION, false, IMP_RGB, (struct expected){3, {0, raw[1], raw[2]}},
          1e-15, "a green line is clamped");
    tap_ok(raw[0] < -1e-3 && raw[1] > 1e-3, "red of the line is negative # %g", raw[0]);
    struct imp_node *one = node_make("");
    list_add(one, 2, (double[]){300, 900, 1, 1});
    check(one, IMP_REFLECTANCE, false, IMP_RGB,
          (struct expected){3, {0.99899, 0.99887, 0.99880}}, 6e-6, "constant 1 as list");
    double sum = 0;
    for (int i = 0; i < IMP_CIE_N; i++) sum += 5 * imp__cie_xyz[1][i];
    tap_near(sum, IMP_CIE_Y_INTEGRAL, 2e-3, 0, "integral of the y curve");
    tap_near(imp__cie_lookup(imp__cie_d65, 560), 100, 0, 0, "D65 at 560 nm");
    tap_near(imp__cie_lookup(imp__cie_xyz[0], 457.5), 0.5 * (0.3187 + 0.2908), 1e-12, 0,
             "linear between the samples");
    tap_ok(imp__cie_lookup(imp__cie_d65, 359.9) == 0 &&
               imp__cie_lookup(imp__cie_d65, 830.1) == 0 &&
               imp__cie_lookup(imp__cie_d65, 830) == 60.3125,
           "nothing outside 360-830 nm");
    double rgb[3] = {0.2, 0.5, 0.9}, xyz[3], back[3];
    imp__rgb_to_xyz(rgb, xyz);
    imp__xyz_to_rgb(xyz, back);
    tap_ok(fabs(back[0] - 0.2) + fabs(back[1] - 0.5) + fabs(back[2] - 0.9) < 1e-5,
           "to XYZ and back");
    tap_near(xyz[1], imp__luminance(0.2, 0.5, 0.9), 1e-12, 0, "Y is the luminance");
    tap_near(imp__srgb_decode(0.5), 0.21404114048, 1e-10, 0, "sRGB decode of 0.5");
    double worst = 0;
    for (int i = 0; i <= 255; i++)
        worst =
            fmax(worst, fabs(imp__srgb_encode(imp__srgb_decode(i / 255.0)) - i / 255.0));
    tap_ok(worst < 1e-7, "sRGB there and back # %.1e", worst);
}

static void table(void)
{
    struct imp_node *f = node_make(""), *rgb = node_make(""), *u = node_make(""),
                    *i = node_make("");
    prop_add(f, "c", IMP_PROP_FLOAT)->number[0] = 0.25;
    prop_add(i, "c", IMP_PROP_INTEGER)->integer = 1;
    prop_add(u, "c", IMP_PROP_UNIFORM)->number[0] = 0.5;
    struct imp_prop *p = prop_add(rgb, "c", IMP_PROP_RGB);
    p->number[0] = 0.2, p->number[1] = 0.4, p->number[2] = 0.6;
    const double lum = 0.212671 * 0.2 + 0.715160 * 0.4 + 0.072169 * 0.6;

    check(f, IMP_REFLECTANCE, false, IMP_RGB, (struct expected){1, {0.25}}, 0,
          "number, R");
    check(f, IMP_UNBOUNDED, false, IMP_RGB, (struct expected){1, {0.25}}, 0, "number, U");
    check(f, IMP_EMISSION, false, IMP_RGB, (struct expected){3, {0.25, 0.25, 0.25}}, 0,
          "number, E");
    check(f, IMP_EMISSION, false, IMP_MONO, (struct expected){1, {0.25}}, 0,
          "number, E, mono");
    check(i, IMP_REFLECTANCE, false, IMP_RGB, (struct expected){1, {1}}, 0, "integer, R");
    check(rgb, IMP_REFLECTANCE, false, IMP_RGB, (struct expected){3, {0.2, 0.4, 0.6}}, 0,
          "rgb, R");
    check(rgb, IMP_EMISSION, false, IMP_MONO, (struct expected){1, {lum}}, 1e-15,
          "rgb, E, mono");
    check(rgb, IMP_REFLECTANCE, true, IMP_RGB, (struct expected){1, {0.4}}, 1e-15,
          "rgb as one number: the mean");
    check(rgb, IMP_REFLECTANCE, true, IMP_MONO, (struct expected){1, {lum}}, 1e-15,
          "rgb as one number, mono: the luminance");
    check(u, IMP_REFLECTANCE, false, IMP_RGB, (struct expected){1, {0.5}}, 0,
          "spectrum value, R");
    check(u, IMP_EMISSION, false, IMP_RGB,
          (struct expected){3, {0.602397, 0.4741455, 0.454458}}, 1e-12,
          "spectrum value, E");
    check(u, IMP_EMISSION, false, IMP_MONO, (struct expected){1, {0.5}}, 0,
          "spectrum value, E, mono");

    p->number[0] = 3;
    check(rgb, IMP_UNBOUNDED, false, IMP_RGB, (struct expected){3, {3, 0.4, 0.6}}, 0,
          "rgb, U, any");
    check(rgb, IMP_EMISSION, false, IMP_RGB, (struct expected){3, {3, 0.4, 0.6}}, 0,
          "rgb, E, any");
    check(rgb, IMP_REFLECTANCE, false, IMP_RGB, (struct expected){0, {0}}, 0, "rgb 3, R");
    check(rgb, IMP_REFLECTANCE, false, IMP_MONO, (struct expected){0, {0}}, 0,
          "rgb 3, R, mono");
    p->number[0] = -0.1;
    check(rgb, IMP_EMISSION, false, IMP_RGB, (struct expected){0, {0}}, 0,
          "negative light");
    p->number[0] = NAN;
    check(rgb, IMP_UNBOUNDED, false, IMP_RGB, (struct expected){0, {0}}, 0, "NaN");
    struct imp_node *t = node_make("");
    prop_add(t, "c", IMP_PROP_VECTOR);
    check(t, IMP_REFLECTANCE, false, IMP_RGB, (struct expected){0, {0}}, 0, "a vector");
    struct imp_node *bad = node_make("");
    list_add(bad, 2, (double[]){500, 400, 1, 1});
    struct imp__color_ask ask = {
        .ctx = ctx, .arena = &arena, .mode = IMP_RGB, .role = IMP_REFLECTANCE};
    struct imp__color c;
    tap_ok(imp__color_convert(&ask, bad, imp__node_prop(bad, "c"), &c) == IMP_E_SCENE,
           "wavelengths that do not increase # %s", imp_last_error(ctx));
    struct imp_node *negative = node_make("");
    list_add(negative, 2, (double[]){400, 500, 1, -1});
    tap_ok(imp__color_convert(&ask, negative, imp__node_prop(negative, "c"), &c) ==
               IMP_E_SCENE,
           "a negative sample # %s", imp_last_error(ctx));
    struct imp_node *above = node_make("");
    list_add(above, 2, (double[]){400, 500, 1, 1.5});
    tap_ok(imp__color_convert(&ask, above, imp__node_prop(above, "c"), &c) == IMP_OK,
           "a reflectance above 1 is clamped in rgb");
    ask.mode = IMP_SPECTRAL;
    tap_ok(imp__color_convert(&ask, above, imp__node_prop(above, "c"), &c) == IMP_E_SCENE,
           "and refused as a spectrum # %s", imp_last_error(ctx));
    ask.mode = IMP_RGB;

    tap_ok(imp__color_default(&ask, 0.5, &c) == IMP_OK && c.count == 1 &&
               c.value[0] == 0.5 && c.value[2] == 0.5,
           "default, R");
    ask.role = IMP_EMISSION;
    tap_ok(imp__color_default(&ask, 1, &c) == IMP_OK && c.count == 3 && c.value[1] == 1,
           "default, E");
}

static enum imp_status object(struct imp_node *n, enum imp_role role, imp_spec *v,
                              int *count)
{
    const struct imp__color_ask ask = {
        .ctx = ctx, .arena = &arena, .mode = IMP_RGB, .role = role};
    struct imp__color c;
    const enum imp_status st = imp__color_object(&ask, n, &c);
    if (st != IMP_OK) return st;
    *v = c.value;
    *count = c.count;
    return strcmp(c.key, "value") != 0 ? IMP_E_ARG : st;
}

/* Linear sRGB of Planck's law, W m^-2 sr^-1 nm^-1, by 1 nm; Y of 1 at all wavelengths is 1. */
static void planck_colour(double T, double rgb[3])
{
    const double h = 6.62607015e-34, c = 299792458, k = 1.380649e-23;
    double xyz[3] = {0}, y = 0;
    for (int nm = 360; nm <= 830; nm++) {
        const double l = nm * 1e-9;
        const double B =
            2 * h * c * c / pow(l, 5) / (exp(h * c / (l * k * T)) - 1) * 1e-9;
        for (int a = 0; a < 3; a++) xyz[a] += B * imp__cie_lookup(imp__cie_xyz[a], nm);
        y += imp__cie_lookup(imp__cie_xyz[1], nm);
    }
    for (int a = 0; a < 3; a++) xyz[a] /= y;
    imp__xyz_to_rgb(xyz, rgb);
}

static void objects(void)
{
    imp_spec v;
    int n;
    struct imp_node *u = node_make("uniform");
    prop_add(u, "value", IMP_PROP_FLOAT)->number[0] = 0.3;
    tap_ok(object(u, IMP_REFLECTANCE, &v, &n) == IMP_OK && n == 1 && v[1] == 0.3,
           "uniform, R");
    tap_ok(object(u, IMP_EMISSION, &v, &n) == IMP_OK && n == 3 && v[1] == 0.3,
           "uniform, E");

    struct imp_node *d = node_make("d65");
    prop_add(d, "scale", IMP_PROP_FLOAT)->number[0] = 2;
    tap_ok(object(d, IMP_EMISSION, &v, &n) == IMP_OK && n == 3 && v[0] == 2 && v[2] == 2,
           "d65: white times scale");
    struct imp_prop *c = prop_add(d, "color", IMP_PROP_RGB);
    c->number[0] = 1, c->number[1] = 0.5, c->number[2] = 0.25;
    tap_ok(object(d, IMP_EMISSION, &v, &n) == IMP_OK && v[0] == 2 && v[1] == 1 &&
               v[2] == 0.5,
           "d65: colour times scale");

    struct imp_node *r = node_make("regular"), *i = node_make("irregular");
    prop_add(r, "values", IMP_PROP_STRING)->string = "0.1, 0.2  0.8,0.9";
    prop_add(r, "wavelength_min", IMP_PROP_FLOAT)->number[0] = 400;
    prop_add(r, "wavelength_max", IMP_PROP_FLOAT)->number[0] = 700;
    tap_ok(object(r, IMP_REFLECTANCE, &v, &n) == IMP_OK && fabs(v[0] - 0.958689) < 6e-7,
           "regular");
    prop_add(i, "values", IMP_PROP_STRING)->string = "0.1 0.2 0.8 0.9";
    prop_add(i, "wavelengths", IMP_PROP_STRING)->string = "400 500 600 700";
    tap_ok(object(i, IMP_EMISSION, &v, &n) == IMP_OK && fabs(v[0] - 1.103547) < 6e-7,
           "irregular");
    imp__node_prop(i, "wavelengths")->string = "400 500 600";
    tap_ok(object(i, IMP_EMISSION, &v, &n) == IMP_E_SCENE,
           "irregular: lengths differ # %s", imp_last_error(ctx));
    imp__node_prop(i, "wavelengths")->string = "400 500 600 7oo";
    tap_ok(object(i, IMP_EMISSION, &v, &n) == IMP_E_SCENE, "irregular: not a number # %s",
           imp_last_error(ctx));

    struct imp_node *raw = node_make("rawconstant");
    struct imp_prop *p = prop_add(raw, "value", IMP_PROP_VECTOR);
    p->number[0] = 4, p->number[1] = 5, p->number[2] = 6;
    tap_ok(object(raw, IMP_REFLECTANCE, &v, &n) == IMP_OK && n == 3 && v[2] == 6,
           "rawconstant");

    tap_ok(object(node_make("blackbody"), IMP_EMISSION, &v, &n) == IMP_E_SCENE &&
               strstr(imp_last_error(ctx), "temperature"),
           "blackbody without temperature # %s", imp_last_error(ctx));
    struct imp_node *hot = node_make("blackbody");
    prop_add(hot, "temperature", IMP_PROP_FLOAT)->number[0] = 5000;
    prop_add(hot, "scale", IMP_PROP_FLOAT)->number[0] = 2;
    double rgb[3], worst = 0;
    planck_colour(5000, rgb);
    const bool made = object(hot, IMP_EMISSION, &v, &n) == IMP_OK && n == 3;
    for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(v[c] / (2 * rgb[c]) - 1));
    tap_ok(made && worst < 2e-3, "blackbody in rgb is its colour # %g %g %g, within %.1e",
           v[0], v[1], v[2], worst);
    tap_ok(object(node_make("srgb"), IMP_EMISSION, &v, &n) == IMP_E_SCENE,
           "srgb without colour # %s", imp_last_error(ctx));
    prop_add(u, "vlaue", IMP_PROP_FLOAT);
    tap_ok(object(u, IMP_EMISSION, &v, &n) == IMP_E_SCENE, "unknown property # %s",
           imp_last_error(ctx));
    tap_ok(imp__color_is_object(u) && !imp__color_is_object(node_make("bitmap")),
           "what is a colour object");
}

int main(void)
{
    const struct imp_context_options options = {.size = sizeof options, .threads = 1};
    if (imp_context_create(&options, &ctx) != IMP_OK) return 1;
    imp__arena_init(&arena, ctx);
    published();
    table();
    objects();
    imp__arena_free(&arena);
    imp_context_destroy(ctx);
    return tap_done();
}
