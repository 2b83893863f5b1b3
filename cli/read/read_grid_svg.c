/* SPDX-License-Identifier: Apache-2.0
 *
 * The plan of a grid as SVG: a coloured cell for each point, isolines between the points
 * (marching squares, linear along the edges), numbers, and a scale of colours. */
#include "read_grid.h"
#include "shared/command.h"
#include "shared/output.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLAN = 720, MARGIN = 20, TOP = 44, SCALE = 96, STEPS_MAX = 12 };

struct plan {
    const struct grid *g;
    int *point;     /* [rows][columns] of the raster; -1: no point */
    double cell[2]; /* pixels of the drawing */
    double lo, hi;  /* of the colours */
    double step;    /* between isolines */
};

/* 1, 2 or 5 times a power of ten, so that at most STEPS_MAX lie in the range. */
static double step_of(double range)
{
    if (!(range > 0)) return 1;
    double step = pow(10, floor(log10(range / STEPS_MAX)));
    for (int k = 0; range / step > STEPS_MAX && k < 3; k++) step *= k == 1 ? 2.5 : 2;
    return step;
}

/* Between five colours of Viridis (van der Walt and Smith 2015), from dark to light. */
static void colour(double t, char text[8])
{
    static const unsigned char stop[5][3] = {
        {68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}};
    const double x = 4 * fmin(fmax(t, 0), 1);
    const int k = x < 4 ? (int)x : 3;
    int c[3];
    for (int i = 0; i < 3; i++)
        c[i] = (int)lrint(stop[k][i] + (x - k) * (stop[k + 1][i] - stop[k][i]));
    snprintf(text, 8, "#%02x%02x%02x", (unsigned)c[0] & 255, (unsigned)c[1] & 255,
             (unsigned)c[2] & 255);
}

static double part_of(const struct plan *p, double value)
{
    return p->hi > p->lo ? (value - p->lo) / (p->hi - p->lo) : 0.5;
}

/* Rows go up: the film's first row is the shape's v = 0. */
static double x_at(const struct plan *p, double column)
{
    return MARGIN + (column + 0.5) * p->cell[0];
}
static double y_at(const struct plan *p, double row)
{
    return TOP + (p->g->rows - row - 0.5) * p->cell[1];
}

static double length_between(const struct grid *g, size_t a, size_t b)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        const double d = g->points[3 * a + (size_t)k] - g->points[3 * b + (size_t)k];
        sum += d * d;
    }
    return sqrt(sum);
}

/* Between neighbours along columns (0) or rows (1); 0: no two points are neighbours. */
static double spacing_of(const struct plan *p, int along)
{
    const struct grid *g = p->g;
    for (size_t i = 0; i < g->n; i++) {
        const int x = g->cell[2 * i] + (along == 0), y = g->cell[2 * i + 1] + along;
        const int next =
            x < g->columns && y < g->rows ? p->point[y * g->columns + x] : -1;
        if (next >= 0) return length_between(g, i, (size_t)next);
    }
    return 0;
}

static struct plan plan_of(const struct grid *g)
{
    struct plan p = {.g = g, .lo = INFINITY, .hi = -INFINITY};
    const size_t places = (size_t)g->columns * (size_t)g->rows;
    p.point = cli_alloc(places, sizeof *p.point);
    for (size_t i = 0; i < places; i++) p.point[i] = -1;
    for (size_t i = 0; i < g->n; i++)
        p.point[g->cell[2 * i + 1] * g->columns + g->cell[2 * i]] = (int)i;
    double side[2] = {spacing_of(&p, 0), spacing_of(&p, 1)};
    for (int k = 0; k < 2; k++)
        if (side[k] == 0) side[k] = side[1 - k] > 0 ? side[1 - k] : 1;
    const double wide = side[0] * g->columns, high = side[1] * g->rows;
    for (int k = 0; k < 2; k++) p.cell[k] = side[k] * PLAN / fmax(wide, high);
    for (size_t i = 0; i < g->n; i++) {
        if (!isfinite(g->value[i])) continue;
        p.lo = fmin(p.lo, g->value[i]);
        p.hi = fmax(p.hi, g->value[i]);
    }
    if (!(p.lo <= p.hi)) p.lo = p.hi = 0;
    p.step = step_of(p.hi - p.lo);
    return p;
}

static void cells_put(FILE *f, const struct plan *p)
{
    const struct grid *g = p->g;
    for (size_t i = 0; i < g->n; i++) {
        const double column = g->cell[2 * i], row = g->cell[2 * i + 1];
        char c[8] = "#c8ccd2";
        if (isfinite(g->value[i])) colour(part_of(p, g->value[i]), c);
        fprintf(
            f,
            "<rect x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" fill=\"%s\"/>\n",
            x_at(p, column - 0.5), y_at(p, row + 0.5), p->cell[0] + 0.2, p->cell[1] + 0.2,
            c);
    }
}

/* Where the level crosses the edge from corner a to corner b, both in cells. */
static void crossing(const struct plan *p, double level, const double a[3],
                     const double b[3], double out[2])
{
    const double t = (level - a[2]) / (b[2] - a[2]);
    out[0] = x_at(p, a[0] + t * (b[0] - a[0]));
    out[1] = y_at(p, a[1] + t * (b[1] - a[1]));
}

/* The lines of a level in the square with the points (x, y) and (x + 1, y + 1) as corners, if there
 * are all four. Where two opposite corners are above it, the mean decides which way the lines run. */
static void square_put(FILE *f, const struct plan *p, int x, int y, double level)
{
    static const int dx[4] = {0, 1, 1, 0}, dy[4] = {0, 0, 1, 1};
    double corner[4][3], mean = 0, cut[4][2];
    int n = 0;
    for (int k = 0; k < 4; k++) {
        corner[k][0] = x + dx[k];
        corner[k][1] = y + dy[k];
        const int i = p->point[(y + dy[k]) * p->g->columns + x + dx[k]];
        if (i < 0) return;
        corner[k][2] = p->g->value[i];
        if (!isfinite(corner[k][2])) return;
        mean += corner[k][2] / 4;
    }
    for (int k = 0; k < 4; k++) {
        const double *a = corner[k], *b = corner[(k + 1) % 4];
        if ((a[2] >= level) == (b[2] >= level)) continue;
        crossing(p, level, a, b, cut[n++]);
    }
    if (n == 0) return;
    const int turn = n == 4 && (mean >= level) == (corner[0][2] >= level);
    for (int k = 0; k + 1 < n; k += 2) {
        const int a = turn ? k : (k + n - 1) % n, b = turn ? k + 1 : k;
        fprintf(f, "M%.2f %.2fL%.2f %.2f", cut[a][0], cut[a][1], cut[b][0], cut[b][1]);
    }
}

static void isolines_put(FILE *f, const struct plan *p)
{
    for (double level = ceil(p->lo / p->step) * p->step; level < p->hi;
         level += p->step) {
        fprintf(f, "<path fill=\"none\" stroke=\"#fff\" stroke-width=\"1.2\" d=\"");
        for (int y = 0; y + 1 < p->g->rows; y++)
            for (int x = 0; x + 1 < p->g->columns; x++) square_put(f, p, x, y, level);
        fprintf(f, "\"><title>%g %s</title></path>\n", level, p->g->unit);
    }
}

/* A number takes about 28 x 12 pixels. */
static void numbers_put(FILE *f, const struct plan *p)
{
    const struct grid *g = p->g;
    if (p->cell[0] < 28 || p->cell[1] < 12) return;
    for (size_t i = 0; i < g->n; i++) {
        const double column = g->cell[2 * i], row = g->cell[2 * i + 1];
        const double v = g->value[i];
        if (!isfinite(v)) continue;
        fprintf(f,
                "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\" "
                "fill=\"%s\">%.*f</text>\n",
                x_at(p, column), y_at(p, row) + 4, part_of(p, v) > 0.6 ? "#000" : "#fff",
                v < 10    ? 2
                : v < 100 ? 1
                          : 0,
                v);
    }
}

static void scale_put(FILE *f, const struct plan *p, double x, double high)
{
    enum { BANDS = 64 };
    for (int k = 0; k < BANDS; k++) {
        char c[8];
        colour((k + 0.5) / BANDS, c);
        fprintf(
            f, "<rect x=\"%.1f\" y=\"%.2f\" width=\"14\" height=\"%.2f\" fill=\"%s\"/>\n",
            x, TOP + high * (1 - (k + 1.0) / BANDS), high / BANDS + 0.2, c);
    }
    for (double level = ceil(p->lo / p->step) * p->step; level <= p->hi; level += p->step)
        fprintf(f, "<text x=\"%.1f\" y=\"%.1f\">%g</text>\n", x + 19,
                TOP + high * (1 - part_of(p, level)) + 4, level);
    fprintf(f, "<text x=\"%.1f\" y=\"%d\">%s</text>\n", x, TOP - 10, p->g->unit);
}

static void name_put(FILE *f, const char *name)
{
    for (const char *c = name; *c; c++)
        if (strchr("<>&", *c)) fprintf(f, "&#%d;", *c);
        else fputc(*c, f);
}

void grid_svg_put(FILE *f, const struct grid *g)
{
    const struct plan p = plan_of(g);
    const double wide = p.cell[0] * g->columns, high = p.cell[1] * g->rows;
    const double full = MARGIN + wide + SCALE, whole = TOP + fmax(high, 120) + MARGIN;
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
            "viewBox=\"0 0 %.0f %.0f\" font-family=\"sans-serif\" font-size=\"11\">\n"
            "<metadata>importon</metadata>\n<rect width=\"100%%\" height=\"100%%\" "
            "fill=\"#fff\"/>\n<text x=\"%d\" y=\"%d\" font-size=\"14\">",
            full, whole, full, whole, MARGIN, TOP - 18);
    name_put(f, g->name);
    if (g->heading) fprintf(f, ": %s</text>\n", g->heading);
    else
        fprintf(f, ": average %.4g %s, minimum/average %.2f</text>\n",
                g->summary.average.value, g->unit, g->summary.uniformity.value);
    cells_put(f, &p);
    isolines_put(f, &p);
    numbers_put(f, &p);
    scale_put(f, &p, MARGIN + wide + 12, fmax(high, 120));
    fprintf(f, "</svg>\n");
    free(p.point);
}

int grid_svg(const char *path, const struct grid *g)
{
    struct output o;
    const int rc = output_open(&o, path, OUTPUT_CURVE);
    if (rc) return rc;
    grid_svg_put(o.file, g);
    return output_close(&o, rc);
}
