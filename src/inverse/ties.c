/* SPDX-License-Identifier: Apache-2.0
 *
 * Ties: numbers of several parameters that are one number of x, common factors, and
 * logarithms. Walks add what each number is worth to the number of x that it follows
 * (imp__active_at, imp__active_slope), so standard errors and covariances of x hold as
 * they do without ties. */
#include "base/arguments.h"
#include "match.h"
#include "math/hash.h"
#include "problem.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- From x to the scene and back ---------------------------------------------- */

const struct imp__block *imp__problem_block(const struct imp_problem *p, size_t i)
{
    /* The last block that begins at i or before. Blocks of no numbers share their place
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
        /* From the largest number that the factor multiplies: its relative rounding is
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
    const bool plain = !tied || !tied->param;
    for (size_t e = 0; e < param->info.count; e++) {
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

static int tie_of(const struct imp_problem *p, size_t k, bool log)
{
    for (size_t i = 0; i < p->n_ties; i++)
        if (p->ties[i].on[k] && (p->ties[i].kind == IMP_TIE_LOG) == log) return (int)i;
    return -1;
}

/* The bounds of a parameter's numbers, as bounds of x. */
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
    if (p->n_ties > 0) {
        active.tied = imp__alloc(p->ctx, room, sizeof *active.tied);
        if (!active.tied)
            IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for active parameters"));
    }
    for (size_t k = 0; k < s->n_params; k++) {
        if (!chosen[k]) continue;
        const int index = tie_of(p, k, false);
        const struct imp__param_tie *tie = index < 0 ? NULL : &p->ties[index];
        const bool log = tie_of(p, k, true) >= 0;
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

/* ---- Making ties --------------------------------------------------------------- */

static void tie_free(imp_context *ctx, struct imp__param_tie *t)
{
    imp__release(ctx, t->on);
    imp__release(ctx, t->name);
    imp__release(ctx, t->members);
    imp__release(ctx, t->origin);
}

void imp__ties_free(struct imp_problem *p)
{
    for (size_t i = 0; i < p->n_ties; i++) tie_free(p->ctx, &p->ties[i]);
    imp__release(p->ctx, p->ties);
    p->ties = NULL;
    p->n_ties = p->cap_ties = 0;
}

void imp__tie_last_free(struct imp_problem *p)
{
    tie_free(p->ctx, &p->ties[--p->n_ties]);
}

static bool alike(const struct imp_param_info *a, const struct imp_param_info *b)
{
    if (a->count != b->count || a->n_dims != b->n_dims ||
        memcmp(a->dims, b->dims, sizeof a->dims) != 0 ||
        !a->wavelengths_nm != !b->wavelengths_nm)
        return false;
    return !a->wavelengths_nm || memcmp(a->wavelengths_nm, b->wavelengths_nm,
                                        a->count * sizeof *a->wavelengths_nm) == 0;
}

/* "a.*,b.value": any of them. */
static bool matches(const char *globs, const char *name)
{
    char one[256];
    for (const char *from = globs;; from += strcspn(from, ",") + 1) {
        const size_t n = strcspn(from, ",");
        if (n < sizeof one) {
            memcpy(one, from, n);
            one[n] = 0;
            if (imp__glob(one, name)) return true;
        }
        if (!from[n]) return false;
    }
}

static enum imp_status members_find(imp_problem *p, const char *glob,
                                    struct imp__param_tie *t)
{
    const struct imp_scene *s = p->scene;
    size_t first = 0;
    for (size_t k = 0; k < s->n_params; k++) {
        const struct imp_param_info *info = &s->params[k].info;
        if (!p->chosen[k] || !matches(glob, info->name)) continue;
        if (tie_of(p, k, t->kind == IMP_TIE_LOG) >= 0)
            return imp__error(p->ctx, IMP_E_ARG, "%s is tied already", info->name);
        if (t->n_members == 0) first = k;
        if (t->kind == IMP_TIE_SAME && !alike(&s->params[first].info, info))
            return imp__error(p->ctx, IMP_E_ARG,
                              "%s and %s cannot be equal: they have %zu and %zu numbers, "
                              "or other sizes",
                              s->params[first].info.name, info->name,
                              s->params[first].info.count, info->count);
        t->on[k] = 1;
        t->members[t->n_members++] = info->name;
    }
    if (t->n_members == 0)
        return imp__error(p->ctx, IMP_E_ARG, "no active parameter matches '%s'", glob);
    if (t->n_members == 1 && t->kind == IMP_TIE_SAME)
        return imp__error(
            p->ctx, IMP_E_ARG,
            "of the active parameters '%s' matches %s alone, which is equal "
            "to nothing else",
            glob, t->members[0]);
    return IMP_OK;
}

/* Sets tied numbers to the values of the first parameter. */
static void made_equal(imp_problem *p, const struct imp__param_tie *t)
{
    size_t first = 0;
    while (!t->on[first]) first++;
    const struct imp__block *b = imp__problem_block(p, (size_t)p->active.base[first]);
    for (size_t k = p->scene->n_params; k-- > first;) { /* the source comes last */
        struct imp_param *q = &p->scene->params[k];
        for (size_t e = 0; t->on[k] && e < q->info.count; e++)
            imp__param_set(q, e,
                           imp_clamp(imp__param_get(&p->scene->params[first], e),
                                     b->log ? exp(b->lo) : b->lo,
                                     b->log ? exp(b->hi) : b->hi));
    }
    imp__theta_announce(p->scene);
}

static enum imp_status origin_take(imp_problem *p, const char *glob,
                                   struct imp__param_tie *t)
{
    const struct imp_scene *s = p->scene;
    const size_t length = strlen(glob) + 16;
    t->origin = imp__alloc(p->ctx, imp_max(s->n_theta, (size_t)1), sizeof *t->origin);
    t->name = imp__alloc(p->ctx, length, 1);
    if (!t->origin || !t->name)
        return imp__error(p->ctx, IMP_E_NOMEM, "no memory for a tie");
    snprintf(t->name, length, "factor(%s)", glob);
    imp_scene_get_theta(s, t->origin);
    for (size_t k = 0; k < s->n_params; k++) {
        bool some = false;
        for (size_t e = 0; t->on[k] && e < s->params[k].info.count; e++)
            some |= t->origin[s->params[k].info.offset + e] != 0;
        if (t->on[k] && !some)
            return imp__error(p->ctx, IMP_E_ARG,
                              "%s is zero, which no factor changes: set it first",
                              s->params[k].info.name);
    }
    return IMP_OK;
}

enum imp_status imp_problem_tie(imp_problem *p, const char *glob, enum imp_tie kind)
{
    enum imp_status st = IMP_OK;
    struct imp__param_tie t = {.kind = kind};

    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, glob, "glob");
    if ((unsigned)kind > IMP_TIE_LOG)
        return imp__error(p->ctx, IMP_E_ARG, "tie %d does not exist", (int)kind);
    IMP_SETS(p->scene, st);
    if (st != IMP_OK) return st;
    const size_t room = imp_max(p->scene->n_params, (size_t)1);
    t.on = imp__alloc(p->ctx, room, 1);
    t.members = imp__alloc(p->ctx, room, sizeof *t.members);
    struct imp__param_tie *grown =
        imp__grow(p->ctx, p->ties, &p->cap_ties, p->n_ties + 1, sizeof *grown);
    if (grown) p->ties = grown;
    if (!t.on || !t.members || !grown)
        IMP_TRY(imp__error(p->ctx, IMP_E_NOMEM, "no memory for a tie"));
    IMP_TRY(members_find(p, glob, &t));
    if (kind == IMP_TIE_FACTOR) IMP_TRY(origin_take(p, glob, &t));
    p->ties[p->n_ties++] = t;
    st = imp__problem_layout(p, p->chosen);
    if (st != IMP_OK) {
        p->n_ties--;
        goto out;
    }
    if (kind == IMP_TIE_SAME) made_equal(p, &t);
    return IMP_OK;
out:
    tie_free(p->ctx, &t);
    return st;
}

enum imp_status imp_problem_get_tie(const imp_problem *p, size_t i,
                                    struct imp_tie_info *out)
{
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, out, "out");
    if (i >= p->n)
        return imp__error(p->ctx, IMP_E_ARG,
                          "there is no active number %zu (there are %zu)", i, p->n);
    const struct imp__block *b = imp__problem_block(p, i);
    const struct imp__param_tie *tie = imp__block_tie(p, b);
    const struct imp_tie_info info = {
        .size = sizeof info,
        .name = imp__block_name(p, b),
        .factor = imp__block_factor(p, b),
        .log = b->log,
        .count = b->count,
        .n_members = tie ? tie->n_members : 1,
        .members = tie ? tie->members : &p->scene->params[b->param].info.name};
    IMP_GIVE(p->ctx, out, info, "out");
    return IMP_OK;
}

uint64_t imp__ties_hash(const struct imp_problem *p, uint64_t hash)
{
    for (size_t i = 0; i < p->n_ties; i++) {
        const struct imp__param_tie *t = &p->ties[i];
        const int kind = t->kind;
        hash = imp__hash(hash, &kind, sizeof kind);
        hash = imp__hash(hash, t->on, p->scene->n_params);
        if (t->origin)
            hash = imp__hash(hash, t->origin, p->scene->n_theta * sizeof *t->origin);
    }
    return hash;
}

enum imp_status imp__ties_equal_only(const struct imp_problem *p, const char *what)
{
    for (size_t i = 0; i < p->n_ties; i++)
        if (p->ties[i].kind != IMP_TIE_SAME)
            return imp__error(
                p->ctx, IMP_E_UNSUPPORTED,
                "%s knows numbers that are equal, but no common factors and "
                "no logarithms",
                what);
    return IMP_OK;
}
