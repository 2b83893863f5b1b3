/* SPDX-License-Identifier: Apache-2.0
 *
 * Bent rays in the live view: rays, slices of the index and spots for the values of the
 * field, and a fit as it runs. */
#include "view.h"

#include "bend/bend_items.h"
#include "bend/cmd_bend.h"
#include "fit/fit_options.h"
#include "shared/picture_files.h"
#include "text/progress.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS = 64 };
#define SHOW_SHARE 0.25 /* of the time, at most, is for pictures of the view */

static struct {
    imp_bend *bend;
    struct bend_truth truth;
    size_t n;  /* numbers with sliders: all of a field whose numbers have names */
    bool fits; /* there are targets */
    double *history;
    size_t n_history, room;
    double begun_s, shown_s;
    struct imp_bend_fit_result result;
} b;

/* ---- What is shown -------------------------------------------------------------------- */

static void numbers_show(void)
{
    double theta[NUMBERS];
    if (b.n) imp_field_get_theta(imp_bend_field(b.bend), theta);
    view_numbers_are(theta);
}

static void numbers_open(void)
{
    const imp_field *f = imp_bend_field(b.bend);
    const size_t n = imp_field_n_theta(f);
    struct view_number *number = cli_alloc(NUMBERS, sizeof *number);
    double theta[NUMBERS];
    if (n <= NUMBERS && imp_field_param_name(f, 0)) b.n = n;
    if (b.n) imp_field_get_theta(f, theta);
    for (size_t i = 0; i < b.n; i++)
        number[i] = (struct view_number){cli_strdup(imp_field_param_name(f, i)),
                                         "1",
                                         -INFINITY,
                                         INFINITY,
                                         theta[i],
                                         theta[i],
                                         0};
    view_numbers(number, b.n);
}

static void numbers_move(void)
{
    double theta[NUMBERS];
    view_values(theta);
    if (b.n && imp_field_set_theta(imp_bend_field(b.bend), theta) != IMP_OK)
        cli_say("importon: %s", imp_last_error(cli.context));
    numbers_show();
}

static struct json item_open(char **text, size_t *size)
{
    struct json j = view_stream(text, size);
    json_object(&j, NULL);
    return j;
}

static void rays_show(void)
{
    char *text;
    size_t size;
    const double start = cli_now();
    struct json j = item_open(&text, &size);
    const int rc = bend_rays_json(&j, b.bend, bend_truth_field(&b.truth));
    json_end_object(&j);
    fclose(j.file);
    if (rc) free(text);
    else view_show_json(VIEW_RAYS, "rays", NULL, text);
    b.shown_s += cli_now() - start;
}

static void answer_show(const char *reason)
{
    char *text;
    size_t size;
    double value = NAN;
    struct json j = item_open(&text, &size);
    if (b.n_history) value = b.history[b.n_history - 1];
    json_number(&j, "value", value);
    if (b.n_history) json_number(&j, "start", b.history[0]);
    json_integer(&j, "evaluations", (int64_t)b.n_history);
    json_text(&j, "reason", reason);
    json_object(&j, "field");
    bend_put_numbers(b.bend, NULL, &j);
    json_end_object(&j);
    json_object(&j, "history");
    json_numbers(&j, "loss", b.n_history, b.history);
    json_end_object(&j);
    json_end_object(&j);
    fclose(j.file);
    view_show_json(VIEW_ANSWER, "bend", NULL, text);
}

/* ---- The fit ---------------------------------------------------------------------------- */

static int step(const struct imp_bend_fit_step *s, void *payload)
{
    (void)payload;
    if (b.n_history == b.room) {
        b.room = 2 * b.room + 64;
        b.history = realloc(b.history, b.room * sizeof *b.history);
        if (!b.history) exit(cli_error(EXIT_RUN, "out of memory"));
    }
    b.history[b.n_history++] = s->value;
    if (b.shown_s <= SHOW_SHARE * (cli_now() - b.begun_s)) {
        const double start = cli_now();
        numbers_show();
        rays_show();
        answer_show("it goes on");
        b.shown_s += cli_now() - start;
    }
    return view_asked();
}

/* The search of bend fit, by the options that a fit of a scene has, too. */
static int options_read(struct imp_bend_fit_options *o)
{
    const char *word = NULL;
    for (size_t i = 0; i < cli.typed.n; i++)
        if (!strncmp(cli.typed.item[i], "--optimizer", 11)) word = fit_optimizer_word();
    if (word && strcmp(word, "adam") && strcmp(word, "lbfgs") && strcmp(word, "mma"))
        return cli_error(EXIT_USAGE, "bent rays are fitted by lbfgs, adam or mma");
    o->optimizer = !word || !strcmp(word, "lbfgs") ? IMP_LBFGS
                   : !strcmp(word, "adam")         ? IMP_ADAM
                                                   : IMP_MMA;
    o->iterations[0] = fit_choice.iterations;
    o->learning_rate = fit_choice.learning_rate;
    o->tolerance = fit_choice.tolerance;
    o->levels = fit_choice.levels;
    o->progress = view_progress;
    o->step = step;
    return 0;
}

static int run_fit(bool *whole)
{
    struct imp_bend_fit_options o = IMP_BEND_FIT_OPTIONS_INIT;
    int rc = options_read(&o);
    if (rc) return rc;
    b.begun_s = cli_now();
    b.shown_s = 0;
    b.result = (struct imp_bend_fit_result){.size = sizeof b.result};
    const enum imp_status st = imp_bend_fit(b.bend, &o, &b.result);
    if (cli_failed(st)) return cli_fail(st, cli.scene_path);
    *whole = st == IMP_OK;
    numbers_show();
    rays_show();
    answer_show(b.result.reason);
    return 0;
}

static void save(char *said, size_t size)
{
    int rc = bend_field_write(b.bend);
    if (!rc) rc = bend_view(b.bend, cli.out, "", NULL);
    snprintf(said, size, rc ? "it was not saved" : "saved: %s", cli.out);
}

static int work(void)
{
    bool running = b.fits, whole = !b.fits;
    char said[512] = "", text[640];
    int rc = 0;
    rays_show();
    for (;;) {
        const bool was_running = running;
        if (running && !whole) {
            view_state(VIEW_RUNNING, said);
            rc = run_fit(&whole);
            running = false;
        }
        if (rc) return rc;
        if (!view_asked()) {
            snprintf(text, sizeof text, "%s%s%s",
                     !b.fits ? "there is no target to fit to"
                     : whole ? "the fit has ended"
                             : "the fit is paused",
                     *said ? "; " : "", said);
            view_state(whole ? VIEW_DONE : VIEW_STOPPED, text);
        }
        const struct view_wish w = view_wait();
        if (w.end) return 0;
        *said = 0;
        if (w.save) save(said, sizeof said);
        if (w.moved) {
            numbers_move();
            rays_show();
        }
        if (w.again && b.fits) {
            b.n_history = 0;
            running = true;
            whole = false;
        }
        if (w.go || (w.save && was_running && !whole && !w.stop)) running = true;
    }
}

/* ---- Beginning and end ------------------------------------------------------------------ */

int view_is_bend(const char *path)
{
    static const char word[] = "<rays";
    char text[4096];
    size_t kept = 0;
    FILE *f = strcmp(path, "-") ? fopen(path, "rb") : NULL;
    int found = 0;
    for (size_t n;
         f && !found && (n = fread(text + kept, 1, sizeof text - kept, f)) > 0;) {
        n += kept;
        found = memmem(text, n, word, sizeof word - 1) != NULL;
        kept = n < sizeof word - 2 ? n : sizeof word - 2;
        memmove(text, text + n - kept, kept);
    }
    if (f) fclose(f);
    return found;
}

int view_bend(const char *path)
{
    int rc = bend_open(path, &b.bend);
    if (rc) return rc;
    b.fits = imp_bend_n_targets(b.bend) > 0;
    const struct view_kind kind = {b.fits ? "bend fit" : "rays", cli.out, b.fits, 0};
    struct imp_bend_fit_options trial = IMP_BEND_FIT_OPTIONS_INIT;
    rc = options_read(&trial);
    if (!rc) rc = bend_truth_open(bend_truth_path, &b.truth);
    if (!rc && cli.out) rc = make_folder(cli.out);
    if (!rc && cli.out) rc = bend_view_writable(cli.out, "");
    if (!rc) {
        numbers_open();
        rc = view_open(&kind, view_options.port);
    }
    if (!rc) {
        numbers_show();
        rc = work();
    }
    view_close();
    bend_truth_close(&b.truth);
    imp_bend_destroy(b.bend);
    free(b.history);
    return rc ? rc : cli_done();
}
