/* SPDX-License-Identifier: Apache-2.0
 *
 * One walk described vertex by vertex: Stam's single-path view, as text to read or JSON to
 * draw. */
#include "base/text.h"
#include "film_filter.h"
#include "film_measure.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <stdio.h>
#include <string.h>

static void put_number(struct imp_text *t, double x)
{
    if (isfinite(x)) imp__put(t, "%.9g", x);
    else imp__put(t, "null");
}
static void put_vector(struct imp_text *t, const char *key, imp_v3 v, int n)
{
    imp__put(t, "\"%s\":[", key);
    for (int c = 0; c < n; c++) {
        if (c) imp__put(t, ",");
        put_number(t, v[c]);
    }
    imp__put(t, "]");
}
static void put_waves(struct imp_text *t, const char *key, const struct imp_waves *waves)
{
    const double *nm = waves->carried.nm;
    put_vector(t, key, (imp_v3){nm[0], nm[1], nm[2], nm[3]}, waves->carried.n);
}
/* Values that its vertices have. */
static int values_of(const struct imp_walk *w, const struct imp_scene *scene)
{
    return w->waves ? w->waves->carried.n : scene->channels;
}
static void put_string(struct imp_text *t, const char *key, const char *s)
{
    imp__put(t, "\"%s\":", key);
    t->failed = t->failed || !imp__json_string(t->ctx, &t->bytes, s);
}

static void json(struct imp_text *t, const struct imp_scene *scene,
                 const struct imp_walk *w, int x, int y, int64_t sample)
{
    const int C = values_of(w, scene);
    imp__put(t, "{\"pixel\":[%d,%d],\"sample\":%lld,", x, y, (long long)sample);
    imp__put(t, "\"film\":[%.9g,%.9g],", w->px, w->py);
    put_vector(t, "origin", w->ray.o, 3);
    imp__put(t, ",");
    put_vector(t, "direction", w->ray.d, 3);
    imp__put(t, ",");
    put_vector(t, "radiance", w->L, scene->channels);
    if (w->waves) {
        imp__put(t, ",");
        put_waves(t, "wavelengths_nm", w->waves);
    }
    imp__put(t, ",\"absorbed\":%s,\"dropped\":%d,\"vertices\":[",
             w->absorbed ? "true" : "false", (int)w->dropped);
    imp_spec beta = imp__spec(1);
    for (const struct imp_vertex *v = w->first; v; v = v->next) {
        imp__put(t, v->prev ? ",{" : "{");
        put_string(t, "shape", v->shape ? v->shape->name : "");
        imp__put(t, ",");
        put_string(t, "bsdf", v->bsdf ? v->bsdf->name : "");
        imp__put(t, ",");
        if (v->d.scatterer == IMP_IN_MEDIUM || v->d.scatterer == IMP_AT_SENSOR) {
            put_vector(t, "position", imp__decided_v3(v->d.p), 3);
            imp__put(t, ",\"distance\":%.9g,", v->t);
        } else if (v->shape) {
            put_vector(t, "position", imp__decided_v3(v->d.p), 3);
            imp__put(t, ",");
            put_vector(t, "normal", v->ng, 3);
            imp__put(t, ",\"uv\":[%.9g,%.9g],\"distance\":%.9g,", v->d.uv[0], v->d.uv[1],
                     v->t);
        } else {
            put_vector(t, "escapes", imp__decided_v3(v->d.p), 3);
            imp__put(t, ",");
        }
        put_vector(t, "throughput", beta, C);
        imp__put(t, ",");
        put_vector(t, "emission", v->e, C);
        imp__put(t, ",");
        if (v->d.connection == IMP_CONNECTED) {
            put_string(t, "light", scene->emitters[v->d.light.emitter]->name);
            imp__put(t, ",");
            if (isfinite(v->d.light.dist)) {
                put_vector(t, "light_position", imp__decided_v3(v->d.light.p), 3);
                imp__put(t, ",");
            }
            put_vector(t, "light_sample", v->light_f * v->light_e * v->light_w, C);
            imp__put(t, ",");
        } else if (v->d.connection == IMP_OCCLUDED) {
            imp__put(t, "\"light\":null,\"light_blocked\":true,");
        }
        if (v->d.goes_on) {
            imp__put(t, "\"lobe\":%d,\"pdf\":", v->d.lobe);
            put_number(t, v->d.pdf);
            imp__put(t, ",\"survival\":%.9g,", v->d.survive);
        }
        put_vector(t, "weight", v->w, C);
        imp__put(t, ",");
        put_vector(t, "arriving", v->beyond, C);
        imp__put(t, "}");
        beta *= v->w;
    }
    imp__put(t, "]}\n");
}

static void plain_spec(struct imp_text *t, const char *name, imp_spec s, int C)
{
    imp__put(t, "    %-12s", name);
    for (int c = 0; c < C; c++) imp__put(t, " %12.6g", s[c]);
    imp__put(t, "\n");
}

static void plain(struct imp_text *t, const struct imp_scene *scene,
                  const struct imp_walk *w, int x, int y, int64_t sample)
{
    const int C = values_of(w, scene);
    imp__put(t, "walk: pixel %d,%d sample %lld, film position %.4f %.4f\n", x, y,
             (long long)sample, w->px, w->py);
    imp__put(t, "  from (%.6g, %.6g, %.6g) along (%.6g, %.6g, %.6g)\n", w->ray.o[0],
             w->ray.o[1], w->ray.o[2], w->ray.d[0], w->ray.d[1], w->ray.d[2]);
    if (w->waves) {
        imp_spec nm;
        for (int c = 0; c < 4; c++) nm[c] = w->waves->carried.nm[c];
        plain_spec(t, "wavelengths", nm, C);
    }
    imp_spec beta = imp__spec(1);
    int k = 0;
    for (const struct imp_vertex *v = w->first; v; v = v->next, k++) {
        if (v->d.scatterer == IMP_AT_SENSOR) {
            imp__put(t, "  sensor\n");
            plain_spec(t, "weight", v->w, C);
            beta *= v->w;
            k--;
            continue;
        }
        if (v->d.scatterer == IMP_IN_MEDIUM)
            imp__put(t, "  %d: in %s at (%.6g, %.6g, %.6g), distance %.6g\n", k,
                     v->bsdf->name, v->d.p[0], v->d.p[1], v->d.p[2], v->t);
        else if (v->shape)
            imp__put(t,
                     "  %d: %s (%s) at (%.6g, %.6g, %.6g), distance %.6g, uv %.4f %.4f\n",
                     k, v->shape->name, *v->bsdf->name ? v->bsdf->name : "black",
                     v->d.p[0], v->d.p[1], v->d.p[2], v->t, v->d.uv[0], v->d.uv[1]);
        else
            imp__put(t, "  %d: leaves the scene along (%.6g, %.6g, %.6g)\n", k, v->d.p[0],
                     v->d.p[1], v->d.p[2]);
        plain_spec(t, "throughput", beta, C);
        if (v->d.met.emitter >= 0 || v->d.glows) plain_spec(t, "emission", v->e, C);
        if (v->d.connection == IMP_CONNECTED) {
            imp__put(t, "    light        %s\n",
                     scene->emitters[v->d.light.emitter]->name);
            plain_spec(t, "light sample", v->light_f * v->light_e * v->light_w, C);
        } else if (v->d.connection == IMP_OCCLUDED) {
            imp__put(t, "    light        blocked\n");
        }
        if (v->d.goes_on) {
            if (v->d.lobe == IMP_SMOOTH)
                imp__put(t, "    goes on      pdf %.6g per sr, survival %.6g\n", v->d.pdf,
                         v->d.survive);
            else
                imp__put(
                    t,
                    "    goes on      delta lobe %d, probability %.6g, survival %.6g\n",
                    v->d.lobe, v->d.pdf, v->d.survive);
            plain_spec(t, "weight", v->w, C);
            plain_spec(t, "arriving", v->beyond, C);
            if (!v->next) imp__put(t, "    leaves the scene\n");
        } else {
            imp__put(t, "    ends here%s\n", w->absorbed && !v->next ? ", absorbed" : "");
        }
        beta *= v->w;
    }
    if (k == 0) imp__put(t, "  meets nothing\n");
    if (w->dropped) imp__put(t, "  dropped: %s\n", imp_drop_text(w->dropped));
    plain_spec(t, "radiance", w->L, scene->channels);
}

enum imp_status imp_walk_describe(const imp_scene *scene, const struct imp_run *run,
                                  int x, int y, int64_t sample, bool as_json, char **out)
{
    struct imp_run own;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, out, "text");
    IMP_RUN_PICTURE(scene->ctx, own, run);
    IMP_CHECKED(imp__run_traces(scene->ctx, __func__, &own));
    IMP_FLOAT_MODE;
    IMP_READS(scene);
    const struct imp_sensor *sensor;
    enum imp_status st = imp__run_sensor(scene, &own, &sensor);
    if (st != IMP_OK) return st;
    /* Samples of the border, which wide filters bring in, are walks like others. */
    const int margin = sensor->film.sample_border ? imp__film_border(&sensor->film) : 0;
    const int width = sensor->film.crop_w, height = sensor->film.crop_h;
    if (x < -margin || y < -margin || x >= width + margin || y >= height + margin)
        return imp__error(
            scene->ctx, IMP_E_ARG,
            "there is no pixel %d,%d: in this picture they go from %d,%d to "
            "%d,%d",
            x, y, -margin, -margin, width + margin - 1, height + margin - 1);
    if (sample < 0)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "there is no sample %lld: the first is 0", (long long)sample);
    const struct imp_walk_integrator *integrator = imp__walk_integrator(scene);
    if (!integrator)
        return imp__error(scene->ctx,
                          scene->integrator->ops->flags & IMP_INTEGRATOR_SOLVES
                              ? IMP_E_UNSUPPORTED
                              : IMP_E_SCENE,
                          "the scene's integrator makes no walks; "
                          "use path, direct or stam");
    struct imp_job job = imp__job(scene, sensor, &own, NULL);
    imp__job_state(&job, IMP_HAS_PRINTED_WALKS, NULL);
    IMP_CHECKED(imp__job_allowed(&job));
    struct imp_walk_integrator read;
    integrator = own.guide ? job.walks : imp__walks_read(scene, sensor, job.walks, &read);
    struct imp_tracer tracer = {.scene = scene,
                                .integrator = integrator,
                                .sensor = sensor,
                                .seed = own.seed,
                                .guide = imp__guide_of(scene, integrator, own.guide)};
    imp__tracer_numbers(&tracer, &own, imp__walks_of(&own, sensor));
    struct imp_arena arena;
    imp__arena_init(&arena, scene->ctx);
    struct imp_walk walk;
    imp__walk_trace(&tracer, &arena, x, y, sample, &walk);
    struct imp_text t = {.ctx = scene->ctx};
    if (as_json) json(&t, scene, &walk, x, y, sample);
    else plain(&t, scene, &walk, x, y, sample);
    const bool failed = t.failed || walk.dropped == IMP_DROP_MEMORY;
    imp__arena_free(&arena);
    if (failed) {
        imp__bytes_free(scene->ctx, &t.bytes);
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory to describe the walk");
    }
    *out = (char *)t.bytes.data;
    return IMP_OK;
}
