/* SPDX-License-Identifier: Apache-2.0
 *
 * A grid is read, printed, and written as a table. */
#include "read_grid.h"
#include "shared/command.h"
#include "shared/output.h"
#include "shared/wanted.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double squares(const struct grid *g)
{
    double sum = 0;
    for (size_t i = 0; i < g->n; i++) sum += g->se[i] * g->se[i];
    return sum;
}

/* The other end's numbers take the place of g's where their errors are smaller. */
static int other_end(struct imp_run run, struct grid *g, struct imp_estimate *average,
                     int64_t *sets)
{
    double *value = cli_alloc(2 * g->n, sizeof *value), *se = value + g->n;
    struct imp_estimate other;
    int64_t other_sets;
    run.from = IMP_FROM_LIGHTS;
    const enum imp_status st =
        imp_grid_read(cli.scene, &run, value, se, &other, &other_sets);
    if (st != IMP_OK) {
        free(value);
        return cli_fail(st, cli.scene_path);
    }
    const double both = hypot(average->se, other.se);
    g->z = both > 0 ? (other.value - average->value) / both : 0;
    double theirs = 0;
    for (size_t i = 0; i < g->n; i++) theirs += se[i] * se[i];
    if (theirs < squares(g) && !(theirs == 0 && other.value == 0)) {
        memcpy(g->value, value, g->n * sizeof *value);
        memcpy(g->se, se, g->n * sizeof *se);
        *average = other;
        *sets = other_sets;
        g->from = "lights";
    }
    free(value);
    return 0;
}

int grid_open(int sensor, struct grid *out)
{
    struct imp_sensor_info info = {.size = sizeof info};
    struct grid *g = out;
    *g = (struct grid){.sensor = sensor, .z = NAN, .summary = IMP_GRID_SUMMARY_INIT};
    g->summary.size = sizeof g->summary;
    g->end = (struct imp_until_end)IMP_UNTIL_END_INIT;
    g->end.size = sizeof g->end;
    enum imp_status st = imp_scene_get_sensor(cli.scene, sensor, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    g->name = info.name;
    g->unit = info.unit;
    g->n = (size_t)info.width * (size_t)info.height;
    g->points = cli_alloc(5 * g->n, sizeof *g->points);
    g->value = g->points + 3 * g->n;
    g->se = g->value + g->n;
    g->cell = cli_alloc(2 * g->n, sizeof *g->cell);
    st = imp_grid_points(cli.scene, sensor, g->points, NULL);
    if (st == IMP_OK)
        st = imp_grid_cells(cli.scene, sensor, &g->columns, &g->rows, g->cell);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

/* From one end, with samples by point or without. */
static enum imp_status one_end(struct imp_run run, struct grid *g,
                               struct imp_estimate *average, int64_t *sets)
{
    if (!(g->until > 0))
        return imp_grid_read(cli.scene, &run, g->value, g->se, average, sets);
    const struct imp_until_options until = until_options(g->until, &run);
    return imp_grid_read_until(cli.scene, &run, &until, g->value, g->se, average, sets,
                               &g->end);
}

int grid_read(struct imp_run run, double until, int ends, struct grid *out)
{
    struct imp_estimate average;
    int64_t sets;
    struct grid g;
    int rc = grid_open(run.sensor, &g);
    if (ends) run.from = IMP_FROM_SENSOR, g.from = "sensor";
    g.until = until;
    if (!rc) {
        const enum imp_status st = one_end(run, &g, &average, &sets);
        if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    }
    if (!rc && ends) rc = other_end(run, &g, &average, &sets);
    if (!rc) {
        const enum imp_status st = imp_grid_summarise(cli.context, g.n, g.value, g.se,
                                                      &average, sets, 0, &g.summary);
        if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    }
    if (rc) grid_free(&g);
    else *out = g;
    return rc;
}

void grid_free(struct grid *g)
{
    free(g->points);
    free(g->cell);
    g->points = g->value = g->se = NULL;
    g->cell = NULL;
}

void grid_size_text(const struct grid *g, char *text, size_t size)
{
    if (g->n == (size_t)g->columns * (size_t)g->rows)
        snprintf(text, size, "%d x %d points", g->columns, g->rows);
    else snprintf(text, size, "%zu of %d x %d points", g->n, g->columns, g->rows);
}

static void row_print(const char *what, const struct imp_interval_estimate *e,
                      const char *unit)
{
    char interval[64];
    snprintf(interval, sizeof interval, "[%.5g, %.5g]", e->lo, e->hi);
    printf("    %-12s %-10.5g %-22s %s", what, e->value, interval, unit);
}

static void place_print(const struct grid *g, size_t at)
{
    const double *p = g->points + 3 * at;
    printf("   at %g, %g, %g", p[0], p[1], p[2]);
}

void grid_print(const struct grid *g)
{
    const struct imp_grid_summary *s = &g->summary;
    char size[64];
    grid_size_text(g, size, sizeof size);
    printf("%s: %s", g->name, size);
    if (g->from) printf(", from the %s (z %.1f)", g->from, g->z);
    printf("; %g %% intervals\n", 100 * s->confidence);
    row_print("average", &s->average, g->unit);
    printf("\n");
    row_print("minimum", &s->minimum, g->unit);
    place_print(g, s->at_minimum);
    printf("\n");
    row_print("maximum", &s->maximum, g->unit);
    place_print(g, s->at_maximum);
    printf("\n");
    row_print("min/average", &s->uniformity, "");
    printf("\n");
    row_print("min/max", &s->diversity, "");
    printf("\n");
}

static void interval_json(struct json *j, const char *key,
                          const struct imp_interval_estimate *e)
{
    json_object(j, key);
    json_number(j, "value", e->value);
    json_numbers(j, "interval", 2, (double[2]){e->lo, e->hi});
    json_end_object(j);
}

void grid_places_json(struct json *j, const struct grid *g)
{
    json_integer(j, "width", g->columns);
    json_integer(j, "height", g->rows);
    json_array(j, "cells");
    for (size_t i = 0; i < g->n; i++)
        json_numbers(j, NULL, 2, (double[2]){g->cell[2 * i], g->cell[2 * i + 1]});
    json_end_array(j);
    json_array(j, "points");
    for (size_t i = 0; i < g->n; i++) json_numbers(j, NULL, 3, g->points + 3 * i);
    json_end_array(j);
}

void grid_json(struct json *j, const struct grid *g)
{
    const struct imp_grid_summary *s = &g->summary;
    json_object(j, NULL);
    json_text(j, "sensor", g->name);
    json_text(j, "unit", g->unit);
    grid_places_json(j, g);
    if (g->from) {
        json_text(j, "from", g->from);
        json_number(j, "z", g->z);
    }
    if (g->until > 0) {
        until_json(j, g->until, &g->end);
        json_integer(j, "samples", g->end.spp);
    }
    json_number(j, "confidence", s->confidence);
    interval_json(j, "average", &s->average);
    interval_json(j, "minimum", &s->minimum);
    interval_json(j, "maximum", &s->maximum);
    interval_json(j, "uniformity", &s->uniformity);
    interval_json(j, "diversity", &s->diversity);
    json_numbers(j, "value", g->n, g->value);
    json_numbers(j, "se", g->n, g->se);
    json_end_object(j);
}

void grid_tell(const struct grid *g)
{
    size_t dark = 0, first = 0;
    for (size_t i = 0; i < g->n; i++)
        if (g->value[i] == 0 && g->se[i] == 0 && dark++ == 0) first = i;
    if (dark == 0 || dark == g->n) return; /* all of them: unlit, said elsewhere */
    const double *p = g->points + 3 * first;
    cli_say("importon: warning: sensor '%s': no light at %zu of %zu points, the first at "
            "%g, %g, %g: is a part of the grid behind a wall or inside of something?",
            g->name, dark, g->n, p[0], p[1], p[2]);
}

int grid_csv(const char *path, const struct grid *g)
{
    struct output o;
    int rc = output_open(&o, path, OUTPUT_TABLE);
    if (rc) return rc;
    fprintf(o.file, "column,row,x,y,z,value,se\n");
    for (size_t i = 0; i < g->n; i++) {
        const double *p = g->points + 3 * i;
        fprintf(o.file, "%d,%d,%.9g,%.9g,%.9g,%.9g,%.3g\n", (int)g->cell[2 * i],
                (int)g->cell[2 * i + 1], p[0], p[1], p[2], g->value[i], g->se[i]);
    }
    return output_close(&o, rc);
}
