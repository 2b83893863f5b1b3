/* SPDX-License-Identifier: Apache-2.0
 *
 * Transmittance on the way to a light sample, by delta, ratio and residual ratio tracking:
 * means, variances by their formulas
 *
 *     delta     T (1 - T)
 *     ratio     T^2 [exp(Int sigma^2/b) - 1]
 *     residual  T^2 [exp(Int (sigma - c)^2/r) - 1]
 *
 * with bounds that are tight and loose, derivatives, and colours from one set of points. */
#include "importon/walks.h"
#include "media_kit.h"
#include "scene/majorants.h"
#include "vol_write.h"

static imp_context *ctx;

enum { ALONG_X, ALONG_Z };

/* A white wall at z = -1 seen from its own side of a box of fog, which fills [0, 1]^3 and lies
 * between it and a lamp at (x, .5, 3): without fog the picture is 1/(16 pi). */
#define CLEAR (1 / (16 * M_PI))
static imp_scene *wall(const char *estimator, int axis, int n, int channels,
                       const float *value, enum imp_color_mode mode)
{
    char text[4096], path[64];
    const double x = axis == ALONG_X ? .5 / n : .5;
    vol_write(path, axis == ALONG_X ? n : 1, 1, axis == ALONG_Z ? n : 1, channels, value);
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'><string "
             "name='transmittance' value='%s'/></integrator>"
             "<medium type='heterogeneous' id='fog'><float name='albedo' value='0'/>"
             "<volume name='sigma_t' type='gridvolume' id='grid'><string name='filename' "
             "value='%s'/><string name='filter_type' value='%s'/></volume></medium>"
             "<shape type='cube'><bsdf type='null'/><ref id='fog' name='interior'/>"
             "<transform name='to_world'><scale value='0.5'/><translate x='0.5' y='0.5' "
             "z='0.5'/></transform></shape><shape type='rectangle'><bsdf type='diffuse'>"
             "<float name='reflectance' value='1'/></bsdf><transform name='to_world'>"
             "<translate z='-1'/></transform></shape><emitter type='point'><point "
             "name='position' x='%g' y='0.5' z='3'/><float name='intensity' value='1'/>"
             "</emitter><sensor type='orthographic'><transform name='to_world'>"
             "<scale value='0.001'/><lookat origin='%g,0.5,-0.5' target='%g,0.5,-1' "
             "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' "
             "value='4'/><integer name='height' value='4'/><rfilter type='box'/></film>"
             "</sensor></scene>",
             estimator, path, axis == ALONG_X ? "nearest" : "trilinear", x, x, x);
    imp_scene *s = test_scene_text(ctx, text, mode);
    remove(path);
    return s;
}

#define SPP 8192
/* T and the variance of one sample. */
static void measure(imp_scene *s, double T, double variance, const char *what)
{
    double mean[3], se[3];
    media_mean(ctx, s, SPP, mean, se);
    media_near(mean[0] / CLEAR, se[0] / CLEAR, T, 4e-3, what);
    tap_near(16. * SPP * pow(se[0] / CLEAR, 2), variance, .03, 0, "... its variance");
}

/* One in a cell, whose bound is that of its neighbour. */
static void bounds(void)
{
    static const double bound[3] = {1, 2, 10}, variance[3] = {.232544, .087795, .014233};
    for (int k = 0; k < 3; k++) {
        float value[128];
        for (int i = 0; i < 128; i++) value[i] = i % 2 ? (float)bound[k] : 1;
        imp_scene *s = wall("ratio", ALONG_X, 128, 1, value, IMP_MONO);
        measure(s, exp(-1.), variance[k], "extinction 1 by ratio tracking");
        imp_scene_destroy(s);
        s = wall("delta", ALONG_X, 128, 1, value, IMP_MONO);
        measure(s, exp(-1.), variance[0], "... by delta tracking");
        imp_scene_destroy(s);
    }
}

static double ramp(double z) { return 2 * imp_clamp(z, .5 / 64, 1 - .5 / 64); }

/* 2 z, of 64 numbers in 16 cells. */
enum { CELLS = 16 };
static void controls(void)
{
    float value[64];
    for (int i = 0; i < 64; i++) value[i] = (float)(2 * (i + .5) / 64);
    for (int k = 0; k < 4; k++) {
        imp_scene *s =
            wall(k < 2 ? "ratio" : "residual", ALONG_Z, 64, 1, value, IMP_MONO);
        struct imp_majorants *g = s->media[0]->majorants;
        double exponent = 0;
        for (int i = 0; i < CELLS; i++) {
            if (k == 1) g->bound[i] = 2;
            if (k == 3) g->control[i] = (struct imp_control){1, 1};
            for (int j = 0; j < 64; j++) {
                const double sigma = ramp((i + (j + .5) / 64) / CELLS);
                exponent += (k < 2 ? sigma * sigma / (double)g->bound[i]
                                   : pow(sigma - (double)g->control[i].mean, 2) /
                                         (double)g->control[i].reach) /
                            (64 * CELLS);
            }
        }
        static const char *const what[] = {
            "2 x by ratio tracking under local bounds", "... under one bound",
            "... by residual tracking with local controls", "... with one control, 1"};
        measure(s, exp(-1.), exp(-2.) * (exp(exponent) - 1), what[k]);
        if (k == 3)
            tap_near(exp(-2.) * (exp(exponent) - 1), .053540, 1e-3, 0,
                     "... whose variance is that of the literature");
        imp_scene_destroy(s);
    }
    imp_scene *s = wall("delta", ALONG_Z, 64, 1, value, IMP_MONO);
    measure(s, exp(-1.), exp(-1.) * (1 - exp(-1.)), "... by delta tracking");
    imp_scene_destroy(s);
}

/* dT = -T times the length in each cell; and what differences say. */
static void derivatives(const char *estimator, double tight)
{
    float value[8] = {4, 0, 2, 3, .05f, 2, 1, 1};
    imp_scene *s = wall(estimator, ALONG_Z, 8, 1, value, IMP_MONO);
    imp_problem *p = test_problem(ctx, s, "grid.data");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    double g[8], se[8], sum = 0, sum_se = 0, depth = 0;
    run.spp = 16384;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, se));
    for (int i = 0; i < 8; i++) depth += (double)value[i] / 8;
    const double T = CLEAR * exp(-depth);
    for (int i = 0; i < 8; i++) {
        media_near(g[i], se[i], -T / 8, tight * T, "derivative of a cell");
        sum += g[i];
        sum_se += se[i];
    }
    media_near(sum, sum_se, -T, 8 * tight * T, "and of all");

    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    const struct imp_check_row *rows;
    size_t n;
    o.draws_s = 0.02;
    o.paths = 200;
    o.fresh_spp = 4096;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    int frozen = 0, reverse = 0, wrong = 0;
    for (size_t k = 0; k < n; k++) {
        frozen += strcmp(rows[k].method, "frozen") == 0;
        reverse += strcmp(rows[k].method, "reverse") == 0;
        if (rows[k].ok) continue;
        wrong++;
        printf("# %s %s %g, reference %g, error %g\n", rows[k].method, rows[k].param,
               rows[k].value, rows[k].reference, rows[k].error);
    }
    tap_ok(frozen > 0 && wrong == 0, "check: %d rows, %d frozen, %d wrong", (int)n,
           frozen, wrong);
    imp_problem_destroy(p);

    /* Controls follow the numbers that they are made of. */
    double theta[8];
    p = test_problem(ctx, s, "grid.data");
    for (int i = 0; i < 8; i++) theta[i] = .5;
    test_must(ctx, imp_problem_set_x(p, theta));
    double mean[3], mean_se[3];
    media_mean(ctx, s, 64, mean, mean_se);
    if (strcmp(estimator, "residual") == 0)
        tap_near(mean[0] / CLEAR, exp(-.5), 1e-5, 0, "a uniform one: no variance");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Extinctions of very different lanes are estimated from the same points. */
static void colours(const char *estimator)
{
    static const double T[3] = {.36787944, .04978707, .60653066};
    float value[64 * 3];
    double mean[3], se[3];
    for (int i = 0; i < 64; i++) {
        value[3 * i] = (float)(2 * (i + .5) / 64);
        value[3 * i + 1] = 3 * value[3 * i];
        value[3 * i + 2] = .5f;
    }
    imp_scene *s = wall(estimator, ALONG_Z, 64, 3, value, IMP_RGB);
    media_mean(ctx, s, SPP, mean, se);
    for (int c = 0; c < 3; c++)
        media_near(mean[c] / CLEAR, se[c] / CLEAR, T[c], 4e-3, "a lane of three");
    imp_scene_destroy(s);
}

/* What was blocked at the draw would stay so at another extinction. */
static void kept(void)
{
    const float value[2] = {1, 1};
    imp_scene *s = wall("delta", ALONG_Z, 2, 1, value, IMP_MONO);
    imp_walks *walks = NULL;
    const enum imp_status st = imp_walks_keep(s, NULL, NULL, &walks);
    tap_ok(st == IMP_E_UNSUPPORTED && !walks && strstr(imp_last_error(ctx), "delta"),
           "walks are not kept # %s", imp_last_error(ctx));
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    kept();
    bounds();
    controls();
    derivatives("residual", .001);
    derivatives("delta", .002);
    colours("residual");
    colours("delta");
    imp_context_destroy(ctx);
    return tap_done();
}
