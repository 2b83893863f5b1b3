/* SPDX-License-Identifier: Apache-2.0
 *
 * A view of Radiance ("rvu -vtv -vp 1 2 3 -vd 0 1 0 -vh 60 -vv 40") as a perspective
 * sensor. The parameters `width` (512) and `spp` (64) are those of the picture; its height
 * follows from the angles, with square pixels. */
#include "base/number.h"
#include "import.h"
#include "math/transform.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { VP, VD, VU, VH, VV, VS, VL, VO, VA, OPTIONS };

struct view {
    const struct imp__import *in;
    double v[OPTIONS][3];
    int line;
};

static const struct {
    const char *name;
    int n;
    double missing[3];
} options[OPTIONS] = {{"-vp", 3, {0, 0, 0}}, {"-vd", 3, {0, 1, 0}}, {"-vu", 3, {0, 0, 1}},
                      {"-vh", 1, {45}},      {"-vv", 1, {45}},      {"-vs", 1, {0}},
                      {"-vl", 1, {0}},       {"-vo", 1, {0}},       {"-va", 1, {0}}};

static enum imp_status IMP_PRINTF(3, 4)
    refuse(const struct view *w, enum imp_status status, const char *format, ...)
{
    char text[300];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__loc_error(w->in->scene->ctx, (struct imp_loc){w->in->name, w->line, 1},
                          status, "%s", text);
}

/* The next word of the text, at most 79 bytes of it; false: the end. */
static bool word(struct view *w, const char **s, const char *end, char out[80])
{
    size_t n = 0;
    while (*s < end && strchr(" \t\r\n", **s)) w->line += *(*s)++ == '\n';
    if (*s == end) return false;
    for (; *s < end && !strchr(" \t\r\n", **s); ++*s)
        if (n < 79) out[n++] = **s;
    out[n] = 0;
    return true;
}

static enum imp_status option_read(struct view *w, const char *name, const char **s,
                                   const char *end)
{
    char text[80];
    if (strncmp(name, "-vt", 3) == 0) {
        if (strcmp(name, "-vtv") == 0) return IMP_OK;
        return refuse(w, IMP_E_UNSUPPORTED,
                      "%s: this type of view is not supported, only -vtv (perspective)",
                      name);
    }
    for (int k = 0; k < OPTIONS; k++) {
        if (strcmp(options[k].name, name) != 0) continue;
        for (int i = 0; i < options[k].n; i++) {
            const char *at = text;
            if (!word(w, s, end, text) ||
                !imp__number(&at, text + strlen(text), &w->v[k][i]) || *at ||
                !isfinite(w->v[k][i]))
                return refuse(w, IMP_E_SCENE, "%s needs %d number%s", name, options[k].n,
                              options[k].n > 1 ? "s" : "");
        }
        return IMP_OK;
    }
    return refuse(w, IMP_E_UNSUPPORTED, "option '%s' is not one of a view", name);
}

static enum imp_status view_check(const struct view *w)
{
    for (int k = VH; k <= VV; k++) /* tan of half of them */
        if (!(w->v[k][0] > 0 && w->v[k][0] < 180))
            return refuse(w, IMP_E_SCENE, "%s %g is not between 0 and 180 degrees",
                          options[k].name, w->v[k][0]);
    for (int k = VO; k <= VA; k++)
        if (w->v[k][0] != 0)
            return refuse(w, IMP_E_UNSUPPORTED, "%s %g: clipping is not supported",
                          options[k].name, w->v[k][0]);
    return IMP_OK;
}

static enum imp_status sensor_make(const struct view *w)
{
    enum imp_status st = IMP_OK;
    const struct imp__import *in = w->in;
    const struct imp_loc loc = {in->name, w->line, 1};
    double width, spp;
    struct imp_node *sensor, *node;
    struct imp_mat4 m;
    IMP_TRY(imp__import_number(in, "width", "512", 1, 65536, &width));
    IMP_TRY(imp__import_number(in, "spp", "64", 1, 1e9, &spp));
    const double *p = w->v[VP], *d = w->v[VD], *u = w->v[VU],
                 height = width * tan(w->v[VV][0] * IMP_PI / 360) /
                          tan(w->v[VH][0] * IMP_PI / 360);
    if (!imp__lookat(imp__v3(p[0], p[1], p[2]),
                     imp__v3(p[0] + d[0], p[1] + d[1], p[2] + d[2]),
                     imp__v3(u[0], u[1], u[2]), &m))
        return refuse(w, IMP_E_SCENE, "the direction of view is zero, or parallel to up");
    if (!(height < 65536))
        return refuse(w, IMP_E_SCENE, "the picture would be %g pixels high", height);
    IMP_TRY(imp__tree_open(in->tree, in->parent, "sensor", "perspective", NULL, NULL, loc,
                           &sensor));
    IMP_TRY(imp__import_matrix(in, sensor, "to_world", m.m, loc));
    IMP_TRY(imp__import_float(in, sensor, "fov", w->v[VH][0], loc));
    if (w->v[VS][0] != 0)
        IMP_TRY(
            imp__import_float(in, sensor, "principal_point_offset_x", w->v[VS][0], loc));
    if (w->v[VL][0] != 0)
        IMP_TRY(
            imp__import_float(in, sensor, "principal_point_offset_y", -w->v[VL][0], loc));
    IMP_TRY(imp__tree_open(in->tree, sensor, "film", "hdrfilm", NULL, NULL, loc, &node));
    IMP_TRY(imp__import_integer(in, node, "width", (int64_t)width, loc));
    IMP_TRY(imp__import_integer(in, node, "height",
                                imp_max((int64_t)floor(height + .5), (int64_t)1), loc));
    IMP_TRY(imp__tree_open(in->tree, sensor, "sampler", "independent", NULL, NULL, loc,
                           &node));
    IMP_TRY(imp__import_integer(in, node, "sample_count", (int64_t)spp, loc));
out:
    return st;
}

enum imp_status imp__view_read(const struct imp__import *in)
{
    enum imp_status st = IMP_OK;
    struct view w = {.in = in, .line = 1};
    const char *s = (const char *)in->text->data, *end = s + in->text->size;
    char text[80];
    for (int k = 0; k < OPTIONS; k++) memcpy(w.v[k], options[k].missing, sizeof w.v[k]);
    for (bool first = true; word(&w, &s, end, text); first = false) {
        const bool program = first && *text != '-'; /* "rvu", "VIEW=" */
        if (!program) IMP_TRY(option_read(&w, text, &s, end));
    }
    IMP_TRY(view_check(&w));
    IMP_TRY(sensor_make(&w));
out:
    return st;
}
