/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by an opacity and through it, in closed form. Two planes without end under a
 * sky of 1: a mask of opacity a around a diffuse sheet of reflectance r on both sides, and
 * below it a floor of reflectance q. The floor's radiosity B and what a camera above sees:
 *
 *     B = q ((1 - a) + a r B),    I = a r + (1 - a) B
 *
 * Light that falls straight down, of irradiance E, does the same times E/pi. Of n texels that
 * are alike, and of which the picture shows one period, each has 1/n of the derivative. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdbool.h>

static imp_context *ctx;

/* Along -z, on a square of side 2 about the origin. */
static void eye(imp_scene *s, int pixels, const char *integrator)
{
    const double camera[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 4, 0, 0, 0, 1};
    imp_scene_begin(s, "integrator", integrator, NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "orthographic", NULL, NULL);
    imp_scene_transform(s, "to_world", camera);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", pixels);
    imp_scene_integer(s, "height", pixels);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
}

/* A square at height z, of half a side `half`. */
static void plane(imp_scene *s, double z, double half)
{
    const double m[16] = {half, 0, 0, 0, 0, half, 0, 0, 0, 0, 1, z, 0, 0, 0, 1};
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_transform(s, "to_world", m);
}

/* Texels [side][side][channels] that tile the plane, the square of side 2 about the origin with
 * one tile; none where side is 0: a number. */
static void numbers(imp_scene *s, const char *slot, double half, int side, int channels,
                    double value)
{
    float texel[64 * 3];
    const double tile[16] = {
        half, 0, 0, .5 - half / 2, 0, half, 0, .5 - half / 2, 0, 0, 1, 0, 0, 0, 0, 1};
    if (side == 0) {
        imp_scene_float(s, slot, value);
        return;
    }
    for (int k = 0; k < side * side * channels; k++) texel[k] = (float)value;
    imp_scene_begin(s, "texture", "bitmap", NULL, slot);
    imp_scene_image(s, side, side, channels, texel);
    imp_scene_bool(s, "raw", true);
    imp_scene_string(s, "filter_type", "nearest");
    imp_scene_transform(s, "to_uv", tile);
    imp_scene_end(s);
}

static imp_scene *planes(double a, int a_side, double r, double q, int q_side, bool sun)
{
    const double half = 4096;
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    /* Light samples of path end at a mask, as in Mitsuba; a lamp far away needs them. */
    eye(s, 16, sun ? "volpath" : "path");
    imp_scene_begin(s, "emitter", sun ? "directional" : "constant", NULL, NULL);
    if (sun) {
        imp_scene_vector(s, "direction", (double[3]){0, 0, -1});
        imp_scene_rgb(s, "irradiance", (double[3]){2, 2, 2});
    }
    imp_scene_end(s);
    plane(s, -1, half);
    imp_scene_begin(s, "bsdf", "diffuse", "floor", NULL);
    numbers(s, "reflectance", half, q_side, 3, q);
    imp_scene_end(s);
    imp_scene_end(s);
    plane(s, 1, half);
    imp_scene_begin(s, "bsdf", "mask", "veil", NULL);
    numbers(s, "opacity", half, a_side, 1, a);
    imp_scene_begin(s, "bsdf", "twosided", NULL, NULL);
    imp_scene_begin(s, "bsdf", "diffuse", "sheet", NULL);
    imp_scene_float(s, "reflectance", r);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

enum { VALUES = 256 };
struct result {
    size_t n;
    struct imp_estimate value;
    double g[VALUES], se[VALUES];
};
static struct result mean_of(imp_scene *s, const char *which, int spp, uint64_t seed)
{
    struct result r = {0};
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p = test_problem(ctx, s, which);
    r.n = imp_problem_n_variables(p);
    run.spp = spp;
    run.seed = seed;
    run.points = IMP_POINTS_INDEPENDENT; /* a texel's error of few sets is not normal */
    if (r.n <= VALUES)
        test_must(ctx, imp_problem_functional(p, NULL, &run, &r.value, r.g, r.se));
    imp_problem_destroy(p);
    return r;
}

static void one(imp_scene *s, const char *which, double value, double truth,
                const char *what)
{
    const struct result r = mean_of(s, which, 256, 5);
    const double z = (r.g[0] - truth) / r.se[0], off = r.value.value - value;
    tap_ok(r.n == 1 && fabs(z) < 4.5 && r.se[0] < .04 * fabs(truth) &&
               fabs(off) <= 4.5 * r.value.se + 1e-6,
           "%s # %.5f +- %.5f, %.5f, z %.2f; value %.5f, off by %.1e", what, r.g[0],
           r.se[0], truth, z, value, off);
}

/* dI/da, dI/dq. */
static double by_opacity(double a, double r, double q)
{
    const double d = 1 - q * a * r;
    return r - q * (1 - a) / d + (1 - a) * q * (q * r - 1) / (d * d);
}
static double by_floor(double a, double r, double q)
{
    const double d = 1 - q * a * r;
    return (1 - a) * (1 - a) / (d * d);
}

static void sheet(double a)
{
    const double r = .4, q = .6, d = 1 - q * a * r, B = q * (1 - a) / d;
    const double I = a * r + (1 - a) * B;
    char what[64];
    imp_scene *s = planes(a, 0, r, q, 0, false);
    snprintf(what, sizeof what, "opacity %g: by it", a);
    one(s, "veil.opacity.value", I, by_opacity(a, r, q), what);
    snprintf(what, sizeof what, "opacity %g: by the floor", a);
    one(s, "floor.reflectance.value", I, by_floor(a, r, q), what);
    snprintf(what, sizeof what, "opacity %g: by the sheet", a);
    one(s, "sheet.reflectance.value", I, a + (1 - a) * q * (1 - a) * q * a / (d * d),
        what);
    imp_scene_destroy(s);
}

/* Many numbers at once: the largest z, and whether their squares have the mean 1. */
static void many(imp_scene *s, const char *which, double truth, double most_se,
                 const char *what)
{
    double worst = 0, square = 0, se = 0;
    size_t n = 0;
    for (uint64_t seed = 1; seed <= 4; seed++) {
        const struct result r = mean_of(s, which, 256, seed);
        for (size_t k = 0; k < r.n && r.n <= VALUES; k++, n++) {
            const double z = r.se[k] > 0 ? (r.g[k] - truth) / r.se[k]
                             : fabs(r.g[k] - truth) < 1e-6 * fabs(truth) ? 0
                                                                         : INFINITY;
            worst = fmax(worst, fabs(z));
            square += z * z;
            se = fmax(se, r.se[k]);
        }
    }
    square /= (double)n;
    tap_ok(n > 0 && worst < 4.8 && square < 1.3 && se < most_se * fabs(truth),
           "%s # %zu numbers: |z| <= %.2f, mean square %.3f, se <= %.2g of %.3g", what, n,
           worst, square, se, truth);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    sheet(.3);
    sheet(.85);
    /* At the ends of the range. */
    imp_scene *open = planes(0, 0, .4, .6, 0, false),
              *shut = planes(1, 0, .4, .6, 0, false);
    one(open, "veil.opacity.value", .6, by_opacity(0, .4, .6), "opacity 0: by it");
    one(shut, "veil.opacity.value", .4, by_opacity(1, .4, .6), "opacity 1: by it");
    imp_scene_destroy(open);
    imp_scene_destroy(shut);
    const double lamp = 2 / acos(-1);
    many(planes(.5, 0, .4, .6, 8, false), "floor.reflectance.data",
         by_floor(.5, .4, .6) / 192, .3, "texels of a floor below a mask");
    many(planes(.5, 0, .4, .6, 8, true), "floor.reflectance.data",
         lamp * by_floor(.5, .4, .6) / 192, .3, "texels of a floor, under a lamp");
    many(planes(.3, 4, .4, .6, 0, false), "veil.opacity.data",
         by_opacity(.3, .4, .6) / 16, .3, "texels of an opacity");
    many(planes(.3, 4, .4, .6, 0, true), "veil.opacity.data",
         lamp * by_opacity(.3, .4, .6) / 16, .3, "texels of an opacity, under a lamp");
    imp_context_destroy(ctx);
    return tap_done();
}
