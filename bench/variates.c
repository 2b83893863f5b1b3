/* SPDX-License-Identifier: Apache-2.0
 *
 * Control variates of fits by Adam (docs/fitting.md): the variance of gradients along a
 * search, without them and with them, and their processor time; then what fits of a texture
 * end at, by several ways of cooling and averaging.
 *
 *     variates chains [--spp N] [--repeats N] [SCENE GLOB]      # of some shipped scenes
 *     variates fits [--width N] [--seeds N] [--iterations N] [--levels N]   # the floor of textured.xml
 *     variates answers [--spp N] [--seeds N] [--iterations N]   # fits of few numbers
 *
 * Variances are those of chains that follow one and the same path of parameters, so that
 * they differ in their walks alone. */
#include "inverse/estimate/replicates.h"
#include "inverse/gradient/objective_gradient.h"
#include "inverse/gradient/variate.h"
#include "math/rng.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static int spp = 8, repeats = 12, seeds = 5, iterations = 150, levels = 1, width = 80;
static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "variates: %s\n", imp_last_error(ctx));
    exit(3);
}
static void *room(size_t n)
{
    void *p = calloc(n + 1, sizeof(double));
    if (!p) exit(3);
    return p;
}
static double cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- A problem ------------------------------------------------------------------- */

/* The scene's own numbers make the target; where the search starts is another matter. */
struct task {
    imp_scene *scene;
    imp_problem *problem;
    size_t n;
    int width, height, channels;
    double *truth, *start, *lo, *hi;
    float *target;
};

static float *picture(imp_scene *scene, int samples, uint64_t seed, int *width,
                      int *height, int *channels)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    imp_film *film;
    run.spp = samples;
    run.seed = seed;
    must(imp_render(scene, &run, &film));
    must(imp_film_get_info(film, &info));
    *width = info.width, *height = info.height, *channels = info.channels;
    const size_t n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
    float *out = malloc(n * sizeof *out);
    if (!out) exit(3);
    memcpy(out, imp_film_mean(film), n * sizeof *out);
    imp_film_destroy(film);
    return out;
}

static void task_make(const char *file, const char *glob, const char *const *defines,
                      int n_defines, int target_spp, struct task *t)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    char path[1024];
    o.defines = defines;
    o.n_defines = n_defines;
    snprintf(path, sizeof path, "%s%s%s", *file == '/' ? "" : IMP_SCENES,
             *file == '/' ? "" : "/", file);
    must(imp_scene_load(ctx, path, &o, &t->scene));
    must(imp_problem_create(t->scene, &t->problem));
    must(imp_problem_activate(t->problem, glob));
    t->n = imp_problem_n_variables(t->problem);
    t->truth = room(t->n), t->start = room(t->n);
    t->lo = room(t->n), t->hi = room(t->n);
    imp_problem_get_x(t->problem, t->truth);
    t->target = picture(t->scene, target_spp, 999, &t->width, &t->height, &t->channels);
    target.pixels = t->target;
    target.width = t->width;
    target.height = t->height;
    target.channels = t->channels;
    must(imp_problem_add_target(t->problem, &target));
    /* Many numbers start at 1/2, few ones 30 % off, every second one above. */
    for (size_t k = 0; k < t->n; k++) {
        const struct imp__block *b = imp__problem_block(t->problem, k);
        t->lo[k] = b->lo, t->hi[k] = b->hi;
        t->start[k] = t->n > 64 ? 0.5 : t->truth[k] * (k % 2 ? 1.3 : 0.7);
        t->start[k] = fmin(fmax(t->start[k], b->lo), b->hi);
    }
}

static void task_free(struct task *t)
{
    imp_problem_destroy(t->problem);
    imp_scene_destroy(t->scene);
    free(t->truth);
    free(t->start);
    free(t->lo);
    free(t->hi);
    free(t->target);
}

static void gradient(struct task *t, const double *x, uint64_t seed, int samples,
                     struct imp__variate *v, double *g)
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = samples;
    run.seed = seed;
    t->problem->variate = v;
    must(imp__problem_objective(t->problem, x, &run, true, NULL, g, NULL));
    t->problem->variate = NULL;
}
static uint64_t seed_of(int chain, int i)
{
    return imp__mix64(((uint64_t)chain << 32) + (uint64_t)i + 1);
}

/* ---- Adam, by the book ------------------------------------------------------------ */

enum rule { FIT, BOTH, COOLED, AVERAGED, CONSTANT };
static const char *const rule_names[] = {"importon fit", "cooled, and the mean",
                                         "rate/(1 + t/20)", "mean of the last half",
                                         "constant rate"};

/* n iterations from the start; path [n][n_numbers] may be NULL. */
static void adam(struct task *t, enum rule rule, int n, int samples, int chain,
                 bool variates, double *x, double *path)
{
    double *g = room(t->n), *mean = room(t->n), *state = room(IMP_OPTIMIZER_STATE(t->n));
    struct imp_optimizer_rule by = IMP_OPTIMIZER_RULE_INIT;
    struct imp__variate *v = NULL;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = samples;
    if (variates) must(imp__variate_create(t->problem, &run, &v));
    memcpy(x, t->start, t->n * sizeof *x);
    const bool averaged = rule == AVERAGED || rule == BOTH;
    for (int i = 0; i < n; i++) {
        if (path) memcpy(path + (size_t)i * t->n, x, t->n * sizeof *x);
        gradient(t, x, seed_of(chain, i), samples, v, g);
        by.learning_rate = rule == COOLED || rule == BOTH ? 0.05 / (1 + i / 20.) : 0.05;
        must(imp_optimizer_step(&by, t->n, g, t->lo, t->hi, state, x));
        for (size_t k = 0; averaged && 2 * i >= n && k < t->n; k++)
            mean[k] += (x[k] - mean[k]) / (i - (n + 1) / 2 + 1);
    }
    if (averaged) memcpy(x, mean, t->n * sizeof *x);
    imp__variate_destroy(v);
    free(g);
    free(mean);
    free(state);
}

static double fit(struct task *t, int samples, int chain, bool variates, double *x)
{
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *result;
    o.max_iterations = iterations;
    o.levels = levels;
    o.control_variate = variates ? IMP_VARIATES_ON : IMP_VARIATES_OFF;
    run.spp = samples;
    run.seed = (uint64_t)chain;
    must(imp_problem_set_x(t->problem, t->start));
    must(imp_fit(t->problem, &o, &run, &result));
    imp_problem_get_x(t->problem, x);
    return result->iterations;
}

/* ---- Chains along one path --------------------------------------------------------- */

static const int shown[] = {1, 3, 5, 8, 10, 12, 20, 30, 40, 59};

static void chains(const char *file, const char *glob, const char *const *defines,
                   int n_defines)
{
    struct task t;
    const int n = 60;
    task_make(file, glob, defines, n_defines, 512, &t);
    double *path = room((size_t)n * t.n), *x = room(t.n);
    if (t.n > 64) {
        adam(&t, CONSTANT, n, spp, 0, true, x, path);
    } else { /* the path of a fit, which turns its directions */
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        const struct imp_fit_result *result;
        run.spp = spp;
        o.max_iterations = n;
        must(imp_problem_set_x(t.problem, t.start));
        must(imp_fit(t.problem, &o, &run, &result));
        for (int i = 0; i < n; i++)
            memcpy(path + (size_t)i * t.n,
                   result->history_x +
                       (size_t)imp_min(i, (int)result->n_history - 1) * t.n,
                   t.n * sizeof *path);
    }
    double variance[2][60] = {{0}}, time[2] = {0, 0}, w[60] = {0};
    double *g = room(t.n), *sum = room(4 * (size_t)n * t.n);
    for (int chain = 1; chain <= repeats; chain++) {
        struct imp__variate *v;
        struct imp_run run = IMP_RUN_INIT;
        run.spp = spp;
        must(imp__variate_create(t.problem, &run, &v));
        for (int i = 0; i < n; i++)
            for (int with = 0; with < 2; with++) {
                const double begun = cpu();
                gradient(&t, path + (size_t)i * t.n, seed_of(chain, i), spp,
                         with ? v : NULL, g);
                if (i > 0) time[with] += cpu() - begun;
                if (with) w[i] = v->views[0].half[0].w;
                double *to = sum + 2 * ((size_t)(with * n + i) * t.n);
                for (size_t k = 0; k < t.n; k++) {
                    to[2 * k] += g[k];
                    to[2 * k + 1] += g[k] * g[k];
                }
            }
        imp__variate_destroy(v);
    }
    /* Of few numbers, whose units differ, the geometric mean. */
    double gain[60];
    for (int i = 0; i < n; i++) {
        double log_gain = 0, seen = 0;
        for (size_t k = 0; k < t.n; k++) {
            double one[2];
            for (int with = 0; with < 2; with++) {
                const double *of = sum + 2 * ((size_t)(with * n + i) * t.n + k);
                one[with] = (of[1] - of[0] * of[0] / repeats) / (repeats - 1);
                variance[with][i] += one[with];
            }
            if (one[0] > 0 && one[1] > 0) log_gain += log(one[0] / one[1]), seen++;
        }
        gain[i] =
            t.n > 64 ? variance[0][i] / variance[1][i] : exp(log_gain / fmax(seen, 1));
    }
    printf("%-14s %-22s %6zu numbers, cpu %.3f; iteration: w, variance without/with\n   ",
           file, glob, t.n, time[1] / time[0]);
    for (size_t k = 0; k < imp_count(shown); k++)
        printf(" %d: %.3f %.3g%s", shown[k], w[shown[k]], gain[shown[k]],
               k + 1 < imp_count(shown) ? "," : "\n");
    fflush(stdout);
    free(path);
    free(x);
    free(g);
    free(sum);
    task_free(&t);
}

/* ---- Fits -------------------------------------------------------------------------- */

/* 1/2 sum of squared differences to the picture of the true numbers, without bias, from two
 * pairs of pictures; the two of a pair have the same walks. */
static double excess(struct task *t, const double *x, float *const truth[2])
{
    double sum = 0;
    float *is[2];
    int w, h, c;
    must(imp_problem_set_x(t->problem, x));
    for (int k = 0; k < 2; k++)
        is[k] = picture(t->scene, 128, 4711 + (uint64_t)k, &w, &h, &c);
    const size_t n = (size_t)w * (size_t)h * (size_t)c;
    for (size_t i = 0; i < n; i++)
        sum += 0.5 * ((double)is[0][i] - truth[0][i]) * ((double)is[1][i] - truth[1][i]);
    free(is[0]);
    free(is[1]);
    return sum;
}

static void fits(void)
{
    char across[24], down[24];
    const char *const defines[] = {across, down};
    snprintf(across, sizeof across, "width=%d", width);
    snprintf(down, sizeof down, "height=%d", width * 3 / 4);
    static const struct {
        int spp;
        bool variates;
    } column[] = {{4, false}, {16, false}, {4, true}, {8, true}};
    struct task t;
    float *truth[2];
    int w, h, c;
    task_make("textured.xml", "floor.*", defines, 2, 4096, &t);
    must(imp_problem_set_x(t.problem, t.truth));
    for (int k = 0; k < 2; k++)
        truth[k] = picture(t.scene, 128, 4711 + (uint64_t)k, &w, &h, &c);
    double *x = room(t.n);
    printf(
        "floor of textured.xml, %d x %d, %d iterations, %d seeds: excess loss (rms error "
        "of a texel; cpu s)\n%-24s",
        width, width * 3 / 4, iterations, seeds, "");
    for (size_t k = 0; k < imp_count(column); k++)
        printf("  %2d samples%s        ", column[k].spp,
               column[k].variates ? ", with" : "      ");
    printf("\n");
    for (int rule = 0; rule <= CONSTANT; rule++) {
        printf("%-24s", rule_names[rule]);
        for (size_t k = 0; k < imp_count(column); k++) {
            double loss = 0, square = 0, error = 0, time = 0;
            for (int s = 1; s <= seeds; s++) {
                const double begun = cpu();
                if (rule == FIT) (void)fit(&t, column[k].spp, s, column[k].variates, x);
                else
                    adam(&t, (enum rule)rule, iterations, column[k].spp, s,
                         column[k].variates, x, NULL);
                time += (cpu() - begun) / seeds;
                const double e = excess(&t, x, truth);
                loss += e / seeds;
                square += e * e / seeds;
                for (size_t i = 0; i < t.n; i++)
                    error += imp__sqr(x[i] - t.truth[i]) / (double)t.n / seeds;
            }
            printf("  %6.3f +- %.3f (%.3f; %4.1f)", loss,
                   sqrt(fmax(square - loss * loss, 0) / imp_max(seeds - 1, 1)),
                   sqrt(error), time);
            fflush(stdout);
        }
        printf("\n");
    }
    free(x);
    free(truth[0]);
    free(truth[1]);
    task_free(&t);
}

/* Few numbers: how far answers are from the truth, without intervals and their last step. */
static void answers(const char *file, const char *glob, const char *const *defines,
                    int n_defines)
{
    struct task t;
    task_make(file, glob, defines, n_defines, 16384, &t);
    double *x = room(t.n);
    printf("%-14s %zu numbers, %d samples, %d seeds: rms relative error (cpu s)", file,
           t.n, spp, seeds);
    for (int with = 0; with < 2; with++) {
        double error = 0, time = 0;
        for (int s = 1; s <= seeds; s++) {
            const double begun = cpu();
            (void)fit(&t, spp, s, with, x);
            time += (cpu() - begun) / seeds;
            for (size_t k = 0; k < t.n; k++)
                if (t.truth[k] != 0)
                    error += imp__sqr(x[k] / t.truth[k] - 1) / (double)t.n / seeds;
        }
        printf("%s %.4f (%.1f)", with ? ", with" : "", sqrt(error), time);
    }
    printf("\n");
    free(x);
    task_free(&t);
}

int main(int argc, char **argv)
{
    static const char *const small[] = {"width=80", "height=60"}, *const room32[] = {
                                                                      "res=32"};
    const char *what = argc > 1 ? argv[1] : "";
    const char *rest[2] = {0};
    int n_rest = 0;
    for (int k = 2; k < argc; k++) {
        const bool more = k + 1 < argc;
        if (more && strcmp(argv[k], "--spp") == 0) spp = atoi(argv[++k]);
        else if (more && strcmp(argv[k], "--repeats") == 0) repeats = atoi(argv[++k]);
        else if (more && strcmp(argv[k], "--seeds") == 0) seeds = atoi(argv[++k]);
        else if (more && strcmp(argv[k], "--iterations") == 0)
            iterations = atoi(argv[++k]);
        else if (more && strcmp(argv[k], "--width") == 0) width = atoi(argv[++k]);
        else if (more && strcmp(argv[k], "--levels") == 0) levels = atoi(argv[++k]);
        else if (*argv[k] != '-' && n_rest < 2) rest[n_rest++] = argv[k];
        else what = "";
    }
    const bool of_chains = strcmp(what, "chains") == 0;
    const bool of_answers = strcmp(what, "answers") == 0;
    if ((!of_chains && !of_answers && strcmp(what, "fits") != 0) || n_rest == 1 ||
        spp < 4 || repeats < 2 || seeds < 1 || iterations < 2 || width < 4) {
        fprintf(
            stderr,
            "usage: variates chains [--spp N] [--repeats N] [SCENE GLOB]\n"
            "       variates fits [--width N] [--seeds N] [--iterations N] [--levels N]\n"
            "       variates answers [--spp N] [--seeds N] [--iterations N]\n");
        return 2;
    }
    const struct imp_context_options o = {.size = sizeof o, .threads = 1};
    if (imp_context_create(&o, &ctx) != IMP_OK) return 3;
    if (of_answers) {
        answers("cornell.xml", "*", room32, 1);
        answers("stam.xml", "*", NULL, 0);
    } else if (!of_chains) {
        fits();
    } else if (n_rest == 2) {
        chains(rest[0], rest[1], strcmp(rest[0], "textured.xml") ? NULL : small,
               strcmp(rest[0], "textured.xml") ? 0 : 2);
    } else {
        chains("textured.xml", "floor.*", small, 2);
        chains("textured.xml", "*", small, 2);
        chains("cornell.xml", "*", room32, 1);
        chains("stam.xml", "*", room32, 1);
        chains("lamps.xml", "*", room32, 1);
        chains("skin.xml", "*", room32, 1);
        chains("wax.xml", "*", room32, 1);
        chains("fog.xml", "*albedo*", room32, 1);
    }
    imp_context_destroy(ctx);
    return 0;
}
