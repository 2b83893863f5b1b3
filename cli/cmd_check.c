/* SPDX-License-Identifier: Apache-2.0
 *
 * importon check: are the gradients right? Adjoints against differences and identities.
 */
#include "cmd_problem.h"
#include "command.h"
#include "progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    int paths, fresh_spp, sampling;
} o;

static const struct arg_option options[] = {
    {ARG_INT, 0, "paths", "N", "number of frozen walks (default 1000)", &o.paths, 1, 1e9,
     NULL},
    {ARG_INT, 0, "fresh-spp", "N", "samples per pixel of fresh-seed differences",
     &o.fresh_spp, 1, 1e9, NULL},
    {ARG_FLAG, 0, "verify-sampling", NULL,
     "compare the picture with one of uniform directions, in place of gradients",
     &o.sampling, 0, 0, NULL},
    {0}};

/* Steps that are not the best have none. */
static const char *verdict(const struct imp_check_row *r)
{
    if (r->limit == 0) return "";
    return r->ok > 0 ? r->kinks > 0 ? "kink" : "ok" : r->ok < 0 ? "noisy" : "FAILED";
}

static void print_text(const struct imp_check_row *rows, size_t n)
{
    int width = 9;
    for (size_t i = 0; i < n; i++)
        if (rows[i].param && (int)strlen(rows[i].param) > width)
            width = (int)strlen(rows[i].param);
    printf("%-7s %-*s %-8s %-15s %-15s %-9s %-9s %s\n", "method", width, "parameter",
           "step", "value", "reference", "se", "error", "verdict");
    for (size_t i = 0; i < n; i++) {
        const struct imp_check_row *r = &rows[i];
        char step[16] = "", se[16] = "";
        if (r->step > 0) snprintf(step, sizeof step, "%.0e", r->step);
        if (r->se > 0) snprintf(se, sizeof se, "%.1e", r->se);
        printf("%-7s %-*s %-8s %-15.8g %-15.8g %-9s %s%-9.2g %s", r->method, width,
               r->param ? r->param : "", step, r->value, r->reference, se,
               r->se > 0 ? "z " : "", r->error, verdict(r));
        if (r->kinks > 0) printf(" (%d walk%s)", r->kinks, r->kinks > 1 ? "s" : "");
        printf("\n");
    }
}

/* `taken`: samples per pixel of a fresh-seed difference, before noisy rows take more. */
static void print_json(const struct imp_run *run, int taken,
                       const struct imp_check_row *rows, size_t n, size_t failed,
                       size_t noisy)
{
    struct json j = cli_json();
    json_seed(&j, "seed", run->seed);
    json_integer(&j, "spp", cli_spp(run));
    json_integer(&j, "spp_taken", taken);
    json_array(&j, "rows");
    for (size_t i = 0; i < n; i++) {
        const struct imp_check_row *r = &rows[i];
        json_object(&j, NULL);
        json_text(&j, "method", r->method);
        json_text(&j, "param", r->param);
        json_number(&j, "step", r->step);
        json_number(&j, "value", r->value);
        json_number(&j, "reference", r->reference);
        json_number(&j, "se", r->se);
        json_number(&j, "error", r->error);
        json_number(&j, "limit", r->limit);
        json_bool(&j, "ok", r->ok != 0);
        json_bool(&j, "resolved", r->ok >= 0);
        json_integer(&j, "kinks", r->kinks);
        json_end_object(&j);
    }
    json_end_array(&j);
    json_integer(&j, "failed", (int64_t)failed);
    json_integer(&j, "noisy", (int64_t)noisy);
    cli_json_end(&j);
}

static int run_check(int n, char **operand)
{
    struct imp_check_options check = IMP_CHECK_OPTIONS_INIT;
    const struct imp_check_row *rows = NULL;
    imp_problem *problem = NULL;
    size_t n_rows = 0, failed = 0, noisy = 0;
    (void)n;
    int rc = cli_load(operand[0]);
    if (!rc) rc = problem_open(&problem);
    if (rc) return rc;
    const struct imp_run run = cli_run();
    progress_deadline(cli.time_s);
    check.paths = o.paths;
    check.fresh_spp = o.fresh_spp;
    check.sampling = o.sampling;
    const enum imp_status st = imp_check(problem, &check, &run, &rows, &n_rows);
    if (cli_failed(st)) {
        rc = cli_fail(st, cli.scene_path);
    } else {
        for (size_t i = 0; i < n_rows; i++) {
            failed += !rows[i].ok;
            noisy += rows[i].ok < 0;
        }
        struct imp_run fresh = run;
        int taken = 0;
        if (o.fresh_spp > 0) fresh.spp = o.fresh_spp;
        if (!cli.json) print_text(rows, n_rows);
        else if (!cli_failed(imp_problem_spp(problem, -1, &fresh, &taken)))
            print_json(&run, taken, rows, n_rows, failed, noisy);
        cli_say("%zu checks, %zu failed, %zu too noisy to tell%s", n_rows, failed, noisy,
                noisy ? " (more --fresh-spp)" : "");
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
     {options, options_params, options_run, options_guide, options_scene, options_file,
      options_general},
     1,
     1},
    run_check,
    1,
    "method ",
    1};
