/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives with respect to the texels of normal maps and bump maps. A camera of 150 degrees sees
 * a floor under a directional light, so that many normals are turned away from it. The mean of
 * the picture is a plane integral, and its derivative by each texel is a difference of that
 * integral, computed here by the midpoint rule with formulas of its own. Then the checks of the
 * library in all colour modes, where light is reflected several times, and what is refused. */
#include "imp_check_rows.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <importon/walks.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { TEXELS = 3, SIDE = 4 };
enum material { DIFFUSE, ROUGH };
enum invalid { CLAMP, FLIP, FLIP_FROZEN };

static imp_context *ctx;

#define HALF    20.0 /* of the floor's side */
#define REPEATS 8.0  /* of the texture over the floor */
#define ALPHA   0.35
#define SCALE   3.0 /* of the bump map */
static const double to_light[3] = {.48, .36, .8};
static const double irradiance[3] = {2, 1.5, 1}, reflectance[3] = {.6, .5, .3};
static const double weights[3] = {.5, .3, .2};

/* ---- Scenes ---------------------------------------------------------------------- */

static void map_make(imp_scene *s, bool bump)
{
    float pixels[3 * TEXELS * TEXELS];
    const double repeat[16] = {REPEATS, 0, 0, 0, 0, REPEATS, 0, 0,
                               0,       0, 1, 0, 0, 0,       0, 1};
    for (uint32_t k = 0; k < TEXELS * TEXELS; k++) {
        const struct imp_key key = imp__key(4, 4, 4);
        const double x = 1.1 * imp__u01(key, 2 * k) - .55,
                     y = 1.1 * imp__u01(key, 2 * k + 1) - .55;
        pixels[3 * k] = (float)(.5 + .5 * x);
        pixels[3 * k + 1] = (float)(.5 + .5 * y);
        pixels[3 * k + 2] = (float)(.5 + .5 * sqrt(1 - x * x - y * y));
        if (bump) pixels[k] = (float)imp__u01(key, 100 + k);
    }
    imp_scene_begin(s, "texture", "bitmap", NULL, bump ? "height" : "normalmap");
    imp_scene_image(s, TEXELS, TEXELS, bump ? 1 : 3, pixels);
    imp_scene_bool(s, "raw", 1);
    imp_scene_transform(s, "to_uv", repeat);
    imp_scene_end(s);
}

static void nested_make(imp_scene *s, const char *type)
{
    imp_scene_begin(s, "bsdf", type, "nested", NULL);
    if (strcmp(type, "principledthin") == 0) imp_scene_float(s, "spec_trans", 0.5);
    if (strcmp(type, "diffuse") == 0) imp_scene_rgb(s, "reflectance", reflectance);
    if (strcmp(type, "roughconductor") == 0) {
        imp_scene_string(s, "material", "none");
        imp_scene_string(s, "distribution", "ggx");
        imp_scene_float(s, "alpha", ALPHA);
        imp_scene_rgb(s, "specular_reflectance", reflectance);
    }
    imp_scene_end(s);
}

/* room: walls and a lamp instead of the directional light. */
static imp_scene *scene_make(bool bump, const char *nested, bool clamp, bool room,
                             enum imp_color_mode mode)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 1, 0, 0, 0, 1};
    const double floor_at[16] = {HALF, 0, 0, 0, 0, HALF, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const double lamp_at[16] = {1, 0, 0, 1, 0, -1, 0, 0, 0, 0, -1, 2.5, 0, 0, 0, 1};
    const double wall_at[16] = {0, 0, 3, -3, 3, 0, 0, 0, 0, 3, 0, 1, 0, 0, 0, 1};
    const double direction[3] = {-to_light[0], -to_light[1], -to_light[2]};
    const double bright[3] = {9, 8, 7}, white[3] = {.8, .8, .8};
    imp_scene *s;
    o.mode = mode;
    test_must(ctx, imp_scene_create(ctx, &o, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", room ? 5 : 2);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_transform(s, "to_world", camera);
    imp_scene_float(s, "fov", 150);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", SIDE);
    imp_scene_integer(s, "height", SIDE);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "bsdf", bump ? "bumpmap" : "normalmap", "turned", NULL);
    if (bump) imp_scene_float(s, "scale", SCALE);
    if (clamp) imp_scene_bool(s, "clamp_invalid_normals", 1);
    map_make(s, bump);
    nested_make(s, nested);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", "floor", NULL);
    imp_scene_transform(s, "to_world", floor_at);
    imp_scene_ref(s, "turned", NULL);
    imp_scene_end(s);
    if (room) {
        imp_scene_begin(s, "shape", "rectangle", "wall", NULL);
        imp_scene_transform(s, "to_world", wall_at);
        imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
        imp_scene_rgb(s, "reflectance", white);
        imp_scene_end(s);
        imp_scene_end(s);
        imp_scene_begin(s, "shape", "rectangle", "lamp", NULL);
        imp_scene_transform(s, "to_world", lamp_at);
        imp_scene_begin(s, "emitter", "area", NULL, NULL);
        imp_scene_rgb(s, "radiance", bright);
        imp_scene_end(s);
        imp_scene_end(s);
    } else {
        imp_scene_begin(s, "emitter", "directional", NULL, NULL);
        imp_scene_vector(s, "direction", direction);
        imp_scene_rgb(s, "irradiance", irradiance);
        imp_scene_end(s);
    }
    test_must(ctx, imp_scene_commit(s));
    return s;
}

/* ---- The plane integral ---------------------------------------------------------- */

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Normal at texture coordinates (u, v) in periods, unit: of bilinear texels, or of the slope of
 * bilinear heights over a floor of 2 HALF units a period REPEATS. */
static void normal_at(bool bump, const double *texel, double u, double v, double n[3])
{
    const double x = (u - floor(u)) * TEXELS - .5, y = (v - floor(v)) * TEXELS - .5;
    const int i = (int)floor(x), j = (int)floor(y);
    const double a = x - i, b = y - j;
    const int at[4] = {
        (j + TEXELS) % TEXELS * TEXELS + (i + TEXELS) % TEXELS,
        (j + TEXELS) % TEXELS * TEXELS + (i + 1) % TEXELS,
        (j + 1) % TEXELS * TEXELS + (i + TEXELS) % TEXELS,
        (j + 1) % TEXELS * TEXELS + (i + 1) % TEXELS,
    };
    const double w[4] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
    if (bump) {
        const double k = SCALE * TEXELS * REPEATS / (2 * HALF), *h = texel;
        n[0] = -k * ((h[at[1]] - h[at[0]]) * (1 - b) + (h[at[3]] - h[at[2]]) * b);
        n[1] = -k * ((h[at[2]] - h[at[0]]) * (1 - a) + (h[at[3]] - h[at[1]]) * a);
        n[2] = 1;
    } else {
        for (int c = 0; c < 3; c++) {
            n[c] = -1;
            for (int k = 0; k < 4; k++) n[c] += 2 * w[k] * texel[3 * at[k] + c];
        }
    }
    const double length = sqrt(dot3(n, n));
    for (int c = 0; c < 3; c++) n[c] /= length;
}

/* Turned away from wo; flip: whether it is, or, decided by other texels, was. */
static void valid(enum invalid rule, bool flip, const double wo[3], double n[3])
{
    const double c = dot3(n, wo);
    if (rule != CLAMP) {
        if (flip) n[0] = -n[0], n[1] = -n[1];
    } else if (c < .01) {
        for (int k = 0; k < 3; k++) n[k] += (.01 - c) * wo[k];
        const double length = sqrt(dot3(n, n));
        for (int k = 0; k < 3; k++) n[k] /= length;
    }
}

static double g1(double cosine)
{
    return 2 / (1 + sqrt(1 + ALPHA * ALPHA * (1 / (cosine * cosine) - 1)));
}

/* Radiance over reflectance and irradiance. */
static double reflected(enum material m, const double n[3], const double wo[3])
{
    const double ci = dot3(n, to_light), co = dot3(n, wo), wz = to_light[2];
    const double A = fmin(1, (1 / (n[2] * n[2]) - 1) / 8);
    const double g = 2 / (1 + sqrt(1 + A * (1 / (wz * wz) - 1)));
    if (!(ci > 0) || !(co > 0)) return 0;
    if (m == DIFFUSE) return g * ci / acos(-1);
    double h[3];
    for (int k = 0; k < 3; k++) h[k] = wo[k] + to_light[k];
    const double hn = dot3(h, n) / sqrt(dot3(h, h)), a2 = ALPHA * ALPHA;
    const double q = hn * hn * (a2 - 1) + 1, D = a2 / (acos(-1) * q * q);
    return g * D * g1(ci) * g1(co) / (4 * co);
}

/* Mean over the film; base: texels by which FLIP_FROZEN decides. */
static double mean(bool bump, enum material m, enum invalid rule, const double *texel,
                   const double *base, int N)
{
    const double T = tan(75 * acos(-1) / 180);
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double x = T * ((2 * i + 1.0) / N - 1), y = T * ((2 * j + 1.0) / N - 1);
            const double l = sqrt(x * x + y * y + 1), wo[3] = {-x / l, -y / l, 1 / l};
            const double u = REPEATS * .5 * (x / HALF + 1),
                         v = REPEATS * .5 * (y / HALF + 1);
            double n[3], decides[3];
            normal_at(bump, texel, u, v, n);
            normal_at(bump, rule == FLIP_FROZEN ? base : texel, u, v, decides);
            valid(rule, dot3(decides, wo) <= 0, wo, n);
            sum += reflected(m, n, wo);
        }
    return sum / ((double)N * N);
}

/* Central difference by texel e. */
static double slope(bool bump, enum material m, enum invalid rule, const double *texel,
                    int count, int e, double h, int N)
{
    double moved[3 * TEXELS * TEXELS];
    memcpy(moved, texel, sizeof *texel * (size_t)count);
    moved[e] = texel[e] + h;
    const double up = mean(bump, m, rule, moved, texel, N);
    moved[e] = texel[e] - h;
    return (up - mean(bump, m, rule, moved, texel, N)) / (2 * h);
}

/* ---- Tests ----------------------------------------------------------------------- */

static size_t texels_of(imp_scene *s, double *texel, struct imp_param_info *info)
{
    size_t param = 0;
    *info = (struct imp_param_info){.size = sizeof *info};
    for (;; param++) {
        test_must(ctx, imp_scene_get_param(s, param, info));
        if (info->count >= TEXELS * TEXELS) break;
    }
    test_must(ctx, imp_scene_get_values(s, param, texel));
    return param;
}

static void quadrature(bool bump, enum material m)
{
    static const char *const names[] = {"diffuse", "roughconductor"};
    imp_scene *s = scene_make(bump, names[m], true, false, IMP_RGB);
    double texel[3 * TEXELS * TEXELS], g[3 * TEXELS * TEXELS], se[3 * TEXELS * TEXELS];
    struct imp_param_info info;
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p;
    float adjoint[SIDE * SIDE * 3];
    double K = 0, worst = 0, z2 = 0, size = 0, worst_se = 0;
    texels_of(s, texel, &info);
    for (int c = 0; c < 3; c++) K += weights[c] * irradiance[c] * reflectance[c];
    for (int k = 0; k < 3 * SIDE * SIDE; k++)
        adjoint[k] = (float)(weights[k % 3] / (SIDE * SIDE));
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, info.name));
    run.spp = 40000;
    run.seed = 11;
    run.points = IMP_POINTS_INDEPENDENT; /* points are as exact as the quadrature */
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, se));
    const int n = (int)info.count;
    for (int e = 0; e < n; e++) {
        const double truth = K * slope(bump, m, CLAMP, texel, n, e, 1e-4, 500);
        const double z = (g[e] - truth) / se[e];
        worst = fmax(worst, fabs(z));
        z2 += z * z;
        size += truth * truth;
        worst_se = fmax(worst_se, se[e]);
    }
    size = sqrt(size / n);
    tap_ok(
        worst < 4.5 && z2 / n < 2.5 && worst_se < .05 * size,
        "%s of %s: %d texels against quadrature # largest z %.2f, mean z^2 %.2f, largest "
        "se %.1f %% of the mean size",
        bump ? "bump map" : "normal map", names[m], n, worst, z2 / n,
        100 * worst_se / size);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Why flips are refused: the part of the derivative that is in the jumps, by quadrature. */
static void lost_by_flips(enum material m)
{
    imp_scene *s = scene_make(false, "diffuse", false, false, IMP_RGB);
    double texel[3 * TEXELS * TEXELS], lost = 0, all = 0;
    struct imp_param_info info;
    texels_of(s, texel, &info);
    for (int e = 0; e < (int)info.count; e++) {
        const double whole = slope(false, m, FLIP, texel, (int)info.count, e, .02, 700),
                     part = slope(false, m, FLIP_FROZEN, texel, (int)info.count, e, .02,
                                  700);
        lost += (whole - part) * (whole - part);
        all += whole * whole;
    }
    tap_ok(sqrt(lost / all) > .05,
           "flipped normals of %s: the derivative of values lacks a part # %.0f %%",
           m == DIFFUSE ? "diffuse" : "roughconductor", 100 * sqrt(lost / all));
    imp_scene_destroy(s);
}

static void rows_of(bool bump, const char *nested, enum imp_color_mode mode)
{
    static const char *const modes[] = {"rgb", "mono", "spectral", "single"};
    imp_scene *s = scene_make(bump, nested, true, true, mode);
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_check_row *rows;
    double texel[3 * TEXELS * TEXELS], worst = 0;
    struct imp_param_info info;
    imp_problem *p;
    size_t n, failed = 0, seen = 0;
    char which[128] = "none";
    texels_of(s, texel, &info);
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, info.name));
    o.draws_s = 0.02;
    o.paths = 400;
    o.fresh_spp = 2000;
    run.seed = 3;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        seen += rows[i].value != 0;
        if (rows[i].se > 0) worst = fmax(worst, rows[i].error);
        if (rows[i].ok != 0) continue;
        failed++;
        snprintf(which, sizeof which, "%s %s %g %g", rows[i].method,
                 rows[i].param ? rows[i].param : "", rows[i].value, rows[i].reference);
    }
    tap_ok(failed == 0 && seen > 3,
           "%s of %s, %s: %zu checks # failed: %s, largest z %.1f",
           bump ? "bump map" : "normal map", nested, modes[mode], n, which, worst);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Gradient of the mean with respect to the texels, of new walks or of recorded ones. */
static void reverse(imp_problem *p, const imp_walks *walks, double *g)
{
    struct imp_run run = IMP_RUN_INIT;
    float adjoint[SIDE * SIDE * 3];
    for (int k = 0; k < 3 * SIDE * SIDE; k++)
        adjoint[k] = (float)(weights[k % 3] / (SIDE * SIDE));
    run.spp = 64;
    run.seed = 5;
    run.points = IMP_POINTS_INDEPENDENT; /* the walks of a record are the same */
    run.walks = walks;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
}

/* Recorded walks are those of the same numbers, and their texels' derivatives, too. */
static void recorded(bool bump)
{
    imp_scene *s = scene_make(bump, "roughconductor", true, true, IMP_RGB);
    double texel[3 * TEXELS * TEXELS], g[2][3 * TEXELS * TEXELS], worst = 0, size = 0;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_param_info info;
    imp_problem *p;
    imp_walks *walks;
    texels_of(s, texel, &info);
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, info.name));
    run.spp = 64;
    run.seed = 5;
    run.points = IMP_POINTS_INDEPENDENT; /* the walks of a record are the same */
    test_must(ctx, imp_walks_keep(s, &run, &o, &walks));
    reverse(p, NULL, g[0]);
    reverse(p, walks, g[1]);
    for (size_t e = 0; e < info.count; e++) {
        worst = fmax(worst, fabs(g[1][e] - g[0][e]));
        size = fmax(size, fabs(g[0][e]));
    }
    tap_ok(worst < 1e-5 * size && size > 0, "%s: recorded walks # %.1e of %.3g",
           bump ? "bump map" : "normal map", worst, size);
    imp_walks_destroy(walks);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void refused(const char *nested, bool clamp, const char *words)
{
    imp_scene *s = scene_make(false, nested, clamp, false, IMP_RGB);
    double texel[3 * TEXELS * TEXELS];
    struct imp_param_info info;
    imp_problem *p;
    texels_of(s, texel, &info);
    test_must(ctx, imp_problem_create(s, &p));
    const enum imp_status st = imp_problem_activate(p, info.name);
    tap_ok(st == IMP_E_BIAS && strstr(imp_last_error(ctx), words), "%s%s is refused # %s",
           nested, clamp ? ", clamped," : ", flipped,", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    test_must(NULL, imp_context_create(NULL, &ctx));
    for (int bump = 0; bump < 2; bump++)
        for (int m = DIFFUSE; m <= ROUGH; m++) quadrature(bump, (enum material)m);
    lost_by_flips(DIFFUSE);
    lost_by_flips(ROUGH);
    for (int bump = 0; bump < 2; bump++) {
        if (is_long || bump) rows_of(bump, "diffuse", IMP_RGB);
        if (is_long || !bump) rows_of(bump, "roughconductor", IMP_MONO);
        if (is_long || bump) rows_of(bump, "roughplastic", IMP_SPECTRAL);
    }
    recorded(false);
    recorded(true);
    refused("diffuse", false, "clamp_invalid_normals");
    refused("conductor", true, "'nested' (conductor) has ideal lobes");
    refused("principledthin", true,
            "'nested' (principledthin) has no derivative with respect to directions");
    imp_context_destroy(ctx);
    return tap_done();
}
