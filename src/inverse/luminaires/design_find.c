/* SPDX-License-Identifier: Apache-2.0
 *
 * A design: responses, the best combination, fresh walks through it, larger margins where these
 * do not show what is wanted, and other answers. */
#include "base/arguments.h"
#include "design_moving.h"
#include "inverse/problem/problem.h"
#include "math/rng.h"
#include "scene/access.h"
#include "walk/run/run.h"
#include <math.h>
#include <string.h>

#define FRESH 0x71c3

struct imp_design {
    imp_context *ctx;
    struct imp_arena arena;
    struct imp_design_answer answer;
};

/* Readings with each lamp that judge, twice those of the responses, then twice as many a round. */
static int repeats_of(int round) { return 2 << (round < 10 ? round : 10); }

static void findings_begin(const struct imp__design_model *m,
                           struct imp_design_finding *f)
{
    for (size_t k = 0; k < m->n_wants; k++)
        f[k] = (struct imp_design_finding){.size = sizeof *f,
                                           .wanted = m->want[k].value,
                                           .attainable = m->want[k].value,
                                           .alone = m->want[k].value};
}

/* The answer of a search becomes that of the design. */
static enum imp_status answer_set(struct imp__design_model *m,
                                  const struct imp__choice_answer *a,
                                  const double *wanted, struct imp_design_finding *f,
                                  struct imp_design_answer *out)
{
    const double *x = a->x;
    out->found = true;
    out->proven = a->proven;
    out->level = x;
    out->watts = imp__design_objective(m, IMP_LEAST_WATTS, x);
    out->flux = imp__design_objective(m, IMP_LEAST_FLUX, x);
    out->cost = imp__design_objective(m, IMP_LEAST_COST, x);
    out->objective = imp__design_objective(m, m->o.least, x);
    out->bound = a->proven ? out->objective : fmin(a->bound, out->objective);
    out->objective_se = imp__design_objective_se(m, x, a->dual);
    for (size_t k = 0; k < m->n_wants; k++) {
        f[k].price = imp__design_price(m, k, wanted[k], x, a->dual);
        f[k].binding = f[k].price != 0;
        if (m->o.least == IMP_LEAST_COST) f[k].price = 0;
    }
    return IMP_OK;
}

/* Search and judge until each want holds; the margin of those that do not grows by what is
 * missing. */
static enum imp_status rounds_run(struct imp__design_model *m, double *wanted,
                                  struct imp_design_finding *f,
                                  struct imp_design_answer *out)
{
    double risk = 1 - m->o.confidence;
    for (int round = 0; round < m->o.rounds; round++) {
        struct imp__choice_answer a;
        struct imp__design_reading fresh;
        for (size_t k = 0; k < m->n_wants; k++)
            imp__design_rows_set(m, k, wanted[k], IMP_DESIGN_MARGIN);
        IMP_CHECKED(imp__design_search(m, NULL, 0, false, &a));
        if (!out->found) out->proven = a.proven;
        if (!a.found) return IMP_OK; /* the answer of the last round stays */
        IMP_CHECKED(answer_set(m, &a, wanted, f, out));
        IMP_CHECKED(imp__design_read(m, out->level, FRESH + (uint64_t)round,
                                     repeats_of(round), &fresh));
        out->rounds = round + 1;
        out->holds = true;
        if (m->o.rounds > 1)
            risk *= 0.5; /* all rounds together have the risk asked for */
        for (size_t k = 0; k < m->n_wants; k++) {
            imp__design_judge(m, k, out->level, &fresh, risk, &f[k]);
            out->holds &= f[k].holds;
            if (!f[k].holds) {
                wanted[k] += m->want[k].value - f[k].sure;
                if (m->want[k].of == IMP_WANT_UNIFORMITY)
                    wanted[k] = fmin(wanted[k], 0.999);
            }
        }
        if (out->holds) return IMP_OK;
        for (size_t k = 0; k < m->n_wants; k++)
            if (!isfinite(wanted[k])) return IMP_OK; /* no reading bounds it */
    }
    return IMP_OK;
}

/* What the objective were if the responses had no errors. */
static enum imp_status margin_find(struct imp__design_model *m,
                                   struct imp_design_answer *out)
{
    struct imp__choice_answer a;
    for (size_t k = 0; k < m->n_wants; k++)
        imp__design_rows_set(m, k, m->want[k].value, 0);
    IMP_CHECKED(imp__design_search(m, NULL, 0, false, &a));
    if (a.found)
        out->margin = fmax(out->objective - imp__design_objective(m, m->o.least, a.x), 0);
    return IMP_OK;
}

/* Other sets of lamps, one by one, with the margins of the answer. */
static enum imp_status others_find(struct imp__design_model *m, const double *wanted,
                                   struct imp_design_answer *out)
{
    const size_t most = (size_t)m->o.others;
    const bool **not_these = imp__arena_array(m->arena, most + 1, sizeof *not_these);
    bool *first = imp__arena_array(m->arena, m->n, sizeof *first);
    double *objective = imp__arena_array(m->arena, most + 1, sizeof *objective);
    double *level = imp__arena_array(m->arena, most * m->n + 1, sizeof *level);
    if (!not_these || !first || !objective || !level)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for other answers");
    for (size_t j = 0; j < m->n; j++) first[j] = out->level[j] > 0;
    not_these[0] = first;
    for (size_t k = 0; k < m->n_wants; k++)
        imp__design_rows_set(m, k, wanted[k], IMP_DESIGN_MARGIN);
    while (out->n_others < most) {
        struct imp__choice_answer a;
        IMP_CHECKED(imp__design_search(m, not_these, out->n_others + 1, false, &a));
        if (!a.found) break;
        const double o = imp__design_objective(m, m->o.least, a.x);
        if (o > out->objective * (1 + m->o.within)) break;
        objective[out->n_others] = o;
        memcpy(level + out->n_others * m->n, a.x, m->n * sizeof *level);
        not_these[++out->n_others] = a.used;
    }
    out->other_objective = objective;
    out->other_level = level;
    return IMP_OK;
}

static enum imp_status design_make(struct imp__design_model *m,
                                   struct imp_design_answer *out)
{
    struct imp_design_finding *f = imp__arena_array(m->arena, m->n_wants, sizeof *f);
    double *wanted = imp__arena_array(m->arena, m->n_wants, sizeof *wanted);
    if (!f || !wanted) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for wants");
    findings_begin(m, f);
    for (size_t k = 0; k < m->n_wants; k++) wanted[k] = m->want[k].value;
    m->whole = (double)m->n_grids * ((double)m->n + 1) * (1 + repeats_of(0));
    out->n_lamps = m->n;
    out->lamp_watts = m->watts;
    out->lamp_flux = m->flux;
    out->n_wants = m->n_wants;
    out->wants = f;
    out->level = imp__arena_array(m->arena, m->n, sizeof *out->level);
    if (!out->level) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for levels");
    IMP_CHECKED(imp__design_responses(m));
    IMP_CHECKED(imp__design_rows_make(m));
    IMP_CHECKED(rounds_run(m, wanted, f, out));
    for (size_t k = 0; !out->found && k < m->n_wants; k++)
        f[k].value = f[k].sure = f[k].attainable = f[k].alone = NAN;
    if (!out->found && out->proven) IMP_CHECKED(imp__design_attainable(m, f));
    if (out->found) {
        if (m->o.others > 0) IMP_CHECKED(others_find(m, wanted, out));
        IMP_CHECKED(margin_find(m, out));
    }
    out->nodes = m->nodes;
    return IMP_OK;
}

/* Places first, then a design there. Where that ends with an error, what has moved goes back. */
static enum imp_status moved_make(struct imp__moving *v,
                                  const struct imp_design_move *moves,
                                  struct imp_design_answer *out)
{
    struct imp__design_model *m = v->m;
    enum imp_status st = IMP_OK;
    v->iterations = m->o.steps;
    m->whole = (double)m->n_grids * ((double)m->n + 2 * (double)v->n) * 10;
    IMP_TRY(imp__moving_bounds(v, moves, m->o.clearance));
    m->whole *= v->n > 0 ? m->o.starts : 1;
    /* The largest error of a point is above their rms, by how much is found out. */
    for (v->more = 1.3; v->more < 5 && !out->found; v->more *= 1.5) {
        *out = (struct imp_design_answer){.size = out->size};
        if (v->n > 0) IMP_TRY(v->end ? imp__design_move(v) : imp__design_starts(v));
        IMP_TRY(design_make(m, out));
        if (v->n == 0) break;
    }
    if (v->steps > 0 && v->started < (out->found ? out->objective : INFINITY)) {
        /* The search took errors of single points as equal: with those that they have the first
         * places are better. */
        *out = (struct imp_design_answer){.size = out->size};
        v->steps = 0;
        v->start = (size_t)m->o.starts;
        memcpy(v->p, v->first, v->n * sizeof *v->p);
        IMP_TRY(imp__moving_place(v, v->p));
        IMP_TRY(design_make(m, out));
    }
    out->n_moves = v->n;
    out->moved_from = v->first;
    out->moved_to = v->p;
    out->steps = v->steps;
    out->n_starts = v->n > 0 ? (size_t)m->o.starts : 0;
    out->start_objective = v->end;
    out->start_place = v->ended;
    out->start = v->start;
out:
    if (st != IMP_OK && v->n > 0) {
        const enum imp_status back = imp__moving_place(v, v->first);
        (void)back; /* the caller gets the first error */
    }
    return st;
}

/* What a design is made of, in a scene whose parameters are held. */
struct asked {
    const struct imp_design_lamp *lamps;
    const struct imp_design_want *wants;
    const struct imp_design_move *moves;
    const struct imp_design_options *options;
};

static enum imp_status design_hold(struct imp__moving *v, const struct asked *a,
                                   struct imp_design_answer *out)
{
    struct imp__design_model *m = v->m;
    enum imp_status st = IMP_OK;
    IMP_FLOAT_MODE;
    IMP_SETS(m->scene, st);
    if (st != IMP_OK) return st;
    return moved_make(v, a->moves, out);
}

/* A design of n_lamps lamps with n_wants wants, of which n_moves numbers move. */
static enum imp_status design_run(imp_scene *scene, size_t n_lamps, size_t n_wants,
                                  size_t n_moves, const struct asked *a,
                                  const char *function, const struct imp_run *run,
                                  imp_design **out)
{
    enum imp_status st = IMP_OK;
    if (!scene) return imp__argument_missing(NULL, function, "scene");
    imp_context *ctx = scene->ctx;
    const struct {
        const void *pointer;
        const char *name;
    } needed[] = {{a->lamps, "lamps"}, {a->wants, "wants"}, {out, "out"}};
    for (size_t k = 0; k < imp_count(needed); k++)
        if (!needed[k].pointer)
            return imp__argument_missing(ctx, function, needed[k].name);
    struct imp__design_model model = {
        .ctx = ctx, .scene = scene, .n = n_lamps, .n_wants = n_wants};
    struct imp__design_model *m = &model;
    struct imp__moving moving = {.m = m, .n = n_moves}, *v = &moving;
    imp_problem *blank = NULL;
    IMP_RUN(ctx, m->run, run);
    IMP_CHECKED(imp__run_traces(ctx, function, &m->run));
    imp_design *d = imp__alloc(ctx, 1, sizeof *d);
    if (!d) return imp__error(ctx, IMP_E_NOMEM, "no memory for a design");
    d->ctx = ctx;
    imp__context_hold(ctx);
    imp__arena_init(&d->arena, ctx);
    m->arena = &d->arena;
    d->answer.size = sizeof d->answer;
    if (!m->scene->committed)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "a design needs a committed scene"));
    IMP_TRY(imp__moving_check(v, a->moves));
    IMP_TRY(imp__design_options_take(m, a->options));
    IMP_TRY(imp__design_lamps_take(m, a->lamps));
    IMP_TRY(imp__design_wants_take(m, a->wants));
    if (v->n > 0) IMP_TRY(imp__moving_names(v, a->moves));
    IMP_TRY(imp_problem_create(m->scene, &blank)); /* a committed scene, and no parts */
    IMP_TRY(imp__problem_no_parts(blank, "a design"));
    IMP_TRY(design_hold(v, a, &d->answer));
    *out = d;
    d = NULL;
out:
    imp_problem_destroy(blank);
    imp_design_destroy(d);
    return st;
}

enum imp_status imp_design_find(imp_scene *scene, const struct imp_design_lamp *lamps,
                                size_t n_lamps, const struct imp_design_want *wants,
                                size_t n_wants, const struct imp_design_options *options,
                                const struct imp_run *run, imp_design **out)
{
    return design_run(scene, n_lamps, n_wants, 0,
                      &(struct asked){lamps, wants, NULL, options}, __func__, run, out);
}

enum imp_status imp_design_move(imp_scene *scene, const struct imp_design_lamp *lamps,
                                size_t n_lamps, const struct imp_design_want *wants,
                                size_t n_wants, const struct imp_design_move *moves,
                                size_t n_moves, const struct imp_design_options *options,
                                const struct imp_run *run, imp_design **out)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, moves, "moves");
    if (n_moves == 0 || n_moves > 1000)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "moves: %zu numbers; there are 1 to 1000", n_moves);
    return design_run(scene, n_lamps, n_wants, n_moves,
                      &(struct asked){lamps, wants, moves, options}, __func__, run, out);
}

const struct imp_design_answer *imp_design_result(const imp_design *design)
{
    return design ? &design->answer : NULL;
}

void imp_design_destroy(imp_design *design)
{
    if (!design) return;
    imp_context *ctx = design->ctx;
    imp__arena_free(&design->arena);
    imp__release(ctx, design);
    imp__context_drop(ctx);
}
