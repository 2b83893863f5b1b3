/* SPDX-License-Identifier: Apache-2.0
 *
 * Targets: pictures with masks, and numbers. */
#include "picture_files.h"

#include "command.h"
#include "photograph.h"
#include "sensor_names.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static int channel_index(imp_film *film, int n, const char *name)
{
    for (int c = 0; c < n; c++)
        if (!strcmp(imp_film_channel(film, c), name)) return c;
    return -1;
}

/* The colour channels of a picture: three, or one. 0: it has others, and index[0] is the first. */
static int colour_channels(imp_film *film, int n, int index[3])
{
    static const char *const rgb[3] = {"R", "G", "B"};
    for (int c = 0; c < 3; c++) index[c] = channel_index(film, n, rgb[c]);
    if (index[0] >= 0 && index[1] >= 0 && index[2] >= 0) return 3;
    index[0] = channel_index(film, n, "Y");
    if (index[0] >= 0) return 1;
    index[0] = 0;
    return n == 1;
}

/* An array has no names: which of two numbers would be the luminance? */
static int is_pair_of_numbers(const char *path, int n)
{
    const char *dot = strrchr(path, '.');
    return n == 2 && dot && !strcasecmp(dot, ".npy");
}

enum { NAMES_SHOWN = 6 };

static int foreign_channels(imp_film *film, const char *path, int n, int sensor)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    char names[256] = "", more[32] = "";
    imp_scene_get_info(cli.scene, &scene);
    const char *own = scene.channels == 3 ? "R, G, B" : "Y";
    if (is_pair_of_numbers(path, n))
        return cli_error(EXIT_USAGE,
                         "%s has 2 channels without names; the film of sensor %d has %s",
                         path, sensor, own);
    for (int c = 0; c < n && c < NAMES_SHOWN; c++) {
        const size_t at = strlen(names);
        snprintf(names + at, sizeof names - at, "%s%.30s", c ? ", " : "",
                 imp_film_channel(film, c));
    }
    if (n > NAMES_SHOWN) snprintf(more, sizeof more, ", ... (%d)", n);
    return cli_error(EXIT_USAGE, "%s has channels %s%s; the film of sensor %d has %s",
                     path, names, more, sensor, own);
}

/* Those of a film's response curves, by name. */
static int curve_channels(imp_film *film, const char *path,
                          const struct imp_film_info *info,
                          const struct imp_sensor_info *sensor, int *index)
{
    for (int c = 0; c < sensor->n_responses; c++) {
        index[c] = channel_index(film, info->channels, sensor->response_names[c]);
        if (index[c] < 0)
            return cli_error(EXIT_USAGE,
                             "%s has no channel '%s', which is a response curve of the "
                             "sensor's film",
                             path, sensor->response_names[c]);
    }
    return 0;
}

/* What becomes of one pixel's numbers; se's are added in squares. */
static double mix(const float *from, const int *index, int squares)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        const double x = picture_luminance[c] * from[index[c]];
        sum += squares ? x * x : x;
    }
    return squares ? sqrt(sum) : sum;
}

static float *extract(const float *from, size_t n_pixels, int stride, const int *index,
                      int channels_in, int channels_out, int squares)
{
    float *out = cli_alloc(n_pixels * (size_t)channels_out, sizeof *out);
    for (size_t i = 0; i < n_pixels; i++, from += stride)
        for (int c = 0; c < channels_out; c++)
            out[i * (size_t)channels_out + (size_t)c] =
                channels_in > channels_out ? (float)mix(from, index, squares)
                                           : from[index[c]];
    return out;
}

/* The "@3" or "@NAME" of "FILE@3"; with '@' and neither after it, it is the name of a file. */
static const char *sensor_part(const char *spec)
{
    const char *at = strrchr(spec, '@');
    if (!at || !at[1]) return NULL;
    const bool digits = strspn(at + 1, "0123456789") == strlen(at + 1) && strlen(at) < 8;
    return digits || sensor_find(at + 1) >= 0 ? at : NULL;
}
int picture_sensor(const char *spec)
{
    const char *at = sensor_part(spec);
    const int named = at ? sensor_find(at + 1) : -1;
    return !at ? -1 : named >= 0 ? named : atoi(at + 1);
}

/* "=V", "=V,V,V" or either with "+-SE": the reading of a sensor of one pixel, or of every pixel
 * of a meter's grid. */
static int number_target(const char *text, int sensor, struct imp_target *target)
{
    struct imp_sensor_info info = {.size = sizeof info};
    struct imp_scene_info scene = {.size = sizeof scene};
    double value[3], se = 0;
    int n = 0, fine = 0;
    imp_scene_get_info(cli.scene, &scene);
    const enum imp_status st = imp_scene_get_sensor(cli.scene, sensor, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    for (const char *p = text + 1; n < 3;) {
        char *end;
        value[n++] = strtod(p, &end);
        if (end == p) break;
        p = end + 1;
        if (*end == ',') continue;
        fine = !*end;
        if (!strncmp(end, "+-", 2)) {
            se = strtod(end + 2, &end);
            fine = !*end && se > 0;
        }
        break;
    }
    const char *at = strrchr(text, '@');
    if (at)
        return cli_error(EXIT_USAGE, "--target %s: the scene has no sensor '%s'", text,
                         at + 1);
    if (!fine || (n != 1 && n != scene.channels))
        return cli_error(
            EXIT_USAGE,
            "--target %s: expected =NUMBER, or =R,G,B, and +-ERROR behind it "
            "if that is known",
            text);
    const int one = info.width == 1 && info.height == 1;
    if (!one && strcmp(info.type, "irradiancemeter") != 0)
        return cli_error(
            EXIT_USAGE,
            "--target %s: sensor %d ('%s') makes %d x %d pixels; a number is "
            "the target of one, or of each of a meter",
            text, sensor, info.name, info.width, info.height);
    const size_t numbers = (size_t)info.width * (size_t)info.height * (size_t)n;
    float *pixels = cli_alloc(numbers, sizeof *pixels);
    float *errors = se > 0 ? cli_alloc(numbers, sizeof *errors) : NULL;
    for (size_t k = 0; k < numbers; k++) {
        pixels[k] = (float)value[k % (size_t)n];
        if (errors) errors[k] = (float)se;
    }
    target->sensor = sensor;
    target->width = info.width;
    target->height = info.height;
    target->channels = n;
    target->pixels = pixels;
    target->noise_se = errors;
    return 0;
}

/* Once for each file, which is read for its copy in the folder of answers, too. */
static void reduced_say(const char *path, int part)
{
    static struct arg_list said;
    for (size_t i = 0; i < said.n; i++)
        if (!strcmp(said.item[i], path)) return;
    args_list_add(&said, cli_strdup(path));
    cli_say("importon: %s: means of %d x %d pixels each", path, part, part);
}

/* A file with a whole number of pixels for each of the sensor's: their means, and weight 0 where some are
 * clipped. *made is to be freed; NULL: nothing was. */
static int reduce(const char *spec, const char *path,
                  const struct imp_sensor_info *sensor, imp_film **film, float **made)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film *small = NULL;
    imp_film_get_info(*film, &info);
    if (sensor->width < 1 || sensor->height < 1 || info.width <= sensor->width ||
        info.width % sensor->width || info.height % sensor->height ||
        info.width / sensor->width != info.height / sensor->height)
        return 0;
    const enum imp_status st = imp_film_reduce(*film, sensor->width, sensor->height,
                                               photograph_white(spec), &small);
    if (st != IMP_OK) return cli_fail(st, path);
    reduced_say(path, info.width / sensor->width);
    imp_film_destroy(*film);
    *film = small;
    const size_t n = (size_t)sensor->width * (size_t)sensor->height,
                 C = (size_t)info.channels;
    float *v = imp_film_mean(small), *se = imp_film_se(small);
    float *weights = cli_alloc(n, sizeof *weights);
    size_t some = 0;
    for (size_t i = 0; i < n; i++) {
        weights[i] = 1;
        for (size_t c = 0; c < C; c++) {
            if (!isnan(v[i * C + c])) continue;
            weights[i] = 0;
            v[i * C + c] = 0;
            if (se) se[i * C + c] = 0;
        }
        some += weights[i] == 0;
    }
    if (some) *made = weights;
    else free(weights);
    return 0;
}

/* A mask of the whole numbers 0 and 1 is read as a picture's: 1 of 255, in sRGB. */
static void faint_tell(const char *mask, const float *weight, size_t n)
{
    float most = 0;
    for (size_t i = 0; i < n; i++) most = weight[i] > most ? weight[i] : most;
    if (most > 0 && most < 4e-4F)
        cli_say("importon: warning: --mask %s: its largest weight is %.2g; of whole "
                "numbers 255 (65535 of 16 bits) "
                "is 1, not 1",
                mask, (double)most);
}

int picture_target(const char *spec, const char *mask, struct imp_target *target)
{
    struct imp_film_info info = {.size = sizeof info},
                         mask_info = {.size = sizeof mask_info};
    struct imp_scene_info scene = {.size = sizeof scene};
    imp_film *film = NULL, *weights = NULL;
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    int *index = NULL;
    float *whole = NULL; /* weights */
    const char *at = sensor_part(spec);
    char *path = at ? strndup(spec, (size_t)(at - spec)) : strdup(spec);
    if (!path) return cli_error(EXIT_RUN, "out of memory");
    int rc = 0;
    if (*path == '=') {
        rc = mask ? cli_error(EXIT_USAGE, "--target %s: a number has no mask", spec)
                  : number_target(path, at ? picture_sensor(spec) : cli.sensor, target);
        goto out;
    }
    rc = picture_read(path, &film);
    if (rc) goto out;
    imp_scene_get_info(cli.scene, &scene);
    imp_film_get_info(film, &info);
    target->sensor = at ? picture_sensor(spec) : cli.sensor;
    if (imp_scene_get_sensor(cli.scene, target->sensor, &sensor) != IMP_OK)
        sensor.n_responses = sensor.width = 0; /* which the problem will report */
    rc = reduce(spec, path, &sensor, &film, &whole);
    if (rc) goto out;
    imp_film_get_info(film, &info);
    index = cli_alloc((size_t)sensor.n_responses + 3, sizeof *index);
    int channels = sensor.n_responses;
    if (channels) {
        rc = curve_channels(film, path, &info, &sensor, index);
    } else {
        channels = colour_channels(film, info.channels, index);
        if (!channels || is_pair_of_numbers(path, info.channels))
            rc = foreign_channels(film, path, info.channels, target->sensor);
    }
    if (rc) goto out;
    const size_t n = (size_t)info.width * (size_t)info.height;
    target->width = info.width;
    target->height = info.height;
    target->channels =
        channels < scene.channels || sensor.n_responses ? channels : scene.channels;
    target->pixels = extract(imp_film_mean(film), n, info.channels, index, channels,
                             target->channels, 0);
    if (imp_film_se(film))
        target->noise_se = extract(imp_film_se(film), n, info.channels, index, channels,
                                   target->channels, 1);
    if (mask) {
        rc = picture_read(mask, &weights);
        if (rc) goto out;
        imp_film_get_info(weights, &mask_info);
        if (mask_info.width != info.width || mask_info.height != info.height) {
            rc = cli_error(EXIT_USAGE, "%s is %d x %d, but %s is %d x %d", mask,
                           mask_info.width, mask_info.height, path, info.width,
                           info.height);
            goto out;
        }
        colour_channels(weights, mask_info.channels, index);
        target->weights =
            extract(imp_film_mean(weights), n, mask_info.channels, index, 1, 1, 0);
        faint_tell(mask, target->weights, n);
        for (size_t i = 0; whole && i < n; i++) ((float *)target->weights)[i] *= whole[i];
    } else if (whole) {
        target->weights = whole;
        whole = NULL;
    }
out:
    free(whole);
    imp_film_destroy(film);
    imp_film_destroy(weights);
    free(index);
    free(path);
    if (rc) picture_target_free(target);
    return rc;
}

void picture_target_free(struct imp_target *target)
{
    free((void *)target->pixels);
    free((void *)target->weights);
    free((void *)target->noise_se);
    target->pixels = target->weights = target->noise_se = NULL;
}
