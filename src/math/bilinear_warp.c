/* SPDX-License-Identifier: Apache-2.0
 *
 * Values, mixtures, draws and inverse draws of bilinear densities (bilinear_warp.h). Both the
 * marginal of rows and the conditional of columns are piecewise linear, so that a draw is the root
 * of a quadratic equation. */
#include "bilinear_warp.h"
#include <math.h>

/* The interval of x between n nodes, and where in it. */
static int cell_of(double x, int n, double *t)
{
    const double at = fmin(fmax(x, 0), 1) * (n - 1);
    const int i = at < n - 2 ? (int)at : n - 2;
    *t = at - i;
    return i;
}

static double mixed(const double *table, size_t stride, size_t offset,
                    const struct imp__bilinear_mix *mix)
{
    double sum = 0;
    for (int k = 0; k < mix->n; k++)
        sum += mix->weight[k] * table[mix->grid[k] * stride + offset];
    return sum;
}

/* Values at the two ends of the interval of columns, t_row within the interval of rows. */
static void ends(const float *table, int rows, int columns,
                 const struct imp__bilinear_mix *mix, int row, double t_row, int column,
                 double c[2])
{
    const size_t stride = (size_t)rows * (size_t)columns,
                 offset = (size_t)row * (size_t)columns + (size_t)column;
    c[0] = c[1] = 0;
    for (int k = 0; k < mix->n; k++) {
        const float *v = table + mix->grid[k] * stride + offset;
        for (int e = 0; e < 2; e++)
            c[e] += mix->weight[k] * ((1 - t_row) * v[e] + t_row * v[columns + e]);
    }
}

double imp__bilinear_value(const float *table, int rows, int columns,
                           const struct imp__bilinear_mix *mix, const double x[2])
{
    double t[2], c[2];
    const int column = cell_of(x[0], columns, &t[0]), row = cell_of(x[1], rows, &t[1]);
    ends(table, rows, columns, mix, row, t[1], column, c);
    return c[0] + t[0] * (c[1] - c[0]);
}

void imp__bilinear_warp_fill(struct imp__bilinear_warp *w, size_t grids)
{
    const size_t n = (size_t)w->columns;
    const double dx = 0.5 / (w->columns - 1), dy = 0.5 / (w->rows - 1);
    for (size_t g = 0; g < grids; g++) {
        double *row = w->row + g * (size_t)w->rows, before = 0;
        for (size_t i = 0; i < (size_t)w->rows; i++) {
            const size_t line = (g * (size_t)w->rows + i) * n;
            const float *v = w->density + line;
            double *sum = w->column + line;
            sum[0] = 0;
            for (size_t j = 1; j < n; j++)
                sum[j] = sum[j - 1] + dx * ((double)v[j - 1] + (double)v[j]);
            row[i] = i ? row[i - 1] + dy * (before + sum[n - 1]) : 0;
            before = sum[n - 1];
        }
    }
}

bool imp__bilinear_warp_mix(const struct imp__bilinear_warp *w,
                            const struct imp__bilinear_mix *mix,
                            struct imp__bilinear_mix *of_warp)
{
    double sum = 0;
    of_warp->n = 0;
    for (int k = 0; k < mix->n; k++) {
        const double total = w->row[(mix->grid[k] + 1) * (size_t)w->rows - 1];
        if (!(total > 0)) continue;
        of_warp->grid[of_warp->n] = mix->grid[k];
        of_warp->weight[of_warp->n++] = mix->weight[k] / total;
        sum += mix->weight[k];
    }
    for (int k = 0; k < of_warp->n; k++) of_warp->weight[k] /= sum;
    return sum > 0;
}

/* The t in [0, 1] of a0 t + (a1 - a0) t^2/2 = s, without cancellation. */
static double segment(double s, double a0, double a1)
{
    const double root = sqrt(fmax(0, a0 * a0 + 2 * s * (a1 - a0)));
    return a0 + root > 0 ? fmin(1, 2 * s / (a0 + root)) : 0;
}
static double segment_sum(double t, double a0, double a1)
{
    return t * (a0 + 0.5 * t * (a1 - a0));
}

/* Integral along x[0] up to a column, between two rows. */
static double along(const struct imp__bilinear_warp *w,
                    const struct imp__bilinear_mix *mix, int row, double t, int column)
{
    const size_t n = (size_t)w->columns, stride = n * (size_t)w->rows,
                 at = (size_t)row * n + (size_t)column;
    const double low = mixed(w->column, stride, at, mix);
    return low + t * (mixed(w->column, stride, at + n, mix) - low);
}

void imp__bilinear_warp_draw(const struct imp__bilinear_warp *w,
                             const struct imp__bilinear_mix *mix, const double u[2],
                             double x[2])
{
    const size_t rows = (size_t)w->rows;
    int row = 0, column = 0;
    for (int step = w->rows - 2;
         row < step;) { /* the last that begins at or below u[1] */
        const int middle = (row + step + 1) / 2;
        if (mixed(w->row, rows, (size_t)middle, mix) <= u[1]) row = middle;
        else step = middle - 1;
    }
    const int last = w->columns - 1;
    const double left = fmax(0, u[1] - mixed(w->row, rows, (size_t)row, mix));
    const double t = segment(left * (w->rows - 1), along(w, mix, row, 0, last),
                             along(w, mix, row, 1, last));
    const double want = u[0] * along(w, mix, row, t, last);
    for (int step = last - 1; column < step;) {
        const int middle = (column + step + 1) / 2;
        if (along(w, mix, row, t, middle) <= want) column = middle;
        else step = middle - 1;
    }
    double c[2];
    ends(w->density, w->rows, w->columns, mix, row, t, column, c);
    const double rest = fmax(0, want - along(w, mix, row, t, column));
    x[0] = (column + segment(rest * last, c[0], c[1])) / last;
    x[1] = (row + t) / (w->rows - 1);
}

double imp__bilinear_warp_invert(const struct imp__bilinear_warp *w,
                                 const struct imp__bilinear_mix *mix, const double x[2],
                                 double u[2])
{
    double t[2], c[2];
    const int last = w->columns - 1;
    const int column = cell_of(x[0], w->columns, &t[0]),
              row = cell_of(x[1], w->rows, &t[1]);
    ends(w->density, w->rows, w->columns, mix, row, t[1], column, c);
    const double whole = along(w, mix, row, t[1], last);
    const double part =
        along(w, mix, row, t[1], column) + segment_sum(t[0], c[0], c[1]) / last;
    u[0] = whole > 0 ? fmin(1, part / whole) : 0;
    u[1] = mixed(w->row, (size_t)w->rows, (size_t)row, mix) +
           segment_sum(t[1], along(w, mix, row, 0, last), along(w, mix, row, 1, last)) /
               (w->rows - 1);
    u[1] = fmin(1, u[1]);
    return c[0] + t[0] * (c[1] - c[0]);
}
