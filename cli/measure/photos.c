/* SPDX-License-Identifier: Apache-2.0
 *
 * Photographs and their sensors: SENSOR.png by its name, FILE@N by its number, or --photo. */
#include "photos.h"

#include "exif.h"
#include "shared/noise.h"
#include "shared/photograph.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "shared/sensor_names.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static struct {
    struct arg_list named;
    const char *noise, *clip;
} o;

const struct arg_option options_photos[] = {
    {ARG_LIST, 0, "photo", "SENSOR=FILE", "this photograph is of this sensor", &o.named,
     0, 0, NULL},
    {ARG_TEXT, 0, "noise", "SIGMA|KEY=V[,..]",
     "one standard deviation of the photographs' values, or as of plan: light v has the "
     "variance read^2 + shot v + (relative v)^2 (default: one, estimated from each)",
     &o.noise, 0, 0, NULL},
    {ARG_TEXT, 0, "clip", "auto|LOW,HIGH|never",
     "values at these levels were clipped (default auto: by the files, where they hold "
     "integers)",
     &o.clip, 0, 0, NULL},
    {0}};

/* ---- Files ----------------------------------------------------------------------------- */

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

static bool has_ending(const char *name, const char *const *endings)
{
    const char *dot = strrchr(name, '.');
    for (; dot && *endings; endings++)
        if (strcasecmp(dot + 1, *endings) == 0) return true;
    return false;
}

static const char *const scene_endings[] = {"xml", NULL};
static const char *const photo_endings[] = {"png", "jpg", "jpeg", "exr", "pfm",
                                            "hdr", "npy", "ppm",  "pgm", "bmp",
                                            "tga", "tif", "tiff", "dng", NULL};

static int by_name(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Files of a folder with these endings, sorted; [*n], each and all to be freed. */
static int folder_list(const char *folder, const char *const *endings, char ***out,
                       size_t *n)
{
    DIR *d = opendir(folder);
    *out = NULL;
    *n = 0;
    if (!d)
        return cli_error(EXIT_USAGE, "%s: cannot be read: %s", folder, strerror(errno));
    for (struct dirent *e; (e = readdir(d));) {
        if (e->d_name[0] == '.' || !has_ending(e->d_name, endings)) continue;
        char *path = join_path(folder, e->d_name);
        if (is_folder(path)) {
            free(path);
            continue;
        }
        char **grown = realloc(*out, (*n + 1) * sizeof *grown);
        if (!grown) exit(cli_error(EXIT_RUN, "out of memory"));
        *out = grown;
        grown[(*n)++] = path;
    }
    closedir(d);
    if (*n) qsort(*out, *n, sizeof **out, by_name);
    return 0;
}

static void list_free(char **list, size_t n)
{
    for (size_t i = 0; i < n; i++) free(list[i]);
    free(list);
}

int photos_scene(int n, char **operand, char **path)
{
    char **list;
    size_t found;
    *path = NULL;
    if (!is_folder(operand[0])) {
        *path = cli_strdup(operand[0]);
        return 0;
    }
    if (n > 1)
        return cli_error(
            EXIT_USAGE,
            "measure: %s is a folder: it stands alone, or behind the scene file",
            operand[0]);
    int rc = folder_list(operand[0], scene_endings, &list, &found);
    if (!rc && found == 1) *path = cli_strdup(list[0]);
    else if (!rc && found == 0)
        rc = cli_error(EXIT_USAGE,
                       "%s: there is no scene file (.xml) in this folder: write one with "
                       "rough guesses and a sensor for each photograph",
                       operand[0]);
    else if (!rc)
        rc = cli_error(
            EXIT_USAGE,
            "%s: there are %zu scene files in this folder, %s and %s: name one, "
            "'importon measure %s %s'",
            operand[0], found, list[0], list[1], list[0], operand[0]);
    list_free(list, found);
    return rc;
}

/* ---- Sensors --------------------------------------------------------------------------- */

/* By the file's name without its folder and ending. */
static int sensor_of_file(const char *path)
{
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    return sensor_named(name, dot ? (size_t)(dot - name) : strlen(name));
}

static int no_sensor(const char *what)
{
    char names[256];
    sensor_names(names, sizeof names);
    return cli_error(EXIT_USAGE,
                     "%s: no sensor has this name; the scene has %s: rename the file, or "
                     "give --photo SENSOR=FILE",
                     what, names);
}

/* ---- Pixels ---------------------------------------------------------------------------- */

struct given_noise {
    double one; /* 0: it is not given */
    struct noise of_light;
};

static int given_noise_read(struct given_noise *out)
{
    char *end;
    *out = (struct given_noise){0};
    if (!o.noise) return 0;
    out->one = strtod(o.noise, &end);
    if (end == o.noise || *end) {
        out->one = 0;
        return noise_read(o.noise, false, &out->of_light);
    }
    return out->one > 0 && isfinite(out->one)
               ? 0
               : cli_error(EXIT_USAGE, "--noise %s: expected a number above 0", o.noise);
}

static int photo_read(struct photos *p, const char *path, int sensor)
{
    struct imp_target t = IMP_TARGET_INIT;
    char spec[4200];
    struct imp_photo photo = IMP_PHOTO_INIT;
    if (strlen(path) > 4096)
        return cli_error(EXIT_USAGE, "%.60s...: too long a name", path);
    snprintf(spec, sizeof spec, "%s@%d", path, sensor);
    struct given_noise noise;
    int rc = given_noise_read(&noise);
    if (!rc) rc = picture_target(spec, NULL, &t);
    if (rc) return rc;
    photo.step = photograph_step(spec);
    const bool never = o.clip && !strcmp(o.clip, "never");
    photo.clipped = !never && (isfinite(photograph_white(spec)) ||
                               (o.clip && strcmp(o.clip, "auto") != 0));
    photograph_undo_srgb(spec, &t);
    if (photo.clipped)
        rc = photograph_levels(spec, o.clip ? o.clip : "auto", &t, &photo.low,
                               &photo.high);
    if (rc) {
        picture_target_free(&t);
        return rc;
    }
    const struct exif_numbers exif = exif_read(path);
    photo.sensor = sensor;
    photo.width = t.width;
    photo.height = t.height;
    photo.channels = t.channels;
    photo.pixels = t.pixels;
    photo.weights = t.weights;
    photo.noise = noise.one;
    photo.read = noise.of_light.read;
    photo.shot = noise.of_light.shot;
    photo.relative = noise.of_light.relative;
    photo.focal_35mm = exif.focal_35mm;
    photo.exposure_s = exif.exposure_s;
    photo.iso = exif.iso;
    photo.f_number = exif.f_number;
    t.pixels = t.weights = NULL;
    picture_target_free(&t);

    struct imp_photo *grown = realloc(p->photo, (p->n + 1) * sizeof *grown);
    if (grown) p->photo = grown;
    char **paths = realloc(p->path, (p->n + 1) * sizeof *paths);
    if (paths) p->path = paths;
    char **specs = realloc(p->spec, (p->n + 1) * sizeof *specs);
    if (specs) p->spec = specs;
    if (!grown || !paths || !specs) exit(cli_error(EXIT_RUN, "out of memory"));
    p->path[p->n] = cli_strdup(path);
    p->spec[p->n] = cli_strdup(spec);
    photo.name = p->path[p->n];
    p->photo[p->n++] = photo;
    args_list_add(&problem_options.targets, p->spec[p->n - 1]);
    return 0;
}

static int folder_read(struct photos *p, const char *folder)
{
    char **list;
    size_t n, taken = 0;
    int rc = folder_list(folder, photo_endings, &list, &n);
    for (size_t i = 0; i < n && !rc; i++) {
        const int sensor = sensor_of_file(list[i]);
        if (sensor < 0) {
            cli_say("importon: %s is no photograph: no sensor has this name", list[i]);
            continue;
        }
        taken++;
        rc = photo_read(p, list[i], sensor);
    }
    if (!rc && n == 0 && !o.named.n)
        rc = cli_error(EXIT_USAGE, "%s: there are no photographs in this folder", folder);
    if (!rc && taken == 0 && !o.named.n) rc = no_sensor(folder);
    list_free(list, n);
    return rc;
}

static int file_read(struct photos *p, const char *word)
{
    int sensor = picture_sensor(word);
    if (sensor >= 0) {
        char *path = strndup(word, (size_t)(strrchr(word, '@') - word));
        if (!path) return cli_error(EXIT_RUN, "out of memory");
        const int rc = photo_read(p, path, sensor);
        free(path);
        return rc;
    }
    sensor = sensor_of_file(word);
    if (sensor < 0 && sensor_count() == 1) sensor = 0;
    return sensor < 0 ? no_sensor(word) : photo_read(p, word, sensor);
}

static int named_read(struct photos *p, const char *text)
{
    const char *equal = strchr(text, '=');
    if (!equal || equal == text || !equal[1])
        return cli_error(EXIT_USAGE, "--photo %s: expected SENSOR=FILE", text);
    const int sensor = sensor_named(text, (size_t)(equal - text));
    return sensor < 0 ? no_sensor(text) : photo_read(p, equal + 1, sensor);
}

int photos_read(int n, char **operand, struct photos *out)
{
    int rc = 0;
    for (int i = is_folder(operand[0]) ? 0 : 1; i < n && !rc; i++)
        rc = is_folder(operand[i]) ? folder_read(out, operand[i])
                                   : file_read(out, operand[i]);
    for (size_t i = 0; i < o.named.n && !rc; i++) rc = named_read(out, o.named.item[i]);
    if (!rc && out->n == 0)
        rc = cli_error(EXIT_USAGE,
                       "measure: no photographs are given: name files, a folder, or "
                       "--photo SENSOR=FILE");
    return rc;
}

void photos_free(struct photos *p)
{
    for (size_t i = 0; i < p->n; i++) {
        free((void *)p->photo[i].pixels);
        free((void *)p->photo[i].weights);
        free(p->path[i]);
        free(p->spec[i]);
    }
    free(p->photo);
    free(p->path);
    free(p->spec);
    args_list_free(&o.named);
}
