/* SPDX-License-Identifier: Apache-2.0
 *
 * Points in sets against independent points, of any scene: variance over seeds, processor
 * time, and estimated standard errors over the spread of seeds (docs/decisions.md).
 *
 *     points JOB SCENE [spp [seeds [GLOB [NAME=VALUE]...]]]
 *
 * JOB is what is computed in the default mode of the scene's channels:
 *
 *     picture     imp_render, by the scene's integrator        mean of the picture: see read
 *     lights      imp_render, from the lights
 *     loss        imp_problem_objective: value and gradient of an l2 loss, whose target is
 *                 1.2 times the picture
 *     read        imp_problem_functional: mean of the picture, and its gradient
 *     reverse     imp_problem_reverse, whose adjoint is the picture of other walks less its mean
 *     jacobian    imp_problem_jacobian: the derivative pictures
 *
 * GLOB chooses the parameters. One row for values (pixels, or entries of a gradient: the medians,
 * the quartiles of the ratio of variances, and what the means of all variances give) and one for
 * the number beside them, if there is one.
 */
#include <importon/importon.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum job { PICTURE, LIGHTS, LOSS, READ, REVERSE, JACOBIAN, N_JOBS };
static const char *const job_names[] = {"picture", "lights",  "loss",
                                        "read",    "reverse", "jacobian"};

static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "points: %s: %s\n", imp_status_text(st), imp_last_error(ctx));
    exit(3);
}
static void *zeros(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    if (p) return p;
    fprintf(stderr, "points: no memory\n");
    exit(3);
}
static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- Sums over seeds ---------------------------------------------------------------- */

struct sums {
    size_t n;     /* values; one more is the number beside them */
    double *mean; /* [n + 1] */
    double *m2, *reported;
    double seconds;
    int seeds;
};

static void add(struct sums *s, size_t i, double x, double se)
{
    const double d = x - s->mean[i];
    s->mean[i] += d / (s->seeds + 1);
    s->m2[i] += d * (x - s->mean[i]);
    s->reported[i] += se * se;
}

/* ---- One job ------------------------------------------------------------------------ */

struct setting {
    enum job job;
    imp_scene *scene;
    imp_problem *problem;
    float *adjoint; /* [pixels][channels] */
};

static size_t film_size(imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    must(imp_film_get_info(film, &info));
    return (size_t)info.width * (size_t)info.height * (size_t)info.channels;
}
static void sums_begin(struct sums *s, size_t n)
{
    if (s->mean) return;
    s->n = n;
    s->mean = zeros(3 * (n + 1), sizeof *s->mean);
    s->m2 = s->mean + n + 1;
    s->reported = s->m2 + n + 1;
}
static void film_add(struct sums *s, size_t first, imp_film *film)
{
    const size_t n = film_size(film);
    for (size_t i = 0; i < n; i++)
        add(s, first + i, (double)imp_film_mean(film)[i], (double)imp_film_se(film)[i]);
}

static void films_add(const struct setting *o, const struct imp_run *run, struct sums *s)
{
    const size_t n = imp_problem_n_variables(o->problem);
    imp_film **films = zeros(n, sizeof(imp_film *));
    must(imp_problem_jacobian(o->problem, run, NULL, films));
    const size_t size = film_size(films[0]);
    sums_begin(s, n * size);
    for (size_t k = 0; k < n; k++) {
        film_add(s, k * size, films[k]);
        imp_film_destroy(films[k]);
    }
    free(films);
}

static void vector_add(const struct setting *o, const struct imp_run *run, struct sums *s)
{
    const size_t n = imp_problem_n_variables(o->problem);
    double *g = zeros(2 * n, sizeof *g), *se = g + n;
    struct imp_estimate e = {0};
    if (o->job == LOSS) must(imp_problem_objective(o->problem, NULL, run, &e, g, se));
    else if (o->job == READ)
        must(imp_problem_functional(o->problem, NULL, run, &e, n ? g : NULL,
                                    n ? se : NULL));
    else must(imp_problem_reverse(o->problem, o->adjoint, run, g, se));
    sums_begin(s, n);
    for (size_t i = 0; i < n; i++) add(s, i, g[i], se[i]);
    add(s, n, e.value, e.se);
    free(g);
}

static void job_run(const struct setting *o, enum imp_points points, int spp, int seeds,
                    struct sums *s)
{
    for (; s->seeds < seeds; s->seeds++) {
        struct imp_run run = IMP_RUN_INIT;
        run.spp = spp;
        run.points = points;
        run.seed = (uint64_t)s->seeds + 1000 * (uint64_t)points;
        run.from = o->job == LIGHTS ? IMP_FROM_LIGHTS : IMP_FROM_SCENE;
        const double start = processor();
        if (o->job == JACOBIAN) films_add(o, &run, s);
        else if (o->job > LIGHTS) vector_add(o, &run, s);
        else {
            imp_film *film;
            must(imp_render(o->scene, &run, &film));
            sums_begin(s, film_size(film));
            film_add(s, 0, film);
            imp_film_destroy(film);
        }
        s->seconds += processor() - start;
    }
}

/* ---- Rows --------------------------------------------------------------------------- */

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Values from..end - 1 of both kinds. */
static void row(const char *name, const struct sums *one, const struct sums *sets,
                size_t from, size_t end)
{
    double *ratio = zeros(3 * (end - from), sizeof *ratio);
    double *reported = ratio + (end - from), *reported_one = reported + (end - from),
           z2 = 0, all[3] = {0, 0, 0};
    size_t n = 0;
    for (size_t i = from; i < end; i++) {
        if (!(one->m2[i] > 0) || !(sets->m2[i] > 0)) continue;
        const double a = one->m2[i] / (one->seeds - 1),
                     b = sets->m2[i] / (sets->seeds - 1),
                     d = one->mean[i] - sets->mean[i];
        z2 += d * d / (a / one->seeds + b / sets->seeds);
        all[0] += a;
        all[1] += b;
        all[2] += sets->reported[i] / sets->seeds;
        ratio[n] = b / a;
        reported[n] = sqrt(sets->reported[i] / sets->seeds / b);
        reported_one[n++] = sqrt(one->reported[i] / one->seeds / a);
    }
    if (n > 0) {
        qsort(ratio, n, sizeof *ratio, by_value);
        qsort(reported, n, sizeof *reported, by_value);
        qsort(reported_one, n, sizeof *reported_one, by_value);
        printf("%-8s %6zu  variance %.3f (%.3f to %.3f)  told/seen %.3f, independent "
               "%.3f  of means %.3f, %.3f  z^2 %.2f  time %.3f\n",
               name, n, ratio[n / 2], ratio[n / 4], ratio[3 * n / 4], reported[n / 2],
               reported_one[n / 2], all[1] / all[0], sqrt(all[2] / all[1]),
               z2 / (double)n, sets->seconds / one->seconds);
    }
    free(ratio);
}

/* ---- Setting ------------------------------------------------------------------------- */

static void target_add(struct setting *o)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct imp_target target = IMP_TARGET_INIT;
    imp_film *film;
    double mean = 0;
    run.spp = 128;
    run.seed = 77;
    must(imp_problem_jacobian(o->problem, &run, &film, zeros(256, sizeof(imp_film *))));
    must(imp_film_get_info(film, &info));
    const size_t n = film_size(film);
    o->adjoint = zeros(n, sizeof *o->adjoint);
    for (size_t i = 0; i < n; i++) mean += (double)imp_film_mean(film)[i] / (double)n;
    for (size_t i = 0; i < n; i++) o->adjoint[i] = imp_film_mean(film)[i] - (float)mean;
    float *pixels = zeros(n, sizeof *pixels);
    for (size_t i = 0; i < n; i++) pixels[i] = 1.2f * imp_film_mean(film)[i];
    target.pixels = pixels;
    target.width = info.width;
    target.height = info.height;
    target.channels = info.channels;
    if (o->job == LOSS) must(imp_problem_add_target(o->problem, &target));
    free(pixels);
    imp_film_destroy(film);
}

int main(int argc, char **argv)
{
    struct setting o = {.job = N_JOBS};
    struct sums sums[2] = {{0}, {0}};
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    const int spp = argc > 3 ? atoi(argv[3]) : 64, seeds = argc > 4 ? atoi(argv[4]) : 24;
    for (int k = 0; argc > 2 && k < N_JOBS; k++)
        if (strcmp(argv[1], job_names[k]) == 0) o.job = (enum job)k;
    if (o.job == N_JOBS || spp < 1 || seeds < 2) {
        fprintf(stderr, "usage: points picture|lights|loss|read|reverse|jacobian SCENE "
                        "[spp [seeds [GLOB [NAME=VALUE]...]]]\n");
        return 2;
    }
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 3;
    load.defines = argc > 6 ? (const char *const *)argv + 6 : NULL;
    load.n_defines = argc > 6 ? argc - 6 : 0;
    must(imp_scene_load(ctx, argv[2], &load, &o.scene));
    must(imp_problem_create(o.scene, &o.problem));
    if (argc > 5 && *argv[5] && o.job > LIGHTS)
        must(imp_problem_activate(o.problem, argv[5]));
    if (o.job == LOSS || o.job == REVERSE) target_add(&o);
    job_run(&o, IMP_POINTS_INDEPENDENT, spp, seeds, &sums[0]);
    job_run(&o, IMP_POINTS_SOBOL, spp, seeds, &sums[1]);
    printf("%s of %s, %d samples, %d seeds\n", argv[1], argv[2], spp, seeds);
    row("values", &sums[0], &sums[1], 0, sums[0].n);
    if (o.job == LOSS || o.job == READ)
        row("number", &sums[0], &sums[1], sums[0].n, sums[0].n + 1);
    for (int k = 0; k < 2; k++) free(sums[k].mean);
    free(o.adjoint);
    imp_problem_destroy(o.problem);
    imp_scene_destroy(o.scene);
    imp_context_destroy(ctx);
    return 0;
}
