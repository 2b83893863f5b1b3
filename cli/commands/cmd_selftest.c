/* SPDX-License-Identifier: Apache-2.0
 *
 * importon selftest: do the materials, lights, cameras, media and shapes of a scene keep
 * their contracts?
 */
#include "shared/command.h"
#include "text/progress.h"

#include <string.h>

static struct {
    int samples, directions;
} o;

static const struct arg_option options[] = {
    {ARG_INT, 0, "samples", "N",
     "draws of every object (default 200000, and more until an error of 2 % would be "
     "seen)",
     &o.samples, 1000, 1e9, NULL},
    {ARG_INT, 0, "directions", "N",
     "outgoing directions, or places, of every object (default 12)", &o.directions, 1,
     1e6, NULL},
    {ARG_SEED, 0, "seed", "N", "seed of the random numbers (default 0)", &cli.seed, 0, 0,
     NULL},
    {0}};

static const char *const subjects[] = {"material", "light",  "camera",
                                       "phase",    "medium", "shape"};
enum { SUBJECTS = sizeof subjects / sizeof subjects[0] };

static const char *verdict(const struct imp_selftest_row *r)
{
    static char text[48];
    const char *word = r->ok > 0     ? "ok"
                       : r->ok == 0  ? "FAILED"
                       : r->sees > 0 ? "too few draws"
                                     : "no, not promised";
    if (!(r->sees > 0)) return word;
    snprintf(text, sizeof text, "%s (sees %.2g %%)", word, 100 * r->sees);
    return text;
}

static void print_text(const struct imp_selftest_row *rows, size_t n)
{
    int width = 6, kind = 4;
    for (size_t i = 0; i < n; i++) {
        const struct imp_selftest_row *r = IMP_ROW(imp_selftest_row, rows, i);
        if ((int)strlen(r->object) > width) width = (int)strlen(r->object);
        if ((int)strlen(r->kind) > kind) kind = (int)strlen(r->kind);
    }
    printf("%-*s %-*s %-10s %-12s %-12s %-9s %-10s %s\n", width, "object", kind, "kind",
           "contract", "value", "reference", "p", "error", "verdict");
    for (size_t i = 0; i < n; i++) {
        const struct imp_selftest_row *r = IMP_ROW(imp_selftest_row, rows, i);
        char p[16] = "", reference[24], error[24];
        if (r->chance >= 0) snprintf(p, sizeof p, "%.2g", r->chance);
        snprintf(reference, sizeof reference, r->answers > 0 ? "0 of %.0f" : "%.6g",
                 r->answers > 0 ? r->answers : r->reference);
        snprintf(error, sizeof error, "%s%.2g", r->chance >= 0 ? "z " : "", r->error);
        printf("%-*s %-*s %-10s %-12.6g %-12s %-9s %-10s %s\n", width, r->object, kind,
               r->kind, r->contract, r->value, reference, p, error, verdict(r));
    }
}

static void print_json(const char *subject, const struct imp_selftest_row *rows, size_t n,
                       size_t failed)
{
    struct json j = cli_json();
    json_text(&j, "subject", subject);
    json_array(&j, "rows");
    for (size_t i = 0; i < n; i++) {
        const struct imp_selftest_row *r = IMP_ROW(imp_selftest_row, rows, i);
        json_object(&j, NULL);
        json_text(&j, "object", r->object);
        json_text(&j, "kind", r->kind);
        json_text(&j, "contract", r->contract);
        json_number(&j, "value", r->value);
        json_number(&j, "reference", r->reference);
        json_number(&j, "se", r->se);
        json_number(&j, "answers", r->answers);
        json_number(&j, "error", r->error);
        json_number(&j, "limit", r->limit);
        if (r->chance >= 0) json_number(&j, "p", r->chance);
        json_bool(&j, "ok", r->ok != 0);
        if (r->sees > 0) json_number(&j, "sees", r->sees);
        json_bool(&j, "promised", r->ok >= 0 || r->sees > 0);
        json_end_object(&j);
    }
    json_end_array(&j);
    json_integer(&j, "failed", (int64_t)failed);
    cli_json_end(&j);
}

static int run_selftest(int n, char **operand)
{
    struct imp_selftest_options selftest = IMP_SELFTEST_OPTIONS_INIT;
    const struct imp_selftest_row *rows = NULL;
    size_t n_rows = 0, failed = 0, subject = 0;
    (void)n;
    while (subject < SUBJECTS && strcmp(operand[0], subjects[subject]) != 0) subject++;
    if (subject == SUBJECTS)
        return cli_error(EXIT_USAGE,
                         "selftest: '%s' is not material, light, camera, phase, medium "
                         "or shape",
                         operand[0]);
    int rc = cli_load(operand[1]);
    if (rc) return rc;
    selftest.samples = o.samples;
    selftest.directions = o.directions;
    selftest.seed = cli.seed;
    selftest.progress = progress_report;
    const enum imp_status st = imp_selftest(cli.scene, (enum imp_selftest_subject)subject,
                                            &selftest, &rows, &n_rows);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    for (size_t i = 0; i < n_rows; i++)
        failed += IMP_ROW(imp_selftest_row, rows, i)->ok == IMP_VERDICT_WRONG;
    if (cli.json) print_json(subjects[subject], rows, n_rows, failed);
    else print_text(rows, n_rows);
    cli_say("%zu contract%s, %zu broken", n_rows, plural((long long)n_rows), failed);
    rc = cli_done();
    return !rc && failed ? EXIT_NO : rc;
}

const struct command command_selftest = {
    {"selftest",
     "material|light|... SCENE",
     "test the contracts of materials, lights, cameras, media, shapes",
     {options, options_scene, options_file, options_general},
     2,
     2},
    run_selftest,
    1,
    0,
    REPLAYS_NEVER};
