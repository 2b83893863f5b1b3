/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_check: options, the order of its checks, rows of the answer, progress. */
#include "base/team.h"
#include "check_sources.h"
#include "inverse/estimate/problem_tracer.h"
#include "scene/pose.h"
#include "walk/rules/features.h"
#include "walk/run/run.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- Which rows are wanted --------------------------------------------------------- */

#define DRAWS_S 20 /* default of imp_check_options.draws_s */

static const char *const methods[] = {
    "frozen", "dot",    "euler",      "fresh",   "loss",   "ends",    "uniform",
    "energy", "aim",    "directions", "choices", "points", "flights", "passes",
    "areas",  "leaves", "guides",     "weights", "film",   "times",   "waves"};

/* Is `word` [n] one of the comma-separated words of `list`? */
static bool listed(const char *list, const char *word, size_t n)
{
    for (const char *at = list; *at;) {
        const size_t length = strcspn(at, ",");
        if (length == n && memcmp(at, word, n) == 0) return true;
        at += length + (at[length] == ',');
    }
    return false;
}

bool imp__check_wants(const struct imp__check *c, const char *method)
{
    return !c->options.only || listed(c->options.only, method, strlen(method));
}

static bool wants_any(const struct imp__check *c, const char *list)
{
    for (const char *at = list; *at;) {
        const size_t n = strcspn(at, ",");
        if (!c->options.only || listed(c->options.only, at, n)) return true;
        at += n + (at[n] == ',');
    }
    return false;
}

static enum imp_status only_verify(const struct imp__check *c)
{
    for (const char *at = c->options.only; at && *at;) {
        const size_t n = strcspn(at, ",");
        bool known = false;
        for (size_t k = 0; k < imp_count(methods); k++)
            known |= strlen(methods[k]) == n && memcmp(methods[k], at, n) == 0;
        if (!known)
            return imp__error(c->ctx, IMP_E_ARG, "no rows of a check are called '%.*s'",
                              (int)n, at);
        at += n + (at[n] == ',');
    }
    return IMP_OK;
}

/* ---- Rows ---------------------------------------------------------------------------- */

enum imp_status imp__check_row(struct imp__check *c, const char *method,
                               const char *param, int64_t element,
                               const struct imp_check_row *row)
{
    char name[512];
    if (!imp__check_wants(c, method)) return IMP_OK;
    struct imp_check_row *grown =
        imp__grow(c->ctx, c->rows, &c->cap_rows, c->n_rows + 1, sizeof *grown);
    if (grown) c->rows = grown;
    if (element >= 0) snprintf(name, sizeof name, "%s[%lld]", param, (long long)element);
    else snprintf(name, sizeof name, "%s", param ? param : "*");
    char *copy = imp__arena_strdup(&c->problem->check_arena, name);
    if (!grown || !copy) return imp__error(c->ctx, IMP_E_NOMEM, "no memory for a check");
    c->rows[c->n_rows] = *row;
    c->rows[c->n_rows].size = sizeof *row;
    c->rows[c->n_rows].method = method;
    c->rows[c->n_rows++].param = copy;
    return IMP_OK;
}

double imp__check_scale(const struct imp_param *p, size_t e)
{
    const double value = fabs(imp__param_get(p, e)), range = p->info.hi - p->info.lo;
    const double size = isfinite(range) && range > 0 ? fmax(value, 1e-3 * range) : value;
    return size > 0 ? size : 1;
}

void imp__check_direction(const struct imp_param *p, double *w)
{
    for (size_t e = 0; e < p->info.count; e++) {
        const double by = 0.5 + imp__u01(imp__key(9, 9, 9), (uint32_t)e);
        const double x = imp__param_get(p, e);
        w[e] = x - p->info.lo > p->info.hi - x ? -by : by;
    }
}

static bool report(struct imp__check *c, double fraction)
{
    if (!c->outer.progress) return false;
    const double elapsed = imp__now() - c->start_s;
    fraction = c->shown = fmax(c->shown, fraction); /* rows may need more samples */
    const struct imp_progress p = {
        .size = sizeof p,
        .stage = "check",
        .fraction = fmin(fraction, 1),
        .elapsed_s = elapsed,
        .eta_s = fraction > 1e-3 ? elapsed * (1 - fraction) / fraction : -1,
        .rate = elapsed > 0 ? c->done / elapsed : 0,
        .rate_unit = "pieces"};
    c->stopped |= c->outer.progress(&p, c->outer.progress_payload) != 0;
    return c->stopped;
}

enum imp_status imp__check_progress(struct imp__check *c, double work)
{
    c->done += work;
    if (c->outer.time_limit_s > 0 && imp__now() - c->start_s > c->outer.time_limit_s)
        c->stopped = true;
    report(c, c->done / fmax(c->total, 1));
    const enum imp_status st = imp__team_any(c->ctx, c->stopped, &c->stopped);
    if (st != IMP_OK) return st;
    return c->stopped
               ? imp__error(c->ctx, IMP_CANCELLED, "%s", imp_status_text(IMP_CANCELLED))
               : IMP_OK;
}

/* Progress of one evaluation, which is one piece of work. */
static int inner_progress(const struct imp_progress *p, void *payload)
{
    struct imp__check *c = payload;
    return report(c, (c->done + p->fraction) / fmax(c->total, 1));
}

enum imp_status imp__check_densities(struct imp__check *c)
{
    enum imp_status st = IMP_OK;
    struct imp__draw_list l = {.check = c};
    struct imp__places places = {.check = c};
    if (!wants_any(c, "directions,choices,points,flights,passes,areas,leaves,guides,"
                      "weights,film,times,waves"))
        return IMP_OK;
    imp__arena_init(&l.arena, c->ctx);
    IMP_TRY(imp__places_find(&places));
    IMP_TRY(imp__check_directions(&l, &places));
    IMP_TRY(imp__check_lights(&l, &places));
    IMP_TRY(imp__check_flights(&l, &places));
    IMP_TRY(imp__check_areas(&l, &places));
    IMP_TRY(imp__check_far(&l, &places));
    IMP_TRY(imp__check_guides(&l, &places));
    IMP_TRY(imp__check_weights(&l, &places));
    IMP_TRY(imp__check_film(&l, &places));
    IMP_TRY(imp__draw_all(&l));
out:
    imp__places_destroy(&places);
    imp__arena_free(&l.arena);
    imp__release(c->ctx, l.row);
    return st;
}

/* The active parameters of `chosen` [n_params] that are poses, or are none. */
static enum imp_status layout_of(struct imp_problem *p, const uint8_t *chosen, bool poses)
{
    const size_t n = p->scene->n_params;
    uint8_t *some = imp__alloc(p->ctx, n + 1, 1);
    if (!some) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for a check");
    memcpy(some, chosen, n);
    for (size_t k = 0; k < n; k++) {
        const struct imp_pose *pose = imp__pose_of(p->scene, k);
        some[k] &= pose && imp__pose_moves(pose) ? poses : !poses;
    }
    const enum imp_status st = imp__problem_layout(p, some);
    imp__release(p->ctx, some);
    return st;
}

/* Rows of all parameters but poses. */
static enum imp_status numbers_check(struct imp__check *c, bool lights)
{
    enum imp_status ended =
        imp__check_densities(c); /* first: all that follows rests on them */
    if (ended == IMP_OK && !lights && wants_any(c, "frozen,dot,euler"))
        ended = imp__check_frozen(c);
    if (ended == IMP_OK && wants_any(c, "fresh,ends")) ended = imp__check_fresh(c);
    if (ended == IMP_OK && !lights && wants_any(c, "loss")) ended = imp__check_losses(c);
    if (ended == IMP_OK && wants_any(c, "ends")) ended = imp__check_ends(c);
    return ended;
}

/* Rows of poses, which are compared by themselves: walks of other rows stay where they are. */
static enum imp_status poses_check(struct imp__check *c)
{
    struct imp_problem *p = c->problem;
    p->edge_terms = true;
    enum imp_status st = imp__problem_tracer_of_any_end(p, &c->outer, NULL, &c->tracer);
    p->edge_terms = false;
    if (st == IMP_OK && wants_any(c, "frozen")) st = imp__check_poses(c);
    if (st == IMP_OK && wants_any(c, "fresh")) st = imp__check_fresh(c);
    return st;
}

static enum imp_status check(imp_problem *p, const struct imp_check_options *options,
                             const struct imp_run *run, const struct imp_check_row **rows,
                             size_t *n_rows)
{
    enum imp_status st = IMP_OK, ended = IMP_OK;
    uint8_t *chosen = NULL; /* with poses: what is active, before and after */
    IMP_CHECKED(imp__problem_no_parts(p, "check"));
    IMP_FLOAT_MODE;
    IMP_SETS(p->scene, st);
    if (st != IMP_OK) return st;
    struct imp__check c = {.problem = p,
                           .ctx = p->ctx,
                           .options = IMP_CHECK_OPTIONS_INIT,
                           .outer = IMP_RUN_INIT,
                           .start_s = imp__now()};

    IMP_CHECKED(imp__options_take(p->ctx, "imp_check", "options", options, &c.options,
                                  sizeof c.options));
    IMP_CHECKED(imp__run_take(p->ctx, "imp_check", run, &c.outer));
    IMP_CHECKED(imp__run_traces(p->ctx, "imp_check", &c.outer));
    if (p->n == 0 && !c.options.sampling)
        IMP_TRY(
            imp__error(p->ctx, IMP_E_ARG, "nothing to check: no parameter is active"));
    if (c.options.paths < 0 || c.options.fresh_spp < 0)
        IMP_TRY(imp__error(p->ctx, IMP_E_ARG, "paths and fresh_spp must be >= 0"));
    if (!(c.options.draws_s >= 0) || isinf(c.options.draws_s))
        IMP_TRY(imp__error(p->ctx, IMP_E_ARG, "draws_s must be finite and >= 0"));
    IMP_TRY(only_verify(&c));
    if (c.options.paths == 0) c.options.paths = 1000;
    if (c.options.draws_s == 0) c.options.draws_s = DRAWS_S;
    c.outer.points = IMP_POINTS_INDEPENDENT; /* samples are compared one by one */
    c.run = c.outer;
    c.run.time_limit_s = 0;
    c.run.progress = inner_progress;
    c.run.progress_payload = &c;
    if (c.options.fresh_spp > 0) c.run.spp = c.options.fresh_spp;
    const bool moves = imp__problem_moves(p);
    if (moves) {
        chosen = imp__alloc(p->ctx, p->scene->n_params + 1, 1);
        if (!chosen) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a check"));
        memcpy(chosen, p->chosen, p->scene->n_params);
        IMP_TRY(layout_of(p, chosen, false));
    }
    IMP_TRY(imp__problem_tracer_of_any_end(p, &c.outer, NULL, &c.tracer));
    const bool lights = c.tracer.integrator->from_lights;
    if (c.options.sampling) {
        struct imp_job job = imp__job(p->scene, c.tracer.sensor, &c.outer, &p->active);
        imp__job_state(&job, IMP_HAS_CHECKED_SAMPLING, NULL);
        IMP_TRY(imp__job_allowed(&job));
    }
    imp__arena_free(&p->check_arena);

    if (c.options.sampling) {
        ended = imp__check_sampling(&c);
    } else {
        if (p->n > 0) ended = numbers_check(&c, lights);
        if (ended == IMP_OK && moves) {
            IMP_TRY(layout_of(p, chosen, true));
            ended = poses_check(&c);
        }
    }
    if (ended != IMP_OK && ended != IMP_CANCELLED) IMP_TRY(ended);
    struct imp_check_row *kept =
        imp__arena_array(&p->check_arena, c.n_rows + 1, sizeof *kept);
    if (!kept) IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a check"));
    if (c.n_rows > 0) memcpy(kept, c.rows, c.n_rows * sizeof *kept);
    *rows = kept;
    *n_rows = c.n_rows;
    st = ended;
out:
    if (chosen) {
        const enum imp_status back = imp__problem_layout(p, chosen);
        if (st == IMP_OK) st = back;
    }
    imp__release(p->ctx, chosen);
    imp__release(p->ctx, c.rows);
    imp__release(p->ctx, c.slopes);
    return st;
}

/* Values are checked one by one, whatever ties they have, and those that are held. */
enum imp_status imp_check(imp_problem *p, const struct imp_check_options *options,
                          const struct imp_run *run, const struct imp_check_row **rows,
                          size_t *n_rows)
{
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, rows, "rows");
    IMP_REQUIRE(p->ctx, n_rows, "n_rows");
    const size_t ties = p->n_ties;
    uint8_t *held = p->held;
    if (ties == 0 && !held) return check(p, options, run, rows, n_rows);
    p->n_ties = 0;
    p->held = NULL;
    enum imp_status st = imp__problem_layout(p, p->chosen);
    if (st == IMP_OK) st = check(p, options, run, rows, n_rows);
    p->n_ties = ties;
    p->held = held;
    const enum imp_status back = imp__problem_layout(p, p->chosen);
    return st != IMP_OK ? st : back;
}
