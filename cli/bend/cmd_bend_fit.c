/* SPDX-License-Identifier: Apache-2.0
 *
 * importon bend fit: a field that meets the targets, and what is written of it. */
#include "cmd_bend.h"
#include "shared/answer_file.h"
#include "shared/output.h"
#include "shared/picture_files.h"
#include "shared/plot.h"
#include "text/progress.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const char *const carry_words[] = {"auto", "always", "never", NULL};
static const char *const optimizer_words[] = {"lbfgs", "adam", "mma", NULL};

static struct {
    int optimizer, levels, resume, carry;
    const char *iterations, *checkpoint;
    double learning_rate, tolerance, scale, smooth_length;
} o;

const struct arg_option bend_fit_options[] = {
    {ARG_CHOICE, 0, "optimizer", "NAME", "fit: lbfgs (default), adam or mma",
     &o.optimizer, 0, 0, optimizer_words},
    {ARG_INT, 0, "levels", "N", "fit: refine grids N - 1 times (default 1)", &o.levels, 1,
     IMP_BEND_LEVELS_MAX, NULL},
    {ARG_TEXT, 'n', "iterations", "N[,N..]", "fit: maximum for each level (default 50)",
     &o.iterations, 0, 0, NULL},
    {ARG_NUMBER, 0, "lr", "X",
     "fit, adam: learning rate, as a fraction of the scale (default 0.05), halved at "
     "each level",
     &o.learning_rate, 1e-12, 1e3, NULL},
    {ARG_NUMBER, 0, "tolerance", "X",
     "fit: stop when steps stay below this fraction of the scale (1e-6)", &o.tolerance,
     1e-300, 1, NULL},
    {ARG_NUMBER, 0, "scale", "X", "fit: a large change of an index (default 0.1)",
     &o.scale, 1e-12, 1e12, NULL},
    {ARG_NUMBER, 0, "smooth-length", "X",
     "fit, lbfgs: changes of a grid are smooth over this length as long as the rays "
     "allow "
     "it (default 0)",
     &o.smooth_length, 1e-12, 1e12, NULL},
    {ARG_TEXT, 0, "checkpoint", "FILE", "fit: save the state every few seconds",
     &o.checkpoint, 0, 0, NULL},
    {ARG_CHOICE, 0, "carry", "WHEN",
     "fit: keep the optimiser's history at the next level: auto (lbfgs), always, never",
     &o.carry, 0, 0, carry_words},
    {ARG_FLAG, 0, "resume", NULL, "fit: continue from the checkpoint", &o.resume, 0, 0,
     NULL},
    {ARG_TEXT, 0, "truth", "FILE",
     "fit, view: the true field, a .xml with rays or a field's file; a report compares",
     &bend_truth_path, 0, 0, NULL},
    {0}};

int bend_field_write(const imp_bend *bend)
{
    const imp_field *f = imp_bend_field((imp_bend *)(uintptr_t)bend);
    const char *kind = imp_field_kind(f);
    const int grid = !strcmp(kind, "spline") || !strcmp(kind, "trilinear") ||
                     !strcmp(kind, "tied grid");
    enum imp_status st = IMP_OK;
    if (grid || !strcmp(kind, "radial") || !strcmp(kind, "rz")) {
        char *path = join_path(cli.out, grid ? "field.vol" : "field.txt");
        st = imp_field_write(f, path);
        free(path);
        if (st == IMP_OK && grid) {
            path = join_path(cli.out, "field.npy");
            st = imp_field_write(f, path);
            free(path);
        }
    }
    return st == IMP_OK ? 0 : cli_fail(st, cli.out);
}

void bend_put_numbers(imp_bend *bend, FILE *to, struct json *j)
{
    const imp_field *f = imp_bend_field(bend);
    const size_t n = imp_field_n_theta(f);
    if (!imp_field_param_name(f, 0) && n > 32) return;
    double *theta = cli_alloc(n, sizeof *theta);
    imp_field_get_theta(f, theta);
    for (size_t i = 0; i < n; i++) {
        const char *name = imp_field_param_name(f, i);
        if (!name) continue;
        if (j) json_number(j, name, theta[i]);
        else fprintf(to, "  %-10s %.9g\n", name, theta[i]);
    }
    free(theta);
}

static int write_history(const struct imp_bend_fit_result *r)
{
    char *svg = join_path(cli.out, "loss.svg"), *csv = join_path(cli.out, "loss.csv");
    int rc = plot_curve(svg, "Objective", "evaluation", "objective", r->n_history,
                        r->history, NULL);
    struct output to = {0};
    if (!rc && !(rc = output_open(&to, csv, OUTPUT_TABLE))) {
        fprintf(to.file, "evaluation,objective\n");
        for (size_t i = 0; i < r->n_history; i++)
            fprintf(to.file, "%zu,%.9g\n", i, r->history[i]);
        rc = output_close(&to, rc);
    }
    free(svg);
    free(csv);
    return rc;
}

static int iterations_read(int out[IMP_BEND_LEVELS_MAX])
{
    const char *s = o.iterations;
    for (int k = 0; s && *s; k++) {
        char *end;
        const long n = strtol(s, &end, 10);
        if (end == s || n < 1 || n > 1000000 || k == IMP_BEND_LEVELS_MAX ||
            (*end && *end != ','))
            return cli_error(EXIT_USAGE, "--iterations %s: expected N[,N..]",
                             o.iterations);
        out[k] = (int)n;
        s = *end ? end + 1 : end;
    }
    return 0;
}

/* May everything be written? */
static int writable(void)
{
    static const struct {
        const char *name;
        enum output_kind kind;
    } files[] = {{"field.vol", OUTPUT_VOL},  {"field.txt", OUTPUT_PROFILE},
                 {"field.npy", OUTPUT_NPY},  {"loss.csv", OUTPUT_TABLE},
                 {"loss.svg", OUTPUT_CURVE}, {"bend.json", OUTPUT_JSON}};
    int rc = 0;
    for (size_t k = 0; k < sizeof files / sizeof *files && !rc; k++)
        rc = overwrite_check_in(cli.out, files[k].name, files[k].kind);
    if (!rc) rc = bend_view_writable(cli.out, "before-");
    return rc ? rc : bend_view_writable(cli.out, "");
}

static void put_answer(struct json *j, imp_bend *bend,
                       const struct imp_bend_fit_result *r, double seconds)
{
    json_number(j, "start", r->start);
    json_number(j, "value", r->value);
    json_integer(j, "evaluations", r->iterations);
    json_integer(j, "levels", r->levels);
    json_number(j, "seconds", seconds);
    json_text(j, "reason", r->reason);
    json_bool(j, "complete", !progress_interrupted());
    bend_put_stats(j, &r->stats);
    json_object(j, "field");
    bend_put_numbers(bend, NULL, j);
    json_end_object(j);
}

/* The answer and the losses, for reports. */
static int write_answer(imp_bend *bend, const struct imp_bend_fit_result *r,
                        double seconds)
{
    struct answer_file to;
    const int rc = answer_open(&to, cli.out, "bend.json", "bend");
    if (rc) return rc;
    put_answer(&to.json, bend, r, seconds);
    json_object(&to.json, "history");
    json_numbers(&to.json, "loss", r->n_history, r->history);
    json_end_object(&to.json);
    return answer_close(&to, 0);
}

int bend_fit(imp_bend *bend)
{
    static const enum imp_optimizer kinds[] = {IMP_LBFGS, IMP_ADAM, IMP_MMA};
    struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r = {.size = sizeof r};
    int rc = iterations_read(fo.iterations);
    if (!rc && o.resume && !o.checkpoint)
        rc = cli_error(EXIT_USAGE, "bend fit: --resume needs --checkpoint FILE");
    if (!rc) rc = checkpoint_writable(o.checkpoint, o.resume);
    if (!rc && cli.out) rc = make_folder(cli.out);
    if (!rc && cli.out) rc = writable();
    if (!rc && cli.out) rc = bend_view(bend, cli.out, "before-", NULL);
    if (rc) return rc;
    fo.optimizer = kinds[o.optimizer];
    fo.levels = o.levels;
    fo.learning_rate = o.learning_rate;
    fo.tolerance = o.tolerance;
    fo.scale = o.scale;
    fo.smooth_length = o.smooth_length;
    fo.checkpoint = o.checkpoint;
    fo.resume = o.resume;
    fo.carry = o.carry == 1   ? IMP_BEND_CARRY_ON
               : o.carry == 2 ? IMP_BEND_CARRY_OFF
                              : IMP_BEND_CARRY_AUTO;
    fo.progress = progress_report;
    const double start = cli_now();
    const enum imp_status st = imp_bend_fit(bend, &fo, &r);
    if (cli_failed(st)) return cli_fail(st, cli.scene_path);
    const double seconds = cli_now() - start;
    progress_clear();
    progress_resume(); /* what is there is drawn and written, also after Ctrl-C */
    if (cli.json) {
        struct json j = cli_json();
        put_answer(&j, bend, &r, seconds);
        cli_json_end(&j);
    } else {
        printf("objective %.9g -> %.9g in %d evaluation%s, %d level%s, %.1f s: %s\n",
               r.start, r.value, r.iterations, plural(r.iterations), r.levels,
               plural(r.levels), seconds, r.reason);
        bend_put_numbers(bend, stdout, NULL);
        bend_print_stats(stdout, &r.stats);
    }
    if (cli.out) rc = bend_field_write(bend);
    if (cli.out && !rc) rc = write_history(&r);
    if (cli.out && !rc) rc = write_answer(bend, &r, seconds);
    if (cli.out && !rc) rc = bend_view(bend, cli.out, "", NULL);
    if (!rc) checkpoint_hint(o.checkpoint);
    return rc ? rc : cli_done();
}
