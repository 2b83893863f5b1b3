/* SPDX-License-Identifier: Apache-2.0
 *
 * A picture without its noise, by what is known of first surfaces. */
#include "base/arguments.h"
#include "denoiser.h"
#include "film_measure.h"
#include "walk/run/run.h"
#include <math.h>
#include <string.h>

/* Albedo and normal have little noise: that of edges, lenses and textures. */
#define FEATURE_SAMPLES 32

/* Which channels are the colours; 3, or 1, or 0. */
static int colours(const imp_film *film, int at[3])
{
    static const char *const rgb[3] = {"R", "G", "B"};
    int n = 0;
    for (int c = 0; c < 3; c++) {
        at[c] = -1;
        for (int k = 0; k < film->channels; k++)
            if (strcmp(imp_film_channel(film, k), rgb[c]) == 0) at[c] = k;
        n += at[c] >= 0;
    }
    if (n == 3) return 3;
    for (int k = 0; k < film->channels; k++)
        if (strcmp(imp_film_channel(film, k), "Y") == 0) {
            at[0] = at[1] = at[2] = k;
            return 1;
        }
    return 0;
}

static enum imp_status features_make(const imp_scene *scene, const struct imp_run *run,
                                     imp_film **out)
{
    struct imp_measure m;
    struct imp_run own = *run;
    own.spp = FEATURE_SAMPLES;
    own.time_limit_s = 0;
    own.preview = NULL;
    own.drop_budget = 1; /* a first surface drops nothing */
    IMP_CHECKED(imp__measure_create(scene, &own, &m));
    const struct imp_picture picture = {.sensor = m.sensor,
                                        .stage = "denoise",
                                        .names = "albedo.R,albedo.G,albedo.B,"
                                                 "normal.X,normal.Y,normal.Z",
                                        .n = 6,
                                        .sample = imp__measure_features,
                                        .payload = &m};
    const enum imp_status st = imp__picture_make(scene->ctx, &picture, &own, out);
    imp__measure_destroy(&m);
    return st;
}

enum imp_status imp_denoiser_check(imp_context *context)
{
    IMP_REQUIRE(NULL, context, "context");
    return imp__denoiser_find(context);
}

enum imp_status imp_denoise(const imp_scene *scene, const struct imp_run *run,
                            const imp_film *film, imp_film **out)
{
    enum imp_status st = IMP_OK;
    struct imp_run own;
    const struct imp_sensor *sensor;
    imp_film *features = NULL, *made = NULL;
    float *planes = NULL;
    char *names = NULL;
    int at[3];
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, film, "picture");
    IMP_REQUIRE(scene->ctx, out, "out");
    IMP_RUN_PICTURE(scene->ctx, own, run);
    IMP_CHECKED(imp__run_traces(scene->ctx, __func__, &own));
    IMP_FLOAT_MODE;
    IMP_READS(scene);
    IMP_CHECKED(imp__run_sensor(scene, &own, &sensor));
    if (film->width != sensor->film.crop_w || film->height != sensor->film.crop_h)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "the picture is %d x %d, but sensor %d makes %d x %d pixels",
                          film->width, film->height, own.sensor, sensor->film.crop_w,
                          sensor->film.crop_h);
    const int n_colours = colours(film, at);
    if (!n_colours)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "a picture without channels R, G, B or Y cannot be denoised");
    const size_t n = (size_t)film->width * (size_t)film->height;
    planes = imp__alloc(scene->ctx, 9 * n, sizeof *planes);
    size_t length = 1;
    for (int k = 0; k < film->channels; k++)
        length += strlen(imp_film_channel(film, k)) + 1;
    names = imp__alloc(scene->ctx, length, 1);
    if (!planes || !names)
        IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "no memory to denoise a picture"));
    for (int k = 0; k < film->channels; k++) {
        if (k) strcat(names, ",");
        strcat(names, imp_film_channel(film, k));
    }
    IMP_TRY(features_make(scene, &own, &features));
    float *colour = planes, *albedo = planes + 3 * n, *normal = planes + 6 * n;
    for (size_t i = 0; i < n; i++)
        for (int c = 0; c < 3; c++) {
            const int lane = scene->channels == 3 ? c : 0;
            colour[3 * i + (size_t)c] =
                film->mean[i * (size_t)film->channels + (size_t)at[c]];
            albedo[3 * i + (size_t)c] =
                imp_clamp(features->mean[6 * i + (size_t)lane], 0.f, 1.f);
            normal[3 * i + (size_t)c] = features->mean[6 * i + 3 + (size_t)c];
        }
    IMP_TRY(imp__denoise(scene->ctx, film->width, film->height, colour, albedo, normal,
                         colour));
    IMP_TRY(imp_film_create(scene->ctx, film->width, film->height, names, &made));
    memcpy(made->mean, film->mean, n * (size_t)film->channels * sizeof *film->mean);
    for (size_t i = 0; i < n; i++)
        for (int c = 0; c < n_colours; c++) {
            const float v = colour[3 * i + (size_t)c];
            if (!isfinite(v))
                IMP_TRY(imp__error(scene->ctx, IMP_E_NUMERIC,
                                   "pixel (%zu, %zu) is not finite after denoising",
                                   i % (size_t)film->width, i / (size_t)film->width));
            made->mean[i * (size_t)film->channels + (size_t)at[c]] = v;
        }
    made->spp = film->spp;
    made->dropped = film->dropped;
    made->drops = film->drops;
    *out = made;
    made = NULL;
out:
    imp_film_destroy(features);
    imp_film_destroy(made);
    imp__release(scene->ctx, planes);
    imp__release(scene->ctx, names);
    return st;
}
