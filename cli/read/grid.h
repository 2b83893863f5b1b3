/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids of readings: the pixels of an irradiancemeter, as text, JSON, a table, and a plan
 * with isolines. */
#ifndef IMP_CLI_GRID_H
#define IMP_CLI_GRID_H

#include "text/json.h"
#include <importon/rooms.h>

struct grid {
    const char *name, *unit; /* of the sensor */
    int width, height;
    size_t n;
    double *points;     /* [n][3] */
    double *value, *se; /* [n] */
    const char *from;   /* which walks they are of: "sensor", "lights", or NULL */
    double z;           /* of the averages of both ends; NAN: one was read */
    struct imp_grid_summary summary;
};

/* Read the grid of run->sensor; `ends`: from both, and what has the smaller error counts.
 * 0, or an exit code with the reason printed. */
int grid_read(struct imp_run run, int ends, struct grid *out);
void grid_free(struct grid *g);
void grid_print(const struct grid *g);
void grid_json(struct json *j, const struct grid *g);
/* Points at which no light was found, in part of the grid: a warning. */
void grid_tell(const struct grid *g);

/* A line a point: column, row, x, y, z, value, se. 0, or an exit code. */
int grid_csv(const char *path, const struct grid *g);
/* The plan of the grid: colours with their scale, isolines, a number at each point where
 * there is room. 0, or an exit code. */
int grid_svg(const char *path, const struct grid *g);

#endif
