/* SPDX-License-Identifier: Apache-2.0
 *
 * importon record: walks are drawn and written to a file, from which importon what-if
 * answers without the scene. */
#include "shared/command.h"
#include "shared/overwrite.h"
#include "text/progress.h"

#include <importon/walks.h>

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static struct {
    double memory, survival, ess, headroom;
    int all_sensors, pictures;
} o = {.survival = 0.8};

static const struct arg_option options[] = {
    {ARG_FLAG, 0, "all-sensors", NULL, "walks of all sensors, and not of --sensor alone",
     &o.all_sensors, 0, 0, NULL},
    {ARG_FLAG, 0, "pictures", NULL,
     "the walks of render, whose pictures have the same bits; with Sobol's points they "
     "are not those of a loss",
     &o.pictures, 0, 0, NULL},
    {ARG_NUMBER, 0, "memory", "MB", "for the walks (default 1074)", &o.memory, 1e-3, 1e12,
     NULL},
    {ARG_NUMBER, 0, "survival", "P",
     "lower limit of the survival probability in roulette (default 0.8; 0: that of the "
     "integrator)",
     &o.survival, 0, 1, NULL},
    {ARG_NUMBER, 0, "ess", "F",
     "smallest effective sample size, a fraction, for an answer (default 0.5)", &o.ess,
     1e-6, 1, NULL},
    {ARG_NUMBER, 0, "headroom", "H",
     "extinctions of grids may grow to this times the largest one, also from 0 "
     "(default 1: they may not)",
     &o.headroom, 1, 64, NULL},
    {0}};

/* The scene's file name with the extension .walks, in the working folder. */
static char *default_output(void)
{
    const char *base = strrchr(cli.scene_path, '/');
    base = base ? base + 1 : cli.scene_path;
    if (base[0] == '<') base = "scene"; /* stdin */
    const char *dot = strrchr(base, '.');
    const int stem = dot && dot > base ? (int)(dot - base) : (int)strlen(base);
    char *path = cli_alloc((size_t)stem + 7, 1);
    snprintf(path, (size_t)stem + 7, "%.*s.walks", stem, base);
    return path;
}

static void report(const char *path, const struct imp_walks_info *info)
{
    struct stat file;
    cli_say("%s: %d walk%s a pixel%s, drawn with seed %llu", path, info->spp,
            plural(info->spp), info->n_sensors > 1 ? ", of several sensors" : "",
            (unsigned long long)info->seed);
    if (!cli.json) return;
    struct json j = cli_json();
    json_text(&j, "file", path);
    json_seed(&j, "seed", info->seed);
    json_integer(&j, "spp", info->spp);
    json_integer(&j, "sensors", info->n_sensors);
    json_text(&j, "walks_of", info->losses ? "losses" : "pictures");
    if (stat(path, &file) == 0) json_integer(&j, "bytes", file.st_size);
    cli_json_end(&j);
}

static int run_record(int n, char **operand)
{
    struct imp_walks_options options_of = IMP_WALKS_OPTIONS_INIT;
    struct imp_walks_info info = {.size = sizeof info};
    imp_walks *walks = NULL;
    (void)n;
    int rc = cli_load(operand[0]);
    if (rc) return rc;
    const struct imp_run run = cli_run();
    char *path = cli.out ? cli_strdup(cli.out) : default_output();
    rc = overwrite_check(path, OUTPUT_RECORD);
    if (!rc) {
        options_of.memory = (size_t)(1e6 * o.memory);
        options_of.losses = !o.pictures;
        options_of.all_sensors = o.all_sensors;
        options_of.survival = o.survival > 0 ? o.survival : -1;
        options_of.ess = o.ess;
        options_of.headroom = o.headroom;
        options_of.spread = 1;
        enum imp_status st = imp_walks_keep(cli.scene, &run, &options_of, &walks);
        if (st == IMP_OK) st = imp_walks_write(walks, path);
        if (st == IMP_CANCELLED)
            rc = cli_error(cli_done(), "interrupted: nothing is written");
        else if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    }
    if (!rc && imp_walks_get_info(walks, &info) == IMP_OK && cli_writes())
        report(path, &info);
    imp_walks_destroy(walks);
    free(path);
    return rc ? rc : cli_done();
}

const struct command command_record = {
    {"record",
     "SCENE",
     "write walks to a file that answers without the scene (what-if)",
     {options, options_run, options_guide, options_scene, options_file, options_general},
     1,
     1},
    run_record,
    0,
    1,
    REPLAYS_NEVER};
