/* SPDX-License-Identifier: Apache-2.0
 *
 * importon design: which luminaires of a room, how far dimmed, for what is wanted of its grids. */
#include "design_answer.h"
#include "read/room_page.h"
#include "shared/command.h"
#include "shared/overwrite.h"
#include "text/progress.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PAGE_TIMES                                                                       \
    8 /* samples of a grid of the page, all lamps at once, over those of one lamp */

static struct {
    int least, others, rounds, nodes;
    double confidence, within;
    const char *settings, *report;
} o;

static const char *const least_words[] = {"watts", "flux", "cost", NULL};

static const struct arg_option options[] = {
    {ARG_CHOICE, 0, "least", "WHAT", "watts (default), flux or cost", &o.least, 0, 0,
     least_words},
    {ARG_NUMBER, 0, "confidence", "P", "with which all of it holds (default 0.95)",
     &o.confidence, 0.5, 0.999999, NULL},
    {ARG_INT, 0, "rounds", "N", "of fresh walks that judge an answer (default 4)",
     &o.rounds, 1, 20, NULL},
    {ARG_INT, 0, "others", "N", "list other sets of lamps that are nearly as good",
     &o.others, 1, 100, NULL},
    {ARG_NUMBER, 0, "within", "PART",
     "of the objective, up to which others are listed (default 0.05)", &o.within, 1e-9,
     10, NULL},
    {ARG_INT, 0, "nodes", "N", "branches of a search, at most (default 20000)", &o.nodes,
     1, 1e9, NULL},
    {ARG_TEXT, 0, "settings", "FILE", "write the levels and places, for --set @FILE",
     &o.settings, 0, 0, NULL},
    {ARG_TEXT, 0, "report", "FILE",
     "the answer as a page for a client: plans, what is wanted, luminaires, a view",
     &o.report, 0, 0, NULL},
    {0}};

/* ---- The page ------------------------------------------------------------------------ */

static size_t lamp_index(const struct design_answer *a, const char *name)
{
    size_t j = 0;
    while (j < a->lamps->n && strcmp(a->lamps->lamp[j].lamp, name) != 0) j++;
    return j;
}
static const char *file_of(const char *lamp, void *payload)
{
    const struct design_answer *a = payload;
    const size_t j = lamp_index(a, lamp);
    return j < a->lamps->n && a->lamps->file[j] ? a->lamps->file[j] : "";
}
static double level_of(const char *lamp, void *payload)
{
    const struct design_answer *a = payload;
    const size_t j = lamp_index(a, lamp);
    return j < a->lamps->n ? a->answer->level[j] : 1;
}
static double watts_of(const char *lamp, void *payload)
{
    const struct design_answer *a = payload;
    const size_t j = lamp_index(a, lamp);
    return j < a->lamps->n ? a->answer->lamp_watts[j] : 0;
}

/* The grids that something is wanted of, with the answer's levels and walks of their own. */
static int report_write(struct design_answer *a, size_t n)
{
    struct room_page *page = cli_alloc(1, sizeof *page);
    struct imp_run run = cli_run();
    char heading[200];
    bool met;
    int rc = design_levels_apply(a);
    run.seed += 1;
    snprintf(heading, sizeof heading,
             "Chosen with the fewest %s: %.4g W, %.5g lm. Fresh walks show all that is "
             "wanted with %g %% confidence: %s.",
             least_words[o.least], a->answer->watts, a->answer->flux,
             100 * (o.confidence > 0 ? o.confidence : 0.95),
             a->answer->holds ? "yes" : "no");
    page->heading = heading;
    page->file_of = file_of;
    page->level_of = level_of;
    page->watts_of = watts_of;
    page->payload = a;
    page->n_wants = n;
    memcpy(page->want, a->wants, n * sizeof *page->want);
    for (size_t k = 0; k < n && !rc; k++) {
        struct grid g;
        bool there = false;
        for (size_t i = 0; i < page->n_grids; i++)
            there |= page->grid[i].sensor == a->wants[k].sensor;
        if (there) continue;
        run.sensor = a->wants[k].sensor;
        run.spp = cli.spp;
        run.spp = PAGE_TIMES * cli_spp(&run);
        rc = grid_read(run, 0, 0, &g);
        if (!rc) room_page_add(page, &g);
    }
    if (!rc) rc = room_page_write(page, o.report, run, &met);
    room_page_free(page);
    free(page);
    return rc;
}

/* An older file of an option stays where there is no answer, and is none of this scene. */
static void older_tell(const char *path)
{
    if (path && access(path, F_OK) == 0)
        cli_say(
            "importon: warning: %s is not written, since there is no answer: what is in "
            "it is older",
            path);
}

static int samples_check(struct imp_run run, const struct imp_design_want *want, size_t n)
{
    int rc = 0;
    for (size_t k = 0; k < n && !rc; k++) {
        run.sensor = want[k].sensor;
        rc = grid_samples_check(run);
    }
    return rc;
}

static enum imp_status find(const struct design_lamps *lamps,
                            const struct design_moves *moves,
                            const struct imp_design_want *want, size_t n,
                            const struct imp_design_options *options,
                            const struct imp_run *run, imp_design **out)
{
    return moves->n > 0 ? imp_design_move(cli.scene, lamps->lamp, lamps->n, want, n,
                                          moves->move, moves->n, options, run, out)
                        : imp_design_find(cli.scene, lamps->lamp, lamps->n, want, n,
                                          options, run, out);
}

static int design(const struct design_lamps *lamps)
{
    const struct imp_run run = cli_run();
    struct imp_design_options options = IMP_DESIGN_OPTIONS_INIT;
    struct imp_design_want *want = cli_alloc(WANTS_MAX, sizeof *want);
    struct design_moves moves = {0};
    imp_design *found = NULL;
    size_t n = 0;
    options.least = (enum imp_design_least)o.least;
    options.confidence = o.confidence;
    options.rounds = o.rounds;
    options.others = o.others;
    options.within = o.within;
    options.nodes = o.nodes;
    int rc = wants_read(want, &n);
    if (!rc && n == 0)
        rc = cli_error(EXIT_USAGE,
                       "design: nothing is wanted; say it by --want, such as --want "
                       "work.average=500,work.uniformity=0.6");
    if (!rc) rc = samples_check(run, want, n);
    if (!rc) rc = design_moves_make(design_is_catalogued(), &moves, &options);
    if (!rc && o.settings) rc = overwrite_check(o.settings, OUTPUT_SETTINGS);
    if (!rc && o.report) rc = overwrite_check(o.report, OUTPUT_PAGE);
    if (!rc) {
        const enum imp_status st = find(lamps, &moves, want, n, &options, &run, &found);
        if (st == IMP_CANCELLED) rc = cli_error(cli_done(), "interrupted: no answer yet");
        else if (st != IMP_OK) rc = cli_fail(st, cli.scene_path);
    }
    if (!rc) {
        struct design_answer a = {lamps, &moves, want, &options,
                                  imp_design_result(found)};
        if (cli.json) design_json(&a);
        else design_print(&a);
        if (!a.answer->found) older_tell(o.settings), older_tell(o.report);
        if (o.settings && a.answer->found) rc = design_settings_write(o.settings, &a);
        if (!rc && o.report && a.answer->found) rc = report_write(&a, n);
        if (!rc && !(a.answer->found && a.answer->holds)) rc = EXIT_NO;
    }
    imp_design_destroy(found);
    design_moves_free(&moves);
    free(want);
    return rc;
}

static int run_design(int n, char **operand)
{
    struct design_lamps lamps = {0};
    (void)n;
    int rc = design_catalogue_read();
    if (!rc) rc = cli_load(operand[0]);
    if (!rc) rc = design_lamps_make(&lamps);
    if (!rc) rc = design(&lamps);
    design_lamps_free(&lamps);
    return rc ? rc : cli_done();
}

const struct command command_design = {
    {"design",
     "SCENE",
     "which luminaires of a room, how far dimmed, for wanted lux",
     {options_wants, options, options_lamps, options_moves, options_walks, options_scene,
      options_file, options_general},
     1,
     1},
    run_design,
    1,
    0,
    REPLAYS_NEVER};
