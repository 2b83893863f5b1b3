/* SPDX-License-Identifier: Apache-2.0
 *
 * Blocks of x: which numbers of the scene a number of x sets, between which bounds, and
 * how it is moved there and back. */
#include "math/hash.h"
#include "problem.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- From x to the scene and back ---------------------------------------------- */

const struct imp__block *imp__problem_block(const struct imp_problem *p, size_t i)
{
    /* The last block that begins at i or before. Blocks without values share their place
     * with the next, and come before it. */
    size_t at = 0, end = p->n_blocks;
    while (end - at > 1) {
        const size_t middle = at + (end - at) / 2;
        if (p->blocks[middle].first <= i) at = middle;
        else end = middle;
    }
    return &p->blocks[at];
}

const char *imp__block_name(const struct imp_problem *p, const struct imp__block *b)
{
    return imp__block_factor(p, b) ? imp__block_tie(p, b)->name
                                   : p->scene->params[b->param].info.name;
}

double imp__block_get(const struct imp_problem *p, const struct imp__block *b, size_t e)
{
    const struct imp_param *q = &p->scene->params[b->param];
    double v;
    if (b->tie < 0 && !b->log) return imp__param_get(q, e);
    if (imp__block_factor(p, b)) {
        /* From the largest value that the factor multiplies: its relative rounding is
         * least. */
        const double *origin = imp__block_tie(p, b)->origin + q->info.offset;
        size_t most = 0;
        for (size_t i = 1; i < q->info.count; i++)
            if (fabs(origin[i]) > fabs(origin[most])) most = i;
        v = imp__param_get(q, most) / origin[most];
    } else {
        v = imp__param_get(q, e);
    }
    return b->log ? imp_clamp(log(v), b->lo, b->hi) : imp_clamp(v, b->lo, b->hi);
}

void imp__tied_set(const struct imp_active *active, struct imp_param *param, size_t k,
                   const double *x)
{
    const struct imp_tied *tied = active->tied ? &active->tied[k] : NULL;
    const double *from = x + active->base[k];
    const bool plain = !tied || !(tied->factor || tied->log);
    for (size_t e = 0; e < param->info.count; e++) {
        if (tied && tied->held && tied->held[e]) continue;
        if (plain) {
            imp__param_set(param, e, from[e]);
            continue;
        }
        const double value = from[tied->factor ? 0 : e];
        const double v =
            (tied->factor ? tied->factor[e] : 1) * (tied->log ? exp(value) : value);
        imp__param_set(param, e, imp_clamp(v, param->info.lo, param->info.hi));
    }
}

/* ---- Layout -------------------------------------------------------------------- */

int imp__tie_of(const struct imp_problem *p, size_t k, bool log)
{
    for (size_t i = 0; i < p->n_ties; i++)
        if (p->ties[i].on[k] && (p->ties[i].kind == IMP_TIE_LOG) == log) return (int)i;
    return -1;
}

/* The bounds of a parameter's values, as bounds of x. */
static void narrow(const struct imp_problem *p, const struct imp__param_tie *tie,
                   size_t k, struct imp__block *b)
{
    const struct imp_param_info *info = &p->scene->params[k].info;
    const size_t n = tie && tie->kind == IMP_TIE_FACTOR ? info->count : 1;
    for (size_t e = 0; e < n; e++) {
        double lo = info->lo, hi = info->hi;
        if (tie && tie->kind == IMP_TIE_FACTOR) {
            const double origin = tie->origin[info->offset + e];
            if (origin == 0) continue;
            lo = (origin > 0 ? info->lo : info->hi) / origin;
            hi = (origin > 0 ? info->hi : info->lo) / origin;
        }
        b->lo = fmax(b->lo, lo);
        b->hi = fmin(b->hi, hi);
    }
}

/* Without walks through fields of indices, which have a chain rule of their own. */
static bool in_body(const struct imp_scene *s, size_t k)
{
    for (int m = 0; m < s->n_bodies; m++)
        for (int i = 0; i < s->bodies[m]->n_numbers; i++)
            if (s->bodies[m]->numbers[i].param == (int)k) return true;
    return false;
}

static enum imp_status block_finish(const struct imp_problem *p, struct imp__block *b)
{
    if (!b->log) return IMP_OK;
    if (!(b->hi > 0))
        return imp__error(p->ctx, IMP_E_ARG, "%s has no logarithm: it is at most %g",
                          imp__block_name(p, b), b->hi);
    const double least = fmax(b->lo, DBL_MIN);
    for (size_t e = 0; e < b->count; e++) {
        const double v =
            imp__block_factor(p, b) ? 1 : imp__param_get(&p->scene->params[b->param], e);
        if (!(v > 0))
            return imp__error(p->ctx, IMP_E_ARG, "%s[%zu] = %g has no logarithm",
                              imp__block_name(p, b), e, v);
    }
    b->lo = log(least);
    b->hi = b->hi < DBL_MAX ? log(b->hi) : log(DBL_MAX);
    return IMP_OK;
}

enum imp_status imp__problem_layout(struct imp_problem *p, const uint8_t *chosen)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *s = p->scene;
    const size_t room = imp_max(s->n_params, (size_t)1);
    struct imp_active active = {0};
    struct imp__block *blocks = imp__alloc(p->ctx, room, sizeof *blocks);
    size_t n_blocks = 0, n = 0;

    if (!blocks)
        IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for active parameters"));
    IMP_TRY(imp__active_create(s, chosen, &active));
    if (p->n_ties > 0 || p->held) {
        active.tied = imp__alloc(p->ctx, room, sizeof *active.tied);
        if (!active.tied)
            IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for active parameters"));
    }
    for (size_t k = 0; k < s->n_params; k++) {
        if (!chosen[k]) continue;
        const int index = imp__tie_of(p, k, false);
        const struct imp__param_tie *tie = index < 0 ? NULL : &p->ties[index];
        const bool log = imp__tie_of(p, k, true) >= 0;
        struct imp__block *b = NULL;
        for (size_t i = 0; tie && i < n_blocks; i++)
            if (blocks[i].tie == index) b = &blocks[i];
        if (!b) {
            b = &blocks[n_blocks++];
            *b = (struct imp__block){
                .param = k,
                .first = n,
                .count = tie && tie->kind == IMP_TIE_FACTOR ? 1 : s->params[k].info.count,
                .lo = -INFINITY,
                .hi = INFINITY,
                .log = log,
                .tie = index};
            n += b->count;
        }
        if (log != b->log)
            IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                               "%s and %s are tied: both have logarithms, or none",
                               s->params[b->param].info.name, s->params[k].info.name));
        narrow(p, tie, k, b);
        if (b->lo > b->hi)
            IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                               "no number is within the bounds of all that %s is tied to",
                               s->params[k].info.name));
        active.base[k] = (int64_t)b->first;
        if (imp__param_held(p, k)) {
            active.tied[k] = (struct imp_tied){
                .param = &s->params[k], .held = p->held + s->params[k].info.offset};
            if (tie || log)
                IMP_TRY(imp__error(p->ctx, IMP_E_ARG,
                                   "%s has numbers that are held: it cannot be tied",
                                   s->params[k].info.name));
            if (in_body(s, k))
                IMP_TRY(imp__error(p->ctx, IMP_E_UNSUPPORTED,
                                   "%s: numbers of a field of indices cannot be held",
                                   s->params[k].info.name));
            continue;
        }
        if (!active.tied || (!log && !(tie && tie->kind == IMP_TIE_FACTOR))) continue;
        if (in_body(s, k))
            IMP_TRY(imp__error(p->ctx, IMP_E_UNSUPPORTED,
                               "%s: numbers of a field of indices can be tied to be "
                               "equal, but have no common factor and no logarithm",
                               s->params[k].info.name));
        active.tied[k] =
            (struct imp_tied){.param = &s->params[k],
                              .factor = tie && tie->kind == IMP_TIE_FACTOR
                                            ? tie->origin + s->params[k].info.offset
                                            : NULL,
                              .log = log};
    }
    for (size_t i = 0; i < n_blocks; i++) IMP_TRY(block_finish(p, &blocks[i]));
    active.n = n;
    imp__active_destroy(p->ctx, &p->active);
    p->active = active;
    p->n = n;
    memmove(p->chosen, chosen, s->n_params);
    imp__release(p->ctx, p->blocks);
    p->blocks = blocks;
    p->n_blocks = n_blocks;
    p->same_known = false;
    return IMP_OK;
out:
    imp__active_destroy(p->ctx, &active);
    imp__release(p->ctx, blocks);
    return st;
}
