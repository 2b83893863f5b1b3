/* SPDX-License-Identifier: Apache-2.0
 *
 * A fit in the live view: after each iteration its values, its losses and, now and then,
 * a picture with few samples. What is stopped goes on from a checkpoint, with the bits of
 * a fit that was not stopped; or begins anew where the sliders are. */
#include "view.h"

#include "fit/fit_answer.h"
#include "fit/fit_options.h"
#include "fit/fit_pictures.h"
#include "shared/blocks.h"
#include "shared/picture_files.h"
#include "shared/places.h"
#include "shared/problem_options.h"
#include "text/progress.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PICTURE_SHARE 0.25 /* of the time, at most, is for pictures of the view */

static struct {
    imp_problem *problem;
    struct block *blocks;
    size_t n_blocks, n;
    double *start;    /* [n] of the fit that runs */
    char *checkpoint; /* path */
    char *folder;     /* of a checkpoint that goes with the view; NULL */
    bool begun;       /* there is a checkpoint to go on from */
    const struct imp_fit_result *result; /* of the last call; NULL: none */
    double begun_s, pictures_s;          /* clock, and time for pictures */
} f;

/* ---- Numbers ---------------------------------------------------------------------------- */

/* Number i of a block as it is; x has the logarithm of some. */
static double shown(const struct block *b, const double *x, size_t i)
{
    return b->tie.log ? exp(x[b->first + i]) : x[b->first + i];
}

/* And back: number i of x from one that is shown, inside its bounds. */
static double hidden(const struct block *b, double v, size_t i)
{
    struct imp_variable_info bounds = IMP_VARIABLE_INFO_INIT;
    bounds.lo = -INFINITY, bounds.hi = INFINITY;
    (void)!imp_problem_get_variable(f.problem, i, &bounds); /* it is there */
    return fmin(fmax(b->tie.log ? log(v) : v, bounds.lo), bounds.hi);
}

/* Values of all blocks but textures, in the order of x. */
static size_t few(const double *x, double *out)
{
    size_t n = 0;
    for (size_t k = 0; k < f.n_blocks; k++)
        for (size_t i = 0; !block_is_large(&f.blocks[k]) && i < f.blocks[k].n; i++)
            out[n++] = shown(&f.blocks[k], x, i);
    return n;
}

static void numbers_show(const double *x)
{
    double *value = cli_alloc(f.n, sizeof *value);
    few(x, value);
    view_numbers_are(value);
    free(value);
}

static void numbers_open(void)
{
    struct view_number *number = cli_alloc(f.n, sizeof *number);
    size_t n = 0;
    for (size_t k = 0; k < f.n_blocks; k++) {
        const struct block *b = &f.blocks[k];
        char name[512];
        for (size_t i = 0; !block_is_large(b) && i < b->n; i++) {
            cli_number_name(&b->info, i, name, sizeof name);
            number[n++] = (struct view_number){cli_strdup(name),
                                               view_unit(&b->info, i),
                                               b->info.lo,
                                               b->info.hi,
                                               shown(b, f.start, i),
                                               shown(b, f.start, i),
                                               view_reach(&b->info, i)};
        }
    }
    view_numbers(number, n);
}

static void numbers_move(void)
{
    double *value = cli_alloc(f.n, sizeof *value), *x = cli_alloc(f.n, sizeof *x);
    size_t n = 0;
    view_values(value);
    imp_problem_get_x(f.problem, x);
    for (size_t k = 0; k < f.n_blocks; k++)
        for (size_t i = 0; !block_is_large(&f.blocks[k]) && i < f.blocks[k].n; i++)
            x[f.blocks[k].first + i] =
                hidden(&f.blocks[k], value[n++], f.blocks[k].first + i);
    if (imp_problem_set_x(f.problem, x) != IMP_OK)
        cli_say("importon: %s", imp_last_error(cli.context));
    imp_problem_get_x(f.problem, x);
    numbers_show(x);
    free(value);
    free(x);
}

/* ---- The fit ---------------------------------------------------------------------------- */

static struct json answer_open(char **text, size_t *size)
{
    struct json j = view_stream(text, size);
    json_object(&j, NULL);
    json_text(&j, "importon", imp_version());
    json_text(&j, "command", "fit");
    return j;
}

static void answer_show(struct json *j, char **text)
{
    json_end_object(j);
    fclose(j->file);
    view_show_json(VIEW_ANSWER, "fit", NULL, *text);
}

static void step_show(const struct imp_fit_step *s)
{
    const struct fit_history h = {s->n_history, f.n, s->history, s->history_se,
                                  s->history_x};
    char *text, name[512];
    size_t size;
    struct json j = answer_open(&text, &size);
    json_text(&j, "optimizer", fit_optimizer_word());
    json_text(&j, "loss", loss_word());
    json_seed(&j, "seed", cli.seed);
    json_integer(&j, "iterations", s->iteration);
    if (s->n_history) {
        json_number(&j, "value", s->history[s->n_history - 1]);
        json_number(&j, "se", s->history_se[s->n_history - 1]);
    }
    json_text(&j, "reason", "it goes on");
    json_bool(&j, "running", 1);
    json_array(&j, "params");
    for (size_t k = 0; s->x && k < f.n_blocks; k++) {
        const struct block *b = &f.blocks[k];
        for (size_t i = 0; !block_is_large(b) && i < b->n; i++) {
            json_object(&j, NULL);
            json_text(&j, "name", cli_number_name(&b->info, i, name, sizeof name));
            json_text(&j, "unit", b->info.unit);
            json_number(&j, "min", b->info.lo);
            json_number(&j, "max", b->info.hi);
            json_number(&j, "start", shown(b, f.start, i));
            json_number(&j, "value", shown(b, s->x, i));
            json_end_object(&j);
        }
    }
    json_end_array(&j);
    fit_history_json(&j, &h, f.blocks, f.n_blocks);
    answer_show(&j, &text);
}

/* What moves, over the pictures: at the scene's numbers, with the way there. */
static void places_show(const struct imp_fit_step *s)
{
    const struct places_way way = {s && s->history_x ? s->n_history : 0, f.n,
                                   s ? s->history_x : NULL};
    char *text;
    size_t size;
    struct json j = view_stream(&text, &size);
    json_object(&j, NULL);
    places_json(&j, f.blocks, f.n_blocks, &way);
    view_show_places(&j, &text);
}

/* An imp_fit_step_fn. */
static int step(const struct imp_fit_step *s, void *payload)
{
    enum { SPP = 4 };
    (void)payload;
    step_show(s);
    f.begun = true;
    if (s->x) {
        numbers_show(s->x);
        if (f.pictures_s <= PICTURE_SHARE * (cli_now() - f.begun_s) &&
            imp_problem_set_x(f.problem, s->x) == IMP_OK) {
            const double start = cli_now();
            view_pictures(VIEW_PICTURE, "recovered", "picture", SPP);
            places_show(s);
            f.pictures_s += cli_now() - start;
        }
    }
    return view_asked();
}

static struct fit_answer answer(void)
{
    return (struct fit_answer){.problem = f.problem,
                               .result = f.result,
                               .blocks = f.blocks,
                               .n_blocks = f.n_blocks,
                               .optimizer = fit_optimizer_word(),
                               .no_intervals = fit_choice.no_intervals};
}

static void result_show(void)
{
    char *text;
    size_t size;
    struct json j = answer_open(&text, &size);
    const struct fit_answer a = answer();
    fit_answer_json(&j, &a, NULL);
    answer_show(&j, &text);
}

/* As far as it comes. */
static int run_fit(bool *whole)
{
    struct imp_fit_options fit = fit_choice_options();
    struct imp_run run = cli_run();
    double *x = cli_alloc(f.n, sizeof *x);
    run.progress = view_progress;
    if (!problem_options.clip) { /* else it begins at the scene's present parameters */
        fit.checkpoint = f.checkpoint;
        fit.resume = f.begun;
    }
    fit.step = step;
    f.begun_s = cli_now();
    f.pictures_s = 0;
    f.result = NULL;
    if (!f.begun) imp_problem_get_x(f.problem, f.start);
    const enum imp_status st = imp_fit(f.problem, &fit, &run, &f.result);
    const int rc = cli_failed(st) ? cli_fail(st, cli.scene_path) : 0;
    *whole = st == IMP_OK;
    f.begun = true;
    if (!rc && f.result) {
        result_show();
        imp_problem_get_x(f.problem, x);
        numbers_show(x);
        const struct imp_fit_step last = {.n_history = f.result->n_history,
                                          .history_x = f.result->history_x};
        places_show(&last);
        view_pictures(VIEW_PICTURE, "recovered", "picture", 0);
    }
    free(x);
    return rc;
}

/* The files of importon fit. Sliders may have moved the scene away from the result. */
static int write_all(void)
{
    const struct fit_answer a = answer();
    double *found = cli_alloc(f.n, sizeof *found), *now = cli_alloc(f.n, sizeof *now);
    imp_problem_get_x(f.problem, now);
    for (size_t k = 0; k < f.n_blocks; k++)
        for (size_t i = f.blocks[k].first; i < f.blocks[k].first + f.blocks[k].n; i++)
            found[i] = hidden(&f.blocks[k], fit_variable(f.problem, i).value, i);
    int rc = imp_problem_set_x(f.problem, found) == IMP_OK ? 0 : EXIT_RUN;
    if (!rc) rc = fit_answer_write(&a);
    if (!rc) rc = fit_targets_write();
    if (!rc) rc = fit_pictures_write("recovered", 0);
    if (imp_problem_set_x(f.problem, now) != IMP_OK) rc = EXIT_RUN;
    free(found);
    free(now);
    return rc;
}

static void save(char *said, size_t size)
{
    if (!f.result) snprintf(said, size, "there is no result yet");
    else if (write_all()) snprintf(said, size, "it was not saved");
    else snprintf(said, size, "saved: %s", cli.out);
}

static int work(void)
{
    bool running = true, whole = false, moved = false;
    char said[512] = "", text[640];
    int rc = 0;
    for (;;) {
        const bool was_running = running;
        if (running && !whole) {
            view_state(VIEW_RUNNING, said);
            rc = run_fit(&whole);
            running = false;
        } else if (moved) { /* the sliders' values, until more is wanted */
            view_state(VIEW_STOPPED, "a picture of the numbers as they are");
            places_show(NULL);
            view_pictures(VIEW_PICTURE, "recovered", "picture", 1);
            view_pictures(VIEW_PICTURE, "recovered", "picture", 8);
            view_pictures(VIEW_PICTURE, "recovered", "picture", 0);
        }
        if (rc) return rc;
        if (!view_asked()) {
            snprintf(text, sizeof text, "%s%s%s",
                     whole ? "the fit has ended" : "the fit is paused", *said ? "; " : "",
                     said);
            view_state(whole ? VIEW_DONE : VIEW_STOPPED, text);
        }
        moved = false;
        const struct view_wish w = view_wait();
        if (w.end) return 0;
        if (w.walks) view_walks(w.pixel);
        *said = 0;
        if (w.save) save(said, sizeof said);
        if (w.moved) {
            numbers_move();
            moved = true;
        }
        if (w.again) {
            f.begun = whole = false;
            unlink(f.checkpoint); /* of the fit that is given up */
            running = true;
        }
        if (w.go || (w.save && !whole && !w.stop && was_running)) running = true;
    }
}

/* ---- Beginning and end ------------------------------------------------------------------ */

/* A checkpoint of its own, without --checkpoint. */
static int checkpoint_open(void)
{
    if (view_options.checkpoint) {
        f.checkpoint = cli_strdup(view_options.checkpoint);
        return 0;
    }
    const char *folder = getenv("TMPDIR");
    if (asprintf(&f.folder, "%s/importon-view-XXXXXX", folder ? folder : "/tmp") < 0)
        exit(cli_error(EXIT_RUN, "out of memory"));
    if (!mkdtemp(f.folder))
        return cli_error(EXIT_RUN, "%s: no checkpoint can be made there", f.folder);
    f.checkpoint = join_path(f.folder, "checkpoint");
    return 0;
}

static void checkpoint_close(void)
{
    if (f.folder && f.checkpoint) {
        unlink(f.checkpoint);
        rmdir(f.folder);
    }
    free(f.folder);
    free(f.checkpoint);
}

int view_fit(void)
{
    const struct view_kind kind = {"fit", cli.out, 1, 1};
    int rc = problem_open(&f.problem);
    if (rc) return rc;
    f.blocks = problem_blocks(f.problem, &f.n_blocks);
    f.n = imp_problem_n_variables(f.problem);
    f.start = cli_alloc(f.n, sizeof *f.start);
    imp_problem_get_x(f.problem, f.start);
    if (cli.out) rc = fit_answer_writable(f.blocks, f.n_blocks);
    if (!rc) rc = checkpoint_open();
    numbers_open();
    if (!rc) rc = view_open(&kind, view_options.port);
    if (!rc) {
        numbers_show(f.start);
        places_show(NULL);
        view_targets();
        view_pictures(VIEW_START, "start", NULL, 0);
        if (cli.out) rc = fit_pictures_write("before", 0);
    }
    if (!rc) rc = work();
    view_close();
    checkpoint_close();
    free(f.start);
    free(f.blocks);
    problem_close(f.problem);
    return rc ? rc : cli_done();
}
