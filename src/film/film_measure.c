/* SPDX-License-Identifier: Apache-2.0
 *
 * Channels of a sample: names, and values of radiance and moments. */
#include "film_measure.h"
#include "base/arguments.h"
#include "base/film.h"
#include "base/text.h"
#include "color/rgb.h"
#include "film_aov.h"
#include "film_integrator.h"
#include "walk/bundle/near_walls.h"
#include "walk/rules/features.h"
#include <stdio.h>
#include <string.h>

enum imp_status imp__run_sensor(const struct imp_scene *scene, const struct imp_run *run,
                                const struct imp_sensor **out)
{
    if (!scene->committed)
        return imp__error(scene->ctx, IMP_E_ARG, "the scene has not been committed");
    if (!scene->integrator)
        return imp__node_error(scene->ctx, scene->root, IMP_E_SCENE,
                               "there is no integrator in it; Mitsuba's default is "
                               "<integrator type=\"path\"/>");
    if (scene->n_sensors == 0)
        return imp__node_error(scene->ctx, scene->root, IMP_E_SCENE,
                               "there is no sensor in it");
    if (run->sensor < 0 || run->sensor >= scene->n_sensors)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "there is no sensor %d; the scene has %d", run->sensor,
                          scene->n_sensors);
    if (run->spp < 0)
        return imp__error(scene->ctx, IMP_E_ARG, "samples per pixel = %d is negative",
                          run->spp);
    const struct imp_sensor *sensor = scene->sensors[run->sensor];
    const struct imp_job job = imp__job(scene, sensor, run, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    *out = sensor;
    return IMP_OK;
}

/* ---- Channel names ------------------------------------------------------------- */

struct names {
    struct imp_text text;
    int n;
};

static void names_add(struct names *s, const char *prefix, const char *slot,
                      const char *channel)
{
    imp__put(&s->text, "%s%s%s%s%s", s->n ? "," : "", prefix, slot, *slot ? "." : "",
             channel);
    s->n++;
}

static int base_channels(enum imp_pixel_format format)
{
    static const int n[] = {1, 2, 3, 4, 3, 4};
    return n[format];
}

static void names_make(struct names *s, const struct imp_scene *scene,
                       const struct imp_sensor *sensor)
{
    static const char *const base[][4] = {{"Y"},           {"Y", "A"},
                                          {"R", "G", "B"}, {"R", "G", "B", "A"},
                                          {"X", "Y", "Z"}, {"X", "Y", "Z", "A"}};
    static const char *const rgba[] = {"R", "G", "B", "A"}, *const xyz[] = {"X", "Y",
                                                                            "Z"};
    const struct imp_integrator *top = scene->integrator;
    const struct imp_channels *more = imp__channels_of(top);
    const enum imp_pixel_format format = sensor->film.pixel_format;
    const struct imp_film_desc *film = &sensor->film;
    for (int c = 0; c < film->n_responses; c++)
        names_add(s, "", "", film->response_name[c]);
    for (int c = 0; film->n_responses == 0 && c < base_channels(format); c++)
        names_add(s, "", "", base[format][c]);
    if (!more) return;
    for (int a = 0; a < more->n_aovs; a++)
        for (int c = 0; c < imp__aov_count(more->aovs[a].type); c++)
            names_add(s, "", more->aovs[a].name,
                      imp__aov_channels[more->aovs[a].type][c]);
    for (int k = 0; !more->moments && k < top->n_inner; k++)
        for (int c = 0; c < 4; c++) names_add(s, "", top->inner[k].name, rgba[c]);
    for (int moment = 1; more->moments && moment <= 2; moment++)
        for (int k = 0; k < top->n_inner; k++)
            for (int c = 0; c < 3; c++)
                names_add(s, moment == 2 ? "m2_" : "", top->inner[k].name, xyz[c]);
}

/* integrator NULL: of the first hit. */
static struct imp_tracer tracer_of(const struct imp_measure *m,
                                   const struct imp_walk_integrator *integrator)
{
    static const struct imp_walk_integrator first_hit = {.max_depth = 0};
    struct imp_tracer tracer = {
        .scene = m->scene,
        .integrator = integrator ? integrator : &first_hit,
        .sensor = m->sensor,
        .seed = m->seed,
        .guide = integrator ? imp__guide_of(m->scene, integrator, m->guide) : NULL,
        .value_only = true,
        .kept = m->kept};
    imp__tracer_numbers(&tracer, m->run, imp__walks_of(m->run, m->sensor));
    return tracer;
}

enum imp_status imp__measure_create(const struct imp_scene *scene,
                                    const struct imp_run *run, struct imp_measure *out)
{
    const struct imp_sensor *sensor;
    enum imp_status st = imp__run_sensor(scene, run, &sensor);
    if (st != IMP_OK) return st;
    struct imp_job job = imp__job(scene, sensor, run, NULL);
    imp__job_state(&job, IMP_HAS_PICTURE, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    const struct imp_walk_integrator *walks = imp__walk_integrator_of(scene->integrator);
    const struct imp_walk_integrator *from = imp__walks_from(walks, run->from);
    struct names names = {.text.ctx = scene->ctx};
    names_make(&names, scene, sensor);
    if (names.text.failed || names.n > IMP_MEASURE_MAX) {
        imp__bytes_free(scene->ctx, &names.text.bytes);
        return names.text.failed
                   ? imp__error(scene->ctx, IMP_E_NOMEM, "no memory for channels")
                   : imp__error(scene->ctx, IMP_E_SCENE, "more than %d channels",
                                IMP_MEASURE_MAX);
    }
    *out = (struct imp_measure){.scene = scene,
                                .sensor = sensor,
                                .seed = run->seed,
                                .guide = run->guide,
                                .run = run,
                                .n = names.n,
                                .from_lights = from && from->from_lights,
                                .names = (char *)names.text.bytes.data};
    if (!run->walks && !run->guide)
        from = imp__walks_read(scene, sensor, from, &out->own);
    out->integrator = from;
    struct imp_tracer tracer = {.scene = scene, .sensor = sensor};
    const int64_t samples = imp__walks_of(run, sensor);
    imp__tracer_numbers(&tracer, run, samples);
    if (run->walks) {
        tracer.integrator = from;
        tracer.sensor = sensor;
        st = imp__walks_use(run, &tracer);
    }
    out->kept = tracer.kept;
    if (from) out->tracer = tracer_of(out, from);
    out->spp = (int)imp_max(samples, (int64_t)1);
    out->set = imp__tracer_set(&tracer, samples);
    if (st != IMP_OK) imp__measure_destroy(out);
    return st;
}

/* A sample is one walk. */
static bool is_one(const struct imp_measure *m)
{
    return m->integrator && !imp__channels_of(m->scene->integrator);
}

enum imp_status imp__measure_together(struct imp_measure *m)
{
    struct names names = {.text.ctx = m->scene->ctx};
    if (!is_one(m) || m->run->preview || !imp__reuse_fits(&m->tracer)) return IMP_OK;
    for (int half = 0; half < 2; half++)
        names_add(&names, half > 0 ? "alone." : "", "", m->names);
    if (names.text.failed) {
        imp__bytes_free(m->scene->ctx, &names.text.bytes);
        return imp__error(m->scene->ctx, IMP_E_NOMEM, "no memory for channels");
    }
    imp__release(m->scene->ctx, m->names);
    m->names = (char *)names.text.bytes.data;
    m->n *= 2;
    m->together = true;
    m->tracer.together = IMP_REUSE_MOST;
    IMP_CHECKED(imp__near_walls(&m->tracer, &m->more));
    m->tracer.more = m->more;
    return IMP_OK;
}

const struct imp_tracer *imp__measure_bundles(const struct imp_measure *m)
{
    return !is_one(m) ? NULL : m->together ? &m->tracer : imp__bundle_use(&m->tracer);
}

void imp__measure_destroy(struct imp_measure *m)
{
    imp__release(m->scene->ctx, m->names);
    imp__release(m->scene->ctx, m->more);
}

/* ---- Values -------------------------------------------------------------------- */

static double luminance(imp_spec c) { return imp__luminance(c[0], c[1], c[2]); }

static void to_xyz(imp_spec c, double xyz[3])
{
    imp__rgb_to_xyz((double[3]){c[0], c[1], c[2]}, xyz);
}

int imp__measure_base(const struct imp_measure *m, imp_spec L, double alpha,
                      double *value)
{
    const enum imp_pixel_format format = m->sensor->film.pixel_format;
    const int n = base_channels(format);
    switch (format) {
    case IMP_PIXEL_LUMINANCE:
    case IMP_PIXEL_LUMINANCE_ALPHA:
        value[0] = m->scene->mode == IMP_MONO ? L[0] : luminance(L);
        break;
    case IMP_PIXEL_RGB:
    case IMP_PIXEL_RGBA:
        for (int c = 0; c < 3; c++) value[c] = L[c];
        break;
    case IMP_PIXEL_XYZ:
    case IMP_PIXEL_XYZA: to_xyz(L, value); break;
    }
    if (n == 2 || n == 4) value[n - 1] = alpha;
    return n;
}

/* Alpha (docs/scene-format.md 11): an environment in sight makes every path valid; direct
 * needs a surface at the first hit. */
static double walk_alpha(const struct imp_measure *m,
                         const struct imp_walk_integrator *integrator,
                         const struct imp_walk *walk)
{
    if (integrator->first_hit) return walk->first && walk->first->shape;
    const bool sky = m->scene->environment >= 0 && !integrator->hide_emitters;
    return walk->valid || (sky && integrator->max_depth != 0);
}

/* Radiance and alpha of one integrator, on the same random numbers as the others; marks
 * the sample if the walk was dropped. NULL: the distance of the first hit. */
static void radiance(const struct imp_measure *m,
                     const struct imp_walk_integrator *integrator, struct imp_sample *s,
                     imp_spec *L, double *alpha, struct imp_walk *walk)
{
    struct imp_tracer own;
    const struct imp_tracer *tracer = &m->tracer;
    if (imp_unlikely(!integrator || integrator != tracer->integrator)) {
        own = tracer_of(m, integrator);
        tracer = &own;
    }
    const enum imp_drop before = s->dropped;
    const struct imp_arena_mark mark = imp__arena_mark(s->arena);
    imp__sample_walk(s, tracer, walk);
    if (before != IMP_DROP_NONE) s->dropped = before;
    *L = walk->L;
    if (integrator) {
        *alpha = walk_alpha(m, integrator, walk);
    } else {
        *L = imp__spec(walk->first && walk->first->shape ? walk->first->t : 0);
        *alpha = walk->first && walk->first->shape;
    }
    const struct imp_film_desc *film = &m->sensor->film;
    const double gain = imp_likely(!m->sensor->gain)
                            ? 1 /* of all curves: they have no white balance */
                            : imp__walk_gain(tracer, walk)[0];
    for (int c = 0; c < film->n_responses; c++) {
        imp_spec weight = {0};
        if (walk->waves) imp__waves_response(walk->waves, &film->response[c], &weight);
        s->value[c] = gain * imp__sum_used(weight * walk->values, 4);
    }
    imp__arena_rewind(s->arena, mark);
}

void imp__measure_features(const void *measure, struct imp_sample *s)
{
    static struct imp_aov features[] = {{"albedo", IMP_AOV_ALBEDO},
                                        {"normal", IMP_AOV_SH_NORMAL}};
    static const struct imp_channels both = {.n_aovs = 2, .aovs = features};
    const struct imp_measure *m = measure;
    struct imp_walk walk;
    imp_spec L;
    double alpha;
    radiance(m, NULL, s, &L, &alpha, &walk);
    imp__aov_values(m, &both, &walk, s->value);
}

void imp__measure_sample(const void *measure, struct imp_sample *s)
{
    const struct imp_measure *m = measure;
    const struct imp_integrator *top = m->scene->integrator;
    const struct imp_channels *more = imp__channels_of(top);
    double *value = s->value;
    struct imp_walk walk;
    imp_spec L = {0};
    double alpha = 0;
    int n;
    if (!more) {
        radiance(m, m->integrator, s, &L, &alpha, &walk);
        if (m->sensor->film.n_responses > 0) return;
        n = imp__measure_base(m, L, alpha, value);
        if (m->together)
            imp__measure_base(m, s->supply ? imp__supply_alone(s->supply, &walk) : L,
                              alpha, value + n);
        return;
    }

    imp_spec first = {0};
    double first_alpha = 0;
    n = base_channels(m->sensor->film.pixel_format);
    const int after_base = n;
    if (!more->moments) {
        radiance(m, NULL, s, &L, &alpha, &walk);
        n += imp__aov_values(m, more, &walk, value + n);
    }
    for (int k = 0; k < top->n_inner; k++) {
        radiance(m, imp__walk_integrator_of(&top->inner[k]), s, &L, &alpha, &walk);
        if (k == 0) first = L, first_alpha = alpha;
        if (!more->moments) {
            for (int c = 0; c < 3; c++) value[n++] = L[c];
            value[n++] = alpha;
        } else {
            if (m->scene->mode == IMP_MONO) value[n] = value[n + 1] = value[n + 2] = L[0];
            else to_xyz(L, value + n);
            n += 3;
        }
    }
    if (more->moments) {
        const int count = n - after_base;
        for (int c = 0; c < count; c++) value[n + c] = imp__sqr(value[after_base + c]);
    }
    imp__measure_base(m, first, first_alpha, value);
}
