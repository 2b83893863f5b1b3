/* SPDX-License-Identifier: Apache-2.0
 *
 * Film files as commands read and write them: output paths, previews, the command line
 * in their header, targets with masks. */
#include "cmd_picture.h"

#include "command.h"
#include "display.h"
#include "overwrite.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio_ext.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Luminance of linear sRGB, as the scene format defines it (section 2). */
static const double luminance[3] = {0.212671, 0.715160, 0.072169};
const double *const picture_luminance = luminance;

/* ---- Files --------------------------------------------------------------------- */

char *join_path(const char *folder, const char *name)
{
    const size_t n = strlen(folder) + strlen(name) + 2;
    char *path = cli_alloc(n, 1);
    snprintf(path, n, "%s/%s", folder, name);
    return path;
}

int make_folder(const char *path)
{
    if (!cli_writes()) return 0;
    char *copy = strdup(path);
    int rc = 0;
    if (!copy) return cli_error(EXIT_RUN, "out of memory");
    for (char *p = copy + 1; !rc; p++) {
        if (*p && *p != '/') continue;
        const char end = *p;
        *p = 0;
        struct stat info;
        if (mkdir(copy, 0777) != 0 && errno != EEXIST)
            rc = cli_error(EXIT_RUN, "%s: cannot make this folder: %s", copy,
                           strerror(errno));
        else if (stat(copy, &info) == 0 && !S_ISDIR(info.st_mode))
            rc = cli_error(EXIT_RUN, "%s: this is not a folder", copy);
        *p = end;
        if (!end) break;
    }
    free(copy);
    return rc;
}

void make_file_name(char *name)
{
    for (char *p = name; *p; p++)
        if (*p == '/' || (p == name && *p == '.')) *p = '_';
}

/* The PNG beside a picture, in a new string; NULL: there is none. */
static char *preview_path(const char *path)
{
    const char *dot = strrchr(path, '.'), *slash = strrchr(path, '/');
    if (!dot || (slash && dot < slash) || !strcmp(dot, ".png")) return NULL;
    const size_t stem = (size_t)(dot - path);
    char *preview = cli_alloc(stem + 5, 1);
    memcpy(preview, path, stem);
    memcpy(preview + stem, ".png", 5);
    return preview;
}

int picture_writable(const char *path, int preview)
{
    static const struct {
        const char *extension;
        enum output_kind kind;
    } kinds[] = {{".exr", OUTPUT_EXR},
                 {".png", OUTPUT_PNG},
                 {".pfm", OUTPUT_PFM},
                 {".hdr", OUTPUT_HDR},
                 {".npy", OUTPUT_NPY}};
    const size_t n = strlen(path), n_kinds = sizeof kinds / sizeof kinds[0];
    size_t k = 0;
    if (!strcmp(path, "-")) return 0;
    while (k < n_kinds && (n < 5 || strcasecmp(path + n - 4, kinds[k].extension) != 0))
        k++;
    if (k == n_kinds)
        return cli_error(EXIT_USAGE,
                         "%s: the name must end in .exr, .png, .pfm, .hdr or .npy", path);
    int rc = overwrite_check(path, kinds[k].kind);
    char *beside = preview ? preview_path(path) : NULL;
    if (!rc && beside) rc = overwrite_check(beside, OUTPUT_PNG);
    free(beside);
    return rc;
}

/* A new temporary .exr file: EXR readers and writers want files they can seek in. */
static int temporary(char *path, size_t size)
{
    const char *folder = getenv("TMPDIR");
    snprintf(path, size, "%s/importonXXXXXX.exr", folder && *folder ? folder : "/tmp");
    const int fd = mkstemps(path, 4);
    if (fd < 0) cli_error(EXIT_RUN, "%s: cannot make a temporary file", path);
    return fd;
}

static int copy_stream(FILE *from, FILE *to)
{
    char buffer[1 << 16];
    for (size_t n; (n = fread(buffer, 1, sizeof buffer, from)) > 0;)
        if (fwrite(buffer, 1, n, to) != n) return 0;
    return !ferror(from) && fflush(to) == 0;
}

int picture_read(const char *path, imp_film **out)
{
    char name[4096];
    const int from_stdin = !strcmp(path, "-");
    if (from_stdin) {
        const int fd = temporary(name, sizeof name);
        if (fd < 0) return EXIT_RUN;
        FILE *file = fdopen(fd, "wb");
        const int good = file && copy_stream(stdin, file);
        if (file) fclose(file);
        if (!good) {
            unlink(name);
            return cli_error(EXIT_RUN, "cannot copy standard input");
        }
    }
    if (!from_stdin) overwrite_protect(path);
    const enum imp_status st = imp_film_read(cli.context, from_stdin ? name : path, out);
    if (from_stdin) unlink(name);
    if (st == IMP_OK) return 0;
    cli_fail(st, NULL);
    return st == IMP_E_NOMEM ? EXIT_RUN : EXIT_USAGE; /* an input that cannot be read */
}

static int write_to_stdout(const imp_film *film, const struct imp_write_options *options)
{
    char name[4096];
    const int fd = temporary(name, sizeof name);
    if (fd < 0) return EXIT_RUN;
    close(fd);
    const enum imp_status st = imp_film_write(film, name, options);
    FILE *file = st == IMP_OK ? fopen(name, "rb") : NULL;
    const int good = file && copy_stream(file, stdout), code = errno;
    if (file) fclose(file);
    unlink(name);
    if (st != IMP_OK) return cli_fail(st, NULL);
    if (good) return 0;
    __fpurge(stdout); /* it has been said: nothing is left to fail at the end */
    clearerr(stdout);
    return cli_error(EXIT_RUN, "standard output: %s", strerror(code));
}

int picture_write(const imp_film *film, const char *path, const struct picture_options *o)
{
    struct imp_write_options options = IMP_WRITE_OPTIONS_INIT;
    if (cli.verifies) return 0;
    options.half = o->half;
    options.standard_error = o->standard_error;
    options.exposure = o->exposure;
    options.diverging = o->diverging;
    options.range = o->range;
    display_film(film, path);
    if (!strcmp(path, "-")) return write_to_stdout(film, &options);

    enum imp_status st = imp_film_write(film, path, &options);
    char *preview = o->no_preview ? NULL : preview_path(path);
    if (st == IMP_OK && preview) st = imp_film_write(film, preview, &options);
    free(preview);
    return st == IMP_OK ? 0 : cli_fail(st, NULL);
}

/* By bisection on the count, as imp_film_write does it: the same bits. */
double picture_range(imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    const size_t n = (size_t)info.width * (size_t)info.height;
    const float *mean = imp_film_mean(film);
    double *size = cli_alloc(n, sizeof *size), lo = 0, hi = 0;
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (int c = 0; c < info.channels; c++) sum += (double)*mean++;
        size[i] = fabs(sum / info.channels);
        if (isfinite(size[i])) hi = fmax(hi, size[i]);
    }
    for (int step = 0; step < 40 && hi > 0; step++) {
        const double middle = (lo + hi) / 2;
        size_t above = 0;
        for (size_t i = 0; i < n; i++) above += size[i] > middle;
        if (above > n / 200) lo = middle;
        else hi = middle;
    }
    free(size);
    return hi > 0 ? hi : 1;
}

/* ---- Provenance ---------------------------------------------------------------- */

/* Append `word` to a shell command line, quoted where the shell would split or expand it.
 */
static void quote_word(FILE *f, const char *word)
{
    const char *p = word;
    while (isalnum((unsigned char)*p) || (*p && strchr("-_./=,:@%+", *p))) p++;
    if (*word && !*p) {
        fputs(word, f);
        return;
    }
    fputc('\'', f);
    for (p = word; *p; p++) {
        if (*p == '\'') fputs("'\\''", f);
        else fputc(*p, f);
    }
    fputc('\'', f);
}

static void set_text(imp_film *film, const char *key, const char *value)
{
    if (imp_film_set_text(film, key, value) != IMP_OK)
        cli_say("importon: warning: %s could not be recorded", key);
}

void picture_stamp(imp_film *film, const struct imp_run *run)
{
    struct imp_film_info info = {.size = sizeof info};
    char text[64], *line = NULL;
    size_t length = 0;
    FILE *f = open_memstream(&line, &length);
    const time_t now = time(NULL);
    struct tm utc;

    if (f) {
        fputs("importon", f);
        for (int i = 0; i < cli.argc; i++) {
            fputc(' ', f);
            quote_word(f, cli.argv[i]);
        }
        if (fclose(f) == 0) set_text(film, "importon.command", line);
        free(line);
    }
    set_text(film, "importon.version", imp_version());
    snprintf(text, sizeof text, "%" PRIu64, run->seed);
    set_text(film, "importon.seed", text);
    imp_film_get_info(film, &info);
    snprintf(text, sizeof text, "%" PRId64, info.spp);
    set_text(film, "importon.spp", text);
    if (gmtime_r(&now, &utc) && strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc))
        set_text(film, "importon.time", text);
}

/* ---- Targets ------------------------------------------------------------------- */

static int channel_index(imp_film *film, int n, const char *name)
{
    for (int c = 0; c < n; c++)
        if (!strcmp(imp_film_channel(film, c), name)) return c;
    return -1;
}

/* The colour channels of a picture: three, or one. */
static int colour_channels(imp_film *film, int n, int index[3])
{
    static const char *const rgb[3] = {"R", "G", "B"};
    for (int c = 0; c < 3; c++) index[c] = channel_index(film, n, rgb[c]);
    if (index[0] >= 0 && index[1] >= 0 && index[2] >= 0) return 3;
    index[0] = channel_index(film, n, "Y");
    if (index[0] < 0) index[0] = 0;
    return 1;
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
        const double x = luminance[c] * from[index[c]];
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

/* The "@3" of "FILE@3"; a name with '@' and no digits after it is a name. */
static const char *sensor_part(const char *spec)
{
    const char *at = strrchr(spec, '@');
    return at && at[1] && strspn(at + 1, "0123456789") == strlen(at + 1) && strlen(at) < 8
               ? at
               : NULL;
}
int picture_sensor(const char *spec)
{
    const char *at = sensor_part(spec);
    return at ? atoi(at + 1) : -1;
}

/* "=V", "=V,V,V" or either with "+-SE": the reading of a sensor of one pixel. */
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
    if (!fine || (n != 1 && n != scene.channels))
        return cli_error(
            EXIT_USAGE,
            "--target %s: expected =NUMBER, or =R,G,B, and +-ERROR behind it "
            "if that is known",
            text);
    if (info.width != 1 || info.height != 1)
        return cli_error(
            EXIT_USAGE,
            "--target %s: sensor %d ('%s') makes %d x %d pixels; a number is "
            "the target of one",
            text, sensor, info.name, info.width, info.height);
    float *pixels = cli_alloc((size_t)n, sizeof *pixels);
    float *errors = se > 0 ? cli_alloc((size_t)n, sizeof *errors) : NULL;
    for (int k = 0; k < n; k++) {
        pixels[k] = (float)value[k];
        if (errors) errors[k] = (float)se;
    }
    target->sensor = sensor;
    target->width = target->height = 1;
    target->channels = n;
    target->pixels = pixels;
    target->noise_se = errors;
    return 0;
}

int picture_target(const char *spec, const char *mask, struct imp_target *target)
{
    struct imp_film_info info = {.size = sizeof info},
                         mask_info = {.size = sizeof mask_info};
    struct imp_scene_info scene = {.size = sizeof scene};
    imp_film *film = NULL, *weights = NULL;
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    int *index = NULL;
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
        sensor.n_responses = 0; /* which the problem will say */
    index = cli_alloc((size_t)sensor.n_responses + 3, sizeof *index);
    int channels = sensor.n_responses;
    if (channels) rc = curve_channels(film, path, &info, &sensor, index);
    else channels = colour_channels(film, info.channels, index);
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
    }
out:
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
