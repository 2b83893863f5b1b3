/* SPDX-License-Identifier: Apache-2.0
 *
 * importon design: which luminaires of a room, how far dimmed, for what is wanted of its grids. */
#include "design_answer.h"
#include "shared/command.h"
#include "shared/overwrite.h"
#include "text/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WANTS_MAX 200

static struct {
    struct arg_list wants;
    int least, others, rounds, nodes;
    double confidence, within;
    const char *settings;
} o;

static const char *const least_words[] = {"watts", "flux", "cost", NULL};

static const struct arg_option options[] = {
    {ARG_LIST, 'w', "want", "GRID.WHAT=V",
     "of a grid (an irradiancemeter, by name or number): average, minimum or uniformity "
     "at least V, maximum or ugr at most V",
     &o.wants, 0, 0, NULL},
    {ARG_CHOICE, 0, "least", "WHAT", "watts (default), flux or cost", &o.least, 0, 0,
     least_words},
    {ARG_NUMBER, 0, "confidence", "P", "with which all of it holds (default 0.95)",
     &o.confidence, 0.5, 0.999999, NULL},
    {ARG_INT, 0, "rounds", "N", "of fresh walks that judge an answer (default 4)",
     &o.rounds, 1, 20, NULL},
    {ARG_INT, 0, "others", "N", "list other sets of lamps that are nearly as good",
     &o.others, 1, 100, NULL},
    {ARG_NUMBER, 0, "within", "PART",
     "of the objective, up to which others are listed (default 0.05)", &o.within, 1e-9,
     10, NULL},
    {ARG_INT, 0, "nodes", "N", "branches of a search, at most (default 20000)", &o.nodes,
     1, 1e9, NULL},
    {ARG_TEXT, 0, "settings", "FILE", "write the levels, for --set @FILE", &o.settings, 0,
     0, NULL},
    {0}};

static int sensor_find(const char *name, const char *text, int *out)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    char *end;
    imp_scene_get_info(cli.scene, &scene);
    for (int s = 0; s < scene.n_sensors; s++) {
        struct imp_sensor_info info = {.size = sizeof info};
        if (imp_scene_get_sensor(cli.scene, s, &info) != IMP_OK || !info.name) continue;
        if (strcmp(info.name, name) != 0) continue;
        *out = s;
        return 0;
    }
    const long number = strtol(name, &end, 10);
    if (*name && !*end && number >= 0 && number < scene.n_sensors) {
        *out = (int)number;
        return 0;
    }
    return cli_error(EXIT_USAGE, "--want %s: the scene has no sensor '%s'", text, name);
}

/* "GRID.WHAT=V" */
static int want_read(const char *text, struct imp_design_want *out)
{
    char *copy = cli_strdup(text), *equal = strrchr(copy, '='), *dot, *end = NULL;
    int rc = 0, of = -1;
    if (equal) *equal = 0;
    dot = strrchr(copy, '.');
    const double value = equal ? strtod(equal + 1, &end) : NAN;
    if (dot) {
        *dot = 0;
        for (int k = 0; design_words[k]; k++)
            if (!strcmp(dot + 1, design_words[k])) of = k;
    }
    *out = (struct imp_design_want)IMP_DESIGN_WANT_INIT;
    if (of < 0 || !equal || end == equal + 1 || *end || !isfinite(value))
        rc = cli_error(EXIT_USAGE,
                       "--want %s: expected GRID.WHAT=V, WHAT one of average, minimum, "
                       "maximum, uniformity, ugr",
                       text);
    else rc = sensor_find(copy, text, &out->sensor);
    out->of = (enum imp_design_want_of)(of < 0 ? 0 : of);
    out->value = value;
    free(copy);
    return rc;
}

static int wants_read(struct imp_design_want *want, size_t *n)
{
    int rc = 0;
    for (size_t k = 0; k < o.wants.n && !rc; k++) {
        char *copy = cli_strdup(o.wants.item[k]), *save = NULL;
        for (char *w = strtok_r(copy, ",", &save); w && !rc;
             w = strtok_r(NULL, ",", &save))
            rc = *n < WANTS_MAX ? want_read(w, &want[(*n)++])
                                : cli_error(EXIT_USAGE, "more than %d wants", WANTS_MAX);
        free(copy);
    }
    if (!rc && *n == 0)
        rc = cli_error(EXIT_USAGE,
                       "design: nothing is wanted; say it by --want, such as --want "
                       "work.average=500,work.uniformity=0.6");
    return rc;
}

static int design(const struct design_lamps *lamps)
{
    const struct imp_run run = cli_run();
    struct imp_design_options options = IMP_DESIGN_OPTIONS_INIT;
    struct imp_design_want *want = cli_alloc(WANTS_MAX, sizeof *want);
    imp_design *found = NULL;
    size_t n = 0;
    options.least = (enum imp_design_least)o.least;
    options.confidence = o.confidence;
    options.rounds = o.rounds;
    options.others = o.others;
    options.within = o.within;
    options.nodes = o.nodes;
    int rc = wants_read(want, &n);
    if (!rc && o.settings) rc = overwrite_check(o.settings, OUTPUT_SETTINGS);
    if (!rc) {
        const enum imp_status st = imp_design_find(cli.scene, lamps->lamp, lamps->n, want,
                                                   n, &options, &run, &found);
        if (st == IMP_CANCELLED) rc = cli_error(cli_done(), "interrupted: no answer yet");
        else if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    }
    if (!rc) {
        const struct design_answer a = {lamps, want, &options, imp_design_result(found)};
        if (cli.json) design_json(&a);
        else design_print(&a);
        if (o.settings && a.answer->found) rc = design_settings_write(o.settings, &a);
        if (!rc && !(a.answer->found && a.answer->holds)) rc = EXIT_NO;
    }
    imp_design_destroy(found);
    free(want);
    return rc;
}

static int run_design(int n, char **operand)
{
    struct design_lamps lamps = {0};
    (void)n;
    int rc = design_catalogue_read();
    if (!rc) rc = cli_load(operand[0]);
    if (!rc && cli.time_s > 0)
        rc = cli_error(EXIT_USAGE, "design takes --spp samples, and has no --time");
    if (!rc) rc = design_lamps_make(&lamps);
    if (!rc) rc = design(&lamps);
    design_lamps_free(&lamps);
    args_list_free(&o.wants);
    return rc ? rc : cli_done();
}

const struct command command_design = {
    {"design",
     "SCENE",
     "which luminaires of a room, how far dimmed, for wanted lux",
     {options, options_lamps, options_run, options_scene, options_file, options_general},
     1,
     1},
    run_design,
    1,
    0,
    REPLAYS_NEVER};
