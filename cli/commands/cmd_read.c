/* SPDX-License-Identifier: Apache-2.0
 *
 * importon read: the numbers of a scene's sensors, means over their films, with standard
 * errors, units and derivatives; from either end, or from both to compare them. */
#include "read/read_grid.h"
#include "read/read_ratings.h"
#include "read/read_year.h"
#include "read/readings.h"
#include "read/room_page.h"
#include "shared/command.h"
#include "shared/overwrite.h"
#include "shared/problem_options.h"
#include "shared/wanted.h"
#include "text/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    int ends, grid, shares;
    double until;
    const char *csv, *svg, *report;
} o;

static const struct arg_option options[] = {
    {ARG_FLAG | ARG_REPLAYS, 0, "ends", NULL,
     "read by light tracing, too, and compare: exit status 1 if they differ", &o.ends, 0,
     0, NULL},
    {ARG_FLAG | ARG_REPLAYS, 0, "grid", NULL,
     "every pixel of an irradiancemeter: average, minimum, maximum, uniformity", &o.grid,
     0, 0, NULL},
    {ARG_FLAG | ARG_REPLAYS, 0, "shares", NULL,
     "what each lamp and each material has to do with the readings", &o.shares, 0, 0,
     NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "until", "REL",
     "of a grid: take samples, at most --spp, until each point is this close, in 95 of "
     "100 cases",
     &o.until, 1e-6, 1, NULL},
    {ARG_TEXT, 0, "csv", "FILE",
     "the points, values and errors of a grid or of glare ratings as a table", &o.csv, 0,
     0, NULL},
    {ARG_TEXT, 0, "svg", "FILE", "the same as a plan with isolines", &o.svg, 0, 0, NULL},
    {ARG_TEXT, 0, "report", "FILE",
     "the grids as a page for a client: plans, --want, luminaires, the view of a camera",
     &o.report, 0, 0, NULL},
    {0}};

/* Options that exclude or need each other. 0, or 2 with the reason. */
static int options_refused(const struct imp_scene_info *scene)
{
    const int year = year_wanted.weather != NULL;
    const int ugr = ratings_wanted.ugr, dgp = ratings_wanted.dgp;
    if (!o.grid && !year && !ugr && !dgp && (o.csv || o.svg))
        return cli_error(EXIT_USAGE,
                         "--csv and --svg write a grid: they go with --grid, --ugr, "
                         "--dgp or --year");
    if (year &&
        (ugr || o.shares || o.grid || o.ends || cli.from || problem_options.params.n))
        return cli_error(EXIT_USAGE,
                         "--year goes without --ugr, --shares, --grid, --ends, "
                         "--from and --param");
    if (year && !cli_typed("sensor") && scene->n_sensors > 1)
        return cli_error(
            EXIT_USAGE,
            "%s: it has %d sensors, and --year is of one grid: choose it with "
            "--sensor",
            cli.scene_path, scene->n_sensors);
    if (!year && (cli_typed("hours") || cli_typed("wanted")))
        return cli_error(EXIT_USAGE,
                         "--hours and --wanted are of daylight: they go with --year");
    if (o.grid && problem_options.params.n)
        return cli_error(EXIT_USAGE,
                         "--grid has no derivatives: it goes without --param");
    if (o.shares && (o.grid || o.ends || problem_options.params.n))
        return cli_error(EXIT_USAGE, "--shares goes without --grid, --ends and --param");
    if (ugr && (o.shares || o.grid || o.ends || problem_options.params.n))
        return cli_error(EXIT_USAGE,
                         "--ugr goes without --shares, --grid, --ends and --param");
    if (ugr && !cli_typed("sensor"))
        return cli_error(EXIT_USAGE, "--ugr is of one grid: choose it with --sensor");
    if (dgp && (ugr || year || o.shares || o.grid || o.ends || cli.from ||
                problem_options.params.n))
        return cli_error(EXIT_USAGE,
                         "--dgp goes without --ugr, --year, --shares, --grid, --ends, "
                         "--from and --param");
    if (dgp && !cli_typed("sensor"))
        return cli_error(EXIT_USAGE, "--dgp is of one grid: choose it with --sensor");
    if (problem_options.hold.n && !problem_options.params.n)
        return cli_error(EXIT_USAGE, "--hold is of derivatives: it goes with --param");
    if (o.until > 0 && (!o.grid || o.ends))
        return cli_error(EXIT_USAGE,
                         "--until is of the points of a grid, by walks from the sensor: "
                         "it goes with --grid, without --ends");
    if (o.report && !o.grid)
        return cli_error(EXIT_USAGE, "--report is of grids: it goes with --grid");
    if (wants_given() && !o.report)
        return cli_error(EXIT_USAGE,
                         "--want is compared on a page: it goes with --report");
    if (o.ends && cli.from)
        return cli_error(EXIT_USAGE, "--ends reads from both: it goes without --from");
    return o.until > 0 ? until_refused() : 0;
}

static int run_read(int n, char **operand)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    struct block *blocks = NULL;
    size_t n_blocks = 0;
    imp_problem *problem = NULL;
    struct findings found = {.ends = o.ends};
    (void)n;
    cli.brief = !o.ends && !o.shares && !year_wanted.weather && !ratings_wanted.ugr &&
                !ratings_wanted.dgp;
    int rc = cli_load(operand[0]);
    if (rc) return rc;
    struct imp_run run = cli_run();
    imp_scene_get_info(cli.scene, &scene);
    if (scene.n_sensors == 0)
        return cli_error(EXIT_USAGE, "%s: there is no sensor in it", cli.scene_path);
    rc = options_refused(&scene);
    if (rc) return rc;
    const int year = year_wanted.weather != NULL;
    const int ugr = ratings_wanted.ugr, dgp = ratings_wanted.dgp;
    if (o.report) rc = overwrite_check(o.report, OUTPUT_PAGE);
    if (o.csv && !rc) rc = overwrite_check(o.csv, OUTPUT_TABLE);
    if (o.svg && !rc) rc = overwrite_check(o.svg, OUTPUT_CURVE);
    if (rc) return rc;
    if (problem_options.params.n) {
        rc = problem_open(&problem);
        if (rc) return rc;
        blocks = problem_blocks(problem, &n_blocks);
    } else {
        const enum imp_status st = imp_problem_create(cli.scene, &problem);
        if (st != IMP_OK) return cli_fail(st, NULL);
    }
    luminaires_tell();
    struct json j;
    if (cli.json) {
        j = cli_json();
        json_integer(&j, "spp", cli_spp(&run));
        json_array(&j, o.grid       ? "grids"
                       : ugr || dgp ? "glare"
                       : year       ? "years"
                                    : "readings");
    }
    const int one = cli_typed("sensor"), first = one ? cli.sensor : 0;
    const int end = one ? first + 1 : scene.n_sensors;
    int *unlit = cli_alloc((size_t)scene.n_sensors, sizeof *unlit), n_unlit = 0;
    struct room_page *page = o.report ? cli_alloc(1, sizeof *page) : NULL;
    bool met = true;
    const struct grid_wanted wanted = {o.ends, o.until, o.csv, o.svg, page};
    if (page && !rc) rc = wants_read(page->want, &page->n_wants);
    if (o.grid && !rc)
        rc = grids_read(&j, run, first, end, &wanted, ENDS_APART, &found.apart, unlit,
                        &n_unlit);
    if (page && !rc) rc = room_page_write(page, o.report, run, &met);
    if (page) room_page_free(page);
    free(page);
    if ((ugr || dgp) && !rc) {
        run.sensor = first;
        rc = ratings_read(&j, &run, o.csv, o.svg);
    }
    if (year && !rc) {
        run.sensor = first;
        rc = year_read(&j, &run, o.csv, o.svg);
    }
    const bool others = o.grid || ugr || dgp || year;
    for (int s = first; s < end && !rc && !others; s++) {
        run.sensor = s;
        found.lit = 0;
        rc = o.shares ? shares_read(&j, &run, &found)
                      : sensor_read(problem, &j, run, blocks, n_blocks, &found);
        if (!rc && !found.lit) unlit[n_unlit++] = s;
    }
    if (cli.json && !rc) json_end_array(&j);
    if (!rc) unlit_tell(&j, unlit, n_unlit);
    if (cli.json && !rc) cli_json_end(&j);
    free(unlit);
    free(blocks);
    problem_close(problem);
    if (rc) return rc;
    return found.apart || !met ? EXIT_NO : cli_done();
}

/* Readings take --spp samples: a clock cannot end them, and no manifest has them. */
static const struct arg_option options_part[] = {OPTION_PART, {0}};

const struct command command_read = {
    {"read",
     "SCENE",
     "the readings of all sensors, with units, errors and derivatives",
     {options, options_ratings, options_wants, options_year, options_params, options_run,
      options_part, options_scene, options_file, options_general},
     1,
     1},
    run_read,
    1,
    0,
    REPLAYS_PARTS};
