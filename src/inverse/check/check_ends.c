/* SPDX-License-Identifier: Apache-2.0
 *
 * F and its derivatives, as in fresh rows, by walks from the sensor and by light tracing,
 * which share neither a random number nor a density: R = R_A (docs/adjoint-photons.md).
 * Light that one of the two cannot find with any number of walks is not compared: that
 * reflected or refracted into a camera by a mirror or clear glass, or from a point light
 * by such a material.
 *
 * A light walk is swept once into all rows, so one pass, of half as many samples as a
 * fresh picture, has their values and, from the spread of walks, their errors. From the
 * sensor the derivatives are those of the fresh rows, where the check's own walks begin
 * there. */
#include "base/team.h"
#include "check_difference.h"
#include "inverse/estimate/problem_tracer.h"
#include "inverse/gradient/light_gradient.h"
#include "walk/rules/features.h"
#include <limits.h>
#include <math.h>

#define Z_LIMIT 4.5 /* of many rows, with few batches behind a standard error */
/* With a standard error above this part of its own value an end decides nothing: what few
 * walks bring is not normal, and where it is too low its standard error is, too. */
#define RESOLVED 0.2

/* From the lights: few of them bring much, and without these the spread is too low. */
#define WALKS_LEAST 32768
/* From the sensor, where a fresh row brings what it has: with fewer a row decides nothing. */
#define SAMPLES_LEAST 4096
/* A row that fails is measured again, with this many times as many light walks: where
 * single walks have large values (a lamp in a blurred mirror), value and error of few
 * walks are too low together. */
#define AGAIN 8

struct ends {
    struct imp__check *check;
    struct imp__fresh fresh;
    size_t n;                    /* rows: F, then the check's slopes */
    struct imp_estimate *sensor; /* [n] */
    double *lights, *se;         /* [n] */
    double *weight;              /* [n active] of the directions */
};

static bool has_point_lights(const struct imp_scene *scene)
{
    for (int i = 0; i < scene->n_emitters; i++)
        if (scene->emitters[i]->ops->flags & (IMP_EMITTER_DELTA | IMP_EMITTER_FAR))
            return true;
    return false;
}

/* May walks begin at either end, and meet the same light? */
static bool both_ends(const struct imp__check *c)
{
    const struct imp_scene *scene = c->problem->scene;
    if (!imp__walk_integrator(scene)->other_end) return false;
    if (imp__delta_bsdf(scene) && (!c->tracer.sensor->shape || has_point_lights(scene)))
        return false;
    struct imp_run run = c->run;
    run.from = IMP_FROM_LIGHTS;
    const struct imp_job job =
        imp__job(scene, c->tracer.sensor, &run, &c->problem->active);
    return imp__job_allowed(&job) == IMP_OK;
}

/* ---- From the lights --------------------------------------------------------------- */

struct light_rows {
    const struct imp_tracer *tracer;
    struct imp__light_adjoints pattern;
    const double *weight;
    size_t n;
    int *row; /* [params] a parameter's first row; 0: it has none */
};

struct pieces {
    struct imp_sink sink; /* first */
    const struct light_rows *rows;
    double *value; /* [rows] */
};

static void piece_add(struct imp_sink *sink, int param, size_t element, int channels,
                      const imp_spec *bar)
{
    const struct pieces *p = (const struct pieces *)sink;
    const struct imp_scene *scene = p->rows->tracer->scene;
    const int first = p->rows->row[param];
    if (first == 0) return;
    const bool singly = scene->params[param].info.count <= IMP_CHECK_SINGLY;
    const double *weight = p->rows->weight + p->rows->tracer->active->base[param];
    for (size_t c = 0; c < (channels == 3 ? 3 : 1); c++) {
        const double d = channels == 3 ? (*bar)[c] : imp__sum_used(*bar, scene->lanes);
        if (singly) p->value[(size_t)first + element + c] += d;
        else p->value[first] += weight[element + c] * d;
    }
}

static void walk_rows(const void *payload, const struct imp_light_walk *walk,
                      double *value)
{
    const struct light_rows *rows = payload;
    struct imp_light_walk own = *walk; /* a sweep needs its entries for a while */
    struct imp_arena *arena = walk->arena;
    struct pieces pieces = {{.add = piece_add}, rows, value};
    const struct imp__light_adjoints *a = &rows->pattern;
    imp_spec *P = imp__arena_take(arena, (size_t)walk->n_reach + 1, sizeof *P);
    size_t k = 0;
    for (size_t i = 0; i < rows->n; i++) value[i] = 0;
    for (const struct imp_reach *r = P ? walk->reach : NULL; r; r = r->next) {
        const imp_spec p = imp__light_adjoint_at(a, a->image[0], r->px, r->py);
        for (int c = 0; c < a->channels; c++) value[0] += p[c] * r->L[c];
        P[k++] = imp__walk_lanes(&walk->walk, p);
    }
    if (!P || !imp__light_walk_sweep(rows->tracer, arena, &own, P, 1, &pieces.sink))
        value[0] = NAN;
}

static enum imp_status lights_measure(struct ends *e, int times)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = e->check;
    const struct imp_problem *p = c->problem;
    const struct imp_film_desc *film = &c->tracer.sensor->film;
    const size_t values =
        (size_t)film->crop_w * (size_t)film->crop_h * (size_t)e->fresh.channels;
    struct imp_run run = c->run;
    struct imp_tracer tracer;
    struct imp_splat_scale scale = {0};
    double *image = imp__alloc(c->ctx, values, sizeof *image);
    struct light_rows rows = {.tracer = &tracer,
                              .pattern = {.film = film,
                                          .channels = e->fresh.channels,
                                          .scale = &scale,
                                          .n_images = 1,
                                          .image = {image}},
                              .weight = e->weight,
                              .n = e->n};
    rows.row = imp__alloc(c->ctx, p->scene->n_params + 1, sizeof *rows.row);
    if (!image || !rows.row)
        IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    for (size_t k = 0; k < values; k++) image[k] = e->fresh.pattern[k];
    for (size_t k = c->n_slopes; k-- > 0;) rows.row[c->slopes[k].param] = (int)k + 1;
    run.from = IMP_FROM_LIGHTS;
    run.spp = ((run.spp > 0 ? run.spp : c->tracer.sensor->spp) + 1) / 2;
    run.spp =
        imp_max(run.spp, (int)(WALKS_LEAST / ((int64_t)film->crop_w * film->crop_h)));
    run.spp = (int)imp_min((int64_t)run.spp * times, (int64_t)INT_MAX);
    run.seed = imp__fresh_seed(&e->fresh);
    IMP_TRY(imp__problem_tracer_of_any_end(p, &run, NULL, &tracer));
    IMP_TRY(imp__splat_scale_create(c->ctx, film, &scale));
    const struct imp_light_picture picture = {
        .tracer = &tracer,
        .run = &run,
        .stage = "check",
        .n = (int)e->n,
        .whole = walk_rows,
        .payload = &rows,
        .walks = imp__light_walks_of(&run, tracer.sensor)};
    IMP_TRY(imp__light_picture_make(&picture, e->lights, e->se, NULL));
    st = imp__check_progress(c, 1);
out:
    imp__splat_scale_destroy(c->ctx, &scale);
    imp__release(c->ctx, image);
    imp__release(c->ctx, rows.row);
    return st;
}

/* ---- From the sensor --------------------------------------------------------------- */

/* The derivatives, where the check's own walks begin at the other end. */
static enum imp_status sensor_slopes(struct ends *e)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = e->check;
    struct imp_problem *p = c->problem;
    struct imp_run run = c->run;
    double *g = imp__alloc(c->ctx, 3 * p->n, sizeof *g);
    if (!g) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    double *x_dot = g + 2 * p->n;
    run.seed = imp__fresh_seed(&e->fresh);
    IMP_TRY(imp_problem_reverse(p, e->fresh.pattern, &run, g, g + p->n));
    for (size_t k = 0; k < c->n_slopes; k++) {
        const struct imp__slope *s = &c->slopes[k];
        const size_t base = (size_t)p->active.base[s->param],
                     count = p->scene->params[s->param].info.count;
        const size_t i = base + (s->element < 0 ? 0 : (size_t)s->element);
        if (count <= IMP_CHECK_SINGLY) {
            e->sensor[k + 1] = (struct imp_estimate){.value = g[i], .se = g[p->n + i]};
            continue;
        }
        for (size_t j = 0; j < p->n; j++)
            x_dot[j] = j >= base && j < base + count ? e->weight[j] : 0;
        IMP_TRY(imp__fresh_slope(&e->fresh, x_dot, &e->sensor[k + 1]));
    }
out:
    imp__release(c->ctx, g);
    return st;
}

static enum imp_status sensor_measure(struct ends *e)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = e->check;
    const struct imp_run run = c->run;
    const struct imp_tracer own = c->tracer;
    c->run.from = IMP_FROM_SENSOR;
    IMP_TRY(imp__problem_tracer_of_any_end(c->problem, &c->run, NULL, &c->tracer));
    IMP_TRY(imp__fresh_value(&e->fresh, &e->sensor[0]));
    for (size_t k = 0; k < c->n_slopes; k++) e->sensor[k + 1] = c->slopes[k].d;
    if (own.integrator->from_lights) IMP_TRY(sensor_slopes(e));
out:
    c->run = run;
    c->tracer = own;
    return st;
}

/* ---- Rows ---------------------------------------------------------------------------- */

static bool few_samples(const struct imp__check *c)
{
    const struct imp_sensor *sensor = c->tracer.sensor;
    const double spp = c->run.spp > 0 ? c->run.spp : sensor->spp;
    return spp * sensor->film.crop_w * sensor->film.crop_h < SAMPLES_LEAST;
}

static struct imp_check_row judged(const struct imp__check *c, struct imp_estimate lights,
                                   struct imp_estimate sensor)
{
    struct imp_check_row row = {.value = lights.value,
                                .reference = sensor.value,
                                .se = hypot(lights.se, sensor.se)};
    const double off = fabs(lights.value - sensor.value);
    const double size = fmax(fabs(lights.value), fabs(sensor.value));
    if (row.se > 0) {
        row.error = isfinite(off) ? off / row.se : INFINITY;
        row.limit = Z_LIMIT + 1e-6 * size / row.se;
    } else {
        row.error = off == 0 ? 0 : isfinite(off) ? off / size : INFINITY;
        row.limit = 1e-6;
    }
    /* An end whose walks have found nothing has no error to go by: a small sensor before a
     * large lamp. */
    const bool unseen =
        (lights.value == 0 && lights.se == 0) != (sensor.value == 0 && sensor.se == 0);
    const bool noisy = unseen || few_samples(c) || row.se > RESOLVED * size ||
                       lights.se > RESOLVED * fabs(lights.value) ||
                       sensor.se > RESOLVED * fabs(sensor.value);
    row.ok = noisy ? -1 : row.error <= row.limit;
    return row;
}

static struct imp_check_row judged_row(const struct ends *e, size_t k)
{
    return judged(e->check, (struct imp_estimate){.value = e->lights[k], .se = e->se[k]},
                  e->sensor[k]);
}

/* Relative error that both ends together should have of the reading, so that a bias of 5 %
 * of what they do not share is seen; the part of the time of rows that draw (draws_s) that a
 * measurement for it may take; factors of the walks that are tried. */
#define WANTED 0.01
#define PART   0.25
#define MORE   4
#define MOST   64

/* The reading from the sensor, by `times` as many samples. */
static enum imp_status reading_measure(struct ends *e, int times)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = e->check;
    const struct imp_run run = c->run;
    const struct imp_tracer own = c->tracer;
    const int more = e->fresh.more;
    c->run.from = IMP_FROM_SENSOR;
    e->fresh.more = more * times;
    IMP_TRY(imp__problem_tracer_of_any_end(c->problem, &c->run, NULL, &c->tracer));
    IMP_TRY(imp__fresh_value(&e->fresh, &e->sensor[0]));
out:
    e->fresh.more = more;
    c->run = run;
    c->tracer = own;
    return st;
}

/* More walks from both ends; used_s: seconds of the first measurement. */
static enum imp_status reading_refine(struct ends *e, double used_s)
{
    enum imp_status st = IMP_OK;
    struct imp__check *c = e->check;
    for (int times = MORE; times <= MOST; times *= MORE) {
        const struct imp_check_row row = judged_row(e, 0);
        const double size = fmax(fabs(row.value), fabs(row.reference));
        bool enough =
            !(row.se > WANTED * size) || used_s * MORE > PART * c->options.draws_s;
        IMP_TRY(imp__team_any(c->ctx, enough, &enough));
        if (enough) return IMP_OK;
        const double start = imp__now();
        IMP_TRY(reading_measure(e, times));
        IMP_TRY(lights_measure(e, times));
        used_s = imp__now() - start;
    }
out:
    return st;
}

enum imp_status imp__check_ends(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *p = c->problem;
    if (!both_ends(c)) return IMP_OK;
    struct ends e = {.check = c, .n = c->n_slopes + 1};
    e.sensor = imp__alloc(c->ctx, e.n, sizeof *e.sensor);
    e.lights = imp__alloc(c->ctx, 2 * e.n, sizeof *e.lights);
    e.weight = imp__alloc(c->ctx, p->n, sizeof *e.weight);
    if (!e.sensor || !e.lights || !e.weight)
        IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check"));
    e.se = e.lights + e.n;
    for (size_t k = 0; k < p->scene->n_params; k++)
        if (p->active.base[k] >= 0 && p->scene->params[k].info.count > IMP_CHECK_SINGLY)
            imp__check_direction(&p->scene->params[k], e.weight + p->active.base[k]);
    IMP_TRY(imp__fresh_begin(&e.fresh, c));
    const double start = imp__now();
    IMP_TRY(sensor_measure(&e));
    IMP_TRY(lights_measure(&e, 1));
    IMP_TRY(reading_refine(&e, imp__now() - start));
    for (size_t k = 0; k < e.n; k++)
        if (judged_row(&e, k).ok == 0) {
            IMP_TRY(lights_measure(&e, AGAIN));
            break;
        }
    for (size_t k = 0; k < e.n; k++) {
        const struct imp__slope *s = k > 0 ? &c->slopes[k - 1] : NULL;
        const struct imp_check_row row = judged_row(&e, k);
        IMP_TRY(imp__check_row(c, "ends",
                               s ? p->scene->params[s->param].info.name : "reading",
                               s ? s->element : -1, &row));
    }
out:
    imp__fresh_end(&e.fresh);
    imp__release(c->ctx, e.sensor);
    imp__release(c->ctx, e.lights);
    imp__release(c->ctx, e.weight);
    return st;
}
