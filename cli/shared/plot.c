/* SPDX-License-Identifier: Apache-2.0
 *
 * The curve of a fit's loss, and numbers over wavelengths, as SVG. */
#include "plot.h"

#include "command.h"
#include "output.h"

#include <errno.h>
#include <math.h>
#include <string.h>

enum { WIDTH = 720, HEIGHT = 440, LEFT = 84, RIGHT = 24, TOP = 44, BOTTOM = 58 };

/* y is drawn as asinh(y / (2 unit)): logarithmic where |y| is far above `unit`, linear
 * below. An unbiased loss may be negative near its end, and such a scale has room for it.
 * Over wavelengths it is drawn as it is. */
struct axes {
    double n;
    double unit;
    double lo, hi;    /* of y */
    const double *nm; /* [n]; NULL: 0, 1, .. n-1 */
};

static double x_part(double part) { return LEFT + (WIDTH - LEFT - RIGHT) * part; }
static double x_at(const struct axes *a, size_t i)
{
    const size_t last = (size_t)a->n - 1;
    if (last == 0) return x_part(0.5);
    if (!a->nm) return x_part((double)i / (a->n - 1));
    return x_part((a->nm[i] - a->nm[0]) / (a->nm[last] - a->nm[0]));
}
static double bend(const struct axes *a, double y)
{
    return a->nm ? y : asinh(0.5 * y / a->unit);
}
static double y_at(const struct axes *a, double y)
{
    const double lo = bend(a, a->lo), hi = bend(a, a->hi);
    const double t = (bend(a, fmin(fmax(y, a->lo), a->hi)) - lo) / (hi - lo);
    return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * t;
}

/* The unit is the least error where there are errors, else the least positive value; at
 * most eight decades are shown. */
static struct axes find_axes(size_t n, const double *y, const double *se)
{
    struct axes a = {(double)n, INFINITY, INFINITY, -INFINITY, NULL};
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(y[i])) continue;
        const double small = se && se[i] > 0 ? se[i] : fabs(y[i]);
        if (small > 0) a.unit = fmin(a.unit, small);
        a.lo = fmin(a.lo, y[i]);
        a.hi = fmax(a.hi, y[i]);
    }
    if (!(a.lo <= a.hi)) a.lo = 0, a.hi = 1;
    const double largest = fmax(fabs(a.lo), fabs(a.hi));
    a.unit = fmax(isfinite(a.unit) ? a.unit : 1, fmax(1e-8 * largest, 1e-300));
    a.lo = fmin(a.lo - 0.5 * a.unit, 0);
    a.hi = fmax(1.2 * a.hi, a.lo + a.unit);
    return a;
}

/* 1, 2 or 5 times a power of ten, about a sixth of the range. */
static double nice_step(double range)
{
    const double rough = range / 6, power = pow(10, floor(log10(rough)));
    const double m = rough / power;
    return power * (m < 1.5 ? 1 : m < 3.5 ? 2 : m < 7.5 ? 5 : 10);
}

static void put_tick(FILE *f, double x, double y, const char *anchor, const char *text)
{
    fprintf(f, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%s</text>\n", x, y, anchor,
            text);
}

static void put_level(FILE *f, const struct axes *a, double value)
{
    char text[32];
    const double y = y_at(a, value);
    if (value < a->lo || value > a->hi) return;
    fprintf(f, "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\" stroke=\"#d0d0d0\"/>\n",
            LEFT, y, WIDTH - RIGHT, y);
    snprintf(text, sizeof text, "%g", value);
    put_tick(f, LEFT - 8, y + 4, "end", text);
}

static void put_wavelengths(FILE *f, const struct axes *a)
{
    const double first = a->nm[0], last = a->nm[(size_t)a->n - 1];
    const double step_x = nice_step(last - first), step_y = nice_step(a->hi - a->lo);
    char text[32];
    for (double y = step_y * ceil(a->lo / step_y); y <= a->hi; y += step_y)
        put_level(f, a, fabs(y) < 1e-9 * step_y ? 0 : y);
    for (double nm = step_x * ceil(first / step_x); nm <= last; nm += step_x) {
        snprintf(text, sizeof text, "%g", nm);
        put_tick(f, x_part((nm - first) / (last - first)), HEIGHT - BOTTOM + 20, "middle",
                 text);
    }
}

static void put_axes(FILE *f, const struct axes *a)
{
    if (a->nm) {
        put_wavelengths(f, a);
        return;
    }
    const double step_x = a->n > 2 ? fmax(1, nice_step(a->n - 1)) : 1;
    const double first = ceil(log10(a->unit)), last = log10(fmax(a->hi, -a->lo));
    const double step_y = fmax(1, ceil((last - first) / 8));
    char text[32];
    put_level(f, a, 0);
    for (double k = first; k <= last; k += step_y) {
        put_level(f, a, pow(10, k));
        put_level(f, a, -pow(10, k));
    }
    for (double i = 0; i < a->n; i += step_x) {
        snprintf(text, sizeof text, "%.0f", i);
        put_tick(f, x_at(a, (size_t)i), HEIGHT - BOTTOM + 20, "middle", text);
    }
}

static void put_band(FILE *f, const struct axes *a, size_t n, const double *y,
                     const double *se)
{
    fprintf(f, "<path fill=\"#c8d4f0\" d=\"");
    for (size_t i = 0; i < n; i++)
        fprintf(f, "%c%.2f %.2f ", i ? 'L' : 'M', x_at(a, i), y_at(a, y[i] + se[i]));
    for (size_t i = n; i-- > 0;)
        fprintf(f, "L%.2f %.2f ", x_at(a, i), y_at(a, y[i] - se[i]));
    fprintf(f, "Z\"/>\n");
}

static int plot(const char *path, const char *title, const char *x_label,
                const char *y_label, const struct axes *a, const double *y,
                const double *se)
{
    const size_t n = (size_t)a->n;
    int finite = 1;
    struct output to;
    const int rc = output_open(&to, path, OUTPUT_CURVE);
    if (rc) return rc;
    FILE *f = to.file;
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
            "viewBox=\"0 0 %d %d\" font-family=\"sans-serif\" font-size=\"13\">\n"
            "<metadata>importon</metadata>\n"
            "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
            WIDTH, HEIGHT, WIDTH, HEIGHT);
    put_axes(f, a);
    for (size_t i = 0; i < n; i++)
        if (!isfinite(y[i]) || (se && !isfinite(se[i]))) finite = 0;
    if (se && n > 1 && finite) put_band(f, a, n, y, se);
    fprintf(f, "<path fill=\"none\" stroke=\"#3060c0\" stroke-width=\"2\" d=\"");
    for (size_t i = 0, started = 0; i < n; i++) {
        if (!isfinite(y[i])) continue;
        fprintf(f, "%c%.2f %.2f ", started ? 'L' : 'M', x_at(a, i), y_at(a, y[i]));
        started = 1;
    }
    fprintf(f,
            "\"/>\n<text x=\"%d\" y=\"26\" text-anchor=\"middle\" font-size=\"16\">%s"
            "</text>\n",
            WIDTH / 2, title);
    put_tick(f, (LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 14, "middle", x_label);
    fprintf(f,
            "<text transform=\"translate(20 %d) rotate(-90)\" text-anchor=\"middle\">%s"
            "</text>\n</svg>\n",
            (TOP + HEIGHT - BOTTOM) / 2, y_label);
    return output_close(&to, 0);
}

int plot_curve(const char *path, const char *title, const char *x_label,
               const char *y_label, size_t n, const double *y, const double *se)
{
    const struct axes a = find_axes(n, y, se);
    return plot(path, title, x_label, y_label, &a, y, se);
}

int plot_spectrum(const char *path, const char *title, const char *y_label, size_t n,
                  const double *nm, const double *y, const double *se)
{
    struct axes a = {.n = (double)n, .lo = 0, .hi = 0, .nm = nm};
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(y[i]) || !isfinite(se[i])) continue;
        a.lo = fmin(a.lo, 1.05 * (y[i] - se[i]));
        a.hi = fmax(a.hi, 1.05 * (y[i] + se[i]));
    }
    if (!(a.lo < a.hi)) a.hi = a.lo + 1;
    return plot(path, title, "wavelength (nm)", y_label, &a, y, se);
}
