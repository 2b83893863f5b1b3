/* SPDX-License-Identifier: Apache-2.0
 *
 * Several environments at once: pictures are the sum of those of each alone, for every
 * integrator, with and without media; derivatives are those of each alone; walks are kept,
 * written and read; a fit tells the suns apart. */
#include "importon/walks.h"
#include "media_kit.h"
#include <unistd.h>

static imp_context *ctx;

#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='6'/>"                             \
    "<integer name='height' value='6'/><rfilter type='box'/></film>"
#define EYE                                                                              \
    "<sensor type='perspective'><float name='fov' value='40'/>"                          \
    "<transform name='to_world'><lookat origin='0,-5,2' target='0,0,0.4' up='0,0,1'/>"   \
    "</transform>" FILM "</sensor>"
/* A ball on a floor. */
#define THINGS                                                                           \
    "<shape type='rectangle'><bsdf type='diffuse' id='floor'><rgb name='reflectance' "   \
    "value='.5,.4,.3'/></bsdf><transform name='to_world'><scale value='2'/></transform>" \
    "</shape><shape type='sphere'><point name='center' x='0' y='0' z='0.6'/>"            \
    "<float name='radius' value='0.6'/><bsdf type='roughconductor' id='ball'>"           \
    "<float name='alpha' value='0.3'/></bsdf></shape>"
#define FOG                                                                              \
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='.3'/>"             \
    "<float name='albedo' value='.8'/></medium><shape type='cube'><bsdf type='null'/>"   \
    "<ref id='fog' name='interior'/><transform name='to_world'><scale value='2.5'/>"     \
    "</transform></shape>"

enum { SUN, EVEN, SKY, SKIES };
static const char *const sky[SKIES] = {
    "<emitter type='sun' id='sun'><rgb name='radiance' value='9,8,7'/><float "
    "name='radius' "
    "value='.2'/><vector name='direction' x='.5' y='.6' z='-1'/></emitter>",
    "<emitter type='constant' id='even'><rgb name='radiance' "
    "value='.2,.3,.4'/></emitter>",
    "<emitter type='sunsky' id='blue'><float name='sun_scale' value='0'/>"
    "<float name='sky_scale' value='5'/></emitter>"};

static imp_scene *world(const char *integrator, const char *things, unsigned skies)
{
    char text[8192];
    int n =
        snprintf(text, sizeof text, "<scene version='3.0.0'><integrator type='%s'/>%s",
                 integrator, things);
    for (int k = 0; k < SKIES; k++)
        if (skies >> k & 1)
            n += snprintf(text + n, sizeof text - (size_t)n, "%s", sky[k]);
    snprintf(text + n, sizeof text - (size_t)n, "</scene>");
    return test_scene_text(ctx, text, IMP_RGB);
}

static void pictures(const char *integrator, const char *things, int spp, double tight)
{
    double sum[3] = {0}, square[3] = {0}, mean[3], se[3];
    for (int k = 0; k <= SKIES; k++) {
        imp_scene *s = world(integrator, things, k < SKIES ? 1u << k : 7);
        struct imp_run run = IMP_RUN_INIT;
        run.spp = spp;
        run.seed = (uint64_t)k + 1;
        media_mean_run(ctx, s, &run, mean, se, IMP_DROP_NONE);
        for (int c = 0; c < 3 && k < SKIES; c++) {
            sum[c] += mean[c];
            square[c] += se[c] * se[c];
        }
        imp_scene_destroy(s);
    }
    for (int c = 0; c < 3; c++)
        media_near(mean[c], sqrt(se[c] * se[c] + square[c]), sum[c], tight * sum[c],
                   integrator);
}

/* Past everything: all radiances, without noise. */
static void bare(void)
{
    static const char up[] =
        "<sensor type='perspective'><float name='fov' value='4'/><transform "
        "name='to_world'><lookat origin='0,0,9' target='-.5,-.6,10' up='0,0,1'/>"
        "</transform>" FILM "</sensor>" THINGS;
    imp_scene *s = world("path", up, 1u << SUN | 1u << EVEN);
    double mean[3], se[3];
    media_mean(ctx, s, 4, mean, se);
    tap_near(mean[0], 9.2, 1e-6, 0, "the sun's disc before the sky");
    tap_ok(se[0] < 1e-7, "... without noise # %g", se[0]);
    imp_scene_destroy(s);
}

/* The picture is linear in the radiances, so its derivatives are the others' pictures. */
static void derivatives(void)
{
    static const char *const by[] = {"path", "volpath", "ptracer", "bdpt"};
    for (int i = 0; i < 4; i++) {
        imp_scene *s =
            world(by[i], i % 2 ? EYE THINGS FOG : EYE THINGS, 1u << SUN | 1u << EVEN);
        imp_problem *p = test_problem(ctx, s, "*.radiance.value");
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate v;
        static const double Le[6] = {9, 8, 7, .2, .3, .4};
        double g[6], se[6], mean[3], mean_se[3];
        run.spp = 1024;
        run.seed = 11 + (uint64_t)i;
        test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, se));
        imp_problem_destroy(p);
        for (int k = 0; k < 2; k++) {
            imp_scene *one = world(by[i], i % 2 ? EYE THINGS FOG : EYE THINGS, 1u << k);
            media_mean(ctx, one, 1024, mean, mean_se);
            imp_scene_destroy(one);
            for (int c = 0; c < 3; c++) { /* of the mean over channels */
                const double of = 3 * Le[3 * k + c];
                media_near(g[3 * k + c], hypot(se[3 * k + c], mean_se[c] / of),
                           mean[c] / of, .06 * mean[c] / of, "its derivative");
            }
        }
        imp_scene_destroy(s);
    }
}

static void checked(const char *integrator, const char *things)
{
    imp_scene *s = world(integrator, things, 7);
    imp_problem *p = test_problem(ctx, s, "*");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    const struct imp_check_row *rows;
    size_t n;
    int wrong = 0;
    o.draws_s = 0.02;
    o.paths = 100;
    o.fresh_spp = 256;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    for (size_t k = 0; k < n; k++) {
        if (rows[k].ok) continue;
        wrong++;
        printf("# %s %s %g, reference %g, error %g\n", rows[k].method, rows[k].param,
               rows[k].value, rows[k].reference, rows[k].error);
    }
    tap_ok(n > 10 && wrong == 0, "%s: check of %d rows, %d wrong", integrator, (int)n,
           wrong);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* The same picture from recorded walks, from their file, and at other radiances. */
static void kept(void)
{
    imp_scene *s = world("path", EYE THINGS, 7);
    char path[] = "/tmp/importon-skies-XXXXXX";
    struct imp_run run = IMP_RUN_INIT;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    imp_walks *walks, *read;
    imp_film *film[4];
    size_t n, sun;
    const double dim[3] = {1, 2, 3};
    struct imp_film_info info = {.size = sizeof info};
    const int file = mkstemp(path);
    if (file >= 0) close(file);
    run.spp = 16;
    o.survival = -1; /* as drawn */
    test_must(ctx, imp_walks_keep(s, &run, &o, &walks));
    test_must(ctx, imp_walks_write(walks, path));
    test_must(ctx, imp_walks_read(ctx, s, path, NULL, &read));
    test_must(ctx, imp_render(s, &run, &film[0]));
    run.walks = walks;
    test_must(ctx, imp_render(s, &run, &film[1]));
    run.walks = read;
    test_must(ctx, imp_render(s, &run, &film[2]));
    test_must(ctx, imp_scene_find_param(s, "sun.radiance.value", &sun));
    test_must(ctx, imp_scene_set_values(s, sun, 3, dim));
    test_must(ctx, imp_render(s, &run, &film[3]));
    test_must(ctx, imp_film_get_info(film[0], &info));
    n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
    for (int k = 1; k < 3; k++)
        tap_ok(memcmp(imp_film_mean(film[k]), imp_film_mean(film[0]),
                      n * sizeof *imp_film_mean(film[0])) == 0,
               "recorded walks%s: the bits of those drawn", k == 2 ? " in a file" : "");
    double mean = 0, se = 0, of[3], of_se[3];
    for (size_t k = 0; k < n; k += (size_t)info.channels) {
        mean += (double)imp_film_mean(film[3])[k] / 36;
        se += pow((double)imp_film_se(film[3])[k] / 36, 2);
    }
    for (int k = 0; k < 4; k++) imp_film_destroy(film[k]);
    imp_walks_destroy(read);
    imp_walks_destroy(walks);
    media_mean(ctx, s, 256, of, of_se);
    media_near(mean, hypot(sqrt(se), of_se[0]), of[0], .1 * of[0], "... at another sun");
    imp_scene_destroy(s);
    remove(path);
}

/* Sun and sky apart, by the shadow. */
static void fitted(void)
{
    static const double wrong[3] = {4, 4, 4}, grey[3] = {1, 1, 1},
                        truth[6] = {9, 8, 7, .2, .3, .4};
    imp_scene *s = world("path", EYE THINGS, 1u << SUN | 1u << EVEN);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_target t = IMP_TARGET_INIT;
    const struct imp_fit_result *r;
    imp_film *film;
    size_t sun, even;
    run.spp = 1024;
    run.seed = 4;
    test_must(ctx, imp_render(s, &run, &film));
    test_must(ctx, imp_scene_find_param(s, "sun.radiance.value", &sun));
    test_must(ctx, imp_scene_find_param(s, "even.radiance.value", &even));
    test_must(ctx, imp_scene_set_values(s, sun, 3, wrong));
    test_must(ctx, imp_scene_set_values(s, even, 3, grey));
    imp_problem *p = test_problem(ctx, s, "*.radiance.value");
    t.width = t.height = 6;
    t.channels = 3;
    t.pixels = imp_film_mean(film);
    t.noise_se = imp_film_se(film);
    test_must(ctx, imp_problem_add_target(p, &t));
    run.spp = 256;
    run.seed = 9;
    o.optimizer = IMP_LM;
    o.intervals = 1;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    for (int i = 0; i < 6; i++)
        tap_ok(fabs(r->variables[i].value - truth[i]) < 4.5 * r->variables[i].se &&
                   r->variables[i].se < .05 * truth[i],
               "%s is found # %.4f +- %.4f", i < 3 ? "the sun" : "the sky",
               r->variables[i].value, r->variables[i].se);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_film_destroy(film);
}

int main(void)
{
    ctx = test_context(0);
    bare();
    pictures("path", EYE THINGS, 1024, .01);
    pictures("direct", EYE THINGS, 1024, .01);
    pictures("photons", EYE THINGS, 1024, .02);
    pictures("ptracer", EYE THINGS, 2048, .03);
    pictures("bdpt", EYE THINGS, 512, .02);
    pictures("volpath", EYE THINGS FOG, 1024, .01);
    pictures("photons", EYE THINGS FOG, 1024, .02);
    pictures("ptracer", EYE THINGS FOG, 2048, .03);
    pictures("bdpt", EYE THINGS FOG, 512, .02);
    derivatives();
    checked("path", EYE THINGS);
    checked("volpath", EYE THINGS FOG);
    checked("photons", EYE THINGS);
    kept();
    fitted();
    imp_context_destroy(ctx);
    return tap_done();
}
