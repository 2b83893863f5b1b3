/* SPDX-License-Identifier: Apache-2.0
 *
 * A picture by finite elements: solved for the mean of this picture, then seen through
 * the sensor on a regular grid of rays in every pixel, as many as there are samples.
 * The film's filter is not applied: a pixel is the mean of its square. */
#include "base/film.h"
#include "base/pool.h"
#include "elements/elements_integrator.h"
#include "film_render.h"
#include "kind/cleared.h"

struct convert {
    const struct imp_measure *measure;
    const imp_film *from; /* "Y" or "R,G,B" */
    imp_film *to;
    int side;
};

/* Alpha as walks have it: something that reflects or shines is seen there. */
static double alpha_of(const struct convert *c, int x, int y)
{
    const struct imp_sensor *s = c->measure->sensor;
    const int n = c->side * c->side;
    int count = 0;
    for (int k = 0; k < n; k++) {
        const double px = s->film.crop_x + x + (k % c->side + 0.5) / c->side;
        const double py = s->film.crop_y + y + (k / c->side + 0.5) / c->side;
        struct imp_sensor_ray ray;
        struct imp_hit hit;
        imp__sensor_ray(s, px, py, (double[2]){0.5, 0.5}, &ray);
        count += imp__intersect(c->measure->scene, &ray.o, &ray.d, ray.t_near, ray.t_far,
                                &hit);
    }
    return (double)count / n;
}

static enum imp_status row_work(size_t item, int worker, int slot, void *payload)
{
    const struct convert *c = payload;
    const enum imp_pixel_format format = c->measure->sensor->film.pixel_format;
    const bool alpha = format == IMP_PIXEL_LUMINANCE_ALPHA || format == IMP_PIXEL_RGBA ||
                       format == IMP_PIXEL_XYZA;
    (void)worker, (void)slot;
    for (int x = 0; x < c->to->width; x++) {
        const size_t at = item * (size_t)c->to->width + (size_t)x;
        const float *in = c->from->mean + at * (size_t)c->from->channels;
        imp_spec L = imp__spec(in[0]);
        double value[IMP_MEASURE_MAX];
        if (c->from->channels == 3) L[1] = in[1], L[2] = in[2];
        imp__measure_base(c->measure, L, alpha ? alpha_of(c, x, (int)item) : 1, value);
        for (int k = 0; k < c->to->channels; k++)
            c->to->mean[at * (size_t)c->to->channels + (size_t)k] = (float)value[k];
    }
    return IMP_OK;
}

enum imp_status imp__render_elements(const struct imp_measure *m,
                                     const struct imp_run *run, imp_film **out)
{
    enum imp_status st = IMP_OK, ended;
    const imp_scene *scene = m->scene;
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    imp_elements *e = NULL;
    imp_film *seen = NULL, *film = NULL;
    const int side = imp_clamp((int)ceil(sqrt(m->spp)), 1, 64);
    if (imp__is_spectral(scene->mode))
        IMP_TRY(imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                           "finite elements are solved in rgb and mono modes"));
    if (scene->sensors[run->sensor]->gain)
        IMP_TRY(imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                           "finite elements make radiance: the film of sensor %d has an "
                           "exposure",
                           run->sensor));
    o.sensor = run->sensor;
    o.seed = run->seed;
    o.time_limit_s = run->time_limit_s;
    o.progress = run->progress;
    o.progress_payload = run->progress_payload;
    IMP_TRY(imp_elements_create(scene, &o, &e));
    ended = imp_elements_solve(e);
    if (ended != IMP_CANCELLED) IMP_TRY(ended);
    const enum imp_elements_image kind =
        imp__elements_integrator(scene->integrator)->image;
    IMP_TRY(imp_elements_image(e, run->sensor, kind, side, &seen));
    IMP_TRY(
        imp__film_create(scene->ctx, seen->width, seen->height, m->names, false, &film));
    film->spp = seen->spp;
    struct convert c = {m, seen, film, side};
    const struct imp_loop loop = {
        .n_items = (size_t)film->height, .work = row_work, .payload = &c};
    IMP_TRY(imp__parallel(scene->ctx, &loop, NULL));
    *out = film;
    film = NULL;
    st = ended;
out:
    imp_film_destroy(film);
    imp_film_destroy(seen);
    imp_elements_destroy(e);
    return st;
}
