/* SPDX-License-Identifier: Apache-2.0
 *
 * importon gradient: the derivative of an objective with respect to the scene's
 * parameters, with standard errors. The objective is a loss against target pictures; or
 * the inner product of the picture with a given adjoint image; or, with neither, the mean
 * of the picture over its pixels and channels. */
#include "gradient_answer.h"
#include "shared/command.h"
#include "shared/overwrite.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "shared/proof.h"
#include "shared/ranks.h"
#include "shared/wanted.h"
#include "text/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *adjoint_path, *textures, *spectra;
static double until;
static int allocation;
static const char *const allocation_words[] = {"variance", "even", NULL};
static const struct arg_option options[] = {
    {ARG_TEXT | ARG_REPLAYS, 0, "adjoint", "FILE",
     "derivative of sum(FILE * picture), in place of a loss", &adjoint_path, 0, 0, NULL},
    {ARG_TEXT | ARG_ASIDE, 0, "textures", "DIR",
     "write gradients of textures there, as pictures", &textures, 0, 0, NULL},
    {ARG_TEXT | ARG_ASIDE, 0, "spectra", "DIR",
     "write gradients by spectra there, as plots over wavelengths", &spectra, 0, 0, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "until", "REL",
     "take samples, at most --spp, until each parameter's gradient is this close, in 95 "
     "of 100 cases",
     &until, 1e-6, 10, NULL},
    {ARG_CHOICE | ARG_REPLAYS, 0, "allocation", "HOW",
     "with --until: samples by tile: variance (default; of the gradient), or even",
     &allocation, 0, 0, allocation_words},
    {0}};

/* The adjoint image: from the file, or 1 / (number of pixels and channels) everywhere. */
static int adjoint_image(const struct imp_run *run, float **seed)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    imp_scene_get_info(cli.scene, &scene);
    const enum imp_status st = imp_scene_get_sensor(cli.scene, run->sensor, &sensor);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    const size_t n =
        (size_t)sensor.width * (size_t)sensor.height * (size_t)scene.channels;
    if (adjoint_path) {
        struct imp_target t = IMP_TARGET_INIT;
        const int rc = picture_target(adjoint_path, NULL, &t);
        if (rc) return rc;
        if (t.width == sensor.width && t.height == sensor.height &&
            t.channels == scene.channels) {
            *seed = (float *)t.pixels;
            t.pixels = NULL;
            picture_target_free(&t);
            return 0;
        }
        picture_target_free(&t);
        return cli_error(EXIT_USAGE,
                         "%s is %d x %d with %d channels; the sensor is %d x %d with %d",
                         adjoint_path, t.width, t.height, t.channels, sensor.width,
                         sensor.height, scene.channels);
    }
    *seed = cli_alloc(n, sizeof **seed);
    for (size_t i = 0; i < n; i++) (*seed)[i] = (float)(1 / (double)n);
    return 0;
}

/* One estimate of value, gradient and errors with the random numbers of `run`. */
static enum imp_status estimate(imp_problem *problem, const struct imp_run *run,
                                const float *seed, struct gradient_answer *r)
{
    if (!seed)
        return imp_problem_objective(problem, NULL, run, &r->value, r->grad, r->se);
    return imp_problem_functional(problem, seed, run, &r->value, r->grad, r->se);
}

/* Mean of two independent estimates of k and 1 rounds. */
static void merge(double *mean, double *se, double k, double value, double value_se)
{
    *mean = (k * *mean + value) / (k + 1);
    *se = hypot(k * *se, value_se) / (k + 1);
}

static void add_round(struct gradient_answer *sum, const struct gradient_answer *r,
                      size_t n)
{
    const double k = sum->rounds++;
    merge(&sum->value.value, &sum->value.se, k, r->value.value, r->value.se);
    for (size_t i = 0; i < n; i++)
        merge(&sum->grad[i], &sum->se[i], k, r->grad[i], r->se[i]);
    sum->value.bias_order = r->value.bias_order;
}

/* With --time: rounds of the run with other random numbers, as many as fit, each taken to
 * last as long as those before. Where the time is too short for the first, a small one
 * shows how many samples fit, or is the answer if no more do. The mean of unbiased
 * estimates is one, and rounds that were done survive an interrupt. */
static int estimate_for(imp_problem *problem, struct imp_run run, const float *seed,
                        struct gradient_answer *sum)
{
    enum { SMALL = 4 }; /* replicates need two */
    const size_t n = imp_problem_n_variables(problem);
    const double start = ranks_same(cli_now());
    struct gradient_answer r = *sum;
    enum imp_status st = IMP_OK;
    r.grad = cli_alloc(n, sizeof *r.grad);
    r.se = cli_alloc(n, sizeof *r.se);
    run.time_limit_s = 0;
    sum->rounds = 0;
    double first = start, now = start;
    if (sum->spp > SMALL) {
        run.spp = SMALL;
        run.seed ^= 0x632be59bd9b4e019u;
        st = estimate(problem, &run, seed, &r);
        run.seed ^= 0x632be59bd9b4e019u;
        now = first = ranks_same(cli_now());
        const double fit = SMALL * (cli.time_s / fmax(now - start, 1e-6) - 1);
        if (fit < 2 * SMALL) {
            sum->spp = SMALL;
            if (st == IMP_OK) add_round(sum, &r, n);
            first = start;
        } else if (fit < sum->spp) sum->spp = (int)fit;
    }
    run.spp = sum->spp;
    while (st == IMP_OK && !ranks_same(progress_interrupted()) &&
           (!sum->rounds || now - start + (now - first) / sum->rounds <= cli.time_s)) {
        st = estimate(problem, &run, seed, &r);
        if (st == IMP_OK) add_round(sum, &r, n);
        now = ranks_same(cli_now());
        run.seed += 0x9e3779b97f4a7c15u; /* far from the seeds people choose */
    }
    free(r.grad);
    free(r.se);
    if (st == IMP_CANCELLED && sum->rounds) st = IMP_OK;
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

static enum imp_status estimate_until(imp_problem *problem, struct imp_run run,
                                      const float *seed, struct gradient_answer *r)
{
    struct imp_until_options options = until_options(until, &run);
    if (allocation) options.allocation = IMP_ALLOCATION_EVEN;
    const enum imp_status st = imp_problem_until(problem, seed, &run, &options, &r->value,
                                                 r->grad, r->se, &r->end);
    if (r->end.spp > 0) r->spp = r->spp_taken = (int)r->end.spp;
    return st == IMP_CANCELLED && r->end.spp > 0 ? IMP_OK : st;
}

static int failed(enum imp_status st)
{
    if (st != IMP_CANCELLED) return cli_fail(st, cli.scene_path);
    return cli_error(cli_done(),
                     "interrupted before the gradient was there; with --time or "
                     "--until, what was done is kept");
}

static int compute(imp_problem *problem, const struct imp_run *run,
                   struct gradient_answer *r)
{
    float *seed = NULL;
    int rc = 0;
    const int loss = problem_options.targets.n > 0;
    r->functional = loss ? "loss" : adjoint_path ? "adjoint" : "mean";
    r->rounds = 1;
    r->spp = cli_spp(run);
    for (int t = loss ? 0 : -1; t < (int)problem_options.targets.n; t++) {
        int taken = 0;
        const enum imp_status st = imp_problem_get_spp(problem, t, run, &taken);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
        if (taken > r->spp_taken) r->spp_taken = taken;
    }
    if (!loss) rc = adjoint_image(run, &seed);
    if (!rc && until > 0) {
        const enum imp_status st = estimate_until(problem, *run, seed, r);
        if (st != IMP_OK) rc = failed(st);
    } else if (!rc && cli.time_s > 0) {
        rc = estimate_for(problem, *run, seed, r);
    } else if (!rc) {
        const enum imp_status st = estimate(problem, run, seed, r);
        if (st != IMP_OK) rc = failed(st);
    }
    free(seed);
    return rc;
}

static int run_gradient(int n, char **operand)
{
    imp_problem *problem = NULL;
    struct gradient_answer r = {.functional = "", .end = IMP_UNTIL_END_INIT};
    struct block *blocks = NULL;
    char **paths = NULL;
    size_t n_blocks = 0;
    (void)n;
    int rc = cli_load(operand[0]);
    if (!rc && until > 0) rc = until_refused();
    if (!rc && adjoint_path && problem_options.targets.n)
        rc = cli_error(EXIT_USAGE, "--adjoint and --target exclude each other");
    if (!rc) rc = problem_open(&problem);
    if (!rc && (rc = problem_censor(problem))) problem_close(problem);
    if (rc) return rc;
    const size_t n_x = imp_problem_n_variables(problem);
    struct imp_run run = cli_run();
    if (cli_spp(&run) == 1) run.spp = 2; /* replicates need two, which are reported */
    r.x = cli_alloc(n_x, sizeof *r.x);
    r.grad = cli_alloc(n_x, sizeof *r.grad);
    r.se = cli_alloc(n_x, sizeof *r.se);
    imp_problem_get_x(problem, r.x);
    blocks = problem_blocks(problem, &n_blocks);
    paths = cli_alloc(n_blocks, sizeof *paths);

    if (textures) rc = make_folder(textures);
    for (size_t k = 0; k < n_blocks && !rc && textures; k++)
        if (block_is_large(&blocks[k])) rc = block_writable(&blocks[k], textures, 1);
    if (spectra && !rc) rc = make_folder(spectra);
    for (size_t k = 0; k < n_blocks && !rc && spectra; k++)
        if (gradient_is_spectrum(&blocks[k])) {
            char *path = gradient_plot_path(spectra, &blocks[k]);
            rc = overwrite_check(path, OUTPUT_CURVE);
            free(path);
        }
    if (!rc) rc = manifest_begin(cli.out);
    if (!rc) rc = compute(problem, &run, &r);
    if (!rc) rc = manifest_pause();
    if (!rc) rc = manifest_numbers("value", (double[2]){r.value.value, r.value.se}, 2);
    if (!rc) rc = manifest_numbers("gradient", r.grad, n_x);
    if (!rc) rc = manifest_numbers("errors of the gradient", r.se, n_x);
    for (size_t k = 0; k < n_blocks && !rc && spectra; k++)
        if (gradient_is_spectrum(&blocks[k])) rc = gradient_plot(spectra, &blocks[k], &r);
    for (size_t k = 0; k < n_blocks && !rc && textures; k++)
        if (block_is_large(&blocks[k]))
            rc = block_write(&blocks[k], r.grad, r.se, textures, &paths[k]);
    if (!rc) {
        if (cli.json) gradient_json(&run, until, &r, blocks, n_blocks, paths);
        else gradient_print(&r, blocks, n_blocks, paths);
        if (until > 0) until_say("gradient", &r.end);
        for (size_t k = 0; k < n_blocks && !textures; k++)
            if (block_is_large(&blocks[k])) {
                cli_say("importon: --textures DIR writes the gradients of textures as "
                        "pictures");
                break;
            }
        rc = cli_done();
    }
    for (size_t k = 0; k < n_blocks; k++) free(paths[k]);
    free(paths);
    free(blocks);
    free(r.x);
    free(r.grad);
    free(r.se);
    problem_close(problem);
    return rc;
}

const struct command command_gradient = {
    {"gradient",
     "SCENE",
     "derivatives of a loss (or of the picture's mean), with errors",
     {options, options_targets, options_params, options_run, options_limits,
      options_guide, options_scene, options_file, options_general},
     1,
     1},
    run_gradient,
    1,
    1,
    REPLAYS_PARTS | REPLAYS_MANIFEST};
