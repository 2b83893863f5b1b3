/* SPDX-License-Identifier: Apache-2.0
 *
 * importon check: are the gradients right? Adjoints against differences and identities.
 */
#include "shared/check_rows.h"
#include "shared/command.h"
#include "shared/problem_options.h"
#include "text/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    int paths, fresh_spp, sampling;
    double draws_s;
    const char *only;
} o;

static const struct arg_option options[] = {
    {ARG_INT, 0, "paths", "N", "number of frozen walks (default 1000)", &o.paths, 1, 1e9,
     NULL},
    {ARG_INT, 0, "fresh-spp", "N", "samples per pixel of fresh-seed differences",
     &o.fresh_spp, 1, 1e9, NULL},
    {ARG_NUMBER, 0, "draws-time", "S",
     "seconds for rows that compare draws with densities (default 20)", &o.draws_s, 1e-3,
     1e9, NULL},
    {ARG_TEXT, 0, "only", "ROWS", "rows of these methods alone: frozen,fresh,...",
     &o.only, 0, 0, NULL},
    {ARG_FLAG, 0, "verify-sampling", NULL,
     "compare the picture with one of uniform directions, in place of gradients",
     &o.sampling, 0, 0, NULL},
    {0}};

/* `taken`: samples per pixel of a fresh-seed difference, before noisy rows take more. */
static void print_json(const struct imp_run *run, int taken,
                       const struct imp_check_row *rows, size_t n)
{
    struct json j = cli_json();
    json_seed(&j, "seed", run->seed);
    json_integer(&j, "spp", cli_spp(run));
    json_integer(&j, "spp_taken", taken);
    check_rows_json(&j, rows, n);
    cli_json_end(&j);
}

static int run_check(int n, char **operand)
{
    struct imp_check_options check = IMP_CHECK_OPTIONS_INIT;
    const struct imp_check_row *rows = NULL;
    imp_problem *problem = NULL;
    size_t n_rows = 0;
    (void)n;
    int rc = cli_load(operand[0]);
    if (!rc) rc = problem_open(&problem);
    if (rc) return rc;
    const struct imp_run run = cli_run();
    progress_deadline(cli.time_s);
    check.paths = o.paths;
    check.fresh_spp = o.fresh_spp;
    check.sampling = o.sampling;
    check.only = o.only;
    check.draws_s = o.draws_s;
    const enum imp_status st = imp_check(problem, &check, &run, &rows, &n_rows);
    if (cli_failed(st)) {
        rc = cli_fail(st, cli.scene_path);
    } else if (st == IMP_CANCELLED && n_rows == 0) {
        rc = cli_done();
        if (!rc)
            rc = cli_error(EXIT_RUN, "%s: time ended before the first check",
                           cli.scene_path);
    } else {
        const size_t failed = check_rows_count(rows, n_rows, 0),
                     noisy = check_rows_count(rows, n_rows, -1);
        struct imp_run fresh = run;
        int taken = 0;
        if (o.fresh_spp > 0) fresh.spp = o.fresh_spp;
        if (!cli.json) check_rows_print(rows, n_rows);
        else if (!cli_failed(imp_problem_get_spp(problem, -1, &fresh, &taken)))
            print_json(&run, taken, rows, n_rows);
        cli_say("%zu check%s, %zu failed, %zu too noisy to tell%s%s", n_rows,
                plural((long long)n_rows), failed, noisy,
                noisy ? " (more --fresh-spp or --draws-time)" : "",
                st == IMP_CANCELLED ? "; stopped before the others" : "");
        rc = cli_done();
        if (!rc && failed) rc = EXIT_NO;
    }
    problem_close(problem);
    return rc;
}

const struct command command_check = {
    {"check",
     "SCENE",
     "check the gradients against differences and identities",
     {options, options_params, options_run, options_limits, options_guide, options_scene,
      options_file, options_general},
     1,
     1},
    run_check,
    1,
    1,
    REPLAYS_NEVER};
