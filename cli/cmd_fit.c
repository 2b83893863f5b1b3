/* SPDX-License-Identifier: Apache-2.0
 *
 * importon fit: pictures go in, the scene's numbers come out. Writes, into -o DIR, the
 * picture before and after, the target, the loss curve and the parameters with their 95 %
 * intervals. */
#include "cmd_picture.h"
#include "cmd_problem.h"
#include "command.h"
#include "fit_pictures.h"
#include "output.h"
#include "plot.h"
#include "progress.h"
#include "proof.h"
#include "ranks.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const optimizer_words[] = {"adam", "lm",    "lbfgs",
                                              "mma",  "slsqp", NULL};

static struct {
    int optimizer, iterations, no_intervals, resume, picture_spp;
    double learning_rate, tolerance;
    const char *checkpoint, *sheet;
} o;

static const struct arg_option options[] = {
    {ARG_CHOICE, 0, "optimizer", "NAME", "adam (default), lm, lbfgs, mma or slsqp",
     &o.optimizer, 0, 0, optimizer_words},
    {ARG_INT, 'n', "iterations", "N",
     "maximum number of iterations (default 200 for adam, else 30)", &o.iterations, 1,
     1e9, NULL},
    {ARG_NUMBER, 0, "lr", "RATE", "learning rate of adam (default 0.05)",
     &o.learning_rate, 1e-12, 1e6, NULL},
    {ARG_NUMBER, 0, "tolerance", "T",
     "stop when relative steps stay below (default 1e-4)", &o.tolerance, 1e-15, 1, NULL},
    {ARG_FLAG, 0, "no-intervals", NULL, "do not estimate 95 % intervals at the end",
     &o.no_intervals, 0, 0, NULL},
    {ARG_TEXT, 0, "checkpoint", "FILE",
     "save the state while the fit runs, and at Ctrl-C", &o.checkpoint, 0, 0, NULL},
    {ARG_FLAG, 0, "resume", NULL, "continue from the checkpoint, if it exists", &o.resume,
     0, 0, NULL},
    {ARG_INT, 0, "picture-spp", "N", "samples per pixel of the pictures written",
     &o.picture_spp, 1, 1e9, NULL},
    {ARG_TEXT, 0, "sheet", "FILE.png",
     "one PNG of before, target and recovered (with -o)", &o.sheet, 0, 0, NULL},
    {0}};

/* ---- Numbers ------------------------------------------------------------------- */

static int write_history(const struct imp_fit_result *r)
{
    char *csv = join_path(cli.out, "loss.csv"), *svg = join_path(cli.out, "loss.svg");
    struct output to;
    int rc = output_open(&to, csv, OUTPUT_TABLE);
    if (!rc) {
        fprintf(to.file, "iteration,loss,se\n");
        for (size_t i = 0; i < r->n_history; i++)
            fprintf(to.file, "%zu,%.9g,%.3g\n", i, r->history[i],
                    r->history_se ? r->history_se[i] : NAN);
        rc = output_close(&to, 0);
    }
    if (!rc)
        rc = plot_curve(svg, "Loss", "iteration", loss_word(), r->n_history, r->history,
                        r->history_se);
    free(csv);
    free(svg);
    return rc;
}

/* Number i of the fit that has just ended. */
static struct imp_fit_variable variable_at(const imp_problem *problem, size_t i)
{
    struct imp_fit_variable v = {0};
    (void)!imp_problem_fit_variable(problem, i, &v); /* it is there */
    return v;
}

static void put_variable(struct json *j, const imp_problem *problem, size_t i,
                         const struct block *b, const char *name)
{
    const struct imp_fit_variable all = variable_at(problem, i), *v = &all;
    json_object(j, NULL);
    json_text(j, "name", name);
    json_text(j, "unit", b->info.unit);
    json_number(j, "min", b->info.lo);
    json_number(j, "max", b->info.hi);
    json_number(j, "start", v->start);
    json_number(j, "value", v->value);
    json_number(j, "se", v->se);
    json_number(j, "lo95", v->lo95);
    json_number(j, "hi95", v->hi95);
    json_integer(j, "at_bound", v->at_bound);
    json_bool(j, "determined", v->determined);
    json_end_object(j);
}

/* Numbers of textures are in their pictures, not in lists. */
static void put_texture(struct json *j, const struct block *b, const char *path)
{
    block_json(j, b);
    json_integer(j, "count", (int64_t)b->n);
    json_text(j, "file", path);
    json_end_object(j);
}

/* What a report draws and a table does not print: the loss by iteration, and the
 * covariance of few numbers. */
static void put_curves(struct json *j, const struct imp_fit_result *r)
{
    enum { COVARIANCE_MAX = 64 };
    json_object(j, "history");
    json_numbers(j, "loss", r->n_history, r->history);
    if (r->history_se) json_numbers(j, "se", r->n_history, r->history_se);
    json_end_object(j);
    if (!r->covariance || r->n > COVARIANCE_MAX) return;
    json_array(j, "covariance");
    for (size_t i = 0; i < r->n; i++)
        json_numbers(j, NULL, r->n, r->covariance + i * r->n);
    json_end_array(j);
}

static void put_json(struct json *j, const imp_problem *problem,
                     const struct imp_fit_result *r, const struct block *blocks,
                     size_t n_blocks, char **paths)
{
    json_text(j, "optimizer", optimizer_words[o.optimizer]);
    json_text(j, "loss", loss_word());
    json_seed(j, "seed", cli.seed);
    const struct imp_run run = cli_run();
    json_integer(j, "spp", problem_spp(&run));
    json_integer(j, "spp_taken", r->spp);
    json_integer(j, "iterations", r->iterations);
    json_number(j, "value", r->objective.value);
    json_number(j, "se", r->objective.se);
    json_number(j, "residual", r->residual);
    json_number(j, "residual_hi", r->residual_hi);
    json_number(j, "chi2_per_freedom", r->chi2);
    json_number(j, "chi2_se", r->chi2_se);
    json_number(j, "shift", r->shift);
    json_number(j, "condition", r->condition);
    json_text(j, "reason", r->reason);
    json_text(j, "warning", r->warning);
    json_bool(j, "complete", !progress_interrupted());
    json_array(j, "params");
    for (size_t k = 0; k < n_blocks; k++) {
        const struct block *b = &blocks[k];
        char name[512];
        if (block_is_large(b)) {
            put_texture(j, b, paths[k]);
            continue;
        }
        for (size_t i = 0; i < b->n; i++)
            put_variable(j, problem, b->first + i, b,
                         cli_number_name(&b->info, i, name, sizeof name));
    }
    json_end_array(j);
    put_curves(j, r);
}

static int write_json(const imp_problem *problem, const struct imp_fit_result *r,
                      const struct block *blocks, size_t n_blocks, char **paths)
{
    char *path = join_path(cli.out, "parameters.json");
    struct output to;
    int rc = output_open(&to, path, OUTPUT_JSON);
    if (!rc) {
        struct json j = {to.file, 0};
        json_object(&j, NULL);
        json_text(&j, "importon", imp_version());
        json_text(&j, "command", "fit");
        put_json(&j, problem, r, blocks, n_blocks, paths);
        cli_json_end(&j);
        rc = output_close(&to, 0);
    }
    free(path);
    return rc;
}

/* What is left, or that it is below what so many samples tell. */
static void print_residual(const struct imp_fit_result *r)
{
    if (!isfinite(r->residual)) return;
    if (!(r->residual_hi > 0)) printf("residual within its noise");
    else if (r->residual_hi > 1.5 * r->residual)
        printf("residual below %.2g %% of the targets", 100 * r->residual_hi);
    else printf("residual %.3g %% of the targets", 100 * r->residual);
    if (isfinite(r->chi2) && (r->chi2_se < 1 || r->chi2 > 3 * r->chi2_se))
        printf("; chi-square per degree of freedom %.*f +- %.1g", r->chi2 < 100, r->chi2,
               r->chi2_se);
    else if (isfinite(r->chi2))
        printf("; chi-square needs more --spp: our noise is above the targets'");
    printf("\n");
}

static void print_table(const imp_problem *problem, const struct imp_fit_result *r,
                        const struct block *blocks, size_t n_blocks, char **paths)
{
    int width = 9;
    for (size_t k = 0; k < n_blocks; k++)
        if ((int)strlen(blocks[k].info.name) + 3 > width)
            width = (int)strlen(blocks[k].info.name) + 3;
    printf("%-*s  %-11s %-11s %-22s %s\n", width, "parameter", "start", "value",
           "95 % interval", "unit");
    for (size_t k = 0; k < n_blocks; k++) {
        const struct block *b = &blocks[k];
        char name[512];
        if (block_is_large(b)) {
            printf("%-*s  %zu numbers%s%s\n", width, b->info.name, b->n,
                   paths[k] ? " -> " : "", paths[k] ? paths[k] : "");
            continue;
        }
        for (size_t i = 0; i < b->n; i++) {
            const struct imp_fit_variable all = variable_at(problem, b->first + i),
                                          *v = &all;
            printf("%-*s  %-11.6g %-11.6g ", width,
                   cli_number_row(&b->info, i, name, sizeof name), v->start, v->value);
            char interval[64] = "-";
            if (isfinite(v->lo95) && isfinite(v->hi95))
                snprintf(interval, sizeof interval, "[%.6g, %.6g]", v->lo95, v->hi95);
            else if (!o.no_intervals && !v->determined)
                snprintf(interval, sizeof interval, "not determined");
            printf("%-22s %s", interval, b->info.unit);
            printf("%s\n", v->at_bound < 0   ? "  at its lower bound"
                           : v->at_bound > 0 ? "  at its upper bound"
                                             : "");
        }
    }
    printf("\n%s %.6g +- %.2g after %d iterations: %s\n", loss_word(), r->objective.value,
           r->objective.se, r->iterations, r->reason ? r->reason : "");
    print_residual(r);
}

/* Recovered textures, as pictures. */
static int write_textures(const imp_problem *problem, const struct block *blocks,
                          size_t n_blocks, char **paths)
{
    int rc = 0;
    double *x = cli_alloc(imp_problem_n(problem), sizeof *x);
    imp_problem_get_x(problem, x);
    for (size_t k = 0; k < n_blocks && !rc; k++)
        if (block_is_large(&blocks[k]))
            rc = block_write(&blocks[k], x, NULL, cli.out, &paths[k]);
    free(x);
    return rc;
}

/* What was recovered as --set @FILE takes it, for the next fit, or a render. */
static int write_set(const imp_problem *problem, const struct block *blocks,
                     size_t n_blocks)
{
    char *path = join_path(cli.out, "recovered.txt");
    struct output to;
    int rc = output_open(&to, path, OUTPUT_SETTINGS);
    for (size_t k = 0; !rc && k < n_blocks; k++) {
        const struct block *b = &blocks[k];
        if (block_is_large(b)) continue;
        fprintf(to.file, "%s=", b->info.name);
        for (size_t i = 0; i < b->n; i++)
            fprintf(to.file, "%s%.17g", i ? "," : "",
                    variable_at(problem, b->first + i).value);
        fprintf(to.file, "\n");
    }
    rc = output_close(&to, rc);
    free(path);
    return rc;
}

static int answer(imp_problem *problem, const struct imp_fit_result *r,
                  const struct block *blocks, size_t n_blocks)
{
    char **paths = cli_alloc(n_blocks, sizeof *paths);
    int rc = 0;
    if (cli.out) {
        rc = write_textures(problem, blocks, n_blocks, paths);
        if (!rc) rc = write_history(r);
        if (!rc) rc = write_json(problem, r, blocks, n_blocks, paths);
        if (!rc) rc = write_set(problem, blocks, n_blocks);
    }
    if (cli.json) {
        struct json j = cli_json();
        put_json(&j, problem, r, blocks, n_blocks, paths);
        cli_json_end(&j);
    } else {
        print_table(problem, r, blocks, n_blocks, paths);
    }
    if (r->warning) cli_say("importon: warning: %s", r->warning);
    for (size_t k = 0; k < n_blocks; k++) free(paths[k]);
    free(paths);
    return rc;
}

/* Besides pictures. */
static const struct {
    const char *name;
    enum output_kind kind;
} outputs[] = {{"loss.csv", OUTPUT_TABLE},
               {"loss.svg", OUTPUT_CURVE},
               {"parameters.json", OUTPUT_JSON},
               {"recovered.txt", OUTPUT_SETTINGS}};

/* May everything be written? A checkpoint is begun over, or gone on from, when that is
 * said. */
static int writable(const struct block *blocks, size_t n_blocks)
{
    int rc = checkpoint_writable(o.checkpoint, o.resume);
    if (rc || !cli.out) return rc;
    rc = make_folder(cli.out);
    for (size_t k = 0; k < sizeof outputs / sizeof *outputs && !rc; k++)
        rc = overwrite_check_in(cli.out, outputs[k].name, outputs[k].kind);
    if (!rc) rc = fit_pictures_writable();
    for (size_t k = 0; k < n_blocks && !rc; k++)
        if (block_is_large(&blocks[k])) rc = block_writable(&blocks[k], cli.out);
    if (!rc && o.sheet) rc = picture_writable(o.sheet, 0);
    return rc;
}

/* The numbers that were found, for the manifest. */
static int note_results(const imp_problem *problem, const struct imp_fit_result *r)
{
    const size_t n = imp_problem_n(problem);
    if (!cli.manifest) return 0;
    double *x = cli_alloc(3 * n, sizeof *x);
    for (size_t i = 0; i < n; i++) {
        const struct imp_fit_variable v = variable_at(problem, i);
        x[i] = v.value, x[n + i] = v.lo95, x[2 * n + i] = v.hi95;
    }
    int rc = manifest_numbers("parameters", x, 3 * n);
    if (!rc) rc = manifest_numbers("losses", r->history, r->n_history);
    free(x);
    return rc;
}

static int run_fit(int n, char **operand)
{
    static const enum imp_optimizer optimizers[] = {IMP_ADAM, IMP_LM, IMP_LBFGS, IMP_MMA,
                                                    IMP_SLSQP};
    struct imp_fit_options fit = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *result = NULL;
    imp_problem *problem = NULL;
    struct block *blocks;
    size_t n_blocks;
    (void)n;
    int rc = cli_load(operand[0]);
    if (!rc && !problem_options.targets.n)
        rc = cli_error(EXIT_USAGE, "fit: --target FILE is needed");
    if (!rc && o.sheet && !cli.out)
        rc = cli_error(EXIT_USAGE, "fit: --sheet needs -o DIR, where the pictures go");
    if (!rc && o.resume && !o.checkpoint)
        rc = cli_error(EXIT_USAGE, "fit: --resume needs --checkpoint FILE");
    if (!rc) rc = problem_open(&problem);
    if (rc) return rc;

    fit.optimizer = optimizers[o.optimizer];
    fit.max_iterations = o.iterations;
    fit.learning_rate = o.learning_rate;
    fit.tolerance = o.tolerance;
    fit.intervals = !o.no_intervals;
    fit.checkpoint = o.checkpoint;
    fit.resume = o.resume;
    blocks = problem_blocks(problem, &n_blocks);
    rc = writable(blocks, n_blocks);
    if (!rc && cli.out) rc = fit_targets_write();
    if (!rc && cli.out) rc = fit_pictures_write("before", o.picture_spp);
    if (!rc) {
        const struct imp_run run = cli_run();
        rc = manifest_begin();
        const enum imp_status st = rc ? IMP_OK : imp_fit(problem, &fit, &run, &result);
        /* a checkpoint that cannot be written names itself */
        if (cli_failed(st)) rc = cli_fail(st, st == IMP_E_IO ? NULL : cli.scene_path);
        if (!rc) rc = manifest_pause();
        if (!rc && result) rc = note_results(problem, result);
    }
    if (!rc && result && !cli.verifies) rc = answer(problem, result, blocks, n_blocks);
    if (!rc && result && cli.out) {
        progress_resume(); /* after Ctrl-C the state reached is still written */
        rc = fit_pictures_write("recovered", o.picture_spp);
        if (!rc && o.sheet) rc = fit_sheet_write(o.sheet);
    }
    for (size_t k = 0; k < sizeof outputs / sizeof *outputs && !rc && cli.out; k++) {
        char *path = join_path(cli.out, outputs[k].name);
        rc = manifest_output(path);
        free(path);
    }
    free(blocks);
    problem_close(problem);
    const char *ended;
    if (!rc || ranks_ended(&ended)) checkpoint_hint(o.checkpoint);
    return rc ? rc : cli_done();
}

const struct command command_fit = {
    {"fit",
     "SCENE --target FILE",
     "recover parameters from target pictures",
     {options, options_targets, options_params, options_run, options_guide, options_scene,
      options_folder, options_general},
     1,
     1},
    run_fit,
    0,
    NULL,
    1};
