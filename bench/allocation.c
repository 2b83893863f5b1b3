/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples of Adam's fits to tiles by variance, over equal ones: squared errors of the answer,
 * mean over seeds and numbers, and processor seconds of one thread, in turn.
 *
 *     allocation [--iterations N] [--spp N] [--seeds N] [--scenes FOLDER]
 *
 * Errors are those of the numbers against the ones that the target was made with, each over
 * that of equal samples; the target's own noise is in both. */
#include <importon/importon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { NUMBERS = 32, SIDE = 48 };

static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "allocation: %s: %s\n", imp_status_text(st), imp_last_error(ctx));
    exit(3);
}

static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static const struct job {
    const char *name, *file, *defines[2], *active[5];
    double start; /* of numbers below 1; others begin at 0.7 of the truth */
} jobs[] = {{"Cornell box",
             "cornell.xml",
             {"res=48", NULL},
             {"white.reflectance.value", "red.reflectance.value",
              "green.reflectance.value", "light.radiance.value", NULL},
             .4},
            {"textured, few numbers",
             "textured.xml",
             {"width=56", "height=42"},
             {"wall.reflectance.color0.value", "wall.reflectance.color1.value",
              "metal.alpha*", "sky.radiance.value", "lamp.radiance.value"},
             .35},
            {"textured, floor",
             "textured.xml",
             {"width=56", "height=42"},
             {"floor.reflectance.data", NULL},
             .5}};

static void fits(const struct job *job, const char *folder, int iterations, int spp,
                 int seeds)
{
    char path[1024];
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *scene;
    imp_problem *p;
    imp_film *film;
    snprintf(path, sizeof path, "%s/%s", folder, job->file);
    load.defines = (const char **)(uintptr_t)job->defines;
    load.n_defines = 1 + (job->defines[1] != NULL);
    must(imp_scene_load(ctx, path, &load, &scene));
    run.spp = 4096;
    run.seed = 99;
    must(imp_render(scene, &run, &film));
    imp_film_get_info(film, &info);
    must(imp_problem_create(scene, &p));
    for (int k = 0; k < 5 && job->active[k]; k++)
        must(imp_problem_activate(p, job->active[k]));
    target.pixels = imp_film_mean(film);
    target.width = info.width;
    target.height = info.height;
    target.channels = info.channels;
    must(imp_problem_add_target(p, &target));
    const size_t n = imp_problem_n(p);
    double *truth = calloc(4 * n, sizeof *truth), *x = truth + n, seconds[2] = {0, 0};
    double *error[2] = {x + n, x + 2 * n};
    if (!truth) abort();
    imp_problem_get_x(p, truth);
    run.spp = spp;
    for (int seed = 0; seed < seeds; seed++)
        for (int kind = 0; kind < 2; kind++) {
            struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
            const struct imp_fit_result *r;
            o.max_iterations = iterations;
            o.allocation = kind ? IMP_ALLOCATION_VARIANCE : IMP_ALLOCATION_EVEN;
            run.seed = (uint64_t)seed;
            for (size_t k = 0; k < n; k++)
                x[k] = truth[k] < 1 ? job->start : 0.7 * truth[k];
            must(imp_problem_set_x(p, x));
            const double start = processor();
            must(imp_fit(p, &o, &run, &r));
            seconds[kind] += processor() - start;
            imp_problem_get_x(p, x);
            for (size_t k = 0; k < n; k++)
                error[kind][k] += pow(x[k] - truth[k], 2) / seeds;
        }
    /* Of many numbers the sum: some are hardly seen. */
    double logs = 0, sum[2] = {0, 0};
    for (size_t k = 0; k < n; k++) {
        logs += log(error[1][k] / error[0][k]) / (double)n;
        for (int kind = 0; kind < 2; kind++) sum[kind] += error[kind][k];
    }
    printf("%-24s %6zu numbers   squared error %.3f   seconds %.3f\n", job->name, n,
           n <= NUMBERS ? exp(logs) : sum[1] / sum[0], seconds[1] / seconds[0]);
    free(truth);
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    struct imp_context_options options = IMP_CONTEXT_OPTIONS_INIT;
    const char *folder = IMP_SCENES;
    int iterations = 100, spp = 16, seeds = 6;
    for (int k = 1; k + 1 < argc; k += 2) {
        if (strcmp(argv[k], "--iterations") == 0) iterations = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--spp") == 0) spp = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--seeds") == 0) seeds = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--scenes") == 0) folder = argv[k + 1];
        else {
            fprintf(stderr, "allocation: there is no option %s\n", argv[k]);
            return 2;
        }
    }
    options.threads = 1;
    if (imp_context_create(&options, &ctx) != IMP_OK) return 3;
    for (size_t k = 0; k < sizeof jobs / sizeof *jobs; k++)
        fits(&jobs[k], folder, iterations, spp, seeds);
    imp_context_destroy(ctx);
    return 0;
}
