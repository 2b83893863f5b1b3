/* SPDX-License-Identifier: Apache-2.0
 *
 * importon bend: rays in graded indices. trace, check, fit and view work on one file with
 * field, rays and targets (docs/bend.md). */
#include "cmd_bend.h"
#include "shared/output.h"
#include "shared/picture_files.h"
#include "text/progress.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct arg_option options_bend[] = {
    {ARG_LIST, 'D', "define", "NAME=VALUE", "set a $parameter of the file", &cli.defines,
     0, 0, NULL},
    {ARG_TEXT, 'a', "search", "DIR", "one more folder to search for files", &cli.search,
     0, 0, NULL},
    {0}};

/* ---- Loading and counting ------------------------------------------------------ */

static imp_bend *bend;

int bend_open(const char *path, imp_bend **out)
{
    struct imp_load_options lo = IMP_LOAD_OPTIONS_INIT;
    int rc = cli_open();
    if (rc) return rc;
    cli.scene_path = path;
    lo.defines = cli.defines.item;
    lo.n_defines = cli.defines.n;
    if (cli.search) lo.search = &cli.search, lo.n_search = 1;
    const enum imp_status st = imp_bend_load(cli.context, path, &lo, out);
    if (st == IMP_OK) return 0;
    rc = cli_fail(st, NULL);
    return st == IMP_E_IO ? EXIT_USAGE : rc;
}

struct count {
    const char *name;
    uint64_t n;
};

static void counts_of(const struct imp_bend_stats *s, struct count c[8])
{
    const struct count all[8] = {{"truncated", s->truncated},
                                 {"missed", s->missed},
                                 {"started_outside", s->started_out},
                                 {"grazing", s->grazing},
                                 {"broken", s->broken},
                                 {"energy_off", s->energy},
                                 {"reflected", s->reflected},
                                 {"taps_missed", s->taps_missed}};
    memcpy(c, all, sizeof all);
}

void bend_print_stats(FILE *to, const struct imp_bend_stats *s)
{
    struct count c[8];
    counts_of(s, c);
    fprintf(to, "rays      %llu, traced to the end %llu, %.1f steps each\n",
            (unsigned long long)s->rays, (unsigned long long)s->traced,
            s->rays ? (double)s->steps / (double)s->rays : 0);
    for (int k = 0; k < 8; k++)
        if (c[k].n)
            fprintf(to, "          %-16s %llu%s\n", c[k].name, (unsigned long long)c[k].n,
                    (double)c[k].n > 0.01 * (double)s->rays ? "  (more than 1 %)" : "");
    fprintf(to, "energy    | |v|^2/eta^2 - 1 | <= %.2g at exits\n", s->worst_energy);
}

void bend_put_stats(struct json *j, const struct imp_bend_stats *s)
{
    struct count c[8];
    counts_of(s, c);
    json_object(j, "stats");
    json_integer(j, "rays", (int64_t)s->rays);
    json_integer(j, "traced", (int64_t)s->traced);
    json_integer(j, "steps", (int64_t)s->steps);
    for (int k = 0; k < 8; k++) json_integer(j, c[k].name, (int64_t)c[k].n);
    json_number(j, "worst_energy", s->worst_energy);
    json_end_object(j);
}

const char *bend_target_word(enum imp_bend_target_type t)
{
    static const char *const words[IMP_BEND_N_TARGETS] = {
        "focus", "spot",      "points", "direction", "directions", "deflection",
        "path",  "wavefront", "image",  "far-field", "shape"};
    return words[t];
}

/* ---- trace --------------------------------------------------------------------- */

/* All exits: one line a ray. */
static int write_exits(const char *path)
{
    const size_t n = imp_bend_n_rays(bend);
    struct imp_bend_exit *e = cli_alloc(n, sizeof *e);
    struct imp_bend_rays rays = IMP_BEND_RAYS_INIT;
    int rc = 0;
    const enum imp_status st = imp_bend_run(bend, e, NULL, NULL);
    if (st != IMP_OK) {
        free(e);
        return cli_fail(st, cli.scene_path);
    }
    imp_bend_get_rays(bend, &rays);
    struct output to = {0};
    rc = output_open(&to, path, OUTPUT_TABLE);
    FILE *f = to.file;
    if (f) fprintf(f, "ray,bundle,x,y,z,vx,vy,vz,path,steps,flags\n");
    for (size_t i = 0; f && i < n; i++)
        fprintf(f, "%zu,%d,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%u,%u\n", i,
                rays.group[i], e[i].x[0], e[i].x[1], e[i].x[2], e[i].v[0], e[i].v[1],
                e[i].v[2], e[i].path, e[i].steps, e[i].flags);
    rc = output_close(&to, rc);
    free(e);
    return rc;
}

static int trace(void)
{
    struct imp_bend_stats s = IMP_BEND_STATS_INIT;
    struct imp_bend_options bo = IMP_BEND_OPTIONS_INIT;
    const size_t n = imp_bend_n_targets(bend);
    double value, error, order, *parts;
    const int rc = cli.out ? overwrite_check(cli.out, OUTPUT_TABLE) : 0;
    if (rc) return rc;
    parts = cli_alloc(n, sizeof *parts);
    const double start = cli_now();
    enum imp_status st = imp_bend_objective(bend, &value, NULL, parts, &s);
    const double seconds = cli_now() - start;
    if (st == IMP_OK) st = imp_bend_step_error(bend, 200, &error, &order);
    if (st == IMP_E_NUMERIC && s.traced > 0) { /* lost with the shorter steps alone */
        error = order = NAN;
        st = IMP_OK;
    }
    if (st == IMP_OK) st = imp_bend_get_options(bend, &bo);
    if (st != IMP_OK) {
        free(parts);
        return cli_fail(st, cli.scene_path);
    }
    if (cli.json) {
        struct json j = cli_json();
        bend_put_stats(&j, &s);
        json_number(&j, "seconds", seconds);
        json_number(&j, "step", bo.step);
        json_number(&j, "step_error", error);
        json_number(&j, "step_order", order);
        json_number(&j, "objective", value);
        json_numbers(&j, "targets", n, parts);
        cli_json_end(&j);
    } else if (!cli.out || strcmp(cli.out, "-")) {
        bend_print_stats(stdout, &s);
        printf("step      %.4g: ", bo.step);
        if (isfinite(error))
            printf("exits are off by %.2g rms (order %.1f seen by halving)\n", error,
                   order);
        else printf("error unknown, no ray comes to its end with half the step\n");
        printf("speed     %.3g rays/s, %.3g ray-steps/s\n", (double)s.rays / seconds,
               (double)s.steps / seconds);
        printf("objective %.9g\n", value);
        for (size_t i = 0; i < n && i < 20; i++) {
            struct imp_bend_target t = {.size = sizeof t};
            if (imp_bend_get_target(bend, i, &t) == IMP_OK)
                printf("  target %-3zu %-10s %.9g\n", i, bend_target_word(t.type),
                       parts[i]);
        }
        if (n > 20) printf("  ... and %zu more\n", n - 20);
    }
    free(parts);
    return cli.out ? write_exits(cli.out) : 0;
}

/* ---- check --------------------------------------------------------------------- */

static int check(void)
{
    const struct imp_check_row *rows;
    size_t n;
    int ok = 1;
    const int rc = cli_redirect();
    if (rc) return rc;
    const enum imp_status st = imp_bend_check(bend, &rows, &n);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    for (size_t i = 0; i < n; i++) {
        const struct imp_check_row *r = IMP_ROW(imp_check_row, rows, i);
        if (!strcmp(r->method, "rays") && r->value < r->reference)
            cli_say("%.0f of %.0f rays are lost and not checked: 'bend trace' counts the "
                    "reasons",
                    r->reference - r->value, r->reference);
    }
    struct json j = {0};
    if (cli.json) {
        j = cli_json();
        json_array(&j, "rows");
    } else {
        printf("%-11s %-16s %9s %16s %16s %9s %9s\n", "check", "of", "step", "value",
               "reference", "error", "limit");
    }
    for (size_t i = 0; i < n; i++) {
        const struct imp_check_row *r = IMP_ROW(imp_check_row, rows, i);
        ok = ok && r->ok;
        if (cli.json) {
            json_object(&j, NULL);
            json_text(&j, "method", r->method);
            json_text(&j, "of", r->param);
            json_number(&j, "step", r->step);
            json_number(&j, "value", r->value);
            json_number(&j, "reference", r->reference);
            json_number(&j, "error", r->error);
            json_number(&j, "limit", r->limit);
            json_bool(&j, "ok", r->ok);
            json_end_object(&j);
        } else {
            printf("%-11s %-16s %9.2g %16.9g %16.9g %9.2g %9.2g  %s\n", r->method,
                   r->param, r->step, r->value, r->reference, r->error, r->limit,
                   r->limit <= 0 ? ""
                   : r->ok       ? "ok"
                                 : "FAILED");
        }
    }
    if (cli.json) {
        json_end_array(&j);
        json_bool(&j, "ok", ok);
        cli_json_end(&j);
    }
    return ok ? EXIT_DONE : EXIT_NO;
}

static int fit(void) { return bend_fit(bend); }

/* ---- The command --------------------------------------------------------------- */

static int view(void)
{
    const char *folder = cli.out ? cli.out : "out";
    struct imp_bend_stats s = IMP_BEND_STATS_INIT;
    struct json j = {0};
    double value;
    const enum imp_status st = imp_bend_objective(bend, &value, NULL, NULL, &s);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path); /* also if no ray is traced */
    int rc = make_folder(folder);
    if (!rc) rc = bend_view_writable(folder, "");
    if (!rc && cli.json) {
        j = cli_json();
        json_text(&j, "folder", folder);
        bend_put_stats(&j, &s);
    }
    if (!rc) rc = bend_view(bend, folder, "", cli.json ? &j : NULL);
    if (j.file) cli_json_end(&j);
    if (!rc && s.traced < s.rays)
        cli_say("%llu of %llu rays are lost and not drawn as spots: 'bend trace' counts "
                "the reasons",
                (unsigned long long)(s.rays - s.traced), (unsigned long long)s.rays);
    if (!rc) cli_say("pictures in %s", folder);
    return rc;
}

static int run(int n, char **operand)
{
    static const struct {
        const char *word;
        int (*fn)(void);
    } verbs[] = {{"trace", trace}, {"check", check}, {"fit", fit}, {"view", view}};
    static const char *const words[] = {"trace", "check", "fit", "view", NULL};
    (void)n;
    for (size_t i = 0; i < sizeof verbs / sizeof *verbs; i++) {
        if (strcmp(operand[0], verbs[i].word)) continue;
        int rc = bend_open(operand[1], &bend);
        if (!rc) {
            imp_bend_set_progress(bend, progress_report, NULL);
            rc = verbs[i].fn();
        }
        imp_bend_destroy(bend);
        bend = NULL;
        return rc;
    }
    const char *near = args_nearest(operand[0], words);
    return cli_error(EXIT_USAGE,
                     "bend: unknown '%s'%s%s: there are trace, check, fit, view",
                     operand[0], near ? ", did you mean " : "", near ? near : "");
}

const struct command command_bend = {
    {"bend",
     "trace|check|fit|view FILE",
     "rays in a graded index: trace, check, fit, view",
     {options_file_or_folder, options_general, options_bend, bend_fit_options},
     2,
     2},
    run,
    0,
    0,
    REPLAYS_NEVER};
