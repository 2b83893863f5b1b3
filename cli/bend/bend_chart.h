/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures with axes: a plot area of pixels, tick marks with numbers, a colour bar or a
 * legend beside it. */
#ifndef IMP_CLI_CMD_BEND_CHART_H
#define IMP_CLI_CMD_BEND_CHART_H

#include <importon/importon.h>

/* Linear rgb. */
typedef float chart_colour[3];

struct chart {
    imp_film *film;
    float *pixels;     /* of the film, [height][width][3] */
    int width, height; /* of the film */
    int columns, rows; /* of the plot area */
    double x[2], y[2]; /* coordinates at its left and right, bottom and top border */
};

/* A white picture with a plot area of columns x rows pixels and room around it. 0, or an
 * exit code with the reason printed. */
int chart_open(struct chart *c, int columns, int rows, const double x[2],
               const double y[2]);
/* Pixel (column, row) of the plot area, row 0 at the top. */
void chart_pixel(struct chart *c, int column, int row, const chart_colour colour);
/* A line one pixel wide with soft edges, in coordinates, cut at the border. */
void chart_line(struct chart *c, double x0, double y0, double x1, double y1,
                const chart_colour colour);
/* A small cross. */
void chart_cross(struct chart *c, double x, double y, const chart_colour colour);
/* Border, ticks, numbers, the names of the axes. */
void chart_axes(struct chart *c, const char *x_name, const char *y_name);
/* Colours from `lo` (map(0)) to `hi` (map(1)) beside the plot area. */
void chart_bar(struct chart *c, const char *name, double lo, double hi,
               void (*map)(double t, chart_colour colour));
/* Line `at` of a list of names with their colours, beside the plot area. */
void chart_legend(struct chart *c, int at, const char *name, const chart_colour colour);
/* Write DIR/<prefix><name>.png and close. 0, or an exit code with the reason printed. */
int chart_save(struct chart *c, const char *folder, const char *prefix, const char *name);

#endif
