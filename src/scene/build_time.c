/* SPDX-License-Identifier: Apache-2.0
 *
 * What varies in time: courses of lights and sensors, and when the shutter is open. */
#include "base/number.h"
#include "math/course.h"
#include "scene_build.h"

enum imp_status imp__build_course(struct imp_scene *scene, struct imp_node *node,
                                  const struct imp_course **out)
{
    enum imp_status st = IMP_OK;
    const struct imp_prop *p = imp__node_prop(node, "times");
    const char *text;
    double sum = 0;
    size_t n = 0;
    IMP_TRY(imp__props_string(scene->ctx, node, "times", NULL, &text));
    if (!text) return IMP_OK;
    const char *end = text + strlen(text);
    double *number = imp__arena_take(&scene->arena, strlen(text) + 2, sizeof *number);
    struct imp_course *c = imp__arena_array(&scene->arena, 1, sizeof *c);
    if (!number || !c) IMP_TRY(imp__build_no_memory(scene));
    double *value = number + (end - text) / 2 + 1; /* a pair has four characters */
    for (const char *s = text + strspn(text, " ,\t\n"); s < end; n++) {
        bool good = imp__number(&s, end, &number[n]) && *s == ':';
        if (good) s++, good = imp__number(&s, end, &value[n]);
        good = good && (s == end || strspn(s, " ,\t\n") > 0);
        if (!good || !isfinite(number[n]) || !isfinite(value[n]) || value[n] < 0 ||
            (n > 0 && !(number[n] > number[n - 1])))
            IMP_TRY(imp__prop_error(scene->ctx, node, p, IMP_E_SCENE,
                                    "times = '%.60s': it has pairs time:factor, of "
                                    "ascending times and factors not below 0",
                                    text));
        sum += value[n];
        s += strspn(s, " ,\t\n");
    }
    if (!(sum > 0))
        IMP_TRY(imp__prop_error(scene->ctx, node, p, IMP_E_SCENE,
                                "times = '%.60s': it is 0 at all times", text));
    *c = (struct imp_course){n, number, value};
    *out = c;
out:
    return st;
}

enum imp_status imp__build_shutter(struct imp_scene *scene, struct imp_node *node,
                                   struct imp_sensor *s)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    IMP_TRY(imp__props_float(ctx, node, "shutter_open", 0, &s->open));
    IMP_TRY(imp__props_float(ctx, node, "shutter_close", s->open, &s->close));
    if (s->close < s->open)
        IMP_TRY(imp__prop_error(
            ctx, node, imp__node_prop(node, "shutter_close"), IMP_E_SCENE,
            "shutter_close = %g is outside [shutter_open = %g, inf]", s->close, s->open));
    IMP_TRY(imp__build_course(scene, node, &s->course));
    const bool instant = s->open == s->close;
    if (s->course && !instant &&
        !(imp__course_integral(s->course, s->open, s->close) > 0))
        IMP_TRY(
            imp__prop_error(ctx, node, imp__node_prop(node, "times"), IMP_E_SCENE,
                            "times: the response is 0 while the shutter is open, from "
                            "%g to %g",
                            s->open, s->close));
out:
    return st;
}
