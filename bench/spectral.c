/* SPDX-License-Identifier: Apache-2.0
 *
 * What wavelengths cost: the Cornell box by four wavelengths a walk and by one, over rgb,
 * one thread, processor time; the median of runs measured in turn. Then the noise of a
 * pixel at equal time, over rgb.
 *
 *     spectral [REPEATS] [SPP] */
#include <importon/importon.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "spectral: %s\n", imp_last_error(ctx));
    exit(3);
}
static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
static double median(double *x, int n)
{
    qsort(x, (size_t)n, sizeof *x, by_value);
    return n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

/* Median relative error of a pixel's luminance at these samples. */
static double noise(imp_film *f)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(f, &info);
    const int n = info.width * info.height;
    double *e = malloc((size_t)n * sizeof *e);
    for (int p = 0; p < n; p++) {
        const double mean = imp_film_mean(f)[3 * p + 1], se = imp_film_se(f)[3 * p + 1];
        e[p] = mean > 0 ? se / mean : 0;
    }
    const double m = median(e, n);
    free(e);
    return m;
}

int main(int argc, char **argv)
{
    static const enum imp_color_mode mode[3] = {IMP_RGB, IMP_SPECTRAL, IMP_SINGLE};
    static const char *const name[3] = {"rgb", "spectral", "single"};
    const int repeats = argc > 1 ? atoi(argv[1]) : 7, spp = argc > 2 ? atoi(argv[2]) : 64;
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    imp_scene *scene[3];
    double seconds[3][64], error[3] = {0}, time[3];
    o.threads = 1;
    must(imp_context_create(&o, &ctx));
    const char *defines[] = {"res=128"};
    for (int k = 0; k < 3; k++) {
        struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
        load.mode = mode[k];
        load.defines = defines;
        load.n_defines = 1;
        must(imp_scene_load(ctx, IMP_SCENES "/cornell.xml", &load, &scene[k]));
    }
    for (int r = 0; r < repeats && r < 64; r++)
        for (int k = 0; k < 3; k++) {
            struct imp_run run = IMP_RUN_INIT;
            imp_film *f;
            run.spp = spp;
            run.seed = (uint64_t)r;
            const double t = cpu();
            must(imp_render(scene[k], &run, &f));
            seconds[k][r] = cpu() - t;
            error[k] = noise(f);
            imp_film_destroy(f);
        }
    for (int k = 0; k < 3; k++) time[k] = median(seconds[k], repeats);
    for (int k = 0; k < 3; k++) {
        const double to_1_percent = time[k] * pow(error[k] / 0.01, 2);
        printf("%-9s time/rgb %.3f   median error of a pixel's G %.4f at %d samples   "
               "1 %% in %.1f s\n",
               name[k], time[k] / time[0], error[k], spp, to_1_percent);
    }
    for (int k = 0; k < 3; k++) imp_scene_destroy(scene[k]);
    imp_context_destroy(ctx);
    return 0;
}
