/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight of a year at the points of a grid: options, scenes without it, and the loop over the
 * points. An item of work is one or some points with sums of their own: the number of threads changes
 * no bit. */
#include "annual.h"
#include "base/arguments.h"
#include "film/film_measure.h"
#include "kind/emitter/sky_shape.h"
#include "kind/sensor/receiver.h"
#include "point_loop.h"
#include "walk/path/first_segment.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <float.h>
#include <math.h>
#include <string.h>

struct job {
    struct imp__annual *a;
    struct imp_annual_options options;
    const struct imp_run *run;
    size_t n;                            /* hours as given */
    imp__annual_mask *used;              /* [hours.blocks] -1: an hour of use */
    size_t n_used;                       /* of the year */
    size_t points, each;                 /* of all; of an item of work */
    struct imp__annual_worker *worker;   /* [threads] */
    struct imp__annual_numbers *numbers; /* [points] */
    double *reading, *se;
    pthread_mutex_t lock;
    struct imp_drops drops;
};

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

/* ---- A point ------------------------------------------------------------------------- */

static void hours_give(const struct job *j, size_t point, const struct imp__annual_at *at)
{
    const struct imp__annual_hours *h = &j->a->hours;
    for (size_t k = 0; k < h->n; k++) {
        double group[IMP__GROUPS];
        for (int g = 0; g < IMP__GROUPS; g++)
            group[g] = (double)at->E[k / IMP__AT_ONCE][g][k % IMP__AT_ONCE];
        const struct imp_estimate e = imp__annual_mean(group);
        if (j->reading) j->reading[point * j->n + h->hour[k]] = e.value;
        if (j->se) j->se[point * j->n + h->hour[k]] = e.se;
    }
}

static enum imp_status point_walk(const struct imp__annual *a, size_t point,
                                  struct imp__annual_worker *w, struct imp__annual_at *at)
{
    const int width = a->sensor->film.crop_w;
    const int x = (int)(point % (size_t)width), y = (int)(point / (size_t)width);
    const enum imp_status st = imp__annual_walks(a, x, y, w, at);
    if (st == IMP_E_NOMEM)
        return imp__error(a->scene->ctx, st, "no memory for walks of a year");
    if (st == IMP_OK) imp__annual_direct(a, x, y, at);
    return st;
}

static enum imp_status points_work(size_t i, int worker, int slot, void *payload)
{
    enum imp_status st = IMP_OK;
    struct job *j = payload;
    struct imp__annual_worker *w = &j->worker[worker];
    const size_t first = i * j->each, n = imp_min(j->each, j->points - first);
    (void)slot;
    for (size_t k = 0; k < n && st == IMP_OK; k++)
        st = point_walk(j->a, first + k, w, &w->at[k]);
    if (imp__drops_total(&w->drops) > 0) {
        pthread_mutex_lock(&j->lock);
        imp__drops_merge(&j->drops, &w->drops);
        pthread_mutex_unlock(&j->lock);
        memset(&w->drops, 0, sizeof w->drops);
    }
    if (st != IMP_OK) return st;
    imp__annual_hours_light(j->a, w->at, n);
    for (size_t k = 0; k < n; k++) {
        imp__annual_add(j->a, &j->options, j->used, j->n_used, &w->at[k],
                        &j->numbers[first + k]);
        if (j->reading || j->se) hours_give(j, first + k, &w->at[k]);
    }
    return IMP_OK;
}

static bool at_make(imp_context *ctx, const struct imp__annual_hours *h,
                    struct imp__annual_at *at)
{
    at->C = imp__alloc(ctx, IMP__PATCHES, sizeof *at->C);
    at->I = imp__alloc(ctx, (size_t)h->n_cells + 1, sizeof *at->I);
    at->E = imp__alloc(ctx, h->blocks, sizeof *at->E);
    at->S = imp__alloc(ctx, h->blocks, sizeof *at->S);
    return at->C && at->I && at->E && at->S;
}

static enum imp_status workers_make(struct job *j, int threads)
{
    imp_context *ctx = j->a->scene->ctx;
    j->worker = imp__alloc(ctx, (size_t)threads, sizeof *j->worker);
    if (!j->worker) return IMP_E_NOMEM;
    for (int t = 0; t < threads; t++) {
        struct imp__annual_worker *w = &j->worker[t];
        imp__arena_init(&w->arena, ctx);
        w->C_sum = imp__alloc(ctx, IMP__PATCHES, sizeof *w->C_sum);
        w->I_sum = imp__alloc(ctx, IMP__PATCHES, sizeof *w->I_sum);
        bool got = w->C_sum && w->I_sum;
        for (size_t k = 0; k < j->each; k++) got &= at_make(ctx, &j->a->hours, &w->at[k]);
        if (!got) return IMP_E_NOMEM;
    }
    return IMP_OK;
}
static void workers_free(struct job *j, int threads)
{
    imp_context *ctx = j->a->scene->ctx;
    for (int t = 0; j->worker && t < threads; t++) {
        struct imp__annual_worker *w = &j->worker[t];
        if (w->arena.ctx) imp__arena_free(&w->arena);
        imp__release(ctx, w->C_sum);
        imp__release(ctx, w->I_sum);
        for (int k = 0; k < IMP__POINTS; k++) {
            imp__release(ctx, w->at[k].C);
            imp__release(ctx, w->at[k].I);
            imp__release(ctx, w->at[k].E);
            imp__release(ctx, w->at[k].S);
        }
    }
    imp__release(ctx, j->worker);
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

static void summarise(const struct job *j, size_t n, struct imp_annual_summary *out)
{
    const struct imp_annual_options *o = &j->options;
    struct imp__annual_numbers mean = {{{0}}};
    for (size_t i = 0; i < n; i++)
        for (int m = 0; m < IMP__ANNUAL_NUMBERS; m++)
            for (int k = 0; k < IMP__VARIANTS; k++)
                mean.of[m][k] += j->numbers[i].of[m][k] / (double)n;
    out->hours = j->n_used;
    imp__annual_point_set(&mean, &out->average);
    out->spatial_autonomy = part_of(j->numbers, n, IMP__AUTONOMY, o->part, true);
    out->sun_exposure = part_of(j->numbers, n, IMP__SUNLIT, o->sunlit_hours, false);
}

static enum imp_status use_set(struct job *j, const struct imp_weather_hour *hour)
{
    const struct imp__annual_hours *h = &j->a->hours;
    const struct imp_annual_options *o = &j->options;
    j->used = imp__alloc(j->a->scene->ctx, h->blocks, sizeof *j->used);
    if (!j->used) return IMP_E_NOMEM;
    for (size_t i = 0, k = 0; i < j->n; i++) {
        const bool used = hour[i].hour > o->opens && hour[i].hour < o->closes;
        j->n_used += used;
        if (k >= h->n || h->hour[k] != i) continue;
        j->used[k / IMP__AT_ONCE][k % IMP__AT_ONCE] = -used;
        k++;
    }
    if (j->n_used == 0)
        return imp__error(j->a->scene->ctx, IMP_E_ARG,
                          "none of the hours lies between %g and %g", o->opens,
                          o->closes);
    return IMP_OK;
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
    struct imp__annual a = {.sky = -1};
    struct job j = {.a = &a, .run = &own, .n = n, .reading = reading, .se = se};
    bool locked = false;
    IMP_REQUIRE(NULL, scene, "scene");
    imp_context *ctx = scene->ctx;
    IMP_REQUIRE(ctx, hour, "hour");
    IMP_RUN(ctx, own, run);
    IMP_OPTIONS(ctx, j.options, options, "options");
    IMP_CHECKED(options_take(ctx, &j.options));
    if (summary) IMP_SIZED(ctx, summary, "summary");
    IMP_CHECKED(imp__annual_hours_check(ctx, n, hour));
    IMP_CHECKED(imp__run_traces(ctx, __func__, &own));
    IMP_CHECKED(imp__run_sensor(scene, &own, &sensor));
    own.from = IMP_FROM_SENSOR;
    IMP_READS(scene);
    a.scene = scene;
    IMP_TRY(annual_begin(scene, &own, sensor, &a));
    IMP_TRY(imp__annual_hours_make(&a, n, hour, &a.hours));
    IMP_TRY(use_set(&j, hour));
    const size_t points = (size_t)sensor->film.crop_w * (size_t)sensor->film.crop_h;
    j.points = points;
    /* Some, unless threads would go without. */
    j.each =
        imp_clamp(points / (4 * (size_t)ctx->threads), (size_t)1, (size_t)IMP__POINTS);
    IMP_TRY(workers_make(&j, ctx->threads));
    j.numbers = imp__alloc(ctx, points, sizeof *j.numbers);
    if (!j.numbers) IMP_TRY(IMP_E_NOMEM);
    if (reading) memset(reading, 0, points * n * sizeof *reading);
    if (se) memset(se, 0, points * n * sizeof *se);
    locked = pthread_mutex_init(&j.lock, NULL) == 0;
    if (!locked) IMP_TRY(IMP_E_NOMEM);
    const double walks = (double)a.walks * IMP__GROUPS * (double)points;
    IMP_TRY(imp__point_loop(ctx, &own, (points + j.each - 1) / j.each, walks, "year",
                            points_work, &j, &j.drops));
    for (size_t i = 0; point && i < points; i++)
        imp__annual_point_set(&j.numbers[i], &point[i]);
    if (summary) {
        struct imp_annual_summary all = {.size = sizeof all};
        summarise(&j, points, &all);
        st = imp__info_give(ctx, __func__, "summary", summary, &all, sizeof all);
    }
out:
    if (st == IMP_E_NOMEM && !j.numbers)
        imp__error(ctx, st, "no memory for daylight of a year");
    if (locked) pthread_mutex_destroy(&j.lock);
    workers_free(&j, ctx->threads);
    imp__release(ctx, j.numbers);
    imp__release(ctx, j.used);
    imp__annual_hours_free(ctx, &a.hours);
    return st;
}
