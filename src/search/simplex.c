/* SPDX-License-Identifier: Apache-2.0
 *
 * The dual simplex method on a dense dictionary. */
#include "simplex.h"
#include <math.h>
#include <string.h>

#define FEASIBLE 1e-9 /* of a bound, in rows whose numbers are near 1 */
#define PIVOT    1e-9 /* entries that are smaller are taken as 0 */
#define REBUILT  100  /* pivots after which rounding is wiped out */
#define ROOM     64   /* rows, at first */

static double *row_of(const struct imp__lp *lp, double *rows, size_t i)
{
    return rows + i * (lp->n + 1);
}

enum imp_status imp__lp_create(imp_context *ctx, size_t n, const double *cost,
                               const double *lo, const double *hi, struct imp__lp *out)
{
    *out = (struct imp__lp){.ctx = ctx, .n = n, .cost = cost};
    out->lo = imp__alloc(ctx, 4 * (n + 1), sizeof *out->lo);
    out->nonbasic = imp__alloc(ctx, n + 1, sizeof *out->nonbasic);
    out->upper = imp__alloc(ctx, n + 1, sizeof *out->upper);
    if (!out->lo || !out->nonbasic || !out->upper)
        return imp__error(ctx, IMP_E_NOMEM, "no memory for a linear program");
    out->hi = out->lo + n + 1;
    out->reduced = out->hi + n + 1;
    out->x = out->reduced + n + 1;
    for (size_t j = 0; j < n; j++) {
        out->lo[j] = lo[j];
        out->hi[j] = hi[j];
        out->nonbasic[j] = j;
        out->reduced[j] = cost[j];
        out->upper[j] = cost[j] < 0;
    }
    return IMP_OK;
}

void imp__lp_destroy(struct imp__lp *lp)
{
    if (!lp->ctx) return;
    imp__release(lp->ctx, lp->lo);
    imp__release(lp->ctx, lp->nonbasic);
    imp__release(lp->ctx, lp->upper);
    imp__release(lp->ctx, lp->row);
    imp__release(lp->ctx, lp->tag);
    imp__release(lp->ctx, lp->D);
    imp__release(lp->ctx, lp->value);
    imp__release(lp->ctx, lp->basic);
    imp__release(lp->ctx, lp->dual);
    *lp = (struct imp__lp){0};
}

/* An array with more room, in place of `old`; NULL: no memory, and the old one stays. */
static void *grown(imp_context *ctx, void *old, size_t size, size_t used, size_t room)
{
    void *more = imp__alloc(ctx, room, size);
    if (!more) return NULL;
    if (used) memcpy(more, old, used * size);
    imp__release(ctx, old);
    return more;
}

static enum imp_status room_make(struct imp__lp *lp)
{
    if (lp->m < lp->room) return IMP_OK;
    const size_t room = lp->room ? 2 * lp->room : ROOM, used = lp->m;
    const size_t line = (lp->n + 1) * sizeof(double);
    double *row = grown(lp->ctx, lp->row, line, used, room);
    if (row) lp->row = row;
    double *D = grown(lp->ctx, lp->D, line, used, room);
    if (D) lp->D = D;
    int *tag = grown(lp->ctx, lp->tag, sizeof *tag, used, room);
    if (tag) lp->tag = tag;
    double *value = grown(lp->ctx, lp->value, sizeof *value, used, room);
    if (value) lp->value = value;
    size_t *basic = grown(lp->ctx, lp->basic, sizeof *basic, used, room);
    if (basic) lp->basic = basic;
    double *dual = grown(lp->ctx, lp->dual, sizeof *dual, used, room);
    if (dual) lp->dual = dual;
    if (!row || !D || !tag || !value || !basic || !dual)
        return imp__error(lp->ctx, IMP_E_NOMEM, "no memory for a linear program");
    lp->room = room;
    return IMP_OK;
}

/* A row of the program in terms of the nonbasic variables, into D[at]. */
static void row_express(struct imp__lp *lp, size_t k, size_t at)
{
    const double *a = row_of(lp, lp->row, k);
    double *d = row_of(lp, lp->D, at);
    memset(d, 0, (lp->n + 1) * sizeof *d);
    d[lp->n] = a[lp->n];
    for (size_t j = 0; j < lp->n; j++)
        if (lp->nonbasic[j] < lp->n) d[j] += a[lp->nonbasic[j]];
    for (size_t i = 0; i < lp->m; i++) {
        if (lp->basic[i] >= lp->n || i == at || a[lp->basic[i]] == 0) continue;
        const double *b = row_of(lp, lp->D, i);
        for (size_t j = 0; j <= lp->n; j++) d[j] += a[lp->basic[i]] * b[j];
    }
}

enum imp_status imp__lp_add(struct imp__lp *lp, const double *a, double b, int tag)
{
    const enum imp_status st = room_make(lp);
    if (st != IMP_OK) return st;
    const size_t k = lp->m;
    memcpy(row_of(lp, lp->row, k), a, lp->n * sizeof *a);
    row_of(lp, lp->row, k)[lp->n] = b;
    lp->tag[k] = tag;
    row_express(lp, k, k);
    lp->basic[k] = lp->n + k;
    lp->m++;
    return IMP_OK;
}

/* Basic variable i and nonbasic variable j change places. */
static void pivot(struct imp__lp *lp, size_t i, size_t j)
{
    double *p = row_of(lp, lp->D, i);
    const double inverse = 1 / p[j];
    for (size_t k = 0; k <= lp->n; k++) p[k] *= -inverse;
    p[j] = inverse;
    for (size_t r = 0; r <= lp->m; r++) {
        double *d = r < lp->m ? row_of(lp, lp->D, r) : lp->reduced;
        const double f = d[j];
        if (r == i || f == 0) continue;
        d[j] = 0;
        for (size_t k = 0; k <= lp->n; k++) d[k] += f * p[k];
    }
    const size_t v = lp->basic[i];
    lp->basic[i] = lp->nonbasic[j];
    lp->nonbasic[j] = v;
    lp->pivots++;
}

/* The dictionary of the same basis, made from the rows: at first all slacks are basic, then
 * variables take their places by the largest pivots. */
static enum imp_status rebuild(struct imp__lp *lp)
{
    const size_t n = lp->n, all = n + lp->m;
    bool *basic = imp__alloc(lp->ctx, 2 * all + 2, sizeof *basic),
         *upper = basic + all + 1;
    if (!basic) return imp__error(lp->ctx, IMP_E_NOMEM, "no memory for a linear program");
    for (size_t i = 0; i < lp->m; i++) basic[lp->basic[i]] = true;
    for (size_t j = 0; j < n; j++) upper[lp->nonbasic[j]] = lp->upper[j];
    for (size_t j = 0; j < n; j++) lp->nonbasic[j] = j, lp->reduced[j] = lp->cost[j];
    lp->reduced[n] = 0;
    memcpy(lp->D, lp->row, lp->m * (n + 1) * sizeof *lp->D);
    for (size_t k = 0; k < lp->m; k++) lp->basic[k] = n + k;
    for (
        ;
        ;) { /* the largest entry of a slack that shall leave and a variable that shall enter */
        size_t bi = lp->m, bj = n;
        double most = PIVOT;
        for (size_t i = 0; i < lp->m; i++)
            for (size_t j = 0; j < n && !basic[lp->basic[i]]; j++)
                if (basic[lp->nonbasic[j]] && fabs(row_of(lp, lp->D, i)[j]) > most) {
                    most = fabs(row_of(lp, lp->D, i)[j]);
                    bi = i, bj = j;
                }
        if (bi == lp->m) break;
        pivot(lp, bi, bj);
    }
    for (size_t j = 0; j < n; j++) {
        const size_t v = lp->nonbasic[j];
        /* Where rounding has left another basis, the bound that is dual feasible. */
        lp->upper[j] = basic[v] ? v < n && lp->reduced[j] < 0 : upper[v];
    }
    imp__release(lp->ctx, basic);
    lp->pivots = 0;
    return IMP_OK;
}

enum imp_status imp__lp_purge(struct imp__lp *lp, size_t first, double slack)
{
    size_t kept = first;
    size_t *becomes = imp__alloc(lp->ctx, lp->m + 1, sizeof *becomes);
    if (!becomes)
        return imp__error(lp->ctx, IMP_E_NOMEM, "no memory for a linear program");
    for (size_t k = 0; k < lp->m; k++) becomes[k] = k;
    for (size_t i = 0; i < lp->m; i++)
        if (lp->basic[i] >= lp->n + first && lp->value[i] > slack)
            becomes[lp->basic[i] - lp->n] = SIZE_MAX;
    for (size_t k = first; k < lp->m; k++) {
        if (becomes[k] == SIZE_MAX) continue;
        memmove(row_of(lp, lp->row, kept), row_of(lp, lp->row, k),
                (lp->n + 1) * sizeof *lp->row);
        lp->tag[kept] = lp->tag[k];
        becomes[k] = kept++;
    }
    size_t at = 0;
    for (size_t i = 0; i < lp->m; i++) {
        size_t v = lp->basic[i];
        if (v >= lp->n && becomes[v - lp->n] == SIZE_MAX) continue;
        if (v >= lp->n) v = lp->n + becomes[v - lp->n];
        memmove(row_of(lp, lp->D, at), row_of(lp, lp->D, i), (lp->n + 1) * sizeof *lp->D);
        lp->value[at] = lp->value[i];
        lp->basic[at++] = v;
    }
    for (size_t j = 0; j < lp->n; j++)
        if (lp->nonbasic[j] >= lp->n)
            lp->nonbasic[j] = lp->n + becomes[lp->nonbasic[j] - lp->n];
    lp->m = kept;
    imp__release(lp->ctx, becomes);
    return IMP_OK;
}

static double low(const struct imp__lp *lp, size_t v)
{
    return v < lp->n ? lp->lo[v] : 0;
}
static double high(const struct imp__lp *lp, size_t v)
{
    return v < lp->n ? lp->hi[v] : INFINITY;
}
static double at_bound(const struct imp__lp *lp, size_t j)
{
    const size_t v = lp->nonbasic[j];
    return lp->upper[j] ? high(lp, v) : low(lp, v);
}

static void values_find(struct imp__lp *lp)
{
    for (size_t j = 0; j < lp->n; j++)
        lp->x[j] = at_bound(lp, j); /* by columns, for now */
    for (size_t i = 0; i < lp->m; i++) {
        const double *d = row_of(lp, lp->D, i);
        double sum = d[lp->n];
        for (size_t j = 0; j < lp->n; j++) sum += d[j] * lp->x[j];
        lp->value[i] = sum;
    }
}

/* The basic variable that is furthest outside of its bounds, with `first` the one of the
 * least number (Bland 1977); lp->m: none is. */
static size_t leaving(const struct imp__lp *lp, bool first, bool *above)
{
    size_t best = lp->m;
    double most = FEASIBLE;
    for (size_t i = 0; i < lp->m; i++) {
        const size_t v = lp->basic[i];
        const double under = low(lp, v) - lp->value[i], over = lp->value[i] - high(lp, v);
        const double off = fmax(under, over);
        if (!(off > (first ? FEASIBLE : most))) continue;
        if (first && best < lp->m && lp->basic[best] < v) continue;
        best = i;
        most = off;
        *above = over > under;
    }
    return best;
}

/* The nonbasic variable whose reduced cost is the first to become 0; of those near it the one of
 * the largest pivot (Harris 1973), with `first` of the least number. lp->n: none. */
static size_t entering(const struct imp__lp *lp, size_t i, bool above, bool first)
{
    const double *d = row_of(lp, lp->D, i);
    double least = INFINITY;
    size_t best = lp->n;
    for (int pass = 0; pass < 2; pass++)
        for (size_t j = 0; j < lp->n; j++) {
            const size_t v = lp->nonbasic[j];
            /* How the basic variable moves when this one leaves its bound. */
            const double move = (lp->upper[j] ? -d[j] : d[j]) * (above ? -1 : 1);
            if (!(move > PIVOT) || !(low(lp, v) < high(lp, v))) continue;
            const double ratio = fabs(lp->reduced[j]) / move;
            if (pass == 0) least = fmin(least, ratio + (first ? 0 : 1e-11 / move));
            else if (ratio <= least &&
                     (best == lp->n ||
                      (first ? v < lp->nonbasic[best] : fabs(d[j]) > fabs(d[best]))))
                best = j;
        }
    return best;
}

static void solution_take(struct imp__lp *lp)
{
    double *x = lp->x; /* holds the nonbasic values by columns */
    for (size_t k = 0; k < lp->m; k++) lp->dual[k] = 0;
    for (size_t j = 0; j < lp->n; j++)
        if (lp->nonbasic[j] >= lp->n)
            lp->dual[lp->nonbasic[j] - lp->n] = fmax(lp->reduced[j], 0);
    for (size_t j = 0; j < lp->n; j++)
        if (lp->nonbasic[j] < lp->n) x[lp->nonbasic[j]] = at_bound(lp, j);
    for (size_t i = 0; i < lp->m; i++)
        if (lp->basic[i] < lp->n)
            x[lp->basic[i]] =
                fmin(fmax(lp->value[i], lp->lo[lp->basic[i]]), lp->hi[lp->basic[i]]);
    lp->objective = 0;
    for (size_t j = 0; j < lp->n; j++) lp->objective += lp->cost[j] * x[j];
}

/* By how much the slacks of the dictionary differ from those of the rows. */
static double drift(const struct imp__lp *lp)
{
    double most = 0;
    for (size_t i = 0; i < lp->m; i++) {
        if (lp->basic[i] < lp->n) continue;
        const double *a = lp->row + (lp->basic[i] - lp->n) * (lp->n + 1);
        double sum = a[lp->n];
        for (size_t j = 0; j < lp->n; j++) sum += a[j] * lp->x[j];
        most = fmax(most, fabs(sum - lp->value[i]));
    }
    return most;
}

enum imp_status imp__lp_solve(struct imp__lp *lp, enum imp__lp_end *end)
{
    const size_t patience = 200 + 4 * (lp->n + lp->m), most = 50 * patience;
    bool fresh = false; /* the dictionary was made anew for the answer that is found */
    /* A variable that was fixed may have a reduced cost of either sign. */
    for (size_t j = 0; j < lp->n; j++)
        if (lp->nonbasic[j] < lp->n && lp->reduced[j] != 0)
            lp->upper[j] = lp->reduced[j] < 0;
    for (size_t round = 0; round < most; round++) {
        bool above = false;
        if (lp->pivots > REBUILT) {
            const enum imp_status st = rebuild(lp);
            if (st != IMP_OK) return st;
        }
        values_find(lp);
        const size_t i = leaving(lp, round > patience, &above);
        const size_t j = i < lp->m ? entering(lp, i, above, round > patience) : 0;
        if (i == lp->m || j == lp->n) {
            if (i == lp->m) solution_take(lp);
            const bool doubt = i == lp->m ? drift(lp) > 1e-8 : lp->pivots > 0;
            if (!doubt || fresh) {
                *end = i == lp->m ? IMP_LP_OPTIMAL : IMP_LP_INFEASIBLE;
                return IMP_OK;
            }
            fresh = true;
            const enum imp_status st = rebuild(lp);
            if (st != IMP_OK) return st;
            continue;
        }
        pivot(lp, i, j);
        lp->upper[j] = above;
    }
    return imp__error(lp->ctx, IMP_E_NUMERIC,
                      "a linear program of %zu variables and %zu rows did not end", lp->n,
                      lp->m);
}
