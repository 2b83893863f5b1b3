/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples of Adam's fits to tiles by variance, against equal ones, in equal processor time: what
 * answers cost over the truth, and how far their numbers are from it.
 *
 *     allocation [--iterations N] [--spp N] [--seeds N] [--side N] [--job K]
 *
 * Iterations are those of equal samples; the others make as many as take the same time, as two
 * short fits before have it. The excess of the loss is half the weighted square of the difference
 * of two pictures, at the answer and at the truth, of the same walks: a product of two such
 * differences, so that noise does not add to it. */
#include <importon/importon.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { NUMBERS = 32, FINE = 256, PILOT = 16 };

static imp_context *ctx;
static int iterations = 60, spp = 8, seeds = 5, side = 32;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "allocation: %s: %s\n", imp_status_text(st), imp_last_error(ctx));
    exit(3);
}

static void *room(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    if (!p) exit(3);
    return p;
}

static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static const struct job {
    const char *name, *file, *active[5];
    double start; /* of numbers below 1; others begin at 0.7 of the truth */
    double aside; /* weight of pixels outside of a ninth of the picture */
    enum imp_variates variates;
} jobs[] = {
    {"Cornell box",
     "cornell.xml",
     {"white.reflectance.value", "red.reflectance.value", "green.reflectance.value",
      "light.radiance.value"},
     .4,
     1,
     IMP_VARIATES_OFF},
    {"... with a control variate",
     "cornell.xml",
     {"white.reflectance.value", "red.reflectance.value", "green.reflectance.value",
      "light.radiance.value"},
     .4,
     1,
     IMP_VARIATES_ON},
    {"Cornell box, a part counts",
     "cornell.xml",
     {"white.reflectance.value", "red.reflectance.value", "green.reflectance.value",
      "light.radiance.value"},
     .4,
     .01,
     IMP_VARIATES_OFF},
    {"Cornell box, reflectances",
     "cornell.xml",
     {"white.reflectance.value", "red.reflectance.value", "green.reflectance.value"},
     .4,
     1,
     IMP_VARIATES_OFF},
    {"textured, few numbers",
     "textured.xml",
     {"wall.reflectance.color0.value", "wall.reflectance.color1.value", "metal.alpha*",
      "sky.radiance.value", "lamp.radiance.value"},
     .35,
     1,
     IMP_VARIATES_OFF},
    {"textured, floor",
     "textured.xml",
     {"floor.reflectance.data"},
     .5,
     1,
     IMP_VARIATES_OFF},
    {"... with a control variate",
     "textured.xml",
     {"floor.reflectance.data"},
     .5,
     1,
     IMP_VARIATES_ON},
    {"textured, all, with one", "textured.xml", {"*"}, .5, 1, IMP_VARIATES_ON},
};

struct task {
    const struct job *job;
    imp_scene *scene;
    imp_problem *p;
    size_t n, pixels;
    double *truth, *x;
    float *weights, *fine[2]; /* pictures of the truth */
};

static imp_film *picture(const struct task *t, int samples, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = samples;
    run.seed = seed;
    must(imp_render(t->scene, &run, &film));
    return film;
}

static void task_make(const struct job *job, struct task *t)
{
    char path[1024], across[32], down[32];
    const char *defines[2] = {across, down};
    struct imp_load_options load = IMP_LOAD_OPTIONS_INIT;
    struct imp_film_info info = {.size = sizeof info};
    struct imp_target target = IMP_TARGET_INIT;
    const bool square = strcmp(job->file, "cornell.xml") == 0;
    *t = (struct task){.job = job};
    snprintf(path, sizeof path, "%s/%s", IMP_SCENES, job->file);
    snprintf(across, sizeof across, square ? "res=%d" : "width=%d",
             square ? side : side * 7 / 6);
    snprintf(down, sizeof down, "height=%d", side * 7 / 8);
    load.defines = defines;
    load.n_defines = square ? 1 : 2;
    must(imp_scene_load(ctx, path, &load, &t->scene));
    imp_film *film = picture(t, 4096, 99);
    must(imp_film_get_info(film, &info));
    const int w = (int)info.width, h = (int)info.height;
    t->pixels = (size_t)w * (size_t)h;
    t->weights = room(t->pixels, sizeof *t->weights);
    for (int i = 0; i < w * h; i++) {
        const bool in = 3 * (i % w) >= w && 3 * (i % w) < 2 * w && 3 * (i / w) >= 2 * h;
        t->weights[i] = in ? 1 : (float)job->aside;
    }
    must(imp_problem_create(t->scene, &t->p));
    for (int k = 0; k < 5 && job->active[k]; k++)
        must(imp_problem_activate(t->p, job->active[k]));
    target.pixels = imp_film_mean(film);
    target.weights = t->weights;
    target.width = w;
    target.height = h;
    target.channels = 3;
    must(imp_problem_add_target(t->p, &target));
    imp_film_destroy(film);
    t->n = imp_problem_n_variables(t->p);
    t->truth = room(t->n, sizeof *t->truth);
    t->x = room(t->n, sizeof *t->x);
    imp_problem_get_x(t->p, t->truth);
    for (int k = 0; k < 2; k++) {
        film = picture(t, FINE, 4711 + (uint64_t)k);
        t->fine[k] = room(3 * t->pixels, sizeof *t->fine[k]);
        memcpy(t->fine[k], imp_film_mean(film), 3 * t->pixels * sizeof *t->fine[k]);
        imp_film_destroy(film);
    }
}

static void task_free(struct task *t)
{
    imp_problem_destroy(t->p);
    imp_scene_destroy(t->scene);
    free(t->truth);
    free(t->x);
    free(t->weights);
    free(t->fine[0]);
    free(t->fine[1]);
}

/* Of the scene as it is. */
static double excess(const struct task *t)
{
    imp_film *now[2];
    double sum = 0;
    for (int k = 0; k < 2; k++) now[k] = picture(t, FINE, 4711 + (uint64_t)k);
    for (size_t i = 0; i < 3 * t->pixels; i++)
        sum += 0.5 * t->weights[i / 3] *
               ((double)imp_film_mean(now[0])[i] - (double)t->fine[0][i]) *
               ((double)imp_film_mean(now[1])[i] - (double)t->fine[1][i]);
    for (int k = 0; k < 2; k++) imp_film_destroy(now[k]);
    return sum;
}

/* Seconds of a fit from the start. */
static double fit(struct task *t, int kind, int n, uint64_t seed)
{
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    o.max_iterations = n;
    o.allocation = kind ? IMP_ALLOCATION_VARIANCE : IMP_ALLOCATION_EVEN;
    o.control_variate = t->job->variates;
    run.spp = spp;
    run.seed = seed;
    for (size_t k = 0; k < t->n; k++)
        t->x[k] = t->truth[k] < 1 ? t->job->start : 0.7 * t->truth[k];
    must(imp_problem_set_x(t->p, t->x));
    const double begun = processor();
    must(imp_fit(t->p, &o, &run, &r));
    return processor() - begun;
}

static void fits(const struct job *job)
{
    struct task t;
    task_make(job, &t);
    int n[2] = {iterations, iterations};
    const double even = fit(&t, 0, PILOT, 77), other = fit(&t, 1, PILOT, 77);
    n[1] = (int)lround(iterations * even / other);
    double loss[2] = {0, 0}, square[2] = {0, 0}, time[2] = {0, 0}, both = 0;
    double *error[2] = {room(t.n, sizeof **error), room(t.n, sizeof **error)};
    for (int seed = 0; seed < seeds; seed++) {
        double e[2];
        for (int kind = 0; kind < 2; kind++) {
            time[kind] += fit(&t, kind, n[kind], (uint64_t)seed);
            imp_problem_get_x(t.p, t.x);
            e[kind] = excess(&t);
            loss[kind] += e[kind] / seeds;
            square[kind] += e[kind] * e[kind] / seeds;
            for (size_t k = 0; k < t.n; k++)
                error[kind][k] += pow(t.x[k] - t.truth[k], 2) / seeds;
        }
        both += log(e[1] / e[0]) / seeds;
    }
    double logs = 0, sum[2] = {0, 0};
    for (size_t k = 0; k < t.n; k++) {
        logs += log(error[1][k] / error[0][k]) / (double)t.n;
        for (int kind = 0; kind < 2; kind++) sum[kind] += error[kind][k];
    }
    printf("%-28s %6zu numbers", job->name, t.n);
    for (int kind = 0; kind < 2; kind++)
        printf("   %s %.3g +- %.2g (%d its, %.2f s)", kind ? "allocated" : "even",
               loss[kind],
               sqrt(fmax(square[kind] - loss[kind] * loss[kind], 0) / fmax(seeds - 1, 1)),
               n[kind], time[kind] / seeds);
    /* Of many numbers the sum: some are hardly seen. */
    printf("   excess %.3f (of logs %.3f), squared error %.3f\n", loss[1] / loss[0],
           exp(both), t.n <= NUMBERS ? exp(logs) : sum[1] / sum[0]);
    fflush(stdout);
    free(error[0]);
    free(error[1]);
    task_free(&t);
}

int main(int argc, char **argv)
{
    struct imp_context_options options = IMP_CONTEXT_OPTIONS_INIT;
    const size_t n_jobs = sizeof jobs / sizeof *jobs;
    int one = -1;
    for (int k = 1; k + 1 < argc; k += 2) {
        if (strcmp(argv[k], "--iterations") == 0) iterations = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--spp") == 0) spp = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--seeds") == 0) seeds = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--side") == 0) side = atoi(argv[k + 1]);
        else if (strcmp(argv[k], "--job") == 0) one = atoi(argv[k + 1]);
        else {
            fprintf(stderr, "allocation: there is no option %s\n", argv[k]);
            return 2;
        }
    }
    options.threads = 1;
    if (imp_context_create(&options, &ctx) != IMP_OK) return 3;
    for (size_t k = 0; k < n_jobs; k++)
        if (one < 0 || (size_t)one == k) fits(&jobs[k]);
    imp_context_destroy(ctx);
    return 0;
}
