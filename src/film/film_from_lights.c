/* SPDX-License-Identifier: Apache-2.0
 *
 * The picture of a run by light tracing or bidirectional walks. */
#include "base/team.h"
#include "film_light.h"
#include "film_measure.h"
#include <string.h>

static void measure_values(const void *payload, const struct imp_light_walk *walk,
                           const struct imp_reach *reach, double *value)
{
    const struct imp_measure *m = payload;
    const struct imp_film_desc *film = &m->sensor->film;
    for (int c = 0; c < film->n_responses; c++) {
        imp_spec weight = {0};
        if (walk->walk.waves)
            imp__waves_response(walk->walk.waves, &film->response[c], &weight);
        value[c] = imp__sum_used(weight * reach->values, 4);
    }
    if (film->n_responses == 0) imp__measure_base(m, reach->L, 1, value);
}

enum imp_status imp__light_films_make(const struct imp_light_picture *p,
                                      const char *names, int n_films, imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = p->tracer->scene->ctx;
    const struct imp_film_desc *f = &p->tracer->sensor->film;
    const size_t pixels = (size_t)f->crop_w * (size_t)f->crop_h, n = (size_t)p->n;
    const size_t channels = n / (size_t)n_films;
    struct imp_drops drops = {0};
    double *mean = NULL, *se = NULL;
    imp_film **films = imp__alloc(ctx, (size_t)n_films, sizeof *films);
    if (!films) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for films"));
    if (p->run->time_limit_s > 0 && p->run->spp == 0)
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED,
                           "light tracing has no time limit; give the samples "
                           "per pixel"));
    for (int k = 0; k < n_films; k++)
        IMP_TRY(imp__film_describe(ctx, f->crop_w, f->crop_h, names, &films[k]));
    mean = imp__alloc(ctx, pixels * n, sizeof *mean);
    se = imp__alloc(ctx, pixels * n, sizeof *se);
    if (!mean || !se) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a picture"));
    IMP_TRY(imp__light_picture_make(p, mean, se, &drops));
    if (imp__team_part(ctx) && imp__team_shares(ctx)) IMP_TRY(IMP_PART);
    for (int k = 0; k < n_films; k++) {
        imp_film *film = films[k];
        IMP_TRY(imp__film_room(film, &film->mean));
        IMP_TRY(imp__film_room(film, &film->se));
        for (size_t i = 0; i < pixels * channels; i++) {
            const size_t at = i / channels * n + (size_t)k * channels + i % channels;
            film->mean[i] = (float)mean[at];
            film->se[i] = (float)se[at];
            if (!isfinite(film->mean[i]))
                IMP_TRY(imp__error(ctx, IMP_E_NUMERIC,
                                   "a pixel of the picture is not finite"));
        }
        film->spp = p->run->spp > 0 ? p->run->spp : p->tracer->sensor->spp;
        film->drops = drops;
        film->dropped = imp__drops_total(&drops);
    }
    memcpy(out, films, (size_t)n_films * sizeof *films);
    memset(films, 0, (size_t)n_films * sizeof *films);
out:
    for (int k = 0; films && k < n_films; k++) imp_film_destroy(films[k]);
    imp__release(ctx, films);
    imp__release(ctx, mean);
    imp__release(ctx, se);
    return st;
}

enum imp_status imp__render_from_lights(const struct imp_measure *m,
                                        const struct imp_run *run, imp_film **out)
{
    enum imp_status st = IMP_OK;
    const struct imp_walk_integrator *integrator = m->integrator;
    imp__light_walks_tell(m->scene, m->sensor, integrator);
    struct imp_tracer tracer = {.scene = m->scene,
                                .integrator = integrator,
                                .sensor = m->sensor,
                                .seed = run->seed,
                                .guide = imp__guide_of(m->scene, integrator, run->guide),
                                .value_only = true};
    imp__tracer_numbers(&tracer, run, 0);
    tracer.set = 1;
    const struct imp_light_picture picture = {.tracer = &tracer,
                                              .run = run,
                                              .stage = "render",
                                              .n = m->n,
                                              .values = measure_values,
                                              .payload = m,
                                              .walks =
                                                  imp__light_walks_of(run, m->sensor)};
    IMP_TRY(imp__light_films_make(&picture, m->names, 1, out));
out:
    return st;
}
