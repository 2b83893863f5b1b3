/* SPDX-License-Identifier: Apache-2.0
 *
 * Rendered targets have nearly one noise in all channels of a pixel: intervals of numbers that change
 * all channels, in fits to such targets, against the spread of the fits, with and without the target's
 * standard errors, with filters of one pixel and wider. Taken for independent, three channels would
 * make the mean square of (value - truth)/se three. And targets whose channels are independent. Of one
 * number, and of the 289 texels of a grey wall, whose normal equations are sparse. With the argument "long", more
 * of these. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 16, FITS = 60, SPP = 64, TARGET = 8, KNOWN = 1024 };
#define TRUTH 0.5

static imp_context *ctx;

static imp_scene *ball(const char *filter)
{
    char xml[2048];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='3'/></integrator>"
        "<sensor type='perspective'><float name='fov' value='40'/><transform "
        "name='to_world'><lookat origin='0,-5,1' target='0,0,0' up='0,0,1'/>"
        "</transform><film type='hdrfilm'><integer name='width' value='%d'/><integer "
        "name='height' value='%d'/><rfilter type='%s'/></film></sensor>"
        "<shape type='sphere'><bsdf type='diffuse' id='paint'><float "
        "name='reflectance' value='%g'/></bsdf></shape>"
        "<shape type='rectangle'><transform name='to_world'><scale value='3'/>"
        "<translate z='-1'/></transform><bsdf type='diffuse'/></shape>"
        "<shape type='sphere'><point name='center' x='2' y='-2' z='3'/><float "
        "name='radius' value='.7'/><emitter type='area'><rgb name='radiance' "
        "value='9,6,3'/></emitter></shape></scene>",
        SIDE, SIDE, filter, TRUTH);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* A picture of 3 n numbers: the truth with noise, rendered, or of independent channels as large. */
static void target_make(imp_scene *s, size_t n, const float *mean, const float *se,
                        int fit, bool rendered, float *pixels)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = TARGET;
    run.points = IMP_POINTS_INDEPENDENT;
    run.seed = 1000 + (uint64_t)fit;
    test_must(ctx, imp_render(s, &run, &film));
    memcpy(pixels, imp_film_mean(film), 3 * n * sizeof *pixels);
    imp_film_destroy(film);
    const struct imp_key key = imp__key(7, (uint64_t)fit, 1);
    for (uint32_t i = 0; !rendered && i < 3 * n; i++) {
        const double u = imp__u01(key, 2 * i), v = imp__u01(key, 2 * i + 1);
        pixels[i] = mean[i] + (float)(se[i] * sqrt(-2 * log(1 - u)) * cos(2 * M_PI * v));
    }
}

/* Standard errors of such a target, from many more samples, and the mean. */
static void noise_find(imp_scene *s, size_t n, float *mean, float *se)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = KNOWN;
    run.points = IMP_POINTS_INDEPENDENT;
    test_must(ctx, imp_render(s, &run, &film));
    memcpy(mean, imp_film_mean(film), 3 * n * sizeof *mean);
    for (size_t i = 0; i < 3 * n; i++)
        se[i] = (float)(imp_film_se(film)[i] * sqrt((double)KNOWN / TARGET));
    imp_film_destroy(film);
}

static void fits(const char *filter, bool known, bool rendered)
{
    static float mean[SIDE * SIDE * 3], se[SIDE * SIDE * 3], pixels[SIDE * SIDE * 3];
    double square = 0;
    imp_scene *truth = ball(filter);
    noise_find(truth, SIDE * SIDE, mean, se);
    for (int k = 0; k < FITS; k++) {
        imp_scene *s = ball(filter);
        imp_problem *p = test_problem(ctx, s, "paint.reflectance.value");
        struct imp_target t = IMP_TARGET_INIT;
        struct imp_fit_options options = IMP_FIT_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        const struct imp_fit_result *r;
        target_make(truth, SIDE * SIDE, mean, se, k, rendered, pixels);
        t.width = t.height = SIDE;
        t.channels = 3;
        t.pixels = pixels;
        t.noise_se = known ? se : NULL;
        test_must(ctx, imp_problem_add_target(p, &t));
        options.optimizer = IMP_LM;
        options.intervals = true;
        run.spp = SPP;
        run.seed = 5000 + (uint64_t)k;
        test_must(ctx, imp_fit(p, &options, &run, &r));
        const struct imp_fit_variable *v = &r->variables[0];
        square += (v->value - TRUTH) * (v->value - TRUTH) / (v->se * v->se) / FITS;
        imp_problem_destroy(p);
        imp_scene_destroy(s);
    }
    imp_scene_destroy(truth);
    /* Four standard errors of the mean of so many squares. */
    const double allowed = 4 * sqrt(2. / FITS);
    tap_ok(square > 1 - 0.75 * allowed && square < 1 + allowed,
           "%s, noise %s, %s: mean square # %.2f", filter,
           known ? "given" : "of residuals",
           rendered ? "rendered" : "independent channels", square);
}

/* ---- Many numbers ----------------------------------------------------------------- */

enum { TEXELS = 17, WIDE = 51 };

/* A wall of grey texels, lit by a ball, and all of a picture of it. */
static imp_scene *wall(const float *grey)
{
    static const double look[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 5, 0, 0, 0, 1};
    static const double centre[3] = {2, 1, 3}, light[3] = {9, 6, 3};
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "orthographic", "camera", NULL);
    imp_scene_transform(s, "to_world", look);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", WIDE);
    imp_scene_integer(s, "height", WIDE);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_begin(s, "texture", "bitmap", NULL, "reflectance");
    imp_scene_string(s, "filter_type", "nearest");
    imp_scene_image(s, TEXELS, TEXELS, 1, grey);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", NULL, NULL);
    imp_scene_vector(s, "center", centre);
    imp_scene_float(s, "radius", 1);
    imp_scene_begin(s, "emitter", "area", NULL, NULL);
    imp_scene_rgb(s, "radiance", light);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static void many(int n_fits, bool known, bool rendered)
{
    enum { N = WIDE * WIDE };
    static float mean[3 * N], se[3 * N], pixels[3 * N];
    float grey[TEXELS * TEXELS];
    struct tap_stat squares = {0}, told = {0};
    for (int i = 0; i < TEXELS * TEXELS; i++) grey[i] = .3f + .1f * (float)(i % 5);
    imp_scene *truth = wall(grey);
    noise_find(truth, N, mean, se);
    for (int k = 0; k < n_fits; k++) {
        imp_scene *s = wall(grey);
        imp_problem *p = test_problem(ctx, s, "*data*");
        struct imp_target t = IMP_TARGET_INIT;
        struct imp_fit_options options = IMP_FIT_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        const struct imp_fit_result *r;
        target_make(truth, N, mean, se, k, rendered, pixels);
        t.width = t.height = WIDE;
        t.channels = 3;
        t.pixels = pixels;
        t.noise_se = known ? se : NULL;
        test_must(ctx, imp_problem_add_target(p, &t));
        options.optimizer = IMP_LM;
        options.intervals = true;
        run.spp = SPP;
        run.seed = 5000 + (uint64_t)k;
        test_must(ctx, imp_fit(p, &options, &run, &r));
        for (size_t i = 0; i < r->n; i++) {
            const struct imp_fit_variable *v = &r->variables[i];
            const double off = v->value - (double)grey[i];
            tap_add(&squares, off * off);
            tap_add(&told, v->se * v->se);
        }
        imp_problem_destroy(p);
        imp_scene_destroy(s);
    }
    imp_scene_destroy(truth);
    /* Sums, since residuals of nine pixels tell a single error with eight degrees of freedom. */
    const double ratio = squares.mean / told.mean,
                 se_ratio = tap_se(&squares) / told.mean;
    tap_ok(squares.n == (long)n_fits * TEXELS * TEXELS &&
               fabs(ratio - 1) < 3.5 * se_ratio + .03,
           "%d texels, noise %s, %s: squares over those told # %.3f +- %.3f",
           TEXELS * TEXELS, known ? "given" : "of residuals",
           rendered ? "rendered" : "independent channels", ratio, se_ratio);
}

int main(int argc, char **argv)
{
    const bool all = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(2);
    for (int known = 0; known < 2; known++) {
        fits("box", known, true);
        fits("box", known, false);
        fits("gaussian", known, true);
        many(all ? 12 : 2, known, true);
        if (all) many(12, known, false);
    }
    imp_context_destroy(ctx);
    return tap_done();
}
