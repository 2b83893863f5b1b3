/* SPDX-License-Identifier: Apache-2.0
 *
 * Daylight glare probability at the points of a grid. The walks of a meter that faces along the line
 * of sight are those of the eye: what each brings is added to the cell of the view in whose
 * direction it left, or in which the light lies that was sampled there. So the cells add up to
 * the meter's reading. Samples of a sun's disc are a source of its own, much smaller than a
 * cell; a sun that is met by chance, which a mirror shows, is in the cell. A point is one item of work with sums of its own: the number of
 * threads changes no bit. */
#include "base/arena.h"
#include "base/arguments.h"
#include "base/drops.h"
#include "color/rgb.h"
#include "dgp.h"
#include "film/film_measure.h"
#include "glare_sources.h"
#include "kind/emitter/sun.h"
#include "kind/sensor/receiver.h"
#include "point_loop.h"
#include "walk/core/walk.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <string.h>

struct worker {
    struct imp_arena arena;
    struct imp_drops drops;
    double (*light)[IMP__VIEW_GROUPS]; /* [view[0].n + view[1].n], then [n_discs] */
};

struct job {
    const struct imp_scene *scene;
    const struct imp_sensor *sensor;
    struct imp_tracer tracer;
    struct imp__view view[2]; /* of o.cells a side, and of half as many */
    double threshold;
    int64_t walks;           /* of a group */
    imp_v3 right, up, sight; /* in the meter's frame */
    size_t n_discs;          /* suns before the observer */
    struct imp__view_disc *disc;
    int *sun;                       /* [n_discs] their emitters */
    struct worker *worker;          /* [threads] */
    double *dgp, *se, *illuminance; /* [points] */
    pthread_mutex_t lock;
    struct imp_drops drops;
};

static enum imp_status options_take(imp_context *ctx, struct imp_dgp_options *o)
{
    IMP_FINITE(ctx, o->threshold, "options.threshold");
    if (o->threshold == 0) o->threshold = 5;
    if (o->cells == 0) o->cells = 64;
    if (!(o->threshold > 0))
        return imp__error(ctx, IMP_E_ARG, "a threshold of %g is not above 0",
                          o->threshold);
    if (o->cells < 8 || o->cells > 512 || o->cells % 4)
        return imp__error(
            ctx, IMP_E_ARG,
            "a view of %d x %d cells: the number is a multiple of 4, 8 to 512", o->cells,
            o->cells);
    return IMP_OK;
}

static enum imp_status allowed(const struct imp_scene *scene, const struct imp_sensor *s,
                               const struct imp_walk_integrator *walks)
{
    const char *why = NULL;
    if (scene->mode != IMP_MONO && scene->mode != IMP_RGB) why = "spectral modes";
    else if (!walks || walks->from_lights || walks->both)
        why = "this integrator, whose walks do not begin at the sensor alone";
    else if (scene->n_media > 0) why = "media";
    else if (scene->n_bodies > 0) why = "graded indices";
    else if (walks->hide_emitters) why = "hide_emitters";
    if (why)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "daylight glare probability is not there for %s", why);
    if (!s->receiver->points)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "sensor '%s' reads means over its cells: an observer is at a "
                          "point, so give it 'at' = points",
                          s->name);
    return IMP_OK;
}

static enum imp_status job_begin(struct job *j, const struct imp_scene *scene,
                                 const struct imp_run *run,
                                 const struct imp_sensor *sensor)
{
    struct imp_job what = imp__job(scene, sensor, run, NULL);
    imp__job_state(&what, IMP_HAS_PICTURE, NULL);
    IMP_CHECKED(imp__job_allowed(&what));
    const struct imp_walk_integrator *walks =
        imp__walks_from(imp__walk_integrator(scene), IMP_FROM_SENSOR);
    IMP_CHECKED(allowed(scene, sensor, walks));
    j->scene = scene;
    j->sensor = sensor;
    j->tracer = (struct imp_tracer){.scene = scene,
                                    .integrator = walks,
                                    .sensor = sensor,
                                    .seed = run->seed,
                                    .guide = imp__guide_of(scene, walks, run->guide)};
    imp__tracer_numbers(&j->tracer, run, 0);
    const int64_t asked = imp__walks_of(run, sensor);
    j->walks =
        imp_max((asked + IMP__VIEW_GROUPS - 1) / IMP__VIEW_GROUPS, (int64_t)j->view[0].n);
    j->sight = sensor->receiver->facing;
    j->up = imp__v3(0, 0, 1);
    j->right = imp__cross(j->sight, j->up);
    return IMP_OK;
}

/* Direction w of the meter's frame in that of the view. */
static imp_v3 seen_from(const struct job *j, imp_v3 w)
{
    return imp__v3(imp__dot(w, j->right), imp__dot(w, j->up), imp__dot(w, j->sight));
}

/* The suns before the observer. */
static enum imp_status discs_find(struct job *j)
{
    const struct imp_scene *scene = j->scene;
    const size_t most = (size_t)scene->n_emitters + 1;
    j->disc = imp__alloc(scene->ctx, most, sizeof *j->disc);
    j->sun = imp__alloc(scene->ctx, most, sizeof *j->sun);
    if (!j->disc || !j->sun)
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for views");
    for (int i = 0; i < scene->n_emitters; i++) {
        imp_v3 axis;
        double size;
        if (!imp__sun_disc(scene->emitters[i], &axis, &size)) continue;
        const imp_v3 w = seen_from(j, imp__to_local(&j->sensor->receiver->frame, axis));
        if (!(w[2] > 0)) continue;
        const double p = imp__view_position(w);
        j->disc[j->n_discs] = (struct imp__view_disc){size, w[2], size / (p * p)};
        j->sun[j->n_discs++] = i;
    }
    return IMP_OK;
}

static double number_of(const struct job *j, imp_spec light)
{
    return j->scene->mode == IMP_MONO ? light[0]
                                      : imp__luminance(light[0], light[1], light[2]);
}

/* Light from direction w, in the meter's frame. */
static void light_add(const struct job *j, struct worker *k, int group, imp_v3 w,
                      imp_spec light)
{
    const int cell = imp__view_cell(&j->view[0], seen_from(j, w));
    if (cell >= 0) k->light[cell][group] += number_of(j, light);
}

/* A light sample of an emitter: of a sun's disc, or of the cell in its direction. */
static void sample_add(const struct job *j, struct worker *k, int group, int emitter,
                       imp_v3 w, imp_spec light)
{
    for (size_t d = 0; d < j->n_discs; d++) {
        if (j->sun[d] != emitter) continue;
        k->light[j->view[0].n + j->view[1].n + d][group] += number_of(j, light);
        return;
    }
    light_add(j, k, group, w, light);
}

/* The first vertex of a meter's walk is where it begins, the second the meter itself. */
static void walk_add(const struct job *j, struct worker *k, int group,
                     const struct imp_walk *walk)
{
    const struct imp_vertex *start = walk->first, *meter = start ? start->next : NULL;
    if (!meter) return;
    const struct imp_decision *d = &meter->d;
    if (d->connection == IMP_CONNECTED)
        sample_add(j, k, group, d->light.emitter, imp__decided_v3(d->light.wi),
                   start->w * meter->b);
    if (d->goes_on)
        light_add(j, k, group, imp__decided_v3(d->wi),
                  start->w * meter->w * meter->beyond);
}

static enum imp_status view_trace(const struct job *j, int x, int y, struct worker *k)
{
    struct imp_walk walk;
    /* A group takes sets of points of its own: groups are independent. */
    const int64_t sets = (j->walks + IMP_SET_POINTS - 1) / IMP_SET_POINTS;
    double(*discs)[IMP__VIEW_GROUPS] = k->light + j->view[0].n + j->view[1].n;
    memset(k->light, 0, j->view[0].n * sizeof *k->light);
    memset(discs, 0, j->n_discs * sizeof *discs);
    for (int g = 0; g < IMP__VIEW_GROUPS; g++)
        for (int64_t i = 0; i < j->walks; i++) {
            const struct imp_arena_mark mark = imp__arena_mark(&k->arena);
            const int64_t sample = g * sets * IMP_SET_POINTS + i;
            imp__walk_trace(&j->tracer, &k->arena, x, y, sample, &walk);
            if (walk.dropped == IMP_DROP_MEMORY)
                return imp__error(j->scene->ctx, IMP_E_NOMEM, "no memory for a view");
            if (walk.dropped != IMP_DROP_NONE) {
                const struct imp_drop_key key = {.seed = j->tracer.seed,
                                                 .sample = sample,
                                                 .cause = walk.dropped,
                                                 .x = x + j->sensor->film.crop_x,
                                                 .y = y + j->sensor->film.crop_y};
                imp__drops_add(&k->drops, &key);
            } else if (walk.valid) {
                walk_add(j, k, g, &walk);
            }
            imp__arena_rewind(&k->arena, mark);
        }
    for (size_t c = 0; c < j->view[0].n; c++)
        for (int g = 0; g < IMP__VIEW_GROUPS; g++) k->light[c][g] *= 1 / (double)j->walks;
    for (size_t d = 0; d < j->n_discs; d++)
        for (int g = 0; g < IMP__VIEW_GROUPS; g++) discs[d][g] *= 1 / (double)j->walks;
    return IMP_OK;
}

static enum imp_status point_work(size_t i, int worker, int slot, void *payload)
{
    struct job *j = payload;
    struct worker *k = &j->worker[worker];
    const size_t width = (size_t)j->sensor->film.crop_w;
    double se, illuminance;
    (void)slot;
    const enum imp_status st = view_trace(j, (int)(i % width), (int)(i / width), k);
    if (imp__drops_total(&k->drops) > 0) {
        pthread_mutex_lock(&j->lock);
        imp__drops_merge(&j->drops, &k->drops);
        pthread_mutex_unlock(&j->lock);
        memset(&k->drops, 0, sizeof k->drops);
    }
    if (st != IMP_OK) return st;
    imp__dgp_rate(j->view, k->light, j->n_discs, j->disc,
                  k->light + j->view[0].n + j->view[1].n, j->threshold, &j->dgp[i], &se,
                  &illuminance);
    if (j->se) j->se[i] = se;
    if (j->illuminance) j->illuminance[i] = illuminance;
    return IMP_OK;
}

static enum imp_status workers_make(struct job *j, imp_context *ctx)
{
    const size_t n = j->view[0].n + j->view[1].n + j->n_discs;
    j->worker = imp__alloc(ctx, (size_t)ctx->threads, sizeof *j->worker);
    for (int t = 0; j->worker && t < ctx->threads; t++) {
        imp__arena_init(&j->worker[t].arena, ctx);
        j->worker[t].light = imp__alloc(ctx, n, sizeof *j->worker[t].light);
        if (!j->worker[t].light)
            return imp__error(ctx, IMP_E_NOMEM, "no memory for views");
    }
    return j->worker ? IMP_OK : imp__error(ctx, IMP_E_NOMEM, "no memory for views");
}
static void workers_free(struct job *j, imp_context *ctx)
{
    for (int t = 0; j->worker && t < ctx->threads; t++) {
        if (j->worker[t].arena.ctx) imp__arena_free(&j->worker[t].arena);
        imp__release(ctx, j->worker[t].light);
    }
    imp__release(ctx, j->worker);
}

enum imp_status imp_grid_dgp(imp_scene *scene, const struct imp_run *run,
                             const struct imp_dgp_options *options, double *dgp,
                             double *se, double *illuminance)
{
    enum imp_status st = IMP_OK;
    const struct imp_sensor *sensor;
    struct imp_run own;
    struct imp_dgp_options o = IMP_DGP_OPTIONS_INIT;
    struct job j = {.dgp = dgp, .se = se, .illuminance = illuminance};
    bool locked = false;
    IMP_REQUIRE(NULL, scene, "scene");
    imp_context *ctx = scene->ctx;
    IMP_REQUIRE(ctx, dgp, "dgp");
    IMP_RUN(ctx, own, run);
    IMP_OPTIONS(ctx, o, options, "options");
    IMP_CHECKED(options_take(ctx, &o));
    IMP_CHECKED(imp__run_traces(ctx, __func__, &own));
    IMP_CHECKED(imp__run_sensor(scene, &own, &sensor));
    IMP_CHECKED(imp__glare_sight_check(scene, sensor));
    own.from = IMP_FROM_SENSOR;
    IMP_READS(scene);
    j.threshold = o.threshold;
    for (int k = 0; k < 2; k++)
        IMP_TRY(imp__view_make(ctx, o.cells / (k + 1), &j.view[k]));
    IMP_TRY(job_begin(&j, scene, &own, sensor));
    IMP_TRY(discs_find(&j));
    IMP_TRY(workers_make(&j, ctx));
    locked = pthread_mutex_init(&j.lock, NULL) == 0;
    if (!locked) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for views"));
    const size_t points = (size_t)sensor->film.crop_w * (size_t)sensor->film.crop_h;
    const double walks = (double)j.walks * IMP__VIEW_GROUPS * (double)points;
    IMP_TRY(imp__point_loop(ctx, &own, points, walks, "views", point_work, &j, &j.drops));
out:
    if (locked) pthread_mutex_destroy(&j.lock);
    workers_free(&j, ctx);
    imp__release(ctx, j.disc);
    imp__release(ctx, j.sun);
    for (int k = 0; k < 2; k++) imp__view_free(ctx, &j.view[k]);
    return st;
}
