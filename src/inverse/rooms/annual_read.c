/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight of a year at the points of a grid: options, scenes without it, and what all points say. */
#include "annual.h"
#include "base/arguments.h"
#include "film/film_measure.h"
#include "kind/emitter/sky_shape.h"
#include "kind/sensor/receiver.h"
#include "walk/path/first_segment.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* ---- Options ----------------------------------------------------------------------- */

static void or_default(double *x, double fallback)
{
    if (*x == 0) *x = fallback;
}

static enum imp_status options_take(imp_context *ctx, struct imp_annual_options *o)
{
    const double all[] = {o->opens,     o->closes,       o->wanted,
                          o->useful[0], o->useful[1],    o->useful[2],
                          o->sunlit,    o->sunlit_hours, o->part};
    IMP_FINITE_ALL(ctx, all, 9, "options");
    if (o->opens == 0 && o->closes == 0) o->opens = 8, o->closes = 18;
    or_default(&o->wanted, 300);
    or_default(&o->sunlit, 1000);
    or_default(&o->sunlit_hours, 250);
    or_default(&o->part, 0.5);
    if (o->useful[0] == 0 && o->useful[1] == 0 && o->useful[2] == 0)
        o->useful[0] = 100, o->useful[1] = 300, o->useful[2] = 3000;
    if (!(o->opens >= 0 && o->closes <= 24 && o->opens < o->closes))
        return imp__error(ctx, IMP_E_ARG, "use from hour %g to %g: not a part of 0 to 24",
                          o->opens, o->closes);
    if (!(o->useful[0] >= 0 && o->useful[0] < o->useful[1] &&
          o->useful[1] < o->useful[2]))
        return imp__error(ctx, IMP_E_ARG,
                          "useful daylight between %g, %g and %g lx: they do not ascend",
                          o->useful[0], o->useful[1], o->useful[2]);
    if (!(o->wanted > 0 && o->sunlit > 0 && o->sunlit_hours > 0 && o->part > 0 &&
          o->part <= 1))
        return imp__error(
            ctx, IMP_E_ARG,
            "wanted %g lx, sunlit %g lx for %g hours, part %g: all are above "
            "0, the part at most 1",
            o->wanted, o->sunlit, o->sunlit_hours, o->part);
    return IMP_OK;
}

/* The sky that says where up is: the first of a shape whose draws cover the upper hemisphere. */
static enum imp_status sky_find(const struct imp_scene *scene, struct imp__annual *a)
{
    for (int i = 0; i < scene->n_emitters; i++) {
        const struct imp_emitter *e = scene->emitters[i];
        if (e->ops->eval != imp__sky_shape_eval) continue;
        a->sky = i;
        imp__sky_patches_set(&a->patches, ((const struct imp__sky_shape *)e->self)->axis);
        return IMP_OK;
    }
    return imp__error(
        scene->ctx, IMP_E_ARG,
        "the scene has no emitter perezsky or ciesky, which says where up and "
        "south are: daylight of a year needs one");
}

static enum imp_status allowed(const struct imp_scene *scene, const struct imp_sensor *s,
                               const struct imp_walk_integrator *walks)
{
    const char *why = NULL;
    if (s->gain || !imp__has_grid(s))
        return imp__error(scene->ctx, IMP_E_ARG,
                          "sensor '%s' (%s) is no irradiancemeter with a grid: "
                          "daylight of a year is of the points of one",
                          s->name, s->ops->name);
    if (scene->mode != IMP_MONO && scene->mode != IMP_RGB) why = "spectral modes";
    else if (!walks || walks->from_lights || walks->both)
        why = "this integrator, whose walks do not begin at the sensor alone";
    else if (scene->n_media > 0) why = "media";
    else if (scene->n_bodies > 0) why = "graded indices";
    else if (walks->hide_emitters) why = "hide_emitters";
    return why ? imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                            "daylight of a year is not there for %s", why)
               : IMP_OK;
}

static enum imp_status annual_begin(const struct imp_scene *scene,
                                    const struct imp_run *run,
                                    const struct imp_sensor *sensor,
                                    struct imp__annual *a)
{
    struct imp_job job = imp__job(scene, sensor, run, NULL);
    imp__job_state(&job, IMP_HAS_PICTURE, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    const struct imp_walk_integrator *walks =
        imp__walks_from(imp__walk_integrator(scene), IMP_FROM_SENSOR);
    IMP_CHECKED(allowed(scene, sensor, walks));
    IMP_CHECKED(sky_find(scene, a));
    a->scene = scene;
    a->sensor = sensor;
    a->tracer = (struct imp_tracer){.scene = scene,
                                    .integrator = walks,
                                    .sensor = sensor,
                                    .seed = run->seed,
                                    .guide = imp__guide_of(scene, walks, run->guide)};
    imp__tracer_numbers(&a->tracer, run, 0);
    a->walks = (imp__walks_of(run, sensor) + IMP__GROUPS - 1) / IMP__GROUPS;
    a->through = imp__segment_first(&a->tracer)->through;
    for (int i = 0; i < scene->n_bsdfs; i++) a->panes |= scene->bsdfs[i]->straight != 0;
    return IMP_OK;
}

/* ---- The grid ------------------------------------------------------------------------ */

/* Variants of a part of the points: those whose number m is above (or, `least`, not below) a
 * bound. */
static struct imp_estimate part_of(const struct imp__annual_numbers *x, size_t n, int m,
                                   double bound, bool least)
{
    double v[IMP__VARIANTS] = {0};
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < IMP__VARIANTS; k++) {
            const double here = x[i].of[m][k];
            v[k] += least ? here >= bound : here > bound;
        }
    for (int k = 0; k < IMP__VARIANTS; k++) v[k] /= (double)n;
    struct imp_estimate e = imp__annual_estimate(v);
    e.value = imp_clamp(e.value, 0.0, 1.0);
    return e;
}

static void summarise(const struct imp__annual_year *y, struct imp_annual_summary *out)
{
    const struct imp_annual_options *o = y->options;
    const size_t n = y->points;
    struct imp__annual_numbers mean = {.mean = {0}};
    for (size_t i = 0; i < n; i++)
        for (int m = 0; m < IMP__ANNUAL_NUMBERS; m++)
            for (int k = 0; k < IMP__VARIANTS; k++)
                mean.of[m][k] += y->numbers[i].of[m][k] / (double)n;
    out->hours = y->n_used;
    imp__annual_point_set(&mean, &out->average);
    out->spatial_autonomy = part_of(y->numbers, n, IMP__AUTONOMY, o->part, true);
    out->sun_exposure = part_of(y->numbers, n, IMP__SUNLIT, o->sunlit_hours, false);
}

static enum imp_status use_set(struct imp__annual_year *y,
                               const struct imp_weather_hour *hour,
                               imp__annual_mask *used)
{
    const struct imp__annual_hours *h = &y->a->hours;
    const struct imp_annual_options *o = y->options;
    for (size_t i = 0, k = 0; i < y->n; i++) {
        const bool is = hour[i].hour > o->opens && hour[i].hour < o->closes;
        y->n_used += is;
        if (k >= h->n || h->hour[k] != i) continue;
        used[k / IMP__AT_ONCE][k % IMP__AT_ONCE] = -is;
        k++;
    }
    y->used = used;
    if (y->n_used > 0) return IMP_OK;
    return imp__error(y->a->scene->ctx, IMP_E_ARG,
                      "none of the hours lies between %g and %g", o->opens, o->closes);
}

enum imp_status imp_annual_read(imp_scene *scene, const struct imp_run *run, size_t n,
                                const struct imp_weather_hour *hour,
                                const struct imp_annual_options *options,
                                struct imp_annual_point *point,
                                struct imp_annual_summary *summary, double *reading,
                                double *se)
{
    enum imp_status st = IMP_OK;
    const struct imp_sensor *sensor;
    struct imp_run own;
    struct imp_annual_options o = {.size = 0};
    struct imp__annual a = {.sky = -1};
    struct imp__annual_year y = {
        .a = &a, .options = &o, .run = &own, .n = n, .reading = reading, .se = se};
    imp__annual_mask *used = NULL;
    IMP_REQUIRE(NULL, scene, "scene");
    imp_context *ctx = scene->ctx;
    IMP_REQUIRE(ctx, hour, "hour");
    IMP_FLOAT_MODE;
    IMP_RUN(ctx, own, run);
    IMP_OPTIONS(ctx, o, options, "options");
    IMP_CHECKED(options_take(ctx, &o));
    if (summary) IMP_SIZED(ctx, summary, "summary");
    IMP_CHECKED(imp__annual_hours_check(ctx, n, hour));
    IMP_CHECKED(imp__run_traces(ctx, __func__, &own));
    IMP_CHECKED(imp__run_sensor(scene, &own, &sensor));
    own.from = IMP_FROM_SENSOR;
    IMP_READS(scene);
    a.scene = scene;
    IMP_TRY(annual_begin(scene, &own, sensor, &a));
    IMP_TRY(imp__annual_hours_make(&a, n, hour, &a.hours));
    y.points = (size_t)sensor->film.crop_w * (size_t)sensor->film.crop_h;
    used = imp__alloc(ctx, a.hours.blocks, sizeof *used);
    y.numbers = imp__alloc(ctx, y.points, sizeof *y.numbers);
    if (!used || !y.numbers)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for daylight of a year"));
    IMP_TRY(use_set(&y, hour, used));
    if (reading) memset(reading, 0, y.points * n * sizeof *reading);
    if (se) memset(se, 0, y.points * n * sizeof *se);
    IMP_TRY(imp__annual_points(&y));
    for (size_t i = 0; point && i < y.points; i++)
        imp__annual_point_set(&y.numbers[i], &point[i]);
    if (summary) {
        struct imp_annual_summary all = {.size = sizeof all};
        summarise(&y, &all);
        st = imp__info_give(ctx, __func__, "summary", summary, &all, sizeof all);
    }
out:
    imp__release(ctx, y.numbers);
    imp__release(ctx, used);
    imp__annual_hours_free(ctx, &a.hours);
    return st;
}
