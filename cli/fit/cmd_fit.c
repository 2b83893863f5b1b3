/* SPDX-License-Identifier: Apache-2.0
 *
 * importon fit: the scene's parameters from pictures. Writes, into -o DIR, the picture
 * before and after, the target, the loss curve and the parameters with their 95 %
 * intervals. */
#include "fit_answer.h"
#include "fit_options.h"
#include "fit_pictures.h"
#include "shared/blocks.h"
#include "shared/command.h"
#include "shared/overwrite.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "shared/proof.h"
#include "shared/ranks.h"
#include "text/progress.h"

#include <stdlib.h>

static struct {
    int resume, picture_spp;
    const char *checkpoint, *sheet;
} o;

static const struct arg_option options[] = {
    {ARG_TEXT | ARG_ASIDE, 0, "checkpoint", "FILE",
     "save the state while the fit runs, and at Ctrl-C", &o.checkpoint, 0, 0, NULL},
    {ARG_FLAG | ARG_ASIDE, 0, "resume", NULL,
     "continue from the checkpoint, if it exists", &o.resume, 0, 0, NULL},
    {ARG_INT | ARG_REPLAYS, 0, "picture-spp", "N",
     "samples per pixel of the pictures written", &o.picture_spp, 1, 1e9, NULL},
    {ARG_TEXT | ARG_ASIDE, 0, "sheet", "FILE.png",
     "one PNG of before, target and recovered (with -o)", &o.sheet, 0, 0, NULL},
    {0}};

/* May everything be written? A checkpoint is replaced with --overwrite, and continued
 * with --resume. */
static int writable(const struct block *blocks, size_t n_blocks)
{
    int rc = checkpoint_writable(o.checkpoint, o.resume);
    if (rc || !cli.out) return rc;
    rc = fit_answer_writable(blocks, n_blocks);
    if (!rc && o.sheet) rc = picture_writable(o.sheet, 0);
    return rc;
}

/* The fitted values, for the manifest. */
static int note_results(const imp_problem *problem, const struct imp_fit_result *r)
{
    const size_t n = imp_problem_n_variables(problem);
    if (!cli.manifest) return 0;
    double *x = cli_alloc(3 * n, sizeof *x);
    for (size_t i = 0; i < n; i++) {
        const struct imp_fit_variable v = fit_variable(problem, i);
        x[i] = v.value, x[n + i] = v.lo95, x[2 * n + i] = v.hi95;
    }
    int rc = manifest_numbers("parameters", x, 3 * n);
    if (!rc) rc = manifest_numbers("losses", r->history, r->n_history);
    free(x);
    return rc;
}

static int run_fit(int n, char **operand)
{
    struct imp_fit_options fit = fit_choice_options();
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

    fit.checkpoint = o.checkpoint;
    fit.resume = o.resume;
    blocks = problem_blocks(problem, &n_blocks);
    rc = writable(blocks, n_blocks);
    if (!rc && cli.out) rc = fit_targets_write();
    if (!rc && cli.out) rc = fit_pictures_write("before", o.picture_spp);
    if (!rc) {
        const struct imp_run run = cli_run();
        rc = manifest_begin(cli.out);
        if (!rc && o.resume) rc = manifest_whole();
        const enum imp_status st = rc ? IMP_OK : imp_fit(problem, &fit, &run, &result);
        if (!rc) fit_pictures_refused(st);
        /* a checkpoint that cannot be written names itself */
        if (cli_failed(st)) rc = cli_fail(st, st == IMP_E_IO ? NULL : cli.scene_path);
        if (!rc) rc = manifest_pause();
        if (!rc && result) rc = note_results(problem, result);
    }
    if (!rc && result && !cli.verifies) {
        struct fit_answer answer = {.problem = problem,
                                    .result = result,
                                    .blocks = blocks,
                                    .n_blocks = n_blocks,
                                    .optimizer = fit_optimizer_word(),
                                    .no_intervals = fit_choice.no_intervals};
        if (!progress_interrupted()) fit_missing_find(&answer);
        rc = fit_answer_give(&answer);
    }
    if (!rc && result && cli.out) {
        progress_resume(); /* after Ctrl-C the state reached is still written */
        rc = fit_pictures_write("recovered", o.picture_spp);
        if (!rc && o.sheet) rc = fit_sheet_write(o.sheet);
    }
    free(blocks);
    problem_close(problem);
    const char *ended;
    if ((!rc || ranks_ended(&ended)) && !problem_options.clip)
        checkpoint_hint(o.checkpoint);
    return rc ? rc : cli_done();
}

const struct command command_fit = {
    {"fit",
     "SCENE --target FILE",
     "recover parameters from target pictures",
     {options_search, options_missing, options, options_targets, options_params,
      options_run, options_limits, options_guide, options_scene, options_folder,
      options_general},
     1,
     1},
    run_fit,
    0,
    1,
    REPLAYS_MANIFEST};
