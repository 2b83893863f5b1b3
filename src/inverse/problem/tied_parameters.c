/* SPDX-License-Identifier: Apache-2.0
 *
 * Ties: values of several parameters that are one component of x, common factors, and
 * logarithms. Walks add the derivative with respect to each value, times dv/dx, to its
 * component of x (imp__active_at, imp__active_slope), so standard errors and covariances
 * of x are as valid as without ties. */
#include "base/arguments.h"
#include "match.h"
#include "math/hash.h"
#include "problem.h"
#include "scene/pose.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

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
        if (imp__tie_of(p, k, t->kind == IMP_TIE_LOG) >= 0)
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

/* Sets tied values to those of the first parameter: all of them, or none where something cannot be so
 * placed. */
static enum imp_status made_equal(imp_problem *p, const struct imp__param_tie *t)
{
    struct imp_scene *s = p->scene;
    double *before = imp__alloc(p->ctx, imp_max(s->n_theta, (size_t)1), sizeof *before);
    if (!before) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for a tie");
    imp_scene_get_theta(s, before);
    size_t first = 0;
    while (!t->on[first]) first++;
    const struct imp__block *b = imp__problem_block(p, (size_t)p->active.base[first]);
    for (size_t k = s->n_params; k-- > first;) { /* the source comes last */
        struct imp_param *q = &s->params[k];
        for (size_t e = 0; t->on[k] && e < q->info.count; e++)
            imp__param_set(q, e,
                           imp_clamp(imp__param_get(&s->params[first], e),
                                     b->log ? exp(b->lo) : b->lo,
                                     b->log ? exp(b->hi) : b->hi));
    }
    imp__theta_announce(s);
    enum imp_status st = imp__poses_settle(s);
    if (st != IMP_OK) {
        for (size_t k = 0; k < s->n_params; k++)
            for (size_t e = 0; t->on[k] && e < s->params[k].info.count; e++)
                imp__param_set(&s->params[k], e, before[s->params[k].info.offset + e]);
        imp__theta_announce(s);
        const enum imp_status back = imp__poses_settle(s);
        if (back != IMP_OK) st = back;
    }
    imp__release(p->ctx, before);
    return st;
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
    if (st == IMP_OK && kind == IMP_TIE_SAME) st = made_equal(p, &t);
    if (st == IMP_OK) return IMP_OK;
    p->n_ties--;
    const enum imp_status back = imp__problem_layout(p, p->chosen);
    if (back != IMP_OK) st = back;
out:
    tie_free(p->ctx, &t);
    return st;
}

enum imp_status imp_problem_get_tie(const imp_problem *p, size_t i,
                                    struct imp_tie_info *info)
{
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, info, "info");
    if (i >= p->n)
        return imp__error(p->ctx, IMP_E_ARG,
                          "there is no active number %zu (there are %zu)", i, p->n);
    const struct imp__block *b = imp__problem_block(p, i);
    const struct imp__param_tie *tie = imp__block_tie(p, b);
    const struct imp_tie_info all = {
        .size = sizeof all,
        .name = imp__block_name(p, b),
        .factor = imp__block_factor(p, b),
        .log = b->log,
        .count = b->count,
        .n_members = tie ? tie->n_members : 1,
        .members = tie ? tie->members : &p->scene->params[b->param].info.name};
    IMP_GIVE(p->ctx, info, all, "info");
    return IMP_OK;
}

uint64_t imp__ties_hash(const struct imp_problem *p, uint64_t hash)
{
    hash = imp__hash(hash, &p->n_ties, sizeof p->n_ties);
    for (size_t i = 0; i < p->n_ties; i++) {
        const struct imp__param_tie *t = &p->ties[i];
        const int kind[2] = {t->kind, t->origin != NULL};
        hash = imp__hash(hash, kind, sizeof kind);
        hash = imp__hash(hash, t->on, p->scene->n_params);
        hash = imp__hash(hash, t->origin,
                         t->origin ? p->scene->n_theta * sizeof *t->origin : 0);
    }
    if (p->held) hash = imp__hash(hash, p->held, p->scene->n_theta);
    return hash;
}

enum imp_status imp__ties_equal_only(const struct imp_problem *p, const char *what)
{
    IMP_CHECKED(imp__holds_none(p, what));
    for (size_t i = 0; i < p->n_ties; i++)
        if (p->ties[i].kind != IMP_TIE_SAME)
            return imp__error(
                p->ctx, IMP_E_UNSUPPORTED,
                "%s takes numbers that are equal, but no common factors and "
                "no logarithms",
                what);
    return IMP_OK;
}
