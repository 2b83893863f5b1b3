/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures that a fit writes: the start, the result, the targets, and a contact sheet
 * of them. */
#include "fit_pictures.h"

#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "shared/sheet.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* "name.exr", or "name-1.exr" for the second of several targets. */
static char *picture_path(const char *name, size_t i)
{
    char file[64];
    if (problem_options.targets.n == 1) snprintf(file, sizeof file, "%s.exr", name);
    else snprintf(file, sizeof file, "%s-%zu.exr", name, i);
    return join_path(cli.out, file);
}

static int write_one(const char *name, size_t i, int spp)
{
    struct imp_run run = cli_run();
    const struct picture_options po = {.standard_error = 1};
    imp_film *film = NULL;
    run.sensor = target_sensor(i);
    run.time_limit_s = 0;
    if (spp) run.spp = spp;
    const enum imp_status st = imp_render(cli.scene, &run, &film);
    if (cli_failed(st)) return cli_fail(st, cli.scene_path);
    if (!film) return cli_done();
    char *path = picture_path(name, i);
    picture_stamp(film, &run);
    const int rc = picture_write(film, path, &po);
    free(path);
    imp_film_destroy(film);
    return rc;
}

int fit_pictures_write(const char *name, int spp)
{
    int rc = 0;
    for (size_t i = 0; i < problem_options.targets.n && !rc; i++)
        rc = write_one(name, i, spp);
    return rc;
}

int fit_loosest_write(imp_problem *problem, const double *x_dot)
{
    const struct picture_options po = {.standard_error = 1, .diverging = 1};
    int rc = 0;
    for (size_t i = 0; i < problem_options.targets.n && !rc; i++) {
        struct imp_run run = cli_run();
        imp_film *film = NULL;
        run.sensor = target_sensor(i);
        run.time_limit_s = 0;
        const enum imp_status st = imp_problem_forward(problem, x_dot, &run, &film);
        if (cli_failed(st)) return cli_fail(st, cli.scene_path);
        if (!film) return cli_done();
        char *path = picture_path("undetermined", i);
        picture_stamp(film, &run);
        rc = picture_write(film, path, &po);
        free(path);
        imp_film_destroy(film);
    }
    return rc;
}

/* "a,b,c" of the sensor's film, then "se.a,se.b,se.c" where errors are known. To be freed. */
static char *channel_names(const struct imp_target *t)
{
    static const char *const rgb[] = {"R", "G", "B"}, *const y[] = {"Y"};
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    const char *const *name = t->channels == 3 ? rgb : y;
    char *text = NULL;
    size_t size = 0;
    if (imp_scene_get_sensor(cli.scene, t->sensor, &sensor) == IMP_OK &&
        sensor.n_responses)
        name = sensor.response_names;
    FILE *to = open_memstream(&text, &size);
    if (!to) return NULL;
    for (int part = 0; part < (t->noise_se ? 2 : 1); part++)
        for (int c = 0; c < t->channels; c++)
            fprintf(to, "%s%s%s", part + c ? "," : "", part ? "se." : "", name[c]);
    fclose(to);
    return text;
}

static enum imp_status film_of(const struct imp_target *t, imp_film **out)
{
    const size_t n = (size_t)t->width * (size_t)t->height, c = (size_t)t->channels,
                 all = t->noise_se ? 2 * c : c;
    char *names = channel_names(t);
    if (!names) return IMP_E_NOMEM;
    const enum imp_status st =
        imp_film_create(cli.context, t->width, t->height, names, out);
    free(names);
    if (st != IMP_OK) return st;
    float *to = imp_film_mean(*out);
    for (size_t i = 0; i < n; i++) {
        memcpy(to + i * all, t->pixels + i * c, c * sizeof *to);
        if (t->noise_se) memcpy(to + i * all + c, t->noise_se + i * c, c * sizeof *to);
    }
    return IMP_OK;
}

int fit_target_film(size_t i, imp_film **out)
{
    struct imp_target t = IMP_TARGET_INIT;
    int rc = picture_target(problem_options.targets.item[i], NULL, &t);
    if (rc) return rc;
    const enum imp_status st = film_of(&t, out);
    picture_target_free(&t);
    return st == IMP_OK ? 0 : cli_fail(st, NULL);
}

/* A target that is where its copy would go stays as it is. */
static bool is_there(size_t i, const char *path)
{
    const char *spec = problem_options.targets.item[i], *at = strrchr(spec, '@');
    struct stat from, to;
    if (stat(path, &to) != 0) return false;
    char *file = picture_sensor(spec) >= 0 && at ? strndup(spec, (size_t)(at - spec))
                                                 : strdup(spec);
    const bool same = file && stat(file, &from) == 0 && from.st_dev == to.st_dev &&
                      from.st_ino == to.st_ino;
    free(file);
    return same;
}

int fit_targets_write(void)
{
    const struct picture_options po = {0};
    int rc = 0;
    for (size_t i = 0; i < problem_options.targets.n && !rc; i++) {
        const struct imp_run run = cli_run();
        imp_film *film = NULL;
        char *path = picture_path("target", i);
        if (!is_there(i, path)) {
            rc = fit_target_film(i, &film);
            if (!rc) {
                picture_stamp(film, &run);
                rc = picture_write(film, path, &po);
            }
            imp_film_destroy(film);
        }
        free(path);
    }
    return rc;
}

void fit_pictures_remove(const char *name)
{
    for (size_t i = 0; i < problem_options.targets.n; i++) {
        char *path = picture_path(name, i);
        if (!is_there(i, path)) picture_remove(path);
        free(path);
    }
}

void fit_pictures_refused(enum imp_status st)
{
    if (!cli.out || (st != IMP_E_ARG && st != IMP_E_UNSUPPORTED && st != IMP_E_BIAS))
        return;
    fit_pictures_remove("before");
    fit_pictures_remove("target");
    if (cli_writes()) (void)!rmdir(cli.out);
}

int fit_sheet_write(const char *to)
{
    static const char *const name[] = {"before", "target", "recovered"};
    struct sheet sheet = {NULL, 0};
    for (size_t i = 0; i < problem_options.targets.n; i++)
        for (int k = 0; k < 3; k++) {
            char *path = picture_path(name[k], i);
            sheet_add(&sheet, path);
            free(path);
        }
    const int rc = sheet_write(&sheet, 3, to);
    sheet_free(&sheet);
    return rc;
}

int fit_pictures_writable(void)
{
    static const char *const pictures[] = {"before", "recovered", "undetermined",
                                           "target"};
    int rc = 0;
    for (size_t i = 0; i < problem_options.targets.n; i++)
        for (size_t k = 0; k < 4 && !rc; k++) {
            char *path = picture_path(pictures[k], i);
            if (k < 3 || !is_there(i, path)) rc = picture_writable(path, 1);
            free(path);
        }
    return rc;
}
