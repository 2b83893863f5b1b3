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
#define SMALL 1e-3

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
            c->part[k].hits += p.drawn[k] > 0;
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
            sum->part[k].hits += j.item[i].part[k].hits;
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

/* What the row would see: of everything, of the parts that are often drawn, and of those that
 * it wants to see well. */
static double row_sees(const struct imp__compared *c, const struct imp__draw_row *row)
{
    double sees = imp__compared_part(c, 0, row->slack).sees;
    for (int k = 1; k < IMP_DRAW_PARTS; k++) {
        const double part = imp__compared_part(c, k, row->slack).sees;
        if (!isfinite(part)) continue;
        if (row->fine >> k & 1)
            sees = fmax(sees, part * (IMP_DRAW_WANTED / IMP_DRAW_FINE));
        else if (c->part[k].hits >= IMP_DRAW_OFTEN * c->n)
            sees = fmax(sees, part / IMP_DRAW_COARSE);
    }
    return sees;
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

/* A row while it draws. */
struct drawing {
    struct imp__compared c, again;
    double sees, used_s;
    int looks, part;
    int64_t more; /* pairs of the next look */
    bool wrong;
};

/* More looks at a row, in at most left_s seconds. */
static enum imp_status row_draw(const struct imp__draw_list *l, size_t k, double left_s,
                                struct drawing *d)
{
    enum imp_status st = IMP_OK;
    struct imp__check *check = l->check;
    const struct imp__draw_row *row = &l->row[k];
    const uint64_t seed = imp__mix64(check->outer.seed ^ (0xd5a7 + 0x10000 * k));
    const double start = imp__now();
    while (d->looks < LOOKS && d->more > 0 && !d->wrong) {
        const double used = imp__now() - start;
        const double all = d->used_s + used; /* of what has been drawn */
        bool over = d->looks > 0 && used + all * (double)d->more / d->c.n > left_s;
        IMP_TRY(imp__team_any(check->ctx, over, &over));
        if (over) break;
        IMP_TRY(draw(l, row, seed, (int64_t)d->c.n, d->more, &d->c));
        const int worst = worst_part(&d->c, row->slack);
        if (fabs(imp__compared_part(&d->c, worst, row->slack).z) > Z_LOOK)
            IMP_TRY(confirm(l, row, seed + (uint64_t)d->looks, &d->c, &d->wrong, &d->part,
                            &d->again));
        d->looks++;
        d->sees = row_sees(&d->c, row);
        d->more = pairs_next(&d->c, d->sees);
        IMP_TRY(imp__check_progress(check, 0));
    }
    d->used_s += imp__now() - start;
out:
    return st;
}

static enum imp_status row_report(const struct imp__draw_list *l, size_t k,
                                  const struct drawing *d)
{
    const struct imp__draw_row *row = &l->row[k];
    const struct imp__part_answer a =
        imp__compared_part(d->wrong ? &d->again : &d->c, d->part, row->slack);
    const struct imp_check_row out = {.value = a.drawn,
                                      .reference = a.claimed,
                                      .se = a.se,
                                      .error = fabs(a.z),
                                      .limit = Z_LIMIT,
                                      .sees = isfinite(d->sees) ? d->sees : 1,
                                      .ok = d->wrong ? IMP_VERDICT_WRONG
                                            : d->sees <= IMP_DRAW_WANTED
                                                ? IMP_VERDICT_RIGHT
                                                : IMP_VERDICT_OPEN};
    return imp__check_row(l->check, row->method, row->name, -1, &out);
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

static bool unfinished(const struct drawing *d)
{
    return d->more > 0 && d->looks < LOOKS && !d->wrong;
}

/* Each row first has its share of the time; what rows have left, the unfinished ones share
 * then. */
enum imp_status imp__draw_all(struct imp__draw_list *l)
{
    enum imp_status st = IMP_OK;
    const double start = imp__now(), all = l->check->options.draws_s;
    struct drawing *d = imp__alloc(l->check->ctx, l->n + 1, sizeof *d);
    if (!d) return imp__error(l->check->ctx, IMP_E_NOMEM, "no memory for a check");
    for (size_t k = 0; k < l->n; k++)
        d[k] = (struct drawing){.sees = INFINITY, .more = FIRST};
    for (int turn = 0; turn < 2; turn++) {
        size_t left = 0;
        for (size_t k = 0; k < l->n; k++) left += unfinished(&d[k]);
        for (size_t k = 0; k < l->n; k++) {
            if (!unfinished(&d[k])) continue;
            const double rest = fmax(all - (imp__now() - start), 0);
            IMP_TRY(row_draw(l, k, turn == 0 ? all / (double)l->n : rest / (double)left,
                             &d[k]));
            left--;
        }
    }
    for (size_t k = 0; k < l->n; k++) IMP_TRY(row_report(l, k, &d[k]));
out:
    imp__release(l->check->ctx, d);
    return st;
}
