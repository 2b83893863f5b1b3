/* SPDX-License-Identifier: Apache-2.0
 *
 * Branch and bound over what is used. The variables of the linear programs are the levels x, then
 * u_j = 1 where j is used: least_j u_j <= x_j <= most_j u_j, and the sum of u over a place is at
 * most 1. Branches fix a u_j; the node with the least bound is next, after a dive that follows one
 * branch to its end, so that there is something to compare with early. */
#include "choice.h"
#include "simplex.h"
#include <math.h>
#include <string.h>

#define OFF    1e-7 /* level, and violation of a row, that count as 0 */
#define CUTS   16   /* tangents added at a time, the most violated first */
#define ROUNDS 200  /* of tangents, at a node that is to be an answer */
#define LOOSE  200  /* rows that are not needed, before they are left out */

struct node {
    double bound;
    uint32_t parent; /* UINT32_MAX: the root */
    uint32_t var;
    bool to; /* u_var */
};

struct tree {
    const struct imp__choice *c;
    struct imp__choice_answer *best;
    struct imp__lp lp;
    size_t fixed_rows; /* of the program: those that no tangent is */
    struct node *node; /* [n_nodes] */
    size_t n_nodes, room;
    uint32_t *heap; /* [n_heap] open nodes, by bound; of equal ones the later */
    size_t n_heap;
    double *work; /* [2 n] */
    double *cost; /* [2 n] */
    double *lo, *hi;
    size_t *cut; /* [CUTS] */
    double cut_by[CUTS];
};

double imp__choice_row_at(const struct imp__choice_row *r, size_t n, const double *x)
{
    double g = r->b, v = r->v0, q = 0;
    for (size_t j = 0; j < n; j++) {
        g += r->a[j] * x[j];
        if (r->v) v += r->v[j] * x[j] * x[j];
        if (r->q) q += r->q[j] * x[j] * x[j];
    }
    return g - (r->z > 0 ? r->z * sqrt(v) : 0) - q;
}

/* ---- Tangents ------------------------------------------------------------------------ */

/* With s = sqrt(v0 + sum v x^2) the tangent at x of -z s is -z/s (v0 + sum v_j x_j x), and that of
 * -q x^2 is -2 q x_j x + q x_j^2. */
static enum imp_status tangent_add(struct tree *t, size_t row, const double *x)
{
    const struct imp__choice_row *r = &t->c->rows[row];
    const size_t n = t->c->n;
    double *a = t->work, b = r->b, v = r->v0;
    memset(a, 0, 2 * n * sizeof *a);
    for (size_t j = 0; r->v && j < n; j++) v += r->v[j] * x[j] * x[j];
    const double s = r->z > 0 && v > 0 ? r->z / sqrt(v) : 0;
    b -= s * r->v0;
    for (size_t j = 0; j < n; j++) {
        a[j] = r->a[j];
        if (r->v) a[j] -= s * r->v[j] * x[j];
        if (r->q) {
            a[j] -= 2 * r->q[j] * x[j];
            b += r->q[j] * x[j] * x[j];
        }
    }
    return imp__lp_add(&t->lp, a, b, (int)row);
}

/* Add the tangents of the most violated rows; *n of them. */
static enum imp_status tangents_add(struct tree *t, size_t *n)
{
    const struct imp__choice *c = t->c;
    size_t found = 0;
    for (size_t k = 0; k < c->n_rows; k++) {
        const double g = imp__choice_row_at(&c->rows[k], c->n, t->lp.x);
        if (!(g < -OFF) || (found == CUTS && g >= t->cut_by[CUTS - 1])) continue;
        size_t at = found < CUTS ? found++ : CUTS - 1;
        for (; at > 0 && t->cut_by[at - 1] > g; at--) {
            t->cut_by[at] = t->cut_by[at - 1];
            t->cut[at] = t->cut[at - 1];
        }
        t->cut_by[at] = g;
        t->cut[at] = k;
    }
    for (size_t k = 0; k < found; k++) {
        const enum imp_status st = tangent_add(t, t->cut[k], t->lp.x);
        if (st != IMP_OK) return st;
    }
    *n = found;
    return IMP_OK;
}

/* Solve with all tangents that are needed, or until the bound is above `most`. */
static enum imp_status relax(struct tree *t, double most, bool *feasible)
{
    enum imp_status st = IMP_OK;
    enum imp__lp_end end;
    *feasible = false;
    for (int round = 0; round < ROUNDS; round++) {
        size_t n;
        IMP_TRY(imp__lp_solve(&t->lp, &end));
        if (end == IMP_LP_INFEASIBLE || t->lp.objective > most) return IMP_OK;
        if (t->lp.m > t->fixed_rows + LOOSE + 2 * t->c->n)
            IMP_TRY(imp__lp_purge(&t->lp, t->fixed_rows, 1e-3));
        IMP_TRY(tangents_add(t, &n));
        if (n == 0) {
            *feasible = true;
            return IMP_OK;
        }
    }
    /* A tangent of a violation near OFF moves little: what is left is that small. */
    *feasible = true;
out:
    return st;
}

/* ---- The tree ------------------------------------------------------------------------ */

static bool sooner(const struct tree *t, uint32_t a, uint32_t b)
{
    const double x = t->node[a].bound, y = t->node[b].bound;
    return x < y || (x == y && a > b);
}

static void heap_push(struct tree *t, uint32_t node)
{
    size_t at = t->n_heap++;
    for (; at > 0 && sooner(t, node, t->heap[(at - 1) / 2]); at = (at - 1) / 2)
        t->heap[at] = t->heap[(at - 1) / 2];
    t->heap[at] = node;
}

static uint32_t heap_pop(struct tree *t)
{
    const uint32_t top = t->heap[0], last = t->heap[--t->n_heap];
    size_t at = 0;
    for (;;) {
        size_t child = 2 * at + 1;
        if (child >= t->n_heap) break;
        if (child + 1 < t->n_heap && sooner(t, t->heap[child + 1], t->heap[child]))
            child++;
        if (!sooner(t, t->heap[child], last)) break;
        t->heap[at] = t->heap[child];
        at = child;
    }
    t->heap[at] = last;
    return top;
}

static enum imp_status node_add(struct tree *t, uint32_t parent, size_t var, bool to,
                                uint32_t *out)
{
    if (t->n_nodes == t->room) {
        const size_t room = t->room ? 2 * t->room : 256;
        struct node *node = imp__alloc(t->c->ctx, room, sizeof *node);
        uint32_t *heap = imp__alloc(t->c->ctx, room, sizeof *heap);
        if (!node || !heap) {
            imp__release(t->c->ctx, node);
            imp__release(t->c->ctx, heap);
            return imp__error(t->c->ctx, IMP_E_NOMEM, "no memory for branches");
        }
        if (t->room) {
            memcpy(node, t->node, t->n_nodes * sizeof *node);
            memcpy(heap, t->heap, t->n_heap * sizeof *heap);
        }
        imp__release(t->c->ctx, t->node);
        imp__release(t->c->ctx, t->heap);
        t->node = node;
        t->heap = heap;
        t->room = room;
    }
    t->node[t->n_nodes] = (struct node){t->lp.objective, parent, (uint32_t)var, to};
    *out = (uint32_t)t->n_nodes++;
    return IMP_OK;
}

/* The bounds of a node and of those above it. */
static void node_enter(struct tree *t, uint32_t node)
{
    const size_t n = 2 * t->c->n;
    memcpy(t->lp.lo, t->lo, n * sizeof *t->lo);
    memcpy(t->lp.hi, t->hi, n * sizeof *t->hi);
    for (uint32_t k = node; k != UINT32_MAX; k = t->node[k].parent) {
        const size_t u = t->c->n + t->node[k].var;
        t->lp.lo[u] = t->lp.hi[u] = t->node[k].to;
    }
}

/* The used one that the solution leaves most open; n: it is an answer. */
static size_t open_one(const struct tree *t)
{
    const struct imp__choice *c = t->c;
    const double *x = t->lp.x, *u = x + c->n;
    size_t best = c->n;
    double most = 0;
    for (size_t j = 0; j < c->n; j++) {
        if (t->lp.lo[c->n + j] == t->lp.hi[c->n + j]) continue;
        const bool half = u[j] > OFF && u[j] < 1 - OFF;
        bool open = x[j] > OFF && x[j] < c->least[j] - OFF;
        open |= half && (c->fixed[j] > 0 || c->n_not > 0 || c->needed[c->place[j]]);
        for (size_t k = 0; k < c->n && !open && x[j] > OFF; k++)
            open = k != j && c->place[k] == c->place[j] && x[k] > OFF;
        if (!open) continue;
        const double share = fmax(u[j], x[j] / c->most[j]);
        const double how = fmin(share, 1 - share) + 1e-3;
        if (how > most) most = how, best = j;
    }
    return best;
}

/* With what is used fixed, the levels and the duals. */
static enum imp_status answer_take(struct tree *t)
{
    enum imp_status st = IMP_OK;
    const struct imp__choice *c = t->c;
    struct imp__choice_answer *a = t->best;
    bool feasible;
    for (size_t j = 0; j < c->n; j++) {
        const size_t u = c->n + j;
        const bool used = t->lp.x[j] > OFF || t->lp.x[u] > 1 - OFF;
        t->work[u] = used;
    }
    for (size_t u = c->n; u < 2 * c->n; u++) t->lp.lo[u] = t->lp.hi[u] = t->work[u];
    memcpy(t->cost, t->lp.hi + c->n, c->n * sizeof *t->cost); /* tangents use `work` */
    IMP_TRY(relax(t, INFINITY, &feasible));
    if (!feasible || (a->found && t->lp.objective >= a->price)) return IMP_OK;
    a->found = true;
    a->price = t->lp.objective;
    for (size_t j = 0; j < c->n; j++) { /* without the rounding of the program */
        a->used[j] = t->cost[j] > 0.5;
        a->x[j] = a->used[j] ? fmin(fmax(t->lp.x[j], c->least[j]), c->most[j]) : 0;
    }
    memset(a->dual, 0, c->n_rows * sizeof *a->dual);
    for (size_t k = t->fixed_rows; k < t->lp.m; k++)
        a->dual[t->lp.tag[k]] += t->lp.dual[k];
out:
    return st;
}

static double cutoff(const struct tree *t)
{
    const struct imp__choice_answer *a = t->best;
    return a->found ? a->price - t->c->gap * fabs(a->price) - 1e-9 : INFINITY;
}

/* From a node down one branch until it is an answer, or cannot be better than the best. */
static enum imp_status dive(struct tree *t, uint32_t node)
{
    enum imp_status st = IMP_OK;
    for (;;) {
        bool feasible;
        uint32_t other, next;
        node_enter(t, node);
        IMP_TRY(relax(t, cutoff(t), &feasible));
        t->best->nodes++;
        if (!feasible) return IMP_OK;
        const size_t j = open_one(t);
        if (j == t->c->n) return answer_take(t);
        const double u = fmax(t->lp.x[t->c->n + j], t->lp.x[j] / t->c->most[j]);
        IMP_TRY(node_add(t, node, j, !(u > 0.5), &other));
        IMP_TRY(node_add(t, node, j, u > 0.5, &next));
        heap_push(t, other);
        if (t->best->nodes >= t->c->nodes) {
            heap_push(t, next);
            return IMP_OK;
        }
        node = next;
    }
out:
    return st;
}

/* The rows that are there from the start. */
static enum imp_status rows_add(struct tree *t)
{
    enum imp_status st = IMP_OK;
    const struct imp__choice *c = t->c;
    double *a = t->work;
    for (size_t j = 0; j < c->n; j++) {
        memset(a, 0, 2 * c->n * sizeof *a);
        a[j] = -1, a[c->n + j] = c->most[j];
        IMP_TRY(imp__lp_add(&t->lp, a, 0, -1));
        a[j] = 1, a[c->n + j] = -c->least[j];
        if (c->least[j] > 0) IMP_TRY(imp__lp_add(&t->lp, a, 0, -1));
    }
    for (size_t p = 0; p < c->n_places; p++) {
        size_t of = 0;
        memset(a, 0, 2 * c->n * sizeof *a);
        for (size_t j = 0; j < c->n; j++)
            if (c->place[j] == p) a[c->n + j] = -1, of++;
        if (of > 1) IMP_TRY(imp__lp_add(&t->lp, a, 1, -1));
        for (size_t j = c->n; j < 2 * c->n; j++) a[j] = -a[j];
        if (c->needed[p]) IMP_TRY(imp__lp_add(&t->lp, a, -1, -1));
    }
    for (size_t k = 0; k < c->n_not; k++) { /* one at least is different */
        double b = 0;
        memset(a, 0, 2 * c->n * sizeof *a);
        for (size_t j = 0; j < c->n; j++) {
            a[c->n + j] = c->not_these[k][j] ? -1 : 1;
            b += c->not_these[k][j];
        }
        IMP_TRY(imp__lp_add(&t->lp, a, b - 1, -1));
    }
    t->fixed_rows = t->lp.m;
out:
    return st;
}

enum imp_status imp__choose(const struct imp__choice *c, struct imp__choice_answer *out)
{
    enum imp_status st = IMP_OK;
    struct tree t = {.c = c, .best = out};
    const size_t n = c->n;
    out->found = out->proven = false;
    out->nodes = 0;
    t.work = imp__alloc(c->ctx, 8 * n + 1, sizeof *t.work);
    t.cut = imp__alloc(c->ctx, CUTS, sizeof *t.cut);
    double *cost = imp__alloc(c->ctx, 2 * n + 1, sizeof *cost);
    if (!t.work || !t.cut || !cost)
        IMP_TRY(imp__error(c->ctx, IMP_E_NOMEM, "no memory for branches"));
    t.cost = t.work + 2 * n;
    t.lo = t.work + 4 * n;
    t.hi = t.work + 6 * n;
    for (size_t j = 0; j < n; j++) {
        cost[j] = c->price[j];
        cost[n + j] = c->fixed[j];
        t.hi[j] = c->most[j];
        t.hi[n + j] = 1;
    }
    IMP_TRY(imp__lp_create(c->ctx, 2 * n, cost, t.lo, t.hi, &t.lp));
    IMP_TRY(rows_add(&t));
    out->bound = -INFINITY;
    uint32_t node = UINT32_MAX;
    for (;;) {
        IMP_TRY(dive(&t, node));
        if (t.n_heap > 0 && !(t.node[t.heap[0]].bound < cutoff(&t))) t.n_heap = 0;
        out->proven = t.n_heap == 0;
        if (out->proven || out->nodes >= c->nodes || (c->any && out->found)) break;
        node = heap_pop(&t);
    }
    out->bound = out->found ? out->price : INFINITY;
    for (size_t k = 0; k < t.n_heap; k++)
        out->bound = fmin(out->bound, t.node[t.heap[k]].bound);
out:
    imp__lp_destroy(&t.lp);
    imp__release(c->ctx, t.node);
    imp__release(c->ctx, t.heap);
    imp__release(c->ctx, t.work);
    imp__release(c->ctx, t.cut);
    imp__release(c->ctx, cost);
    return st;
}
