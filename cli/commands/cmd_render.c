/* SPDX-License-Identifier: Apache-2.0
 *
 * importon render: a picture with its standard errors; or single walks as text. */
#include "shared/check_rows.h"
#include "shared/command.h"
#include "shared/display.h"
#include "shared/output.h"
#include "shared/picture_files.h"
#include "shared/proof.h"
#include "shared/wanted.h"
#include "text/progress.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NO_PIXEL INT_MIN /* of a border, x and y may be negative */

static struct {
    struct picture_options picture;
    int pixel[2], sample, count, denoise, sampling;
    double until;
    const char *paths;
} o = {.pixel = {NO_PIXEL, NO_PIXEL}};

static const struct arg_option options[] = {
    {ARG_FLAG | ARG_REPLAYS, 0, "se", NULL,
     "add the standard error of every channel to the EXR file", &o.picture.standard_error,
     0, 0, NULL},
    {ARG_FLAG | ARG_REPLAYS, 0, "denoise", NULL,
     "without noise, by Open Image Denoise; such a picture has no standard errors",
     &o.denoise, 0, 0, NULL},
    {ARG_FLAG | ARG_REPLAYS, 0, "half", NULL, "16-bit floats in the EXR file",
     &o.picture.half, 0, 0, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "exposure", "STOPS", "exposure of the PNG preview",
     &o.picture.exposure, -100, 100, NULL},
    {ARG_FLAG | ARG_REPLAYS, 0, "no-preview", NULL, "write no PNG beside the picture",
     &o.picture.no_preview, 0, 0, NULL},
    {ARG_PAIR, 0, "pixel", "X,Y", "print one walk of this pixel, vertex by vertex",
     o.pixel, 0, 0, NULL},
    {ARG_INT, 0, "sample", "K", "index of the walk in the pixel (default 0)", &o.sample,
     0, 1e9, NULL},
    {ARG_TEXT, 0, "paths", "FILE",
     "write walks from all over the picture, one JSON object per line", &o.paths, 0, 0,
     NULL},
    {ARG_INT, 0, "count", "N", "number of walks for --paths (default 100)", &o.count, 1,
     1e7, NULL},
    {ARG_NUMBER | ARG_REPLAYS, 0, "until", "REL",
     "take samples, at most --spp, until the picture is this close, in 95 of 100 cases",
     &o.until, 1e-6, 10, NULL},
    {ARG_FLAG | ARG_ASIDE, 0, "verify-sampling", NULL,
     "compare the picture with one of uniform directions, and print the share of its "
     "light by density",
     &o.sampling, 0, 0, NULL},
    {0}};

static int describe(const struct imp_run *run, int x, int y, int64_t sample, int json,
                    FILE *to)
{
    char *text = NULL;
    const enum imp_status st =
        imp_walk_describe(cli.scene, run, x, y, sample, json, &text);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    const size_t n = strlen(text);
    fwrite(text, 1, n, to);
    if (n == 0 || text[n - 1] != '\n') fputc('\n', to);
    imp_free(cli.context, text);
    return 0;
}

/* Walks spread evenly over the picture by the golden ratio and its square in two
 * dimensions (the R2 sequence, M. Roberts 2018). */
static int write_paths(const struct imp_run *run)
{
    struct imp_sensor_info info = {.size = sizeof info};
    const double g1 = 0.7548776662466927, g2 = 0.5698402909980532;
    const enum imp_status st = imp_scene_get_sensor(cli.scene, run->sensor, &info);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    struct output to;
    int rc = output_open(&to, o.paths, OUTPUT_WALKS);
    if (rc) return rc;
    const int count = o.count ? o.count : 100;
    for (int i = 0; i < count && !rc && !progress_interrupted(); i++) {
        const double u = 0.5 + g1 * i, v = 0.5 + g2 * i;
        rc = describe(run, (int)((u - floor(u)) * info.width),
                      (int)((v - floor(v)) * info.height), o.sample + i, 1, to.file);
    }
    rc = output_close(&to, rc);
    return rc ? rc : cli_done();
}

/* The scene's file name, or that of the part that is merged, with the extension of its film's
 * format, in the working folder. */
static char *default_output(const struct imp_run *run)
{
    struct imp_sensor_info info = {.size = sizeof info};
    const char *extension = "exr";
    if (imp_scene_get_sensor(cli.scene, run->sensor, &info) == IMP_OK &&
        info.file_format) {
        if (!strcmp(info.file_format, "pfm")) extension = "pfm";
        if (!strcmp(info.file_format, "rgbe")) extension = "hdr";
    }
    /* A part that somebody sent does not choose where the picture goes: its own name does. */
    const char *from = cli.carried ? cli.carried : cli.scene_path;
    const char *base = strrchr(from, '/');
    base = base ? base + 1 : from;
    if (base[0] == '<') base = "render"; /* stdin */
    const char *dot = strrchr(base, '.');
    const int stem = dot && dot > base ? (int)(dot - base) : (int)strlen(base);
    char *path = cli_alloc((size_t)stem + 5, 1);
    snprintf(path, (size_t)stem + 5, "%.*s.%s", stem, base, extension);
    return path;
}

/* Prints the number of dropped walks by cause, and the first of each. More than the
 * budget fails the run. */
static void report_drops(const struct imp_film_info *info)
{
    if (!info->dropped) return;
    cli_say("%llu of %.3g walks were left out, and their light is missing (at most 1 in "
            "10000 may be, at holes in the boundary of a medium 1 in 1000):",
            (unsigned long long)info->dropped,
            (double)info->width * info->height * (double)info->spp);
    for (int c = 0; c < IMP_DROP_CAUSES; c++)
        if (info->dropped_by_cause[c])
            cli_say("  %llu: %s", (unsigned long long)info->dropped_by_cause[c],
                    imp_drop_text((enum imp_drop)c));
    if (info->n_drop_keys)
        cli_say("  the first: render --pixel %d,%d --sample %lld --seed %llu",
                info->drop_keys[0].x, info->drop_keys[0].y,
                (long long)info->drop_keys[0].sample,
                (unsigned long long)info->drop_keys[0].seed);
}

/* The picture as drawn against uniform directions: rows of `importon check`. */
struct sampling {
    imp_problem *problem; /* holds the rows */
    const struct imp_check_row *rows;
    size_t n;
};
static int sampling_check(const struct imp_run *run, struct sampling *s)
{
    struct imp_check_options check = IMP_CHECK_OPTIONS_INIT;
    struct imp_run again = *run;
    check.sampling = 1;
    again.preview = NULL;
    enum imp_status st = imp_problem_create(cli.scene, &s->problem);
    if (st == IMP_OK) st = imp_check(s->problem, &check, &again, &s->rows, &s->n);
    return cli_failed(st) ? cli_fail(st, cli.scene_path) : 0;
}

static void report(const char *path, imp_film *film, const struct imp_run *run,
                   const struct sampling *sampling, const struct imp_until_end *end)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    cli_say("%s: %d x %d, %lld sample%s per pixel%s", path, info.width, info.height,
            (long long)info.spp, plural(info.spp),
            !progress_interrupted() ? ""
            : info.spp
                ? ", interrupted"
                : ", interrupted in the first pass: a part of the picture is there");
    if (o.until > 0) until_say("picture", end);
    report_drops(&info);
    if (!cli.json && sampling->rows) check_rows_print(sampling->rows, sampling->n);
    if (!cli.json || !strcmp(path, "-")) return;
    struct json j = cli_json();
    json_text(&j, "file", path);
    json_integer(&j, "width", info.width);
    json_integer(&j, "height", info.height);
    json_seed(&j, "seed", run->seed);
    json_integer(&j, "spp", info.spp);
    json_seed(&j, "dropped", info.dropped);
    json_bool(&j, "complete", !progress_interrupted());
    if (o.until > 0) until_json(&j, o.until, end);
    json_array(&j, "channels");
    const size_t n = (size_t)info.width * (size_t)info.height;
    const float *mean = imp_film_mean(film), *se = imp_film_se(film);
    for (int c = 0; c < info.channels; c++) {
        double sum = 0, squares = 0;
        for (size_t i = 0; i < n; i++) {
            const size_t k = i * (size_t)info.channels + (size_t)c;
            sum += mean[k];
            if (se) squares += (double)se[k] * se[k];
        }
        json_object(&j, NULL);
        json_text(&j, "name", imp_film_channel(film, c));
        json_number(&j, "mean", sum / (double)n);
        json_number(&j, "se", se ? sqrt(squares) / (double)n : NAN);
        json_end_object(&j);
    }
    json_end_array(&j);
    if (sampling->rows) {
        json_object(&j, "sampling");
        check_rows_json(&j, sampling->rows, sampling->n);
        json_end_object(&j);
    }
    cli_json_end(&j);
}

/* The picture's place is taken by one without noise, and without errors. Where that fails,
 * the picture as it is stays, to be written before the command fails. */
static int denoise(const struct imp_run *run, imp_film **film)
{
    imp_film *made = NULL;
    struct imp_run own = *run;
    own.preview = NULL;
    enum imp_status st = imp_denoise(cli.scene, &own, *film, &made);
    if (st != IMP_OK) {
        const int rc = cli_fail(st, cli.scene_path);
        cli_say("the picture is written with its noise");
        return rc;
    }
    imp_film_destroy(*film);
    *film = made;
    st = imp_film_set_text(made, "denoised", "Open Image Denoise");
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

/* What does not go with --verify-sampling. 0, or an exit code. */
static int sampling_refused(void)
{
    if (o.pixel[0] != NO_PIXEL || o.paths)
        return cli_error(EXIT_USAGE, "--verify-sampling is about the picture: not with "
                                     "--pixel and --paths");
    if (cli.points == IMP_POINTS_WHOLE)
        return cli_error(EXIT_USAGE, "--verify-sampling wants standard errors: not with "
                                     "--points whole");
    if (cli.part || cli.manifest_path || cli.verifies)
        return cli_error(EXIT_USAGE,
                         "--verify-sampling of render: not with parts and "
                         "manifests; 'importon check --verify-sampling' takes "
                         "them");
    if (cli.out && !strcmp(cli.out, "-"))
        return cli_error(EXIT_USAGE,
                         "--verify-sampling prints a table: write the picture "
                         "to a file");
    return 0;
}

static enum imp_status render_until(struct imp_run *run, imp_film **film,
                                    struct imp_until_end *end)
{
    struct imp_until_options until = until_options(o.until, run);
    return imp_render_until(cli.scene, run, &until, film, end);
}

static int run_render(int n, char **operand)
{
    struct imp_until_end end = IMP_UNTIL_END_INIT;
    imp_film *film = NULL;
    struct sampling sampling = {NULL, NULL, 0};
    int noisy = 0; /* the exit code, where denoising failed */
    (void)n;
    int rc = o.sampling ? sampling_refused() : 0;
    if (!rc && o.until > 0) rc = until_refused();
    if (!rc && o.until > 0 && (o.pixel[0] != NO_PIXEL || o.paths))
        rc =
            cli_error(EXIT_USAGE, "--until is of pictures: not with --pixel and --paths");
    cli.brief = 1;
    if (!rc) rc = cli_load(operand[0]);
    if (rc) return rc;
    struct imp_run run = cli_run();
    const int one = o.pixel[0] != NO_PIXEL;
    if (o.sample && !one && !o.paths)
        return cli_error(EXIT_USAGE, "--sample needs --pixel or --paths");
    if (o.count && !o.paths) return cli_error(EXIT_USAGE, "--count needs --paths");
    if (o.denoise && o.picture.standard_error)
        return cli_error(EXIT_USAGE,
                         "--denoise and --se: the error of a denoised picture "
                         "is not known");
    if (o.denoise && (one || o.paths))
        return cli_error(EXIT_USAGE, "--denoise is of pictures, not of walks");
    if (o.denoise && !cli.part) { /* before the time of a picture is spent */
        const enum imp_status st = imp_denoiser_check(cli.context);
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    }
    if (one) {
        rc = cli_redirect();
        return rc ? rc
                  : describe(&run, o.pixel[0], o.pixel[1], o.sample, cli.json, stdout);
    }
    if (o.paths) return write_paths(&run);

    char *automatic = cli.out ? NULL : default_output(&run);
    const char *path = cli.out ? cli.out : automatic;
    rc = picture_writable(path, !o.picture.no_preview);
    if (!rc) {
        if (cli.display && cli_writes()) {
            run.preview = display_preview;
            run.preview_payload = (void *)(uintptr_t)path;
        }
        rc = manifest_begin(path);
        enum imp_status st = IMP_OK;
        if (!rc && o.until > 0) st = render_until(&run, &film, &end);
        else if (!rc) st = imp_render(cli.scene, &run, &film);
        if (cli_failed(st)) rc = cli_fail(st, cli.scene_path);
        if (!rc) rc = manifest_pause();
        if (!rc && film) rc = manifest_film("picture", film);
    }
    if (cli.verifies) {
        imp_film_destroy(film);
        free(automatic);
        return rc ? rc : cli_done();
    }
    if (!film && !rc) cli_say("interrupted in the first pass: no picture is written");
    if (film && !rc) {
        if (o.denoise) noisy = denoise(&run, &film);
        picture_stamp(film, &run);
        rc = picture_write(film, path, &o.picture);
        if (!rc) rc = noisy;
        if (!rc && o.sampling && !progress_interrupted())
            rc = sampling_check(&run, &sampling);
        if (!rc) report(path, film, &run, &sampling, &end);
    }
    imp_film_destroy(film);
    free(automatic);
    if (!rc) rc = cli_done();
    if (!rc && check_rows_count(sampling.rows, sampling.n, 0)) rc = EXIT_NO;
    imp_problem_destroy(sampling.problem);
    return rc;
}

const struct command command_render = {
    {"render",
     "SCENE",
     "render a scene, or print its random walks",
     {options, options_run, options_limits, options_guide, options_scene, options_file,
      options_general},
     1,
     1},
    run_render,
    0,
    1,
    REPLAYS_PARTS | REPLAYS_MANIFEST};
