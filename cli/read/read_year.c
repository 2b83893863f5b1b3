/* SPDX-License-Identifier: Apache-2.0
 *
 * read --year: daylight autonomy, useful daylight and exposure of a weather file's year, as text,
 * JSON, a table, and a plan of the autonomy. */
#include "read_year.h"
#include "read_grid.h"
#include "shared/command.h"
#include "shared/output.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HOURS_MAX 8784 /* of a leap year, the longest that is read */
#define SPP_LEAST 1024 /* samples from which the bias of hours over a bound is small */

struct year_wanted year_wanted = {NULL, {8, 18}, 300};

const struct arg_option options_year[] = {
    {ARG_TEXT, 0, "year", "FILE",
     "daylight over the hours of an EPW weather file: autonomy, useful daylight, "
     "exposure",
     &year_wanted.weather, 0, 0, NULL},
    {ARG_PAIR | ARG_REPLAYS, 0, "hours", "OPENS,CLOSES",
     "hours of use of every day, standard time (8,18)", year_wanted.hours, 0, 0, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "wanted", "LX", "illuminance of the autonomy (300)",
     &year_wanted.lux, 1e-3, 1e9, NULL},
    {0}};

struct year {
    struct imp_weather_info weather;
    struct imp_weather_hour *hour; /* [weather.n] */
    struct imp_annual_options options;
    struct imp_annual_summary all;
    struct imp_annual_point *point; /* [grid.n] */
    struct grid grid; /* its points; and the autonomy in percent for the plan */
};

static void year_free(struct year *y)
{
    free(y->hour);
    free(y->point);
    grid_free(&y->grid);
}

/* From a file or, by "-", from the standard input. */
static int weather_take(struct year *y)
{
    const bool piped = strcmp(year_wanted.weather, "-") == 0;
    if (piped && cli.scene_path[0] == '<')
        return cli_error(EXIT_USAGE,
                         "the scene is read from stdin, so --year names a file");
    y->weather.size = sizeof y->weather;
    y->hour = cli_alloc(HOURS_MAX, sizeof *y->hour);
    const enum imp_status st =
        imp_weather_read(cli.context, piped ? "/dev/stdin" : year_wanted.weather,
                         &y->weather, y->hour, HOURS_MAX);
    if (st == IMP_OK) return 0;
    const int rc = cli_fail(st, NULL);
    return st == IMP_E_IO ? EXIT_USAGE : rc; /* an input that is not there */
}

static int compute(struct year *y, const struct imp_run *run)
{
    struct grid *g = &y->grid;
    int rc = weather_take(y);
    if (rc) return rc;
    rc = grid_open(run->sensor, g);
    if (rc) return rc;
    g->unit = "% autonomy";
    y->point = cli_alloc(g->n, sizeof *y->point);
    y->options.size = sizeof y->options;
    y->options.opens = year_wanted.hours[0];
    y->options.closes = year_wanted.hours[1];
    y->options.wanted = year_wanted.lux;
    y->all.size = sizeof y->all;
    const enum imp_status st =
        imp_annual_read(cli.scene, run, y->weather.n, y->hour, &y->options, y->point,
                        &y->all, NULL, NULL);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

/* ---- Text --------------------------------------------------------------------------- */

static void part_print(const char *what, const char *of, struct imp_estimate e)
{
    printf("    %-12s %-14s %-10.4g +- %-8.2g %%\n", what, of, 100 * e.value, 100 * e.se);
}

static void text_print(const struct year *y)
{
    static const char *const parts[] = {"below 100 lx", "100 to 300 lx", "300 to 3000",
                                        "above 3000"};
    const struct imp_annual_point *a = &y->all.average;
    char wanted[32];
    snprintf(wanted, sizeof wanted, "%g lx", y->options.wanted);
    char size[64];
    grid_size_text(&y->grid, size, sizeof size);
    printf("%s: %s, %zu hours of use (%d to %d)\n", y->grid.name, size, y->all.hours,
           year_wanted.hours[0], year_wanted.hours[1]);
    const double north = y->weather.latitude, east = y->weather.longitude;
    printf("weather: %s, %g %c, %g %c%s\n", y->weather.place, fabs(north),
           north < 0 ? 'S' : 'N', fabs(east), east < 0 ? 'W' : 'E',
           y->weather.modelled ? "; illuminances by Perez' model from radiation" : "");
    part_print("autonomy", wanted, a->autonomy);
    part_print("continuous", wanted, a->continuous);
    for (int k = 0; k < 4; k++) part_print(k ? "" : "useful", parts[k], a->useful[k]);
    snprintf(wanted, sizeof wanted, "%g lx, 50 %%", y->options.wanted);
    part_print("sDA", wanted, y->all.spatial_autonomy);
    part_print("ASE", "1000 lx, 250 h", y->all.sun_exposure);
    printf("    %-27s %-10.5g +- %-8.2g lx\n", "mean", a->mean.value, a->mean.se);
    printf("    %-27s %-10.5g +- %-8.2g klx h\n", "exposure of the year",
           a->exposure.value / 1000, a->exposure.se / 1000);
}

/* ---- JSON ---------------------------------------------------------------------------- */

static void number_json(struct json *j, const char *key, struct imp_estimate e)
{
    json_object(j, key);
    json_number(j, "value", e.value);
    json_number(j, "se", e.se);
    json_end_object(j);
}

static void point_json(struct json *j, const char *key, const struct imp_annual_point *p,
                       const struct grid *g, size_t at)
{
    json_object(j, key);
    if (g) {
        const int32_t *cell = g->cell + 2 * at;
        json_numbers(j, "cell", 2, (double[2]){cell[0], cell[1]});
        json_numbers(j, "point", 3, g->points + 3 * at);
    }
    number_json(j, "autonomy", p->autonomy);
    number_json(j, "continuous", p->continuous);
    json_array(j, "useful");
    for (int k = 0; k < 4; k++) number_json(j, NULL, p->useful[k]);
    json_end_array(j);
    number_json(j, "mean", p->mean);
    number_json(j, "exposure", p->exposure);
    number_json(j, "sunlit_hours", p->sunlit_hours);
    json_end_object(j);
}

static void json_print(struct json *j, const struct year *y)
{
    json_object(j, NULL);
    json_text(j, "sensor", y->grid.name);
    json_integer(j, "width", y->grid.columns);
    json_integer(j, "height", y->grid.rows);
    json_object(j, "weather");
    json_text(j, "place", y->weather.place);
    json_number(j, "latitude", y->weather.latitude);
    json_number(j, "longitude", y->weather.longitude);
    json_number(j, "timezone", y->weather.timezone);
    json_integer(j, "hours", (int64_t)y->weather.n);
    json_bool(j, "modelled", y->weather.modelled);
    json_end_object(j);
    json_integer(j, "hours", (int64_t)y->all.hours);
    json_number(j, "wanted", y->options.wanted);
    point_json(j, "average", &y->all.average, NULL, 0);
    number_json(j, "spatial_autonomy", y->all.spatial_autonomy);
    number_json(j, "sun_exposure", y->all.sun_exposure);
    json_array(j, "points");
    for (size_t i = 0; i < y->grid.n; i++) point_json(j, NULL, &y->point[i], &y->grid, i);
    json_end_array(j);
    json_end_object(j);
}

/* ---- Files --------------------------------------------------------------------------- */

static int table_write(const char *path, const struct year *y)
{
    struct output o;
    int rc = output_open(&o, path, OUTPUT_TABLE);
    if (rc) return rc;
    fprintf(o.file, "column,row,x,y,z");
    /* Units in brackets; parts of the hours of use, from 0 to 1, have none. */
    static const char *const name[][2] = {
        {"autonomy", ""},  {"continuous", ""},      {"below_100", ""},
        {"below_300", ""}, {"below_3000", ""},      {"above_3000", ""},
        {"mean", " [lx]"}, {"exposure", " [lx h]"}, {"sunlit_hours", " [h]"}};
    for (int k = 0; k < 9; k++)
        fprintf(o.file, ",%s%s,%s_se%s", name[k][0], name[k][1], name[k][0], name[k][1]);
    fprintf(o.file, "\n");
    for (size_t i = 0; i < y->grid.n; i++) {
        const double *p = y->grid.points + 3 * i;
        const struct imp_annual_point *x = &y->point[i];
        const struct imp_estimate e[9] = {x->autonomy,  x->continuous, x->useful[0],
                                          x->useful[1], x->useful[2],  x->useful[3],
                                          x->mean,      x->exposure,   x->sunlit_hours};
        const int32_t *cell = y->grid.cell + 2 * i;
        fprintf(o.file, "%d,%d,%.9g,%.9g,%.9g", (int)cell[0], (int)cell[1], p[0], p[1],
                p[2]);
        for (int k = 0; k < 9; k++) fprintf(o.file, ",%.6g,%.2g", e[k].value, e[k].se);
        fprintf(o.file, "\n");
    }
    return output_close(&o, rc);
}

/* The autonomy in percent as a grid. */
static int plan_write(const char *path, struct year *y)
{
    struct grid *g = &y->grid;
    for (size_t i = 0; i < g->n; i++) {
        g->value[i] = 100 * y->point[i].autonomy.value;
        g->se[i] = 100 * y->point[i].autonomy.se;
    }
    g->summary.size = sizeof g->summary;
    const enum imp_status st =
        imp_grid_summarise(cli.context, g->n, g->value, g->se, NULL, 16, 0, &g->summary);
    return st == IMP_OK ? grid_svg(path, g) : cli_fail(st, NULL);
}

int year_read(struct json *j, const struct imp_run *run, const char *csv, const char *svg)
{
    struct year y = {.options = IMP_ANNUAL_OPTIONS_INIT};
    int rc = compute(&y, run);
    if (!rc && cli.json) json_print(j, &y);
    if (!rc && !cli.json) text_print(&y);
    if (!rc && csv) rc = table_write(csv, &y);
    if (!rc && svg) rc = plan_write(svg, &y);
    if (!rc && y.all.average.mean.value == 0 && y.all.average.exposure.value > 0)
        cli_say("importon: warning: %s: no hour of use (%d to %d, standard time) has "
                "daylight at the grid, and others have: are --hours right?",
                year_wanted.weather, year_wanted.hours[0], year_wanted.hours[1]);
    if (!rc && cli_spp(run) < SPP_LEAST)
        cli_say("importon: warning: %d samples: below %d the autonomy may be low by more "
                "than "
                "its error, and its interval holds less often than 95 %%",
                cli_spp(run), SPP_LEAST);
    year_free(&y);
    return rc;
}
