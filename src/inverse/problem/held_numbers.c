/* SPDX-License-Identifier: Apache-2.0
 *
 * Single numbers of active parameters that stay as they are. They keep their places in x: walks
 * add nothing to their derivatives (imp__active_slope is 0), and a search has both bounds at
 * their values. */
#include "base/arguments.h"
#include "match.h"
#include "problem.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool imp__param_held(const struct imp_problem *p, size_t k)
{
    const struct imp_param_info *info = &p->scene->params[k].info;
    return p->held && memchr(p->held + info->offset, 1, info->count) != NULL;
}

bool imp__block_held(const struct imp_problem *p, const struct imp__block *b, size_t e)
{
    return p->held && b->tie < 0 && p->held[p->scene->params[b->param].info.offset + e];
}

size_t imp__held_count(const struct imp_problem *p)
{
    size_t n = 0;
    for (size_t k = 0; p->held && k < p->n_blocks; k++)
        for (size_t e = 0; e < p->blocks[k].count; e++)
            n += imp__block_held(p, &p->blocks[k], e);
    return n;
}

struct imp__bounds imp__block_bounds(const struct imp_problem *p,
                                     const struct imp__block *b, size_t e)
{
    if (!imp__block_held(p, b, e)) return (struct imp__bounds){b->lo, b->hi};
    const double v = imp__block_get(p, b, e);
    return (struct imp__bounds){v, v};
}

enum imp_status imp__holds_none(const struct imp_problem *p, const char *what)
{
    if (imp__held_count(p) == 0) return IMP_OK;
    return imp__error(p->ctx, IMP_E_UNSUPPORTED, "%s holds no single numbers", what);
}

/* ---- Holding ------------------------------------------------------------------------ */

/* "GLOB[i]" or "GLOB[i-j]", of length n: its glob, and the indices. */
static bool item_read(const char *text, size_t n, char glob[256], size_t index[2])
{
    char own[256], *end;
    if (n >= sizeof own) return false;
    memcpy(own, text, n);
    own[n] = 0;
    char *open = strrchr(own, '[');
    if (!open || open == own || open[1] < '0' || open[1] > '9') return false;
    index[0] = index[1] = strtoul(open + 1, &end, 10);
    if (*end == '-' && end[1] >= '0' && end[1] <= '9')
        index[1] = strtoul(end + 1, &end, 10);
    if (strcmp(end, "]") != 0 || index[1] < index[0]) return false;
    *open = 0;
    memcpy(glob, own, sizeof own);
    return true;
}

static enum imp_status item_hold(const struct imp_problem *p, const char *text, size_t n,
                                 uint8_t *held)
{
    const struct imp_scene *s = p->scene;
    char glob[256];
    size_t index[2];
    bool met = false;
    if (!item_read(text, n, glob, index))
        return imp__error(p->ctx, IMP_E_ARG,
                          "'%.*s' holds nothing: expected NAME[i] or NAME[i-j]",
                          (int)imp_min(n, (size_t)200), text);
    for (size_t k = 0; k < s->n_params; k++) {
        const struct imp_param_info *info = &s->params[k].info;
        if (!p->chosen[k] || !imp__glob(glob, info->name)) continue;
        met = true;
        if (index[1] >= info->count)
            return imp__error(p->ctx, IMP_E_ARG, "%s has no number %zu: it has %zu",
                              info->name, index[1], info->count);
        memset(held + info->offset + index[0], 1, index[1] - index[0] + 1);
    }
    if (met) return IMP_OK;
    return imp__error(p->ctx, IMP_E_ARG, "no active parameter matches '%s'", glob);
}

enum imp_status imp_problem_hold(imp_problem *p, const char *glob)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, glob, "glob");
    const size_t n = p->scene->n_theta;
    uint8_t *before = p->held, *held = imp__alloc(p->ctx, n + 1, 1);
    if (!held) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for held numbers");
    if (before) memcpy(held, before, n);
    for (const char *from = glob;; from += strcspn(from, ",") + 1) {
        const size_t length = strcspn(from, ",");
        IMP_TRY(item_hold(p, from, length, held));
        if (!from[length]) break;
    }
    p->held = held;
    st = imp__problem_layout(p, p->chosen);
    if (st != IMP_OK) {
        p->held = before;
        goto out;
    }
    imp__release(p->ctx, before);
    return IMP_OK;
out:
    imp__release(p->ctx, held);
    return st;
}
