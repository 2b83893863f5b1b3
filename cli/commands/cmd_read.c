/* SPDX-License-Identifier: Apache-2.0
 *
 * importon read: the numbers of a scene's sensors, means over their films, with standard
 * errors, units and derivatives; from either end, or from both to compare them. */
#include "read/read_grid.h"
#include "read/read_ratings.h"
#include "read/read_year.h"
#include "read/room_page.h"
#include "shared/blocks.h"
#include "shared/command.h"
#include "shared/overwrite.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "shared/wanted.h"
#include "text/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define APART 5 /* standard errors between the ends that chance does not explain */

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

struct findings {
    int apart; /* do the ends differ? */
    int lit;   /* has light reached the present sensor? */
};

struct reading {
    struct imp_estimate value;
    double *grad, *se; /* NULL: no derivatives are wanted */
};

/* Adjoint of the mean over the film of one channel, or of the luminance (channel -1). */
static float *adjoint_of(const struct imp_sensor_info *sensor, int channels, int channel)
{
    const size_t pixels = (size_t)sensor->width * (size_t)sensor->height;
    float *a = cli_alloc(pixels * (size_t)channels, sizeof *a);
    for (size_t p = 0; p < pixels; p++)
        for (int c = 0; c < channels; c++)
            a[p * (size_t)channels + (size_t)c] =
                (float)((channel == c                   ? 1
                         : channel < 0 && channels == 1 ? 1
                         : channel < 0                  ? picture_luminance[c]
                                                        : 0) /
                        (double)pixels);
    return a;
}

static void print_number(struct json *j, const char *key, double value, double se)
{
    json_object(j, key);
    json_number(j, "value", value);
    json_number(j, "se", se);
    json_end_object(j);
}

static void print_derivatives(const struct block *blocks, size_t n_blocks,
                              const struct reading *r, const char *unit)
{
    for (size_t b = 0; b < n_blocks; b++)
        for (size_t k = 0; k < blocks[b].n && !block_is_large(&blocks[b]); k++) {
            char name[256];
            const size_t at = blocks[b].first + k;
            cli_number_row(&blocks[b].info, k, name, sizeof name);
            if (block_held(&blocks[b], k)) {
                printf("    d/d %-28s held\n", name);
                continue;
            }
            printf("    d/d %-28s %-12.6g +- %-8.2g %s / (%s)\n", name, r->grad[at],
                   r->se[at], unit, blocks[b].info.unit);
        }
}

static void json_derivatives(struct json *j, const struct block *blocks, size_t n_blocks,
                             const struct reading *r)
{
    json_array(j, "derivatives");
    for (size_t b = 0; b < n_blocks; b++) {
        block_json(j, &blocks[b]);
        json_numbers(j, "grad", blocks[b].n, r->grad + blocks[b].first);
        json_numbers(j, "se", blocks[b].n, r->se + blocks[b].first);
        json_end_object(j);
    }
    json_end_array(j);
}

/* A number as JSON or as a line; the object stays open for derivatives. */
static void number_print(struct json *j, const struct imp_sensor_info *info,
                         const char *channel, struct imp_estimate value,
                         struct imp_estimate other, struct findings *found)
{
    const double both = hypot(value.se, other.se);
    const double z = both > 0                     ? (other.value - value.value) / both
                     : other.value == value.value ? 0
                                                  : INFINITY;
    if (o.ends) found->apart |= !(fabs(z) <= APART);
    found->lit |= value.value != 0 || value.se > 0 || other.value != 0 || other.se > 0;
    if (cli.json) {
        json_object(j, NULL);
        json_text(j, "sensor", info->name);
        json_text(j, "channel", channel);
        json_text(j, "unit", info->unit);
        json_number(j, "value", value.value);
        json_number(j, "se", value.se);
        if (o.ends) {
            print_number(j, "from_lights", other.value, other.se);
            json_number(j, "z", z);
        }
        return;
    }
    printf("%-20s %-3s %-12.6g +- %-8.2g %s", info->name, channel, value.value, value.se,
           info->unit);
    if (o.ends)
        printf("   from the lights %-12.6g +- %-8.2g z %.1f", other.value, other.se, z);
    printf("\n");
}

/* One number of one sensor. */
static int number_read(imp_problem *problem, struct json *j, struct imp_run run,
                       const struct imp_sensor_info *info, const char *channel,
                       const float *adjoint, const struct block *blocks, size_t n_blocks,
                       struct findings *found)
{
    const size_t n = n_blocks ? imp_problem_n_variables(problem) : 0;
    struct reading r = {.grad = n ? cli_alloc(n, sizeof(double)) : NULL,
                        .se = n ? cli_alloc(n, sizeof(double)) : NULL};
    struct imp_estimate other = {0};
    int rc = 0;
    if (o.ends) run.from = IMP_FROM_SENSOR;
    enum imp_status st =
        imp_problem_functional(problem, adjoint, &run, &r.value, r.grad, r.se);
    if (st == IMP_OK && o.ends) {
        run.from = IMP_FROM_LIGHTS;
        st = imp_problem_functional(problem, adjoint, &run, &other, NULL, NULL);
    }
    if (st != IMP_OK) {
        rc = cli_fail(st, cli.scene_path);
        goto out;
    }
    number_print(j, info, channel, r.value, other, found);
    if (n && cli.json) json_derivatives(j, blocks, n_blocks, &r);
    if (n && !cli.json) print_derivatives(blocks, n_blocks, &r, info->unit);
    if (cli.json) json_end_object(j);
out:
    free(r.grad);
    free(r.se);
    return rc;
}

/* The film of one pixel of a sensor: mean and standard error of its channels. */
static int pixel_read(struct imp_run run, int n, struct imp_estimate *out)
{
    imp_film *film = NULL;
    const enum imp_status st = imp_render(cli.scene, &run, &film);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    for (int c = 0; c < n; c++)
        out[c] = (struct imp_estimate){.value = imp_film_mean(film)[c],
                                       .se = imp_film_se(film)[c]};
    imp_film_destroy(film);
    return 0;
}

/* A specfilm's numbers, one for each response curve. */
static int curves_read(struct json *j, struct imp_run run,
                       const struct imp_sensor_info *info, struct findings *found)
{
    const int n = info->n_responses;
    if (info->width != 1 || info->height != 1)
        return cli_error(EXIT_USAGE,
                         "%s: sensor '%s' has %d x %d pixels; of a film with response "
                         "curves one pixel is read (render makes pictures)",
                         cli.scene_path, info->name, info->width, info->height);
    struct imp_estimate *value = cli_alloc(2 * (size_t)n, sizeof *value);
    struct imp_estimate *other = value + n;
    if (o.ends) run.from = IMP_FROM_SENSOR;
    int rc = pixel_read(run, n, value);
    if (!rc && o.ends) {
        run.from = IMP_FROM_LIGHTS;
        rc = pixel_read(run, n, other);
    }
    for (int c = 0; c < n && !rc; c++) {
        number_print(j, info, info->response_names[c], value[c], other[c], found);
        if (cli.json) json_end_object(j);
    }
    free(value);
    return rc;
}

static int sensor_read(imp_problem *problem, struct json *j, struct imp_run run,
                       const struct block *blocks, size_t n_blocks,
                       struct findings *found)
{
    static const char *const names[] = {"R", "G", "B"};
    struct imp_sensor_info info = {.size = sizeof info};
    struct imp_scene_info scene = {.size = sizeof scene};
    imp_scene_get_info(cli.scene, &scene);
    const enum imp_status st = imp_scene_get_sensor(cli.scene, run.sensor, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    if (info.n_responses > 0 && n_blocks == 0) return curves_read(j, run, &info, found);
    const int luminous = strchr("lc", info.unit[0]) != NULL; /* lx, cd m^-2 */
    const int one = luminous || scene.channels == 1;
    int rc = 0;
    for (int c = 0; c < (one ? 1 : scene.channels) && !rc; c++) {
        float *adjoint = adjoint_of(&info, scene.channels, one ? -1 : c);
        rc = number_read(problem, j, run, &info, one ? "Y" : names[c], adjoint, blocks,
                         n_blocks, found);
        free(adjoint);
    }
    return rc;
}

/* The reading of a sensor, and the rows of lamps and materials. */
static int shares_read(struct json *j, const struct imp_run *run, struct findings *found)
{
    struct imp_sensor_info info = {.size = sizeof info};
    struct imp_estimate reading;
    struct imp_share *share = NULL;
    size_t n;
    enum imp_status st = imp_scene_get_sensor(cli.scene, run->sensor, &info);
    if (st == IMP_OK) st = imp_reading_shares(cli.scene, run, NULL, 0, &n, NULL);
    if (st == IMP_OK) {
        share = cli_alloc(n + 1, sizeof *share);
        st = imp_reading_shares(cli.scene, run, share, n + 1, &n, &reading);
    }
    if (st != IMP_OK) {
        free(share);
        return cli_fail(st, cli.scene_path);
    }
    number_print(j, &info, "Y", reading, (struct imp_estimate){0}, found);
    if (cli.json) json_array(j, "shares");
    for (size_t k = 0; k < n; k++) {
        const struct imp_share *s = &share[k];
        const char *of = s->of == IMP_SHARE_LIGHT ? "light" : "material";
        const double part = reading.value > 0 ? s->value / reading.value : 0;
        if (s->of == IMP_SHARE_SURFACE && s->value == 0 && s->se == 0) continue;
        if (cli.json) {
            json_object(j, NULL);
            json_text(j, "of", of);
            json_text(j, "name", s->name);
            json_number(j, "value", s->value);
            json_number(j, "se", s->se);
            json_number(j, "part", part);
            json_end_object(j);
        } else {
            printf("    %-8s %-23s %-12.6g +- %-8.2g %s %7.1f %%\n", of, s->name,
                   s->value, s->se, info.unit, 100 * part);
        }
    }
    if (cli.json) json_end_array(j), json_end_object(j);
    free(share);
    return 0;
}

/* Sensors to which no walk brought light. */
static void unlit_tell(struct json *j, const int *sensor, int n)
{
    if (cli.json) json_array(j, "unlit");
    for (int k = 0; k < n; k++) {
        struct imp_sensor_info info = {.size = sizeof info};
        if (imp_scene_get_sensor(cli.scene, sensor[k], &info) != IMP_OK) continue;
        if (cli.json) json_text(j, NULL, info.name);
        cli_say(
            "importon: warning: sensor '%s' (%s): no walk brought light to it, and its "
            "error of 0 means nothing: is it in the dark, or do walks of the other end "
            "find it?",
            info.name, info.type);
    }
    if (cli.json) json_end_array(j);
}

static int run_read(int n, char **operand)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    struct block *blocks = NULL;
    size_t n_blocks = 0;
    imp_problem *problem = NULL;
    struct findings found = {0, 0};
    (void)n;
    cli.brief = !o.ends && !o.shares && !year_wanted.weather;
    int rc = cli_load(operand[0]);
    if (rc) return rc;
    struct imp_run run = cli_run();
    imp_scene_get_info(cli.scene, &scene);
    if (scene.n_sensors == 0)
        return cli_error(EXIT_USAGE, "%s: there is no sensor in it", cli.scene_path);
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
    if (year && !cli_typed("sensor") && scene.n_sensors > 1)
        return cli_error(
            EXIT_USAGE,
            "%s: it has %d sensors, and --year is of one grid: choose it with "
            "--sensor",
            cli.scene_path, scene.n_sensors);
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
    if (o.until > 0 && (rc = until_refused()) != 0) return rc;
    if (o.report && !o.grid)
        return cli_error(EXIT_USAGE, "--report is of grids: it goes with --grid");
    if (wants_given() && !o.report)
        return cli_error(EXIT_USAGE,
                         "--want is compared on a page: it goes with --report");
    if (o.report) rc = overwrite_check(o.report, OUTPUT_PAGE);
    if (o.csv && !rc) rc = overwrite_check(o.csv, OUTPUT_TABLE);
    if (o.svg && !rc) rc = overwrite_check(o.svg, OUTPUT_CURVE);
    if (rc) return rc;
    if (o.ends && cli.from)
        return cli_error(EXIT_USAGE, "--ends reads from both: it goes without --from");
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
        rc = grids_read(&j, run, first, end, &wanted, APART, &found.apart, unlit,
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
