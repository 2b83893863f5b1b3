/* SPDX-License-Identifier: Apache-2.0
 *
 * The pixels of a meter as a grid: where they are, and what they read. */
#include "base/arguments.h"
#include "base/film.h"
#include "base/float_mode.h"
#include "color/rgb.h"
#include "film/film_render.h"
#include "grid_film.h"
#include "kind/sensor/radiancemeter.h"
#include "kind/sensor/receiver.h"
#include "room_average.h"
#include "scene/access.h"
#include "walk/run/run.h"
#include <importon/rooms.h>
#include <math.h>

static enum imp_status no_grid(const struct imp_scene *scene, const struct imp_sensor *s)
{
    return imp__error(scene->ctx, IMP_E_ARG,
                      "sensor '%s' (%s) has no grid of points: that is an "
                      "irradiancemeter on a rectangle or, at points, on a disk or a flat "
                      "mesh, or a radiancemeter with 'grid'",
                      s->name, s->ops->name);
}

static enum imp_status grid_of(const struct imp_scene *scene, int sensor,
                               const struct imp_sensor **out)
{
    if (sensor < 0 || sensor >= scene->n_sensors)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "there is no sensor %d; the scene has %d", sensor,
                          scene->n_sensors);
    *out = scene->sensors[sensor];
    return imp__has_grid(*out) || imp__looks_at_grid(*out) ? IMP_OK
                                                           : no_grid(scene, *out);
}

enum imp_status imp_grid_cells(const imp_scene *scene, int sensor, int *columns,
                               int *rows, int32_t *cell)
{
    const struct imp_sensor *s;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_CHECKED(grid_of(scene, sensor, &s));
    const struct imp_film_desc *f = &s->film;
    const struct imp_receiver *r = s->receiver && s->receiver->place ? s->receiver : NULL;
    if (columns) *columns = r ? r->columns : f->crop_w;
    if (rows) *rows = r ? r->rows : f->crop_h;
    for (int i = 0; cell && i < f->crop_w * f->crop_h; i++) {
        cell[2 * i] = r ? r->cell[i][0] : i % f->crop_w;
        cell[2 * i + 1] = r ? r->cell[i][1] : i / f->crop_w;
    }
    return IMP_OK;
}

static imp_v3 place_of(const struct imp_sensor *s, double px, double py, imp_v3 *normal)
{
    struct imp_surface at;
    double uv[2];
    if (imp__looks_at_grid(s)) return imp__grid_looked_at(s, px, py, normal);
    imp__receiver_uv(s, px, py, uv);
    s->shape->ops->sample_area(s->shape, uv, &at);
    *normal = at.ng;
    return at.p;
}

enum imp_status imp_grid_points(const imp_scene *scene, int sensor, double *points,
                                double *normals)
{
    const struct imp_sensor *s;
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, points, "points");
    IMP_CHECKED(grid_of(scene, sensor, &s));
    const struct imp_film_desc *f = &s->film;
    for (int y = 0; y < f->crop_h; y++)
        for (int x = 0; x < f->crop_w; x++) {
            const size_t at = 3 * ((size_t)y * (size_t)f->crop_w + (size_t)x);
            imp_v3 n;
            const imp_v3 p = place_of(s, f->crop_x + x + 0.5, f->crop_y + y + 0.5, &n);
            for (int k = 0; k < 3; k++) {
                points[at + (size_t)k] = p[k];
                if (normals) normals[at + (size_t)k] = n[k];
            }
        }
    return IMP_OK;
}

/* Weights of a film's channels in the luminance. */
static enum imp_status weights_of(const struct imp_scene *scene,
                                  const struct imp_sensor *s, double w[4], int *n)
{
    const struct imp_film_desc *f = &s->film;
    const enum imp_pixel_format p = f->pixel_format;
    if (f->n_responses > 0 || p == IMP_PIXEL_XYZ || p == IMP_PIXEL_XYZA)
        return imp__error(
            scene->ctx, IMP_E_UNSUPPORTED,
            "the film of sensor '%s' has other channels than luminance or rgb: "
            "a grid has one number of light a point",
            s->name);
    if (f->filter.radius > 0.5)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "the film of sensor '%s' has the filter %s, which mixes "
                          "neighbouring points; a grid has rfilter box",
                          s->name, f->filter.ops->name);
    const bool one = p == IMP_PIXEL_LUMINANCE || p == IMP_PIXEL_LUMINANCE_ALPHA;
    for (int c = 0; c < 3; c++) w[c] = imp__luminance(c == 0, c == 1, c == 2);
    if (one) w[0] = 1;
    *n = one ? 1 : 3;
    return IMP_OK;
}

enum imp_status imp__grid_film_of(const struct imp_scene *scene,
                                  const struct imp_run *run, struct imp_grid_film *out)
{
    struct imp_measure measure;
    IMP_CHECKED(imp__run_sensor(scene, run, &out->sensor));
    IMP_CHECKED(weights_of(scene, out->sensor, out->weight, &out->channels));
    IMP_CHECKED(imp__measure_create(scene, run, &measure));
    out->shared = measure.integrator && (measure.from_lights || measure.integrator->both);
    imp__measure_destroy(&measure);
    return IMP_OK;
}

enum imp_status imp__grid_film_check(const struct imp_grid_film *grid,
                                     const imp_film *film)
{
    if (film->se) return IMP_OK;
    return imp__error(film->ctx, IMP_E_UNSUPPORTED,
                      "the readings of sensor '%s' have no standard errors: a pixel "
                      "needs two samples, or two sets of them",
                      grid->sensor->name);
}

static double error_of(const struct imp_grid_film *grid, const imp_film *film,
                       size_t pixel, int first)
{
    double se = 0;
    for (int c = 0; c < grid->channels; c++)
        se += grid->weight[c] *
              (double)film->se[pixel * (size_t)film->channels + (size_t)(first + c)];
    return se;
}

enum imp_status imp__grid_film_mean(const struct imp_grid_film *grid,
                                    const imp_film *film, struct imp_estimate *out)
{
    const size_t n = (size_t)film->width * (size_t)film->height;
    double *se = imp__alloc(film->ctx, n, sizeof *se), square = 0;
    if (!se) return imp__error(film->ctx, IMP_E_NOMEM, "no memory for the readings");
    *out = (struct imp_estimate){0};
    for (size_t i = 0; i < n; i++) {
        double value, own;
        imp__grid_film_take(grid, film, i, &value, &own);
        out->value += value / (double)n;
        se[i] = error_of(grid, film, i, grid->alone);
        square += se[i] * se[i];
    }
    const double k = (double)imp__grid_film_sets(film) - 1;
    out->se = sqrt(square) / (double)n;
    out->freedom = (int)imp_clamp(imp__grid_freedom(n, se, k), 1.0, 1e9);
    imp__release(film->ctx, se);
    return IMP_OK;
}

void imp__grid_film_take(const struct imp_grid_film *grid, const imp_film *film,
                         size_t pixel, double *value, double *se)
{
    *value = 0;
    for (int c = 0; c < grid->channels; c++)
        *value += grid->weight[c] *
                  (double)film->mean[pixel * (size_t)film->channels + (size_t)c];
    *se = error_of(grid, film, pixel, 0);
}

static enum imp_status grid_render(imp_scene *scene, const struct imp_run *run,
                                   int *alone, imp_film **film)
{
    IMP_FLOAT_MODE;
    IMP_READS(scene);
    return imp__render_grid(scene, run, alone, film);
}

enum imp_status imp_grid_read(imp_scene *scene, const struct imp_run *run, double *value,
                              double *se, struct imp_estimate *average, int64_t *sets)
{
    enum imp_status st = IMP_OK;
    struct imp_grid_film grid;
    struct imp_run own;
    imp_film *film = NULL;
    imp_problem *problem = NULL;
    struct imp_estimate mean = {0};
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, value, "value");
    IMP_REQUIRE(scene->ctx, se, "se");
    IMP_REQUIRE(scene->ctx, average, "average");
    IMP_RUN(scene->ctx, own, run);
    IMP_CHECKED(imp__grid_film_of(scene, &own, &grid));
    IMP_TRY(grid_render(scene, &own, &grid.alone, &film));
    IMP_TRY(imp__grid_film_check(&grid, film));
    const size_t pixels = (size_t)film->width * (size_t)film->height;
    if (!grid.shared) {
        IMP_TRY(imp__grid_film_mean(&grid, film, &mean));
    } else {
        IMP_TRY(imp_problem_create(scene, &problem));
        IMP_TRY(imp__room_average(problem, &own, &mean, NULL, NULL));
    }
    for (size_t i = 0; i < pixels; i++)
        imp__grid_film_take(&grid, film, i, &value[i], &se[i]);
    *average = mean;
    if (sets) *sets = imp__grid_film_sets(film);
out:
    imp_problem_destroy(problem);
    imp_film_destroy(film);
    return st;
}
