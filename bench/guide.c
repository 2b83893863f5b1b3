/* SPDX-License-Identifier: Apache-2.0
 *
 * What a finite-element solution is worth as a guide for walks: variance of the picture
 * times processor time, with and without, on scene d and others given by name.
 *
 *     guide [NAME=VALUE ...] [SCENE.xml ...] > table.json
 *     guide lights > table.json
 *
 * The second is of light walks, guided by importance: a camera and a meter in a
 * corner of sixteen rooms, the same meter by photons that have to meet it, and a room that
 * the camera sees whole. Of the pixels and of their mean there are means over seeds.
 *
 * The times of solving and of making the guide stand apart: they are paid once. The
 * standard errors come from the pictures themselves, so variances of heavy-tailed
 * estimates are known to some per cent only; means are compared to catch what is wrong.
 */
#include <importon/elements.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static imp_context *ctx;
static const char *defines[16] = {"res=64"};
static int n_defines = 1;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "guide: %s: %s\n", imp_status_text(st), imp_last_error(ctx));
    exit(3);
}

static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

struct result {
    double mean, se, variance,
        seconds; /* variance: of one sample, mean over the pixels */
};

static struct result measured(const imp_scene *s, const imp_guide *guide, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct result r = {.seconds = INFINITY};
    imp_film *f;
    run.spp = spp;
    run.guide = guide;
    for (int again = 0; again < 3; again++) {
        const double start = processor();
        must(imp_render(s, &run, &f));
        r.seconds = fmin(r.seconds, processor() - start);
        if (again < 2) imp_film_destroy(f);
    }
    imp_film_get_info(f, &info);
    const size_t n = (size_t)info.width * (size_t)info.height;
    const float *mean = imp_film_mean(f), *se = imp_film_se(f);
    for (size_t k = 0; k < n; k++) {
        r.mean += mean[k] / (double)n;
        r.se += (double)se[k] * se[k];
    }
    r.variance = r.se * spp / (double)n;
    r.se = sqrt(r.se) / (double)n;
    imp_film_destroy(f);
    return r;
}

static void scene(const char *path, int spp)
{
    static const struct {
        const char *name;
        int no_lights;
        double roulette, share;
    } ways[] = {{"lights", 0, 0, 0},
                {"directions", 1, 0, 0.25},
                {"lights+directions", 0, 0, 0.25},
                {"roulette 1", 1, 1, 0},
                {"lights+roulette 0.5", 0, 0.5, 0},
                {"lights+roulette 1", 0, 1, 0},
                {"lights+roulette 4", 0, 4, 0},
                {"all, roulette 4", 0, 4, 0.25}};
    struct imp_load_options lo = IMP_LOAD_OPTIONS_INIT;
    struct imp_elements_options eo = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_info info = {.size = sizeof info};
    imp_scene *s;
    imp_elements *e;
    lo.mode = IMP_MONO;
    lo.defines = defines;
    lo.n_defines = n_defines;
    must(imp_scene_load(ctx, path, &lo, &s));
    double start = processor();
    eo.stop = 0.05;
    must(imp_elements_create(s, &eo, &e));
    must(imp_elements_solve(e));
    must(imp_elements_get_info(e, &info));
    printf("{\"scene\":\"%s\",\"spp\":%d,\"links\":%zu,\"solve_seconds\":%.2f", path, spp,
           info.links, processor() - start);
    const struct result base = measured(s, NULL, spp);
    printf(",\n \"none\":{\"mean\":%.6g,\"se\":%.2g,\"variance\":%.4g,\"seconds\":%.3f}",
           base.mean, base.se, base.variance, base.seconds);
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        struct imp_elements_guide_options o = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
        imp_guide *g;
        o.no_lights = ways[k].no_lights;
        o.roulette = ways[k].roulette;
        o.share = ways[k].share;
        start = processor();
        must(imp_elements_guide(e, &o, &g));
        const double made = processor() - start;
        const struct result r = measured(s, g, spp);
        printf(",\n \"%s\":{\"mean\":%.6g,\"se\":%.2g,\"variance\":%.4g,\"seconds\":%.3f,"
               "\"guide_seconds\":%.2f,\"z\":%.2f,\"variance_x_time\":%.3f}",
               ways[k].name, r.mean, r.se, r.variance, r.seconds, made,
               (r.mean - base.mean) / hypot(r.se, base.se),
               r.variance * r.seconds / (base.variance * base.seconds));
        imp_guide_destroy(g);
    }
    printf("}");
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* ---- Light walks -------------------------------------------------------- */

/* Readings of the sensor: mean over its pixels, its variance over seeds, and time. */
static struct result readings(const imp_scene *s, int sensor, const imp_guide *guide,
                              int spp)
{
    enum { SEEDS = 60 };
    struct result r = {0};
    struct imp_film_info info = {.size = sizeof info};
    double square = 0;
    const double start = processor();
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f;
        run.sensor = sensor;
        run.spp = spp;
        run.seed = guide ? seed + SEEDS : seed;
        run.guide = guide;
        run.from = IMP_FROM_LIGHTS;
        must(imp_render(s, &run, &f));
        imp_film_get_info(f, &info);
        const size_t n = (size_t)info.width * (size_t)info.height;
        double mean = 0, pixels = 0;
        for (size_t k = 0; k < n; k++) {
            mean += imp_film_mean(f)[k] / (double)n;
            pixels += (double)imp_film_se(f)[k] * (double)imp_film_se(f)[k] / (double)n;
        }
        r.mean += mean / SEEDS;
        square += mean * mean / SEEDS;
        r.variance += pixels / SEEDS;
        imp_film_destroy(f);
    }
    r.seconds = processor() - start;
    r.se = sqrt((square - r.mean * r.mean) / (SEEDS - 1));
    return r;
}

static void from_lights(const char *path, const char *integrator, int sensor, int spp)
{
    static const struct {
        const char *name;
        int no_lights;
        double share;
    } ways[] = {
        {"beginning", 0, 0}, {"directions 0.25", 1, 0.25}, {"both, 0.25", 0, 0.25}};
    const char *all[2] = {"res=16", integrator};
    struct imp_load_options lo = IMP_LOAD_OPTIONS_INIT;
    struct imp_elements_options eo = IMP_ELEMENTS_OPTIONS_INIT;
    imp_scene *s;
    imp_elements *e;
    lo.mode = IMP_MONO;
    lo.defines = all;
    lo.n_defines = integrator ? 2 : 1;
    must(imp_scene_load(ctx, path, &lo, &s));
    double start = processor();
    eo.sensor = sensor;
    eo.stop = 0.05;
    must(imp_elements_create(s, &eo, &e));
    must(imp_elements_solve(e));
    printf("{\"scene\":\"%s\",\"%s\":1,\"sensor\":%d,\"spp\":%d,\"solve_seconds\":%.2f",
           strrchr(path, '/') + 1, integrator ? integrator : "ptracer", sensor, spp,
           processor() - start);
    const struct result base = readings(s, sensor, NULL, spp);
    printf(",\n \"none\":{\"mean\":%.6g,\"se\":%.2g,\"seconds\":%.3f}", base.mean,
           base.se, base.seconds);
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        struct imp_elements_guide_options o = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
        imp_guide *g;
        o.no_lights = ways[k].no_lights;
        o.share = ways[k].share;
        start = processor();
        must(imp_elements_guide(e, &o, &g));
        const double made = processor() - start;
        const struct result r = readings(s, sensor, g, spp);
        const double time = r.seconds / base.seconds;
        printf(",\n \"%s\":{\"mean\":%.6g,\"se\":%.2g,\"z\":%.2f,\"guide_seconds\":%.2f,"
               "\"time\":%.3f,\"variance_of_pixels\":%.3f,\"x_time\":%.3f,"
               "\"variance_of_mean\":%.3f,\"x_time_of_mean\":%.3f}",
               ways[k].name, r.mean, r.se, (r.mean - base.mean) / hypot(r.se, base.se),
               made, time, r.variance / base.variance, r.variance / base.variance * time,
               pow(r.se / base.se, 2), pow(r.se / base.se, 2) * time);
        fflush(stdout);
        imp_guide_destroy(g);
    }
    printf("}");
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

static void all_from_lights(void)
{
    from_lights(IMP_SCENES "/elements/offices.xml", NULL, 0, 64);
    printf(",\n");
    from_lights(IMP_SCENES "/elements/offices.xml", NULL, 1, 16384);
    printf(",\n");
    from_lights(IMP_SCENES "/elements/offices.xml", "integrator=photons", 1, 32768);
    printf(",\n");
    from_lights(IMP_SCENES "/cornell.xml", NULL, 0, 32);
}

int main(int argc, char **argv)
{
    struct imp_context_options co = IMP_CONTEXT_OPTIONS_INIT;
    co.threads = 1;
    must(imp_context_create(&co, &ctx));
    printf("[");
    int k = 1;
    if (argc == 2 && strcmp(argv[1], "lights") == 0) {
        all_from_lights();
        k = argc = 0;
    }
    for (; k < argc && strchr(argv[k], '=') && n_defines < 16; k++)
        defines[n_defines++] = argv[k];
    if (k == argc && k > 0) scene(IMP_SCENES "/elements/glossy.xml", 256);
    for (int first = k; k < argc; k++) {
        if (k > first) printf(",\n");
        scene(argv[k], 256);
    }
    printf("]\n");
    imp_context_destroy(ctx);
    return 0;
}
