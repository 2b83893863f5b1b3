/* SPDX-License-Identifier: Apache-2.0
 *
 * importon bench: how long the user's own scene takes: loading, rendering, loss with
 * gradient, and how that scales with threads. Ratios are taken inside one run. */
#include "shared/command.h"
#include "shared/picture_files.h"
#include "text/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int repeats = 3;
static const struct arg_option options[] = {
    {ARG_INT, 0, "repeat", "N", "the best of N times is reported (default 3)", &repeats,
     1, 1000, NULL},
    {0}};

struct times {
    int threads;
    double load, render, gradient;
    double samples; /* of one picture */
    size_t n;       /* values with a gradient */
};

/* Loss against the scene's own picture, of other random numbers, with the gradient of
 * everything. */
static int time_gradient(const struct imp_run *run, imp_film *film, struct times *t)
{
    struct imp_film_info info = {.size = sizeof info};
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_estimate loss;
    imp_problem *problem = NULL;
    double *grad = NULL;
    enum imp_status st = imp_problem_create(cli.scene, &problem);
    if (st == IMP_OK) st = imp_problem_activate(problem, "*");
    imp_film_get_info(film, &info);
    target.sensor = run->sensor;
    target.width = info.width;
    target.height = info.height;
    target.channels = info.channels;
    target.pixels = imp_film_mean(film);
    if (st == IMP_OK) st = imp_problem_add_target(problem, &target);
    if (st == IMP_OK) {
        t->n = imp_problem_n_variables(problem);
        grad = cli_alloc(t->n, sizeof *grad);
    }
    t->gradient = INFINITY;
    for (int i = 0; i < repeats && st == IMP_OK; i++) {
        struct imp_run again = *run;
        again.seed += 1;
        const double start = cli_now();
        st = imp_problem_objective(problem, NULL, &again, &loss, grad, NULL);
        t->gradient = fmin(t->gradient, cli_now() - start);
    }
    imp_problem_destroy(problem);
    free(grad);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

static int measure(const char *path, int threads, struct times *t)
{
    imp_film *film = NULL;
    t->threads = cli.threads = threads;
    double start = cli_now();
    int rc = cli_load(path);
    t->load = cli_now() - start;
    if (rc) return rc;
    const struct imp_run run = cli_run();
    t->render = INFINITY;
    for (int i = 0; i < repeats; i++) {
        imp_film_destroy(film);
        film = NULL;
        start = cli_now();
        const enum imp_status st = imp_render(cli.scene, &run, &film);
        t->render = fmin(t->render, cli_now() - start);
        if (st != IMP_OK) {
            imp_film_destroy(film);
            return cli_fail(st, cli.scene_path);
        }
    }
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    t->samples = (double)info.width * info.height * (double)info.spp;
    rc = time_gradient(&run, film, t);
    imp_film_destroy(film);
    return rc;
}

static void print(const struct times *t, size_t n)
{
    if (cli.json) {
        struct json j = cli_json();
        json_text(&j, "scene", cli.scene_path);
        json_integer(&j, "parameters", (int64_t)t[0].n);
        json_number(&j, "samples", t[0].samples);
        json_array(&j, "runs");
        for (size_t i = 0; i < n; i++) {
            json_object(&j, NULL);
            json_integer(&j, "threads", t[i].threads);
            json_number(&j, "load_s", t[i].load);
            json_number(&j, "render_s", t[i].render);
            json_number(&j, "loss_gradient_s", t[i].gradient);
            json_number(&j, "samples_per_s", t[i].samples / t[i].render);
            json_number(&j, "gradient_over_render", t[i].gradient / t[i].render);
            json_number(&j, "render_speedup", t[0].render / t[i].render);
            json_number(&j, "gradient_speedup", t[0].gradient / t[i].gradient);
            json_end_object(&j);
        }
        json_end_array(&j);
        cli_json_end(&j);
        return;
    }
    printf("%s: %.4g samples, %zu number%s with a gradient\n", cli.scene_path,
           t[0].samples, t[0].n, plural((long long)t[0].n));
    printf("%-8s %-9s %-10s %-14s %-14s %-14s %s\n", "threads", "load s", "render s",
           "Msamples/s", "loss+grad s", "grad/render", "speed-up render, gradient");
    for (size_t i = 0; i < n; i++)
        printf("%-8d %-9.3g %-10.4g %-14.4g %-14.4g %-14.3g %.3g, %.3g\n", t[i].threads,
               t[i].load, t[i].render, 1e-6 * t[i].samples / t[i].render, t[i].gradient,
               t[i].gradient / t[i].render, t[0].render / t[i].render,
               t[0].gradient / t[i].gradient);
}

/* Context and scene only: the options stay for the next round. */
static void close_scene(void)
{
    imp_scene_destroy(cli.scene);
    imp_context_destroy(cli.context);
    cli.scene = NULL;
    cli.context = NULL;
}

static int run_bench(int n, char **operand)
{
    enum { ROUNDS = 16 };
    struct times times[ROUNDS] = {{0}};
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    const int most = cli.threads > 0 ? cli.threads : cores > 0 ? (int)cores : 1;
    size_t rounds = 0;
    int rc = 0;
    (void)n;
    if (!strcmp(operand[0], "-"))
        return cli_error(EXIT_USAGE,
                         "bench reads the scene more than once: not from stdin");
    /* 1, 2, 4, ... and all. */
    for (int threads = 1; !rc && rounds < ROUNDS && threads <= most;) {
        if (rounds) close_scene();
        rc = measure(operand[0], threads, &times[rounds++]);
        if (threads == most || progress_interrupted()) break;
        threads = 2 * threads > most ? most : 2 * threads;
    }
    if (!rc) print(times, rounds);
    return rc ? rc : cli_done();
}

const struct command command_bench = {
    {"bench",
     "SCENE",
     "measure the time for loading, rendering and gradients",
     {options, options_run, options_limits, options_scene, options_file, options_general},
     1,
     1},
    run_bench,
    1,
    0,
    REPLAYS_NEVER};
