/* SPDX-License-Identifier: Apache-2.0
 *
 * The picture of a run by walks from the lights. */
#include "base/team.h"
#include "film_light.h"
#include "film_measure.h"

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

enum imp_status imp__render_from_lights(const struct imp_measure *m,
                                        const struct imp_run *run, imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = m->scene->ctx;
    const struct imp_film_desc *f = &m->sensor->film;
    const size_t values = (size_t)f->crop_w * (size_t)f->crop_h * (size_t)m->n;
    const struct imp_walk_integrator *integrator = m->integrator;
    double *mean = NULL, *se = NULL;
    imp_film *film = NULL;
    struct imp_drops drops = {0};
    IMP_TRY(imp__light_walks_allowed(m->scene, m->sensor, integrator, NULL));
    imp__light_walks_tell(m->scene, m->sensor, integrator);
    if (f->n_responses == 0 &&
        (f->pixel_format == IMP_PIXEL_LUMINANCE_ALPHA ||
         f->pixel_format == IMP_PIXEL_RGBA || f->pixel_format == IMP_PIXEL_XYZA))
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED,
                           "walks from the lights know no alpha: use pixel_format rgb, "
                           "xyz or luminance"));
    if (run->time_limit_s > 0 && run->spp == 0)
        IMP_TRY(imp__error(ctx, IMP_E_UNSUPPORTED,
                           "walks from the lights have no time limit; give the samples "
                           "per pixel"));
    struct imp_tracer tracer = {.scene = m->scene,
                                .integrator = integrator,
                                .sensor = m->sensor,
                                .seed = run->seed,
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
    IMP_TRY(imp__film_describe(ctx, f->crop_w, f->crop_h, m->names, &film));
    mean = imp__alloc(ctx, values, sizeof *mean);
    se = imp__alloc(ctx, values, sizeof *se);
    if (!mean || !se) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a picture"));
    IMP_TRY(imp__light_picture_make(&picture, mean, se, &drops));
    if (imp__team_part(ctx) && imp__team_shares(ctx)) IMP_TRY(IMP_PART);
    IMP_TRY(imp__film_room(film, &film->mean));
    IMP_TRY(imp__film_room(film, &film->se));
    for (size_t k = 0; k < values; k++) {
        film->mean[k] = (float)mean[k];
        film->se[k] = (float)se[k];
        if (!isfinite(film->mean[k]))
            IMP_TRY(
                imp__error(ctx, IMP_E_NUMERIC, "a pixel of the picture is not finite"));
    }
    film->spp = run->spp > 0 ? run->spp : m->sensor->spp;
    film->drops = drops;
    film->dropped = imp__drops_total(&drops);
    *out = film;
    film = NULL;
out:
    imp_film_destroy(film);
    imp__release(ctx, mean);
    imp__release(ctx, se);
    return st;
}
