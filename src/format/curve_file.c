/* SPDX-License-Identifier: Apache-2.0
 *
 * A parser of curve files: x, y, z and radius in a line, empty lines between curves. */
#include "curve_file.h"
#include "base/number.h"
#include <float.h>
#include <math.h>
#include <string.h>

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/* The next line, without blanks around it. */
static const char *line_of(const char *at, const char *end, const char **first,
                           const char **last)
{
    const char *stop = memchr(at, '\n', (size_t)(end - at));
    if (!stop) stop = end;
    *first = at;
    *last = stop;
    while (*first < *last && is_blank(**first)) ++*first;
    while (*last > *first && is_blank((*last)[-1])) --*last;
    return stop < end ? stop + 1 : end;
}

/* Four numbers, and no more. */
static bool point_read(const char *at, const char *end, float out[4])
{
    for (int k = 0; k < 4; k++) {
        double x;
        while (at < end && is_blank(*at)) at++;
        if (!imp__number(&at, end, &x) || !(fabs(x) <= FLT_MAX)) return false;
        if (at < end && !is_blank(*at)) return false;
        out[k] = (float)x;
    }
    return at == end;
}

enum imp_status imp__curve_parse(imp_context *ctx, struct imp_arena *keep,
                                 const char *name, const struct imp_bytes *text,
                                 struct imp_curve_data *out)
{
    const char *const begin = (const char *)text->data, *const end = begin + text->size;
    const char *first, *last;
    size_t points = 0, curves = 0, line = 1;
    bool inside = false;
    for (const char *at = begin; at < end;) {
        at = line_of(at, end, &first, &last);
        const bool empty = first == last;
        curves += !empty && !inside;
        points += !empty;
        inside = !empty;
    }
    if (points == 0)
        return imp__error(ctx, IMP_E_SCENE, "%s: has no control points", name);
    if (points > IMP_CURVE_POINTS_MAX)
        return imp__error(ctx, IMP_E_SCENE, "%s: has more than 2^31 control points",
                          name);
    float *const p = imp__arena_take(keep, 4 * points, sizeof *p);
    uint32_t *const start = imp__arena_take(keep, curves + 1, sizeof *start);
    if (!p || !start)
        return imp__error(ctx, IMP_E_NOMEM, "%s: no memory for the curves", name);
    points = curves = 0;
    inside = false;
    for (const char *at = begin; at < end; line++) {
        at = line_of(at, end, &first, &last);
        if (first == last) {
            inside = false;
            continue;
        }
        if (!inside) start[curves++] = (uint32_t)points;
        inside = true;
        if (!point_read(first, last, p + 4 * points))
            return imp__error(ctx, IMP_E_SCENE,
                              "%s:%zu: a control point is four numbers: x, y, z and "
                              "radius",
                              name, line);
        if (p[4 * points + 3] < 0)
            return imp__error(ctx, IMP_E_SCENE, "%s:%zu: radius %g is negative", name,
                              line, (double)p[4 * points + 3]);
        points++;
    }
    start[curves] = (uint32_t)points;
    *out = (struct imp_curve_data){points, curves, p, start};
    return IMP_OK;
}
