/* SPDX-License-Identifier: Apache-2.0
 *
 * A picture in the live view, made again when a value is moved: with few samples first,
 * by recorded walks where they are available, then with more, at last as importon render
 * makes it. What is stopped goes on with new random numbers, and both count. */
#include "view.h"

#include "shared/picture_files.h"
#include "shared/places.h"
#include "shared/problem_options.h"
#include "shared/settings.h"
#include "text/progress.h"

#include <fnmatch.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { SLIDERS = 64, GROWS = 4 };

static struct {
    size_t *param, *element; /* [n] of the numbers with sliders */
    size_t n;
    const char *path; /* of "save" */
    imp_film *film;   /* the best so far; NULL: none */
    bool kept;        /* it was made of recorded walks */
    bool said_so;     /* and the page shows it */
    int sessions;     /* seeds in use: each run that is merged has its own */
} r;

/* ---- Numbers -------------------------------------------------------------------------- */

/* Those that -p names; without it, those that have a gradient. */
static bool is_wanted(const struct imp_param_info *info)
{
    const struct arg_list *p = &problem_options.params;
    if (info->count > 12) return false; /* a texture has no sliders */
    if (!p->n) return info->flags & IMP_PARAM_DIFFERENTIABLE;
    for (size_t i = 0; i < p->n; i++)
        if (!fnmatch(p->item[i], info->name, 0)) return true;
    return false;
}

static double value_at(size_t param, size_t element)
{
    double values[12] = {0};
    return imp_scene_get_values(cli.scene, param, values) == IMP_OK ? values[element] : 0;
}

static int numbers_open(void)
{
    const struct arg_list *wanted = &problem_options.params;
    for (size_t i = 0; i < wanted->n; i++) {
        const bool one = !strpbrk(wanted->item[i], "*?[");
        const enum imp_status st = one ? settings_pose(wanted->item[i]) : IMP_OK;
        if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    }
    const size_t n_params = imp_scene_n_params(cli.scene);
    struct view_number *number = cli_alloc(SLIDERS, sizeof *number);
    size_t left_out = 0;
    r.param = cli_alloc(SLIDERS, sizeof *r.param);
    r.element = cli_alloc(SLIDERS, sizeof *r.element);
    for (size_t k = 0; k < n_params; k++) {
        struct imp_param_info info = {.size = sizeof info};
        char name[512];
        if (imp_scene_get_param(cli.scene, k, &info) != IMP_OK || !is_wanted(&info))
            continue;
        if (r.n + info.count > SLIDERS) {
            left_out += info.count;
            continue;
        }
        for (size_t e = 0; e < info.count; e++) {
            cli_number_name(&info, e, name, sizeof name);
            r.param[r.n] = k;
            r.element[r.n] = e;
            number[r.n++] = (struct view_number){
                cli_strdup(name), view_unit(&info, e), info.lo, info.hi, value_at(k, e),
                value_at(k, e),   view_reach(&info, e)};
        }
    }
    if (!r.n && problem_options.params.n) {
        free(number);
        return cli_error(EXIT_USAGE, "no number with a slider matches -p %s",
                         problem_options.params.item[0]);
    }
    if (left_out)
        cli_say("%zu number%s no slider: choose some with -p", left_out,
                left_out == 1 ? " has" : "s have");
    view_numbers(number, r.n);
    return 0;
}

static void numbers_show(void)
{
    double value[SLIDERS];
    for (size_t i = 0; i < r.n; i++) value[i] = value_at(r.param[i], r.element[i]);
    view_numbers_are(value);
}

/* What moves, over the picture. */
static void places_show(void)
{
    char *text;
    size_t size;
    struct json j = view_stream(&text, &size);
    json_object(&j, NULL);
    places_params_json(&j, r.param, r.n);
    view_show_places(&j, &text);
}

/* The scene as the sliders are. A value that the scene does not take (one of several that
 * hang together) stays what it was. */
static void numbers_move(void)
{
    double wanted[SLIDERS], values[12];
    view_values(wanted);
    for (size_t i = 0; i < r.n; i++) {
        struct imp_param_info info = {.size = sizeof info};
        if (imp_scene_get_param(cli.scene, r.param[i], &info) != IMP_OK ||
            imp_scene_get_values(cli.scene, r.param[i], values) != IMP_OK)
            continue;
        if (values[r.element[i]] == wanted[i]) continue;
        values[r.element[i]] = wanted[i];
        if (imp_scene_set_values(cli.scene, r.param[i], info.count, values) != IMP_OK)
            cli_say("importon: %s", imp_last_error(cli.context));
    }
}

/* ---- Pictures ------------------------------------------------------------------------- */

static int64_t spp_of(const imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    return film && imp_film_get_info(film, &info) == IMP_OK ? info.spp : 0;
}

static void show(const imp_film *film, void *payload)
{
    const struct imp_run run = cli_run();
    const char *unit = NULL;
    if (spp_of(film) < spp_of(r.film)) return; /* what is there has less noise */
    struct imp_sensor_info sensor = {.size = sizeof sensor};
    struct imp_report_item item = IMP_REPORT_ITEM_INIT;
    (void)payload;
    if (imp_scene_get_sensor(cli.scene, run.sensor, &sensor) == IMP_OK)
        unit = sensor.unit;
    item.kind = "picture";
    item.name = "picture";
    item.role = "picture";
    item.unit = unit;
    item.film = film;
    view_show(VIEW_PICTURE, &item, 1);
    if (r.said_so && film != r.film) view_state(VIEW_RUNNING, "");
    r.said_so &= film == r.film;
}

static void forget(void)
{
    imp_film_destroy(r.film);
    r.film = NULL;
    r.kept = r.said_so = false;
    r.sessions = 1;
}

/* spp samples, as far as they come: by themselves, in place of fewer that are there; or
 * with new random numbers, merged with those. */
static int take(int64_t spp, bool merges)
{
    struct imp_run run = cli_run();
    imp_film *film = NULL;
    run.spp = (int)spp;
    run.seed += merges ? (uint64_t)r.sessions : 0;
    run.progress = view_progress;
    run.preview = merges ? NULL : show;
    const enum imp_status st = imp_render(cli.scene, &run, &film);
    if (cli_failed(st)) return cli_fail(st, cli.scene_path);
    if (merges) r.sessions++;
    const bool better = merges ? spp_of(film) > 0
                               : spp_of(film) > spp_of(r.film); /* 0: in the first pass */
    if (!better) {
        imp_film_destroy(film);
        return 0;
    }
    if (merges && imp_film_merge(film, r.film) != IMP_OK)
        cli_say("importon: %s", imp_last_error(cli.context));
    imp_film_destroy(r.film);
    r.film = film;
    if (r.said_so) view_state(VIEW_RUNNING, "");
    r.kept = r.said_so = false;
    show(film, NULL);
    return 0;
}

/* The picture by walks recorded at other values: it is shown until a fresh one has more
 * samples. */
static void take_kept(int64_t all)
{
    char text[160];
    double ess;
    imp_film *film = view_kept_picture((all - 1) / GROWS, &ess);
    if (!film) return;
    r.film = film;
    r.kept = true;
    show(film, NULL);
    snprintf(text, sizeof text,
             "this picture: %lld recorded walk%s per pixel, of which %.2g count; fresh "
             "ones are "
             "on their way",
             (long long)spp_of(film), plural(spp_of(film)), ess);
    view_state(VIEW_RUNNING, text);
    r.said_so = true;
}

/* Rounds of 1, 4, 16, ... samples, each by itself, then all that are wanted: the last one
 * is what importon render makes. Those that recorded walks replace are left out. */
static int rounds(int64_t all)
{
    int rc = 0;
    forget();
    take_kept(all);
    for (int64_t spp = r.kept ? GROWS * spp_of(r.film) : 1;
         spp < all && !view_asked() && !rc; spp *= GROWS) {
        rc = take(spp, false);
        if (!rc && spp > GROWS && !view_asked()) view_kept_draw((all - 1) / GROWS);
    }
    if (!rc && !view_asked()) rc = take(all, false);
    if (!rc && !view_asked()) view_kept_draw((all - 1) / GROWS);
    return rc;
}

static void save(char *said, size_t size)
{
    const struct imp_run run = cli_run();
    const struct picture_options po = {.standard_error = 1};
    if (!r.film) {
        snprintf(said, size, "there is no picture yet");
        return;
    }
    if (r.kept) {
        snprintf(said, size,
                 "not saved: the picture is one of recorded walks; resume first");
        return;
    }
    picture_stamp(r.film, &run);
    if (picture_write(r.film, r.path, &po)) snprintf(said, size, "it was not saved");
    else snprintf(said, size, "saved: %s", r.path);
}

static int work(void)
{
    const struct imp_run asked = cli_run();
    const int64_t all = cli_spp(&asked);
    bool running = true, fresh = true;
    char said[512] = "", text[640];
    int rc = 0;
    for (;;) {
        if (running && (fresh || spp_of(r.film) < all)) {
            view_state(VIEW_RUNNING, said);
            rc = fresh ? rounds(all) : take(all - spp_of(r.film), true);
            fresh = !r.film || r.kept;
        }
        if (rc) return rc;
        if (!view_asked()) { /* all is done, or nothing is to be done */
            snprintf(text, sizeof text, "%lld of %lld sample%s per pixel%s%s",
                     (long long)spp_of(r.film), (long long)all, plural(all),
                     *said ? "; " : "", said);
            view_state(spp_of(r.film) < all ? VIEW_STOPPED : VIEW_DONE, text);
        }
        const struct view_wish w = view_wait();
        if (w.end) return 0;
        if (w.walks) view_walks(w.pixel);
        if (w.stop) running = false;
        if (w.go) running = true;
        *said = 0;
        if (w.save) save(said, sizeof said);
        if (!w.moved) continue;
        numbers_move();
        numbers_show();
        places_show();
        forget();
        running = fresh = true;
    }
}

/* The scene's file name as a picture, in the working folder. */
static char *default_path(void)
{
    const char *base = strrchr(cli.scene_path, '/');
    base = base ? base + 1 : cli.scene_path;
    const char *dot = strrchr(base, '.');
    const int stem = dot && dot > base ? (int)(dot - base) : (int)strlen(base);
    char *path;
    if (asprintf(&path, "%.*s.exr", stem, base[0] == '<' ? "render" : base) < 0)
        exit(cli_error(EXIT_RUN, "out of memory"));
    return path;
}

int view_scene(void)
{
    char *automatic = cli.out ? NULL : default_path();
    r.path = cli.out ? cli.out : automatic;
    const struct view_kind kind = {"render", r.path, 0, 1};
    int rc = picture_writable(r.path, 1);
    if (!rc) rc = numbers_open();
    if (!rc) rc = view_open(&kind, view_options.port);
    if (!rc) {
        numbers_show();
        places_show();
        rc = work();
    }
    view_close();
    forget();
    view_kept_close();
    free(r.param);
    free(r.element);
    free(automatic);
    return rc ? rc : cli_done();
}
