/* SPDX-License-Identifier: Apache-2.0
 *
 * importon elements: the deterministic solver. A picture, the statistics of the solution,
 * with --sensitivity what every light and reflectance does to the measurement, and with
 * --fit lights and reflectances for wanted measurements. */
#include "cmd_elements.h"
#include "elements_items.h"
#include "shared/output.h"
#include "shared/picture_files.h"
#include "shared/problem_options.h"
#include "text/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    struct picture_options picture;
    struct elements_sources sources;
    struct arg_list phong, beams, exports;
    const char *save, *open, *report;
    int kind, order, no_importance, rays, level, max_links, sensitivity, no_picture,
        no_separate;
    double stop, eps, max_mb;
} o = {.kind = IMP_ELEMENTS_GOURAUD, .stop = -1}; /* -1: not given */

static const char *const kind_words[] = {"flat", "gouraud", "gather", "importance", NULL};

static const struct arg_option options[] = {
    {ARG_CHOICE, 0, "image", "KIND", "flat, gouraud (default), gather or importance",
     &o.kind, 0, 0, kind_words},
    {ARG_FLAG, 0, "no-image", NULL, "no picture", &o.no_picture, 0, 0, NULL},
    {ARG_NUMBER, 0, "stop", "PERCENT",
     "stop when the results change by less (default 1; 0: never)", &o.stop, 0, 100, NULL},
    {ARG_NUMBER, 0, "eps", "E", "smallest link tolerance, relative (default 5e-6)",
     &o.eps, 1e-12, 1, NULL},
    {ARG_INT, 0, "order", "L",
     "order of the directional basis, 2..12 (default: by the materials)", &o.order, 2, 12,
     NULL},
    {ARG_INT, 0, "level", "N", "maximum level of subdivision (default 9)", &o.level, 1,
     10, NULL},
    {ARG_INT, 0, "rays", "N",
     "rays per side of a pixel (default 3 to 24, more in small pictures)", &o.rays, 1, 64,
     NULL},
    {ARG_INT, 0, "max-links", "N", "budget of links", &o.max_links, 1, 2e9, NULL},
    {ARG_NUMBER, 0, "max-memory", "MB", "budget of memory (default 4295)", &o.max_mb, 1,
     1e9, NULL},
    {ARG_FLAG, 0, "no-importance", NULL, "refine by radiance alone", &o.no_importance, 0,
     0, NULL},
    {ARG_LIST, 0, "phong", "SHAPE=KD,KS,N", "make a shape glossy ('*': all but lights)",
     &o.phong, 0, 0, NULL},
    {ARG_LIST, 0, "beam", "SHAPE=N[,X,Y,Z]", "give a light a cosine-power direction",
     &o.beams, 0, 0, NULL},
    {ARG_LIST, 0, "region", "[W:]X0,Y0,X1,Y1[=T]", "measure a part of the picture",
     &o.sources.regions, 0, 0, NULL},
    {ARG_LIST, 0, "plane", "[W:]CORNER,U,V[=T]",
     "measure the illuminance of a virtual patch that faces U x V", &o.sources.planes, 0,
     0, NULL},
    {ARG_LIST, 0, "lux", "[W:]SHAPE[=T]", "measure the illuminance of a shape",
     &o.sources.shapes, 0, 0, NULL},
    {ARG_FLAG, 0, "sensitivity", NULL,
     "print derivatives of the measurement, largest first", &o.sensitivity, 0, 0, NULL},
    {ARG_TEXT, 0, "save", "FILE", "save the solution", &o.save, 0, 0, NULL},
    {ARG_TEXT, 0, "open", "FILE", "read a saved solution instead of solving", &o.open, 0,
     0, NULL},
    {ARG_LIST, 0, "export", "FILE", "write the elements as .ply or .json", &o.exports, 0,
     0, NULL},
    {ARG_TEXT, 0, "report", "DIR", "write what `importon report DIR` draws", &o.report, 0,
     0, NULL},
    {ARG_NUMBER, 0, "exposure", "STOPS", "exposure of the PNG preview",
     &o.picture.exposure, -100, 100, NULL},
    {0}};

/* What options name, in use until the process ends. */
static struct {
    struct imp_elements_phong *phong;
    struct imp_elements_beam *beams;
    struct imp_elements_source *sources;
    double *targets;
    size_t n_sources;
} named;

static int options_make(struct imp_elements_options *e)
{
    int rc = elements_phong(&o.phong, &named.phong);
    if (!rc) rc = elements_beams(&o.beams, &named.beams);
    if (!rc)
        rc = elements_sources(&o.sources, cli.sensor, &named.sources, &named.targets,
                              &named.n_sources);
    if (!rc) rc = elements_fit_check(named.targets, named.n_sources);
    if (rc) return rc;
    e->phong = named.phong;
    e->n_phong = o.phong.n;
    e->beams = named.beams;
    e->n_beams = o.beams.n;
    e->sources = named.sources;
    e->n_sources = named.n_sources;
    e->order = o.order;
    e->no_importance = o.no_importance;
    e->sensor = cli.sensor;
    e->rays = o.rays;
    e->stop = o.stop < 0 ? 0 : o.stop == 0 ? -1 : o.stop / 100;
    e->eps_last = o.eps;
    e->max_level = o.level;
    e->max_links = (size_t)o.max_links;
    e->max_bytes = (size_t)(o.max_mb * 1e6);
    e->picture = !o.no_picture;
    e->time_limit_s = cli.time_s;
    e->seed = cli.seed;
    e->progress = progress_report;
    return 0;
}

/* Importance spans decades: five of them from dark blue to white. */
static imp_film *false_colour(imp_film *film)
{
    static const double map[6][3] = {{0, 0, 0.05},      {0.05, 0.02, 0.35},
                                     {0.35, 0.02, 0.4}, {0.8, 0.1, 0.1},
                                     {0.95, 0.6, 0.02}, {1, 1, 0.9}};
    struct imp_film_info info = {.size = sizeof info};
    imp_film *out = NULL;
    imp_film_get_info(film, &info);
    if (imp_film_create(cli.context, info.width, info.height, "R,G,B", &out) != IMP_OK)
        return NULL;
    const size_t n = (size_t)info.width * (size_t)info.height;
    const float *x = imp_film_mean(film);
    float *y = imp_film_mean(out);
    double most = 0;
    for (size_t i = 0; i < n; i++) most = fmax(most, x[i]);
    for (size_t i = 0; i < n; i++) {
        const double t = x[i] > 0 ? fmax(0, 5 + log10(x[i] / most)) : 0;
        const int k = t >= 5 ? 4 : (int)t;
        for (int c = 0; c < 3; c++)
            y[3 * i + (size_t)c] =
                (float)(map[k][c] + (map[k + 1][c] - map[k][c]) * (t - k));
    }
    return out;
}

static int ends_with(const char *s, const char *tail)
{
    const size_t n = strlen(s), m = strlen(tail);
    return n >= m && !strcmp(s + n - m, tail);
}

static int write_picture(const imp_elements *e, const struct imp_run *run)
{
    const char *path = cli.out ? cli.out : "elements.exr";
    imp_film *film = NULL;
    const enum imp_status st =
        imp_elements_image(e, cli.sensor, (enum imp_elements_image)o.kind, o.rays, &film);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    if (o.kind == IMP_ELEMENTS_IMPORTANCE && ends_with(path, ".png")) {
        imp_film *coloured = false_colour(film);
        imp_film_destroy(film);
        film = coloured;
        if (!film) return cli_fail(IMP_E_NOMEM, NULL);
    }
    picture_stamp(film, run);
    const int rc = picture_write(film, path, &o.picture);
    if (!rc) cli_say("%s: %s picture", path, kind_words[o.kind]);
    imp_film_destroy(film);
    return rc;
}

/* May everything be written? */
static int writable(void)
{
    int rc = 0;
    if (!o.no_separate) rc = picture_writable(cli.out ? cli.out : "elements.exr", 1);
    if (!rc && o.save) rc = overwrite_check(o.save, OUTPUT_SOLUTION);
    for (size_t k = 0; k < o.exports.n && !rc; k++) {
        const char *path = o.exports.item[k];
        rc = overwrite_check(path, ends_with(path, ".json") ? OUTPUT_JSON : OUTPUT_PLY);
    }
    if (!rc && o.report) rc = make_folder(o.report);
    if (!rc && o.report) rc = elements_report_writable(o.report);
    return rc ? rc : elements_fit_writable();
}

static int write_report(imp_elements *e, const struct elements_answer *a,
                        const struct imp_run *run)
{
    const enum imp_elements_image kind[] = {
        o.kind == IMP_ELEMENTS_IMPORTANCE ? IMP_ELEMENTS_GOURAUD : o.kind,
        IMP_ELEMENTS_IMPORTANCE};
    int rc = 0;
    for (int k = 0; k < 2 && !rc && !o.no_picture; k++) {
        char *path = join_path(o.report, k ? "importance.exr" : "picture.exr");
        imp_film *film = NULL;
        const enum imp_status st =
            imp_elements_image(e, cli.sensor, kind[k], o.rays, &film);
        if (st == IMP_OK) {
            picture_stamp(film, run);
            rc = picture_write(film, path, &(struct picture_options){.no_preview = 1});
        } else {
            rc = cli_fail(st, cli.scene_path);
        }
        imp_film_destroy(film);
        free(path);
    }
    return rc ? rc : elements_report_write(e, a, o.report);
}

static int run_elements(int n, char **operand)
{
    struct imp_elements_options options_e = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_info info = {.size = sizeof info};
    imp_elements *e = NULL;
    enum imp_status st;
    (void)n;
    int rc = cli_load(operand[0]), complete = 1;
    if (!rc && cli.from)
        rc = cli_error(EXIT_USAGE, "elements solves, and makes no walks that could begin "
                                   "at one end: it goes without --from");
    if (!rc) rc = options_make(&options_e);
    if (!rc) {
        /* The report has its picture. */
        o.no_separate = o.no_picture || (o.report && !cli.out);
        rc = writable();
    }
    if (rc) return rc;
    const struct imp_run run = cli_run();
    if (o.open) {
        st = imp_elements_open(cli.scene, &options_e, o.open, &e);
    } else {
        st = imp_elements_create(cli.scene, &options_e, &e);
        if (st == IMP_OK && !elements_fit_wanted()) st = imp_elements_solve(e);
    }
    if (cli_failed(st) || !e) rc = cli_fail(st, cli.scene_path);
    complete = st == IMP_OK;
    if (!rc && elements_fit_wanted()) rc = elements_fit(e, named.targets, &complete);
    if (rc) {
        imp_elements_destroy(e);
        return rc;
    }
    progress_resume();
    struct json json, *j = NULL;
    const int to_stdout = cli.out && !strcmp(cli.out, "-");
    st = imp_elements_get_info(e, &info);
    if (!o.no_separate) rc = write_picture(e, &run);
    if (!rc && o.save && (st = imp_elements_save(e, o.save)) != IMP_OK)
        rc = cli_fail(st, NULL);
    for (size_t k = 0; k < o.exports.n && !rc; k++)
        if ((st = imp_elements_export(e, o.exports.item[k])) != IMP_OK)
            rc = cli_fail(st, NULL);
    struct elements_answer a = {&info,           complete,   named.sources, named.targets,
                                named.n_sources, &o.sources, NULL,          0};
    if (!rc && (o.report || (o.sensitivity && !to_stdout))) {
        st = imp_elements_share_errors(e, &a.rows, &a.n_rows);
        if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    }
    if (!rc && o.report) rc = write_report(e, &a, &run);
    if (!rc && cli.json && !to_stdout) {
        json = cli_json();
        j = &json;
    }
    if (!rc) elements_answer_info(&a, j);
    if (!rc && elements_fit_wanted())
        rc = elements_fit_answer(j, to_stdout ? NULL : &o.sources);
    if (!rc && o.sensitivity && !to_stdout) elements_answer_sensitivity(&a, j);
    if (j) cli_json_end(j);
    elements_fit_close();
    imp_elements_destroy(e);
    return rc ? rc : cli_done();
}

const struct command command_elements = {
    {"elements",
     "SCENE",
     "solve a scene by finite elements, without noise",
     {options, options_elements_fit, options_params, options_run, options_limits,
      options_scene, options_file, options_general},
     1,
     1},
    run_elements,
    0,
    1,
    REPLAYS_NEVER};
