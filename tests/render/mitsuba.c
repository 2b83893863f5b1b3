/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures against numbers that Mitsuba 3.9.1 gave for the same files, kept in
 * peer/mitsuba.txt by bench/peers/stored.py: the mean of each quarter of the picture, in
 * each channel, with both renderers' standard errors. Its colour tables are others and
 * its numbers floats: means may differ by 4e-4 in any case (docs/mitsuba.md), by 1e-3 in
 * spectral ones. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>

#define TABLES 4e-4
#define WAVES                                                                            \
    1e-3 /* where walks carry wavelengths: white light in Mitsuba is .9993, .9995, 1.0004 */
#define WALKS 6e5 /* of a picture */

static imp_context *ctx;

struct quarter {
    double mean, se;
};

/* Means over quarters of one channel; box filters, so pixels are independent. */
static void quarters(imp_film *film, const struct imp_film_info *info, int channel,
                     struct quarter q[4])
{
    const int h = info->height / 2, w = info->width / 2;
    int count[4] = {0};
    memset(q, 0, 4 * sizeof *q);
    for (int y = 0; y < info->height; y++)
        for (int x = 0; x < info->width; x++) {
            const int k = (y >= h) * 2 + (x >= w);
            const size_t at = (size_t)((y * info->width + x) * info->channels + channel);
            q[k].mean += imp_film_mean(film)[at];
            q[k].se += imp_film_se(film)[at] * imp_film_se(film)[at];
            count[k]++;
        }
    for (int k = 0; k < 4; k++) {
        q[k].mean /= count[k];
        q[k].se = sqrt(q[k].se) / count[k];
    }
}

static imp_film *render(const char *root, char *line, char *name, size_t size)
{
    char *save = NULL, scene_file[512], mode[16], path[1024];
    const char *defines[8];
    int sensor = 0, used = 0;
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_sensor_info info = {.size = sizeof info};
    imp_scene *scene;
    imp_film *film;
    char short_name[64];
    if (sscanf(line, "case %63s %511s %15s %d %n", short_name, scene_file, mode, &sensor,
               &used) != 4) {
        printf("Bail out! %s", line);
        exit(99);
    }
    snprintf(name, size, "%s", short_name);
    o.mode = strcmp(mode, "mono") == 0       ? IMP_MONO
             : strcmp(mode, "spectral") == 0 ? IMP_SPECTRAL
                                             : IMP_RGB;
    o.defines = defines;
    for (char *d = strtok_r(line + used, " \n", &save); d && o.n_defines < 8;
         d = strtok_r(NULL, " \n", &save))
        defines[o.n_defines++] = d;
    snprintf(path, sizeof path, "%s/../%s", root, scene_file);
    test_must(ctx, imp_scene_load(ctx, path, &o, &scene));
    test_must(ctx, imp_scene_get_sensor(scene, sensor, &info));
    run.sensor = sensor;
    run.seed = 21;
    run.spp = (int)fmax(16, WALKS / (info.width * info.height));
    test_must(ctx, imp_render(scene, &run, &film));
    imp_scene_destroy(scene);
    return film;
}

/* `brighter`: a planted error, that the numbers must catch. */
static int channel_agrees(imp_film *film, const char *line, const char *name,
                          double tables, double brighter)
{
    char channel[32];
    double v[8], worst = 0, se = 0;
    struct quarter q[4];
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    if (sscanf(line, "channel %31s %lf %lf %lf %lf %lf %lf %lf %lf", channel, &v[0],
               &v[1], &v[2], &v[3], &v[4], &v[5], &v[6], &v[7]) != 9)
        return 0;
    const char *at = info.channels == 1 ? "Y" : "RGB";
    const char *c = strchr(at, channel[0]);
    if (!c || channel[1] || c - at >= info.channels) { /* alpha: not in films */
        tap_skip(name, channel);
        return 1;
    }
    quarters(film, &info, (int)(c - at), q);
    for (int k = 0; k < 4; k++) {
        const double off = fabs(brighter * q[k].mean - v[2 * k]);
        const double noise = hypot(q[k].se, v[2 * k + 1]);
        worst = fmax(worst, fmax(0, off - tables * fabs(v[2 * k])) / (noise + 1e-9));
        se = fmax(se, noise / fabs(v[2 * k]));
    }
    if (brighter == 1)
        tap_ok(worst < 4.5, "%s %s # worst z %.2f, se %.2f %%", name, channel, worst,
               100 * se);
    return worst < 4.5;
}

int main(int argc, char **argv)
{
    char line[1024], name[64] = "", path[1024];
    imp_film *film = NULL;
    int caught = 0, channels = 0;
    snprintf(path, sizeof path, "%s/../tests/render/peer/mitsuba.txt", IMP_SCENES);
    FILE *f = fopen(path, "r");
    if (!f) return 99;
    ctx = test_context(0);
    while (fgets(line, sizeof line, f)) {
        if (strncmp(line, "case ", 5) == 0) {
            imp_film_destroy(film);
            film = NULL;
            if (argc < 2 || strstr(line, argv[1]))
                film = render(IMP_SCENES, line, name, sizeof name);
        }
        if (!film || strncmp(line, "channel ", 8) != 0) continue;
        const double tables = strstr(name, "_spectral") ? WAVES : TABLES;
        channel_agrees(film, line, name, tables, 1);
        caught += !channel_agrees(film, line, name, tables, 1.02);
        channels++;
    }
    tap_ok(caught == channels, "2 %% brighter is caught # in %d of %d channels", caught,
           channels);
    fclose(f);
    imp_film_destroy(film);
    imp_context_destroy(ctx);
    return tap_done();
}
