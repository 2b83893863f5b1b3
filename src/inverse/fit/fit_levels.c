/* SPDX-License-Identifier: Apache-2.0
 *
 * A fit from coarse to fine: the first searches have one variable for each 2^level cells
 * of a grid along an axis (cells.h), so that few numbers settle what is large before many
 * settle what is small. With x = P c the gradient with respect to c is P^T g, unbiased as
 * g is. Parameters without cells are fitted as they are on every level. */
#include "fit.h"
#include "inverse/estimate/replicates.h"
#include "inverse/problem/cells.h"
#include <string.h>

struct level {
    struct imp__fit *fit;
    int level;
    size_t n;                /* variables */
    double *x, *g;           /* [problem->n] fine values, and the gradient */
    struct imp__span *spans; /* [n_blocks] of the variables */
    double *trail;           /* [n_trail][problem->n] of the fine search's history_x */
    size_t n_trail, cap_trail;
};

/* The grid of a block's values: its parameter's, unless it is a factor of many. */
static struct imp__cells cells_of(const struct imp_problem *p, size_t block)
{
    const struct imp__block *b = &p->blocks[block];
    if (imp__block_factor(p, b)) return (struct imp__cells){{1, 1, b->count}, 1};
    return imp__cells_of(&p->scene->params[b->param].info);
}
static bool are_many(const struct imp_problem *p, size_t block)
{
    const struct imp__block *b = &p->blocks[block];
    return !imp__block_factor(p, b) &&
           imp__cells_are_many(&p->scene->params[b->param].info);
}
static int level_of(const struct level *l, size_t block)
{
    return are_many(l->fit->problem, block) ? l->level : 0;
}

/* From the fine numbers of all blocks to the coarse ones, or back. */
static void blocks_map(const struct level *l,
                       void (*map)(const struct imp__cells *fine, int level,
                                   const double *from, double *to),
                       bool up, const double *from, double *to)
{
    const struct imp_problem *p = l->fit->problem;
    size_t coarse = 0;
    for (size_t b = 0; b < p->n_blocks; b++) {
        const size_t fine = p->blocks[b].first;
        const struct imp__cells cells = cells_of(p, b);
        map(&cells, level_of(l, b), from + (up ? coarse : fine),
            to + (up ? fine : coarse));
        coarse = l->spans[b].end;
    }
}

static enum imp_status eval(const double *c, uint64_t seed, struct imp_estimate *f,
                            double *g, double *g_se, void *payload)
{
    struct level *l = payload;
    const struct imp__goal *fine = &l->fit->goal;
    (void)g_se; /* Adam needs none */
    blocks_map(l, imp__cells_prolong, true, c, l->x);
    const enum imp_status st = fine->eval(l->x, seed, f, l->g, NULL, fine->payload);
    if (st == IMP_OK) blocks_map(l, imp__cells_restrict, false, l->g, g);
    return st;
}

/* x is where the iteration had its objective. */
static enum imp_status trail_add(struct level *l)
{
    const struct imp_problem *p = l->fit->problem;
    if (p->n > IMP_TRAIL_MAX) return IMP_OK;
    double *grown = imp__grow(p->ctx, l->trail, &l->cap_trail, (l->n_trail + 1) * p->n,
                              sizeof *grown);
    if (!grown) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for the loss history");
    l->trail = grown;
    memcpy(grown + l->n_trail++ * p->n, l->x, p->n * sizeof *grown);
    return IMP_OK;
}

static enum imp_status iterated(const struct imp__search *s, void *payload)
{
    struct level *l = payload;
    const enum imp_status st = trail_add(l);
    if (st != IMP_OK) return st;
    return l->fit->goal.iterated(s, l->fit->goal.payload);
}

/* Bounds of the variables, and the size of a large change from where they start. */
static void spans_make(struct level *l, const double *x)
{
    const struct imp_problem *p = l->fit->problem;
    size_t end = 0;
    for (size_t b = 0; b < p->n_blocks; b++) {
        const struct imp__block *block = &p->blocks[b];
        const struct imp__cells fine = cells_of(p, b),
                                coarse = imp__cells_coarse(&fine, level_of(l, b));
        end += imp__cells_count(&coarse);
        l->spans[b] = (struct imp__span){.end = end, .lo = block->lo, .hi = block->hi};
        imp__fit_span_scale(block, x, &l->spans[b]);
    }
    l->n = end;
}

/* One level, from x to x. *before: the search of the level before, whose history goes on;
 * NULL: none. */
static enum imp_status level_run(struct level *l, const struct imp__opt_options *options,
                                 double *x, struct imp__search **before)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = l->fit->problem->ctx;
    struct imp__search *s = NULL;
    double *c;
    spans_make(l, x);
    c = imp__alloc_raw(ctx, l->n, sizeof *c);
    if (!c) return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu variables", l->n);
    blocks_map(l, imp__cells_average, false, x, c);
    const struct imp__goal goal = {.ctx = ctx,
                                   .n = l->n,
                                   .spans = l->spans,
                                   .n_spans = l->fit->problem->n_blocks,
                                   .seed = l->fit->goal.seed,
                                   .eval = eval,
                                   .iterated = iterated,
                                   .payload = l};
    IMP_TRY(imp__search_create(&goal, IMP_ADAM, options, c, &s));
    if (*before) imp__search_take_history(s, *before);
    imp__search_destroy(*before);
    *before = s;
    l->fit->search = s;
    st = imp__optimize(&goal, options, s);
    if (st != IMP_OK && st != IMP_CANCELLED) goto out;
    imp__search_settle(s);
    blocks_map(l, imp__cells_prolong, true, s->x, x);
out:
    imp__release(ctx, c);
    return st;
}

enum imp_status imp__fit_levels(struct imp__fit *fit,
                                const struct imp__opt_options *options,
                                struct imp__search *fine)
{
    enum imp_status st = IMP_OK;
    const struct imp_problem *p = fit->problem;
    const char *checkpoint = fit->options.checkpoint;
    const int levels = fit->options.levels;
    struct imp__search *s = NULL;
    struct level l = {.fit = fit,
                      .x = imp__alloc_raw(p->ctx, p->n, sizeof *l.x),
                      .g = imp__alloc_raw(p->ctx, p->n, sizeof *l.g),
                      .spans = imp__alloc(p->ctx, p->n_blocks, sizeof *l.spans)};
    double *x = imp__alloc_raw(p->ctx, p->n, sizeof *x);
    if (!l.x || !l.g || !l.spans || !x)
        IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for %zu variables", p->n));
    memcpy(x, fine->x, p->n * sizeof *x);
    fit->options.checkpoint = NULL; /* a checkpoint holds the finest search */
    for (int k = 1; k < levels && st == IMP_OK; k++) {
        struct imp__opt_options o = *options;
        o.max_iterations = (int)((int64_t)options->max_iterations * k / levels);
        l.level = levels - k;
        if (o.max_iterations > 0) st = level_run(&l, &o, x, &s);
    }
    if (st != IMP_OK && st != IMP_CANCELLED) goto out;
    imp__search_move(&fit->goal, fine, x);
    if (s) {
        imp__search_take_history(fine, s);
        fine->history_x = l.trail, fine->cap_history_x = l.cap_trail;
        l.trail = NULL;
    }
out:
    fit->options.checkpoint = checkpoint;
    fit->search = NULL;
    imp__search_destroy(s);
    imp__release(p->ctx, x);
    imp__release(p->ctx, l.x);
    imp__release(p->ctx, l.g);
    imp__release(p->ctx, l.spans);
    imp__release(p->ctx, l.trail);
    return st;
}

enum imp_status imp__fit_levels_allowed(const struct imp_problem *p,
                                        const struct imp_fit_options *o)
{
    bool cells = false;
    const char *list = NULL; /* name of one that is active */
    if (o->levels < 0 || o->levels > 16)
        return imp__error(p->ctx, IMP_E_ARG, "levels = %d is outside [0, 16]", o->levels);
    if (o->levels < 2) return IMP_OK;
    if (imp__problem_moves(p)) return imp__fit_blurs_allowed(p, o);
    for (size_t b = 0; b < p->n_blocks; b++) {
        const struct imp_param_info *info = &p->scene->params[p->blocks[b].param].info;
        cells |= are_many(p, b);
        if (info->flags & IMP_PARAM_LIST) list = info->name;
    }
    if (o->optimizer != IMP_ADAM)
        return imp__error(p->ctx, IMP_E_ARG,
                          "levels from coarse to fine are Adam's: no other optimiser has "
                          "them");
    if (!cells && list)
        return imp__error(p->ctx, IMP_E_ARG,
                          "levels need a texture or a volume: '%s' is a list of numbers "
                          "without neighbours",
                          list);
    if (!cells)
        return imp__error(p->ctx, IMP_E_ARG,
                          "levels need a texture or a volume: nothing that is active has "
                          "cells");
    return IMP_OK;
}
