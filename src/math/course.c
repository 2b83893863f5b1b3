/* SPDX-License-Identifier: Apache-2.0
 *
 * Value, integral and draw of a piecewise linear factor over time: trapezoids between its times,
 * constant at the ends. */
#include "course.h"
#include <math.h>

double imp__course_at(const struct imp_course *c, double time)
{
    size_t k = 0; /* times up to this one */
    while (k < c->n && c->time[k] <= time) k++;
    if (k == 0) return c->value[0];
    if (k == c->n) return c->value[c->n - 1];
    const double x = (time - c->time[k - 1]) / (c->time[k] - c->time[k - 1]);
    return (1 - x) * c->value[k - 1] + x * c->value[k];
}

/* The end of the part from `from` on in which it is linear. */
static double part_end(const struct imp_course *c, double from, double close)
{
    for (size_t k = 0; k < c->n; k++)
        if (c->time[k] > from) return fmin(c->time[k], close);
    return close;
}

double imp__course_integral(const struct imp_course *c, double open, double close)
{
    double sum = 0;
    for (double from = open; from < close;) {
        const double to = part_end(c, from, close);
        sum += (to - from) * (imp__course_at(c, from) + imp__course_at(c, to)) / 2;
        from = to;
    }
    return sum;
}

double imp__course_draw(const struct imp_course *c, double open, double close, double u)
{
    double left = u * imp__course_integral(c, open, close), from = open;
    for (;;) {
        const double to = part_end(c, from, close), span = to - from;
        const double a = imp__course_at(c, from), b = imp__course_at(c, to);
        const double all = span * (a + b) / 2;
        if (left < all || !(to < close)) {
            /* a x + (b - a) x^2/2 = left/span, by the root that keeps its digits */
            const double y = fmin(left, all) / span;
            const double root = sqrt(fmax(a * a + 2 * (b - a) * y, 0));
            const double x = a + root > 0 ? 2 * y / (a + root) : 1;
            return from + span * fmin(x, 1);
        }
        left -= all;
        from = to;
    }
}
