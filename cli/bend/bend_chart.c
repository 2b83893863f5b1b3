/* SPDX-License-Identifier: Apache-2.0
 *
 * A line chart as an 8-bit picture, with a bitmap font of its own. */
#include "bend_chart.h"
#include "shared/command.h"
#include "shared/picture_files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEFT = 108, RIGHT = 144, TOP = 28, BOTTOM = 60, TICK = 6 };
/* Letters are dots of 5 x 7, each dot 2 x 2 pixels. */
enum { DOT = 2, LETTER = 6 * DOT, LINE = 7 * DOT };

static const chart_colour black = {0, 0, 0};

/* Rows of five dots from the top, the leftmost dot the highest of five bits. */
static const struct {
    char c;
    unsigned char row[7];
} letters[] = {
    {'0', {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e}},
    {'1', {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e}},
    {'2', {0x0e, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1f}},
    {'3', {0x1f, 0x02, 0x04, 0x02, 0x01, 0x11, 0x0e}},
    {'4', {0x02, 0x06, 0x0a, 0x12, 0x1f, 0x02, 0x02}},
    {'5', {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e}},
    {'6', {0x06, 0x08, 0x10, 0x1e, 0x11, 0x11, 0x0e}},
    {'7', {0x1f, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08}},
    {'8', {0x0e, 0x11, 0x11, 0x0e, 0x11, 0x11, 0x0e}},
    {'9', {0x0e, 0x11, 0x11, 0x0f, 0x01, 0x02, 0x0c}},
    {'a', {0x00, 0x00, 0x0e, 0x01, 0x0f, 0x11, 0x0f}},
    {'b', {0x10, 0x10, 0x1e, 0x11, 0x11, 0x11, 0x1e}},
    {'c', {0x00, 0x00, 0x0e, 0x10, 0x10, 0x11, 0x0e}},
    {'d', {0x01, 0x01, 0x0f, 0x11, 0x11, 0x11, 0x0f}},
    {'e', {0x00, 0x00, 0x0e, 0x11, 0x1f, 0x10, 0x0e}},
    {'f', {0x06, 0x09, 0x08, 0x1c, 0x08, 0x08, 0x08}},
    {'g', {0x00, 0x0f, 0x11, 0x11, 0x0f, 0x01, 0x0e}},
    {'h', {0x10, 0x10, 0x16, 0x19, 0x11, 0x11, 0x11}},
    {'i', {0x04, 0x00, 0x0c, 0x04, 0x04, 0x04, 0x0e}},
    {'l', {0x0c, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0e}},
    {'m', {0x00, 0x00, 0x1a, 0x15, 0x15, 0x11, 0x11}},
    {'n', {0x00, 0x00, 0x16, 0x19, 0x11, 0x11, 0x11}},
    {'o', {0x00, 0x00, 0x0e, 0x11, 0x11, 0x11, 0x0e}},
    {'r', {0x00, 0x00, 0x16, 0x19, 0x10, 0x10, 0x10}},
    {'s', {0x00, 0x00, 0x0e, 0x10, 0x0e, 0x01, 0x1e}},
    {'t', {0x08, 0x08, 0x1c, 0x08, 0x08, 0x09, 0x06}},
    {'u', {0x00, 0x00, 0x11, 0x11, 0x11, 0x13, 0x0d}},
    {'v', {0x00, 0x00, 0x11, 0x11, 0x11, 0x0a, 0x04}},
    {'x', {0x00, 0x00, 0x11, 0x0a, 0x04, 0x0a, 0x11}},
    {'y', {0x00, 0x00, 0x11, 0x11, 0x0f, 0x01, 0x0e}},
    {'z', {0x00, 0x00, 0x1f, 0x02, 0x04, 0x08, 0x1f}},
    {'-', {0x00, 0x00, 0x00, 0x1f, 0x00, 0x00, 0x00}},
    {'+', {0x00, 0x04, 0x04, 0x1f, 0x04, 0x04, 0x00}},
    {'.', {0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c}},
    {'/', {0x00, 0x01, 0x02, 0x04, 0x08, 0x10, 0x00}},
    {' ', {0}},
};

/* ---- Pixels -------------------------------------------------------------------- */

static void put(struct chart *c, int x, int y, const chart_colour colour, float cover)
{
    if (x < 0 || y < 0 || x >= c->width || y >= c->height) return;
    float *p = c->pixels + 3 * ((size_t)y * (size_t)c->width + (size_t)x);
    for (int k = 0; k < 3; k++) p[k] += cover * (colour[k] - p[k]);
}

static void block(struct chart *c, int x, int y, int w, int h, const chart_colour colour)
{
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) put(c, x + i, y + j, colour, 1);
}

/* The text with its top left at (x, y). */
static void text(struct chart *c, int x, int y, const char *s)
{
    for (; *s; s++, x += LETTER)
        for (size_t k = 0; k < sizeof letters / sizeof *letters; k++) {
            if (letters[k].c != *s) continue;
            for (int j = 0; j < 7; j++)
                for (int i = 0; i < 5; i++)
                    if (letters[k].row[j] >> (4 - i) & 1)
                        block(c, x + i * DOT, y + j * DOT, DOT, DOT, black);
        }
}
static int text_width(const char *s) { return (int)strlen(s) * LETTER - DOT; }

static double column_of(const struct chart *c, double x)
{
    return (x - c->x[0]) / (c->x[1] - c->x[0]) * c->columns;
}
static double row_of(const struct chart *c, double y)
{
    return (c->y[1] - y) / (c->y[1] - c->y[0]) * c->rows;
}

void chart_pixel(struct chart *c, int column, int row, const chart_colour colour)
{
    if (column >= 0 && row >= 0 && column < c->columns && row < c->rows)
        put(c, LEFT + column, TOP + row, colour, 1);
}

static void dab(struct chart *c, int column, int row, const chart_colour colour, float a)
{
    if (column >= 0 && row >= 0 && column < c->columns && row < c->rows)
        put(c, LEFT + column, TOP + row, colour, a);
}

static void segment(struct chart *c, double x0, double y0, double x1, double y1,
                    const chart_colour colour)
{
    const double length = hypot(x1 - x0, y1 - y0);
    if (!(length < 1e5) || !(fabs(x0) < 1e8) || !(fabs(y0) < 1e8)) return;
    const int n = (int)(2 * length) + 1;
    for (int i = 0; i < n; i++) {
        const double x = x0 + (x1 - x0) * i / n - 0.5, y = y0 + (y1 - y0) * i / n - 0.5;
        const int ix = (int)floor(x), iy = (int)floor(y);
        const float u = (float)(x - ix), v = (float)(y - iy);
        dab(c, ix, iy, colour, 0.5f * (1 - u) * (1 - v));
        dab(c, ix + 1, iy, colour, 0.5f * u * (1 - v));
        dab(c, ix, iy + 1, colour, 0.5f * (1 - u) * v);
        dab(c, ix + 1, iy + 1, colour, 0.5f * u * v);
    }
}

void chart_line(struct chart *c, double x0, double y0, double x1, double y1,
                const chart_colour colour)
{
    segment(c, column_of(c, x0), row_of(c, y0), column_of(c, x1), row_of(c, y1), colour);
}

void chart_cross(struct chart *c, double x, double y, const chart_colour colour)
{
    const double column = column_of(c, x), row = row_of(c, y);
    segment(c, column - 2.5, row, column + 2.5, row, colour);
    segment(c, column, row - 2.5, column, row + 2.5, colour);
}

/* ---- Axes ---------------------------------------------------------------------- */

/* 1, 2 or 5 times a power of ten: about four of them in `span`. */
static double tick_step(double span)
{
    const double raw = span / 4, power = pow(10, floor(log10(raw)));
    return power * (raw < 1.5 * power   ? 1
                    : raw < 3.5 * power ? 2
                    : raw < 7.5 * power ? 5
                                        : 10);
}

/* Ticks from lo to hi; returns their number. Numbers are written with the digits that
 * tell neighbours apart. */
enum { TICKS_MAX = 16 };
struct tick {
    double at;
    char name[24];
};
static int ticks(double lo, double hi, struct tick out[TICKS_MAX])
{
    int n = 0;
    if (!(hi > lo) || !isfinite(hi - lo)) return 0;
    const double step = tick_step(hi - lo), most = fmax(fabs(lo), fabs(hi));
    const int digits = (int)fmin(fmax(ceil(log10(most / step) + 1), 2), 9);
    const double first = ceil(lo / step - 1e-9);
    for (; n < TICKS_MAX && (first + n) * step <= hi + 1e-9 * step; n++) {
        out[n].at = (first + n) * step;
        if (fabs(out[n].at) < 1e-9 * step) out[n].at = 0;
        snprintf(out[n].name, sizeof out[n].name, "%.*g", digits, out[n].at);
    }
    return n;
}

void chart_axes(struct chart *c, const char *x_name, const char *y_name)
{
    struct tick t[TICKS_MAX];
    const int right = LEFT + c->columns, below = TOP + c->rows;
    block(c, LEFT - 1, TOP - 1, c->columns + 2, 1, black);
    block(c, LEFT - 1, below, c->columns + 2, 1, black);
    block(c, LEFT - 1, TOP - 1, 1, c->rows + 2, black);
    block(c, right, TOP - 1, 1, c->rows + 2, black);
    int n = ticks(c->x[0], c->x[1], t);
    for (int k = 0; k < n; k++) {
        const int x = LEFT + (int)lround(column_of(c, t[k].at));
        block(c, x, below, 1, TICK, black);
        text(c, x - text_width(t[k].name) / 2, below + TICK + 2, t[k].name);
    }
    text(c, LEFT + (c->columns - text_width(x_name)) / 2, below + TICK + LINE + 10,
         x_name);
    n = ticks(fmin(c->y[0], c->y[1]), fmax(c->y[0], c->y[1]), t);
    for (int k = 0; k < n; k++) {
        const int y = TOP + (int)lround(row_of(c, t[k].at));
        block(c, LEFT - TICK, y, TICK, 1, black);
        text(c, LEFT - TICK - 4 - text_width(t[k].name), y - LINE / 2, t[k].name);
    }
    const int room = LEFT - TICK - 4 - text_width(y_name);
    text(c, room > 4 ? room : 4, TOP - LINE - 8, y_name);
}

void chart_bar(struct chart *c, const char *name, double lo, double hi,
               void (*map)(double t, chart_colour colour))
{
    enum { GAP = 20, WIDE = 20 };
    struct tick t[TICKS_MAX];
    const int x = LEFT + c->columns + GAP;
    for (int j = 0; j < c->rows; j++) {
        chart_colour colour;
        map((c->rows - j - 0.5) / c->rows, colour);
        block(c, x, TOP + j, WIDE, 1, colour);
    }
    text(c, x, TOP - LINE - 8, name);
    const int n = ticks(lo, hi, t);
    for (int k = 0; k < n; k++) {
        const int y = TOP + (int)lround((hi - t[k].at) / (hi - lo) * c->rows);
        block(c, x + WIDE, y, TICK, 1, black);
        text(c, x + WIDE + TICK + 2, y - LINE / 2, t[k].name);
    }
    if (n > 0) return; /* one value everywhere */
    char value[24];
    snprintf(value, sizeof value, "%.6g", lo);
    text(c, x + WIDE + TICK + 2, TOP + c->rows / 2 - LINE / 2, value);
}

void chart_legend(struct chart *c, int at, const char *name, const chart_colour colour)
{
    const int x = LEFT + c->columns + 16, y = TOP + at * (LINE + 8);
    if (y + LINE > TOP + c->rows) return;
    block(c, x, y, LINE, LINE, colour);
    text(c, x + LINE + 6, y, name);
}

/* ---- Pictures ------------------------------------------------------------------ */

int chart_open(struct chart *c, int columns, int rows, const double x[2],
               const double y[2])
{
    *c = (struct chart){.columns = columns,
                        .rows = rows,
                        .width = LEFT + columns + RIGHT,
                        .height = TOP + rows + BOTTOM,
                        .x = {x[0], x[1]},
                        .y = {y[0], y[1]}};
    const enum imp_status st =
        imp_film_create(cli.context, c->width, c->height, "R,G,B", &c->film);
    if (st != IMP_OK) return cli_fail(st, NULL);
    c->pixels = imp_film_mean(c->film);
    for (size_t i = 0; i < 3 * (size_t)c->width * (size_t)c->height; i++)
        c->pixels[i] = 1;
    return 0;
}

int chart_save(struct chart *c, const char *folder, const char *prefix, const char *name)
{
    char file[128];
    struct imp_write_options w = IMP_WRITE_OPTIONS_INIT;
    snprintf(file, sizeof file, "%s%s.png", prefix, name);
    char *path = join_path(folder, file);
    const enum imp_status st = imp_film_write(c->film, path, &w);
    const int rc = st == IMP_OK ? 0 : cli_fail(st, path);
    free(path);
    imp_film_destroy(c->film);
    c->film = NULL;
    return rc;
}
