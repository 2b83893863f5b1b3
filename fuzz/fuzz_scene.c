/* SPDX-License-Identifier: Apache-2.0
 *
 * Random small scenes through rendering and gradients. Bytes choose objects and their
 * numbers, hostile ones among them (huge, tiny, negative, zero, NaN); whatever happens
 * must be a status, and what succeeds must be finite. */
#include <importon/importon.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

struct bytes {
    const uint8_t *data;
    size_t left;
};

static unsigned byte(struct bytes *b)
{
    if (b->left == 0) return 0;
    b->left--;
    return *b->data++;
}

/* Mostly ordinary numbers in [0, 1.6], now and then a bad one. */
static double number(struct bytes *b)
{
    static const double odd[] = {0, -1, 1e-12, 1e12, NAN, INFINITY, -0.0, 1e300};
    const unsigned k = byte(b);
    return k < 8 ? odd[k] : k / 160.0;
}
static double reflectance(struct bytes *b)
{
    const double x = number(b);
    return x > 1 && x < 2 ? x - 1 : x;
}

static void place(struct bytes *b, imp_scene *s)
{
    double m[16] = {0};
    for (int i = 0; i < 3; i++) {
        m[5 * i] = 0.2 + number(b);
        m[4 * i + 3] = 2 * number(b) - 1.5;
    }
    if (byte(b) & 1) m[1] = number(b);
    m[15] = 1;
    imp_scene_transform(s, "to_world", m);
}

static void color(struct bytes *b, imp_scene *s, const char *name, int light)
{
    const double rgb[3] = {light ? 3 * number(b) : reflectance(b), reflectance(b),
                           reflectance(b)};
    switch (byte(b) % 5) {
    case 0: imp_scene_float(s, name, rgb[0]); break;
    case 1: {
        float pixels[2 * 3 * 3];
        for (int k = 0; k < 18; k++) pixels[k] = (float)reflectance(b);
        imp_scene_begin(s, "texture", "bitmap", NULL, name);
        imp_scene_image(s, 2, 3, 3, pixels);
        if (byte(b) & 1) imp_scene_string(s, "filter_type", "nearest");
        imp_scene_end(s);
        break;
    }
    case 2:
        imp_scene_begin(s, "texture", "checkerboard", NULL, name);
        imp_scene_rgb(s, "color0", rgb);
        imp_scene_end(s);
        break;
    case 3: {
        const double nm[3] = {400, 550, 700};
        imp_scene_spectrum(s, name, 3, nm, rgb);
        break;
    }
    default: imp_scene_rgb(s, name, rgb);
    }
}

static void material(struct bytes *b, imp_scene *s, int depth)
{
    static const char *const types[] = {"diffuse",        "dielectric", "conductor",
                                        "roughconductor", "stam_m2",    "stam_m3",
                                        "phong",          "twosided",   "null"};
    const unsigned t = byte(b) % (depth ? 7 : 9);
    imp_scene_begin(s, "bsdf", types[t], NULL, NULL);
    switch (t) {
    case 0: color(b, s, "reflectance", 0); break;
    case 1:
        imp_scene_float(s, "int_ior", 1 + number(b));
        if (byte(b) & 1) color(b, s, "specular_transmittance", 0);
        break;
    case 2: color(b, s, "specular_reflectance", 0); break;
    case 3:
        imp_scene_float(s, "alpha", number(b));
        imp_scene_string(s, "distribution", byte(b) & 1 ? "ggx" : "beckmann");
        if (byte(b) & 1) imp_scene_bool(s, "sample_visible", 0);
        break;
    case 4:
        color(b, s, "diffuse", 0);
        imp_scene_float(s, "exponent", 60 * number(b));
        imp_scene_float(s, "absorb", reflectance(b));
        break;
    case 5: color(b, s, "ambient", 1); break;
    case 6:
        color(b, s, "specular_reflectance", 0);
        imp_scene_float(s, "exponent", 60 * number(b));
        break;
    case 7: material(b, s, 1); break;
    default: break;
    }
    imp_scene_end(s);
}

/* A graded index and the boundary that goes with it. */
static void interior(struct bytes *b, imp_scene *s)
{
    static const char *const fields[] = {"luneburg", "maxwell", "rod", "plume"};
    const unsigned type = byte(b) % 4;
    imp_scene_begin(s, "bsdf", byte(b) & 1 ? "null" : "dielectric", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "medium", "graded", NULL, "interior");
    imp_scene_begin(s, "volume", fields[type], NULL, NULL);
    if (type < 2) imp_scene_float(s, "radius", 1 + number(b));
    if (type == 1 || type == 2) imp_scene_float(s, "n0", 1 + number(b));
    if (type == 2) imp_scene_float(s, "g", number(b));
    imp_scene_end(s);
    if (type == 3) { /* a plume adds to a constant */
        imp_scene_begin(s, "volume", "constant", NULL, NULL);
        imp_scene_float(s, "n0", 1 + number(b));
        imp_scene_end(s);
    }
    if (byte(b) & 1) imp_scene_float(s, "step", 0.3 * number(b));
    imp_scene_end(s);
}

static void shape(struct bytes *b, imp_scene *s)
{
    static const char *const types[] = {"rectangle", "disk",     "sphere",
                                        "cube",      "cylinder", "mesh"};
    const unsigned t = byte(b) % 6;
    imp_scene_begin(s, "shape", types[t], NULL, NULL);
    if (t == 5) {
        float p[12], uv[8];
        uint32_t index[6];
        for (int k = 0; k < 12; k++) p[k] = (float)(2 * number(b) - 1);
        for (int k = 0; k < 8; k++) uv[k] = (float)number(b);
        for (int k = 0; k < 6; k++) index[k] = byte(b) % 5; /* 4 is one too far */
        imp_scene_mesh(s, 4, 2, p, NULL, byte(b) & 1 ? uv : NULL, index);
    }
    place(b, s);
    if (byte(b) & 1) imp_scene_bool(s, "flip_normals", 1);
    const unsigned filled = byte(b) % 6 == 5;
    if (filled) interior(b, s);
    else if (byte(b) & 3) material(b, s, 0);
    if (!filled && byte(b) % 3 == 0) {
        const unsigned beam = byte(b) & 1;
        imp_scene_begin(s, "emitter", beam ? "beam" : "area", NULL, NULL);
        color(b, s, "radiance", 1);
        if (beam) imp_scene_float(s, "exponent", 60 * number(b));
        imp_scene_end(s);
    }
    imp_scene_end(s);
}

static void scene(struct bytes *b, imp_scene *s)
{
    static const char *const integrators[] = {"path", "path", "stam", "direct"};
    static const char *const sensors[] = {"perspective", "orthographic", "thinlens"};
    static const char *const filters[] = {"box", "box", "tent", "gaussian"};
    const unsigned integrator = byte(b) % 4, sensor = byte(b) % 3;
    imp_scene_begin(s, "integrator", integrators[integrator], NULL, NULL);
    if (integrator < 3) imp_scene_integer(s, "max_depth", byte(b) % 7);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", sensors[sensor], NULL, NULL);
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1};
    imp_scene_transform(s, "to_world", camera);
    if (sensor == 2) imp_scene_float(s, "aperture_radius", number(b));
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 1 + byte(b) % 6);
    imp_scene_integer(s, "height", 1 + byte(b) % 6);
    imp_scene_begin(s, "rfilter", filters[byte(b) % 4], NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    if (byte(b) & 1) {
        imp_scene_begin(s, "emitter", "constant", NULL, NULL);
        color(b, s, "radiance", 1);
        imp_scene_end(s);
    }
    if (byte(b) & 1) {
        const double p[3] = {number(b), number(b), 2 * number(b)};
        imp_scene_begin(s, "emitter", "point", NULL, NULL);
        imp_scene_vector(s, "position", p);
        imp_scene_end(s);
    }
    for (unsigned n = byte(b) % 5; n > 0; n--) shape(b, s);
}

static void must_be_finite(const double *x, size_t n)
{
    for (size_t k = 0; k < n; k++)
        if (!isfinite(x[k])) __builtin_trap();
}

static void use(imp_context *ctx, imp_scene *s)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    imp_problem *p = NULL;
    run.spp = 4;
    run.drop_budget = 1; /* absurd scenes drop walks; that is not what is looked for */
    if (imp_render(s, &run, &film) != IMP_OK) return;
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    const size_t values = (size_t)info.width * info.height * info.channels;
    for (size_t k = 0; k < values; k++)
        if (!isfinite(imp_film_mean(film)[k]) &&
            fabsf(imp_film_mean(film)[k]) != INFINITY)
            __builtin_trap();
    if (imp_problem_create(s, &p) == IMP_OK && imp_problem_activate(p, "*") == IMP_OK) {
        const size_t n = imp_problem_n_variables(p);
        struct imp_target t = IMP_TARGET_INIT;
        struct imp_estimate J;
        double *g = malloc(2 * n * sizeof *g);
        float *pixels = calloc(values, sizeof *pixels);
        t.width = info.width;
        t.height = info.height;
        t.channels = info.channels;
        t.pixels = pixels;
        if (g && pixels && imp_problem_add_target(p, &t) == IMP_OK) {
            run.seed = 1;
            if (imp_problem_objective(p, NULL, &run, &J, g, g + n) == IMP_OK &&
                J.value < 1e100) /* squares of 1e300 may overflow */
                must_be_finite(g, n);
        }
        free(g);
        free(pixels);
    }
    imp_problem_destroy(p);
    imp_film_destroy(film);
    (void)ctx;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes b = {data, size};
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_context *ctx;
    imp_scene *s;
    o.threads = 1;
    if (imp_context_create(&o, &ctx) != IMP_OK) return 0;
    if (imp_scene_create(ctx, NULL, &s) == IMP_OK) {
        scene(&b, s);
        if (imp_scene_commit(s) == IMP_OK) use(ctx, s);
        imp_scene_destroy(s);
    }
    imp_context_destroy(ctx);
    return 0;
}
