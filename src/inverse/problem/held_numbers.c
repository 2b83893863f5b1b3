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

enum imp_status imp__held_read(imp_context *ctx, const char *text, size_t n,
                               struct imp__held *out)
{
    char *end, *open;
    *out = (struct imp__held){.first = 0, .last = SIZE_MAX};
    if (n == 0 || n >= sizeof out->glob)
        return imp__error(ctx, IMP_E_ARG,
                          n ? "'%.80s..': a name has at most 255 bytes"
                            : "hold '%s': a name is empty",
                          text);
    memcpy(out->glob, text, n);
    out->glob[n] = 0;
    open = strrchr(out->glob, '[');
    if (!open) return IMP_OK;
    if (open != out->glob && open[1] >= '0' && open[1] <= '9') {
        out->first = out->last = strtoul(open + 1, &end, 10);
        if (*end == '-' && end[1] >= '0' && end[1] <= '9')
            out->last = strtoul(end + 1, &end, 10);
        if (!strcmp(end, "]") && out->first <= out->last) {
            *open = 0;
            return IMP_OK;
        }
    }
    return imp__error(ctx, IMP_E_ARG, "'%s': expected NAME, NAME[i] or NAME[i-j]",
                      out->glob);
}

enum imp_status imp__held_mark(imp_context *ctx, const struct imp__held *item,
                               const struct imp_param_info *info, uint8_t *held)
{
    const size_t last = item->last == SIZE_MAX ? info->count - 1 : item->last;
    if (last >= info->count)
        return imp__error(ctx, IMP_E_ARG, "%s has no number %zu: it has %zu", info->name,
                          last, info->count);
    memset(held + info->offset + item->first, 1, last - item->first + 1);
    return IMP_OK;
}

static enum imp_status item_hold(const struct imp_problem *p, const char *text, size_t n,
                                 uint8_t *held)
{
    const struct imp_scene *s = p->scene;
    struct imp__held item;
    bool met = false;
    IMP_CHECKED(imp__held_read(p->ctx, text, n, &item));
    for (size_t k = 0; k < s->n_params; k++) {
        const struct imp_param_info *info = &s->params[k].info;
        if (!p->chosen[k] || !imp__glob(item.glob, info->name)) continue;
        met = true;
        IMP_CHECKED(imp__held_mark(p->ctx, &item, info, held));
    }
    if (met) return IMP_OK;
    return imp__error(p->ctx, IMP_E_ARG, "no active parameter matches '%s'", item.glob);
}

/* Hold what `held` [n_theta] marks, and nothing else; it belongs to the problem if all is well. */
static enum imp_status held_take(struct imp_problem *p, uint8_t *held)
{
    uint8_t *before = p->held;
    p->held = held;
    const enum imp_status st = imp__problem_layout(p, p->chosen);
    if (st != IMP_OK) p->held = before;
    else imp__release(p->ctx, before);
    return st;
}

static uint8_t *held_copy(const struct imp_problem *p, const uint8_t *held)
{
    uint8_t *copy = imp__alloc(p->ctx, p->scene->n_theta + 1, 1);
    if (copy && held) memcpy(copy, held, p->scene->n_theta);
    return copy;
}

enum imp_status imp__problem_hold_marked(struct imp_problem *p, const uint8_t *held)
{
    uint8_t *own = held_copy(p, held);
    if (!own) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for held numbers");
    const enum imp_status st = held_take(p, own);
    if (st != IMP_OK) imp__release(p->ctx, own);
    return st;
}

enum imp_status imp_problem_hold(imp_problem *p, const char *glob)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, p, "problem");
    IMP_REQUIRE(p->ctx, glob, "glob");
    uint8_t *held = held_copy(p, p->held);
    if (!held) return imp__error(p->ctx, IMP_E_NOMEM, "no memory for held numbers");
    for (const char *from = glob;; from += strcspn(from, ",") + 1) {
        const size_t length = strcspn(from, ",");
        IMP_TRY(item_hold(p, from, length, held));
        if (!from[length]) break;
    }
    IMP_TRY(held_take(p, held));
    return IMP_OK;
out:
    imp__release(p->ctx, held);
    return st;
}
