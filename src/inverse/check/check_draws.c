/* SPDX-License-Identifier: Apache-2.0
 *
 * The loop of rows that draw: how many pairs, in what time, and what follows from them. */
#include "check_draws.h"
#include "base/team.h"
#include "math/rng.h"
#include <math.h>
#include <string.h>

#define PER_ITEM 512
#define FIRST    8192 /* pairs of the first look */
#define LOOKS    10   /* at most */
#define GROWS    2.0  /* pairs of a look over all those before it, at most */
#define Z_LOOK   3.5  /* of a part: it is measured again */
#define Z_LIMIT  4.5  /* and is wrong beyond this */
/* Parts that fewer pairs than this have reached are not judged: their sums are not normal. */
#define REACHED 100
/* Nor are parts that are less than this of everything. */
#define SMALL 1e-4

struct imp__part_answer imp__compared_part(const struct imp__compared *c, int part,
                                           double slack)
{
    struct imp__part_answer a = {.sees = INFINITY};
    const double drawn = c->part[part].drawn, claimed = c->part[part].claimed,
                 square = c->part[part].square, n = c->n;
    if (!(n > 1) || !(drawn + claimed > 0)) return a;
    const double off = (drawn - claimed) / n, size = fmax(drawn, claimed) / n;
    if (size * n < SMALL * fmax(c->part[0].drawn, c->part[0].claimed)) return a;
    a.drawn = drawn / n;
    a.claimed = claimed / n;
    a.se = sqrt(fmax(square / n - off * off, 0) / (n - 1));
    a.se = hypot(a.se, 1e-9 * size);
    /* Pairs that are not 0, as if all of these were alike. */
    const double reached = square > 0 ? imp__sqr(drawn + claimed) / square : n;
    if (reached < REACHED) return a;
    a.z = copysign(fmax(fabs(off) - slack * size, 0), off) / a.se;
    a.sees = (IMP_DRAW_SEEN * a.se + slack * size) / size;
    return a;
}

/* ---- Drawing ----------------------------------------------------------------------- */

struct draw_job {
    const struct imp__draw_row *row;
    uint64_t seed;
    int64_t first, n;
    struct imp__compared *item; /* [items] */
};

static enum imp_status draw_work(size_t item, int worker, int slot, void *payload)
{
    const struct draw_job *j = payload;
    struct imp__compared *c = &j->item[item];
    (void)worker, (void)slot;
    memset(c, 0, sizeof *c);
    const int64_t from = (int64_t)item * PER_ITEM, to = imp_min(from + PER_ITEM, j->n);
    for (int64_t i = from; i < to; i++) {
        struct imp__pair p;
        p.touched = 0;
        j->row->pair(j->row->payload, j->seed, j->first + i, &p);
        for (uint32_t left = p.touched; left; left &= left - 1) {
            const int k = __builtin_ctz(left);
            c->part[k].drawn += p.drawn[k];
            c->part[k].claimed += p.claimed[k];
            c->part[k].square += imp__sqr(p.drawn[k] - p.claimed[k]);
        }
    }
    c->n = (double)(to - from);
    return IMP_OK;
}

/* Pairs [first, first + n) are added to *sum, in the order of their numbers. */
static enum imp_status draw(const struct imp__draw_list *l,
                            const struct imp__draw_row *row, uint64_t seed, int64_t first,
                            int64_t n, struct imp__compared *sum)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = l->check->ctx;
    const size_t items = (size_t)((n + PER_ITEM - 1) / PER_ITEM);
    struct draw_job j = {row, seed, first, n, imp__alloc(ctx, items, sizeof *j.item)};
    if (!j.item) return imp__error(ctx, IMP_E_NOMEM, "no memory for a check");
    const struct imp_loop loop = {.n_items = items, .work = draw_work, .payload = &j};
    IMP_TRY(imp__parallel(ctx, &loop, NULL));
    for (size_t i = 0; i < items; i++) {
        sum->n += j.item[i].n;
        for (int k = 0; k < IMP_DRAW_PARTS; k++) {
            sum->part[k].drawn += j.item[i].part[k].drawn;
            sum->part[k].claimed += j.item[i].part[k].claimed;
            sum->part[k].square += j.item[i].part[k].square;
        }
    }
out:
    imp__release(ctx, j.item);
    return st;
}

/* The part that is farthest off. */
static int worst_part(const struct imp__compared *c, double slack)
{
    int worst = 0;
    double most = -1;
    for (int k = 0; k < IMP_DRAW_PARTS; k++) {
        const double z = fabs(imp__compared_part(c, k, slack).z);
        if (z > most) most = z, worst = k;
    }
    return worst;
}

/* Parts in which a density is wrong: with twice as many new pairs the same part is off
 * again. *part: which. */
static enum imp_status confirm(const struct imp__draw_list *l,
                               const struct imp__draw_row *row, uint64_t seed,
                               const struct imp__compared *first, bool *wrong, int *part,
                               struct imp__compared *again)
{
    enum imp_status st = IMP_OK;
    *wrong = false;
    *again = (struct imp__compared){0};
    IMP_TRY(draw(l, row, imp__mix64(seed ^ 0x2545f4914f6cdd1d), 0, 2 * (int64_t)first->n,
                 again));
    for (int k = 0; k < IMP_DRAW_PARTS; k++) {
        const double a = imp__compared_part(first, k, row->slack).z,
                     b = imp__compared_part(again, k, row->slack).z;
        if (fabs(a) > Z_LOOK && fabs(b) > Z_LIMIT && a * b > 0 && !*wrong)
            *wrong = true, *part = k;
    }
out:
    return st;
}

/* ---- Rows ---------------------------------------------------------------------------- */

/* Pairs of the next look: so many that the row would see what it wants to. 0: it does. */
static int64_t pairs_next(const struct imp__compared *c, double sees)
{
    if (sees <= IMP_DRAW_WANTED) return 0;
    const double more =
        isfinite(sees) ? 1.1 * imp__sqr(sees / IMP_DRAW_WANTED) - 1 : GROWS;
    return (int64_t)(c->n * imp_clamp(more, 0.25, GROWS));
}

/* One row, in at most left_s seconds. */
static enum imp_status row_draw(const struct imp__draw_list *l, size_t k, double left_s)
{
    enum imp_status st = IMP_OK;
    struct imp__check *check = l->check;
    const struct imp__draw_row *row = &l->row[k];
    const uint64_t seed = imp__mix64(check->outer.seed ^ (0xd5a7 + 0x10000 * k));
    const double start = imp__now();
    struct imp__compared c = {0}, again;
    struct imp__part_answer whole = {0};
    bool wrong = false;
    int part = 0;
    int64_t more = FIRST;
    for (int look = 0; look < LOOKS && more > 0 && !wrong; look++) {
        IMP_TRY(draw(l, row, seed, (int64_t)c.n, more, &c));
        const int worst = worst_part(&c, row->slack);
        if (fabs(imp__compared_part(&c, worst, row->slack).z) > Z_LOOK)
            IMP_TRY(confirm(l, row, seed + (uint64_t)look, &c, &wrong, &part, &again));
        whole = imp__compared_part(&c, 0, row->slack);
        more = pairs_next(&c, whole.sees);
        const double used = imp__now() - start;
        bool over = used * (1 + (double)more / c.n) > left_s;
        IMP_TRY(imp__team_any(check->ctx, over, &over));
        if (over) more = 0;
        IMP_TRY(imp__check_progress(check, 0));
    }
    const struct imp__part_answer a =
        wrong ? imp__compared_part(&again, part, row->slack) : whole;
    const struct imp_check_row out = {.value = a.drawn,
                                      .reference = a.claimed,
                                      .se = a.se,
                                      .error = fabs(a.z),
                                      .limit = Z_LIMIT,
                                      .sees = isfinite(whole.sees) ? whole.sees : 1,
                                      .ok = wrong ? IMP_VERDICT_WRONG
                                            : whole.sees <= IMP_DRAW_WANTED
                                                ? IMP_VERDICT_RIGHT
                                                : IMP_VERDICT_OPEN};
    st = imp__check_row(check, row->method, row->name, -1, &out);
out:
    return st;
}

enum imp_status imp__draw_add(struct imp__draw_list *l, const struct imp__draw_row *row)
{
    if (!imp__check_wants(l->check, row->method)) return IMP_OK;
    struct imp__draw_row *grown =
        imp__grow(l->check->ctx, l->row, &l->cap, l->n + 1, sizeof *grown);
    if (!grown) return imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check");
    l->row = grown;
    l->row[l->n++] = *row;
    return IMP_OK;
}

/* What a row leaves of its share, those behind it have. */
enum imp_status imp__draw_all(struct imp__draw_list *l)
{
    enum imp_status st = IMP_OK;
    const double start = imp__now();
    for (size_t k = 0; k < l->n; k++) {
        const double left = l->check->options.draws_s - (imp__now() - start);
        IMP_TRY(row_draw(l, k, fmax(left, 0) / (double)(l->n - k)));
    }
out:
    return st;
}
