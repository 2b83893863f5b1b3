/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids of readings: the pixels of an irradiancemeter, as text, JSON, a table, and a plan
 * with isolines. */
#ifndef IMP_CLI_GRID_H
#define IMP_CLI_GRID_H

#include "text/json.h"
#include <importon/rooms.h>

struct room_page;

struct grid {
    int sensor;
    const char *name, *unit; /* of the sensor */
    const char *heading;     /* of a plan; NULL: average and uniformity */
    int columns, rows;       /* of the raster: all of it has points on a rectangle */
    int32_t *cell;           /* [n][2] column and row of each point */
    size_t n;
    double *points;     /* [n][3] */
    double *value, *se; /* [n] */
    double until; /* error that was wanted at each point; 0: as many samples as --spp */
    struct imp_until_end end;
    const char *from; /* which walks they are of: "sensor", "lights", or NULL */
    double z;         /* of the averages of both ends; NAN: one was read */
    struct imp_grid_summary summary;
};

/* Errors come from two samples on: 0, or an exit code with the reason printed, where run.sensor has
 * fewer. */
int grid_samples_check(struct imp_run run);
/* Read the grid of run->sensor; until > 0: to this part at each point; `ends`: from both, and what has the
 * smaller error counts. 0, or an exit code with the reason printed. */
int grid_read(struct imp_run run, double until, int ends, struct grid *out);
/* The places of a sensor's pixels, with room for values and errors. 0, or an exit code with the
 * reason printed; grid_free in either case. */
int grid_open(int sensor, struct grid *out);
void grid_free(struct grid *g);
/* "8 x 5 points", or how many of them there are. */
void grid_size_text(const struct grid *g, char *text, size_t size);
void grid_print(const struct grid *g);
void grid_json(struct json *j, const struct grid *g);
/* width, height, cells and points: the raster, and where the points are. */
void grid_places_json(struct json *j, const struct grid *g);
/* Points at which no light was found, in part of the grid: a warning. */
void grid_tell(const struct grid *g);

struct grid_wanted {
    int ends;               /* are they read from both ends? */
    double until;           /* error of each point; 0: as many samples as --spp */
    const char *csv, *svg;  /* files; NULL: none */
    struct room_page *page; /* which takes the grids; NULL: none */
};
/* Read and print the grids of the sensors [first, end) that have one; *apart becomes 1 where
 * the ends differ by more than most_z standard errors, unlit [*n_unlit] gets those to
 * which no light comes. 0, or an exit code with the reason printed. */
int grids_read(struct json *j, struct imp_run run, int first, int end,
               const struct grid_wanted *wanted, double most_z, int *apart, int *unlit,
               int *n_unlit);
/* A warning for luminaires outside of the box of all shapes. */
void luminaires_tell(void);

/* A line a point: column, row, x, y, z, value, se. 0, or an exit code. */
int grid_csv(const char *path, const struct grid *g);
/* The plan of the grid: colours with their scale, isolines, a number at each point where
 * there is room. Values that are not finite are grey. 0, or an exit code. */
int grid_svg(const char *path, const struct grid *g);
void grid_svg_put(FILE *f, const struct grid *g);

#endif
