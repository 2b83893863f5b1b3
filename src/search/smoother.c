/* SPDX-License-Identifier: Apache-2.0
 *
 * (I + lambda L)^-1 of a mesh by a sparse Cholesky factorisation (smoother.h): CXSparse's
 * (T. A. Davis, Direct Methods for Sparse Linear Systems, 2006), with an order of least degree. It is
 * serial, so that results do not depend on threads. */
#include "smoother.h"

#ifdef IMP_CXSPARSE
#define NCOMPLEX /* else its header defines I */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <suitesparse/cs.h>

struct imp__smoother {
    size_t n_vertices;
    int n;     /* rows */
    int *row;  /* [n_vertices] of its place; -1: held */
    double *b; /* [2 n] */
    cs_dis *order;
    cs_din *factor;
};

static int by_sides(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* The pairs of places that sides join, each once: (least << 32) + other. */
static size_t sides_find(const struct imp__smooth_mesh *m, uint64_t *side)
{
    size_t n = 0, unique = 0;
    for (size_t k = 0; k < 3 * m->n_triangles; k++) {
        const size_t next = k % 3 == 2 ? k - 2 : k + 1;
        const uint64_t a = m->place[m->indices[k]], b = m->place[m->indices[next]];
        if (a != b) side[n++] = imp_min(a, b) << 32 | imp_max(a, b);
    }
    qsort(side, n, sizeof *side, by_sides);
    for (size_t k = 0; k < n; k++)
        if (k == 0 || side[k] != side[unique - 1]) side[unique++] = side[k];
    return unique;
}

/* I + lambda L of the rows. NULL: no memory. */
static cs_di *matrix_make(const struct imp__smooth_mesh *m, const int *row, int n,
                          const uint64_t *side, size_t n_sides)
{
    const size_t most = (size_t)n + 4 * n_sides;
    if (most > INT32_MAX) return NULL;
    cs_di *entries = cs_di_spalloc(n, n, (int)most, 1, 1);
    int ok = entries != NULL;
    for (int k = 0; ok && k < n; k++) ok = cs_di_entry(entries, k, k, 1);
    for (size_t k = 0; ok && k < n_sides; k++) {
        const int a = row[side[k] >> 32], b = row[side[k] & UINT32_MAX];
        if (a >= 0) ok &= cs_di_entry(entries, a, a, m->lambda);
        if (b >= 0) ok &= cs_di_entry(entries, b, b, m->lambda);
        if (a < 0 || b < 0) continue;
        ok &= cs_di_entry(entries, a, b, -m->lambda) &&
              cs_di_entry(entries, b, a, -m->lambda);
    }
    cs_di *sum = ok ? cs_di_compress(entries) : NULL;
    cs_di_spfree(entries);
    if (sum && !cs_di_dupl(sum)) sum = cs_di_spfree(sum);
    return sum;
}

/* Rows of places that are not held; vertices have those of their place. */
static int rows_number(const struct imp__smooth_mesh *m, int *row)
{
    int n = 0;
    for (size_t v = 0; v < m->n_vertices; v++)
        row[v] = m->place[v] < v ? row[m->place[v]] : m->held && m->held[v] ? -1 : n++;
    return n;
}

enum imp_status imp__smoother_create(imp_context *ctx, const struct imp__smooth_mesh *m,
                                     struct imp__smoother **out)
{
    enum imp_status st = IMP_OK;
    uint64_t *side = imp__alloc_raw(ctx, 3 * m->n_triangles + 1, sizeof *side);
    struct imp__smoother *s = imp__alloc(ctx, 1, sizeof *s);
    cs_di *matrix = NULL;
    if (s) {
        s->n_vertices = m->n_vertices;
        s->row = imp__alloc(ctx, m->n_vertices + 1, sizeof *s->row);
        s->b = imp__alloc(ctx, 2 * m->n_vertices + 1, sizeof *s->b);
    }
    if (!side || !s || !s->row || !s->b || m->n_vertices > INT32_MAX)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for the Laplacian of a mesh"));
    s->n = rows_number(m, s->row);
    if (s->n == 0) goto out;
    matrix = matrix_make(m, s->row, s->n, side, sides_find(m, side));
    if (matrix) s->order = cs_di_schol(1, matrix);
    if (!s->order)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for the Laplacian of a mesh"));
    s->factor = cs_di_chol(matrix, s->order);
    if (!s->factor)
        IMP_TRY(imp__error(ctx, IMP_E_NUMERIC,
                           "the Laplacian of a mesh has no Cholesky factorisation with "
                           "lambda = %g",
                           m->lambda));
out:
    cs_di_spfree(matrix);
    imp__release(ctx, side);
    if (st == IMP_OK) *out = s;
    else imp__smoother_destroy(ctx, s);
    return st;
}

void imp__smoother_destroy(imp_context *ctx, struct imp__smoother *s)
{
    if (!s) return;
    cs_di_sfree(s->order);
    cs_di_nfree(s->factor);
    imp__release(ctx, s->row);
    imp__release(ctx, s->b);
    imp__release(ctx, s);
}

/* One component of all vertices: what they add to their rows, or the value of a row, which each of
 * them has; solved, and given to all of them. */
static void solve(const struct imp__smoother *s, double *v, bool add)
{
    double *b = s->b, *x = s->b + s->n;
    memset(b, 0, (size_t)s->n * sizeof *b);
    for (size_t k = 0; k < s->n_vertices; k++)
        if (s->row[k] >= 0) b[s->row[k]] = (add ? b[s->row[k]] : 0) + v[3 * k];
    if (s->n > 0) {
        cs_di_ipvec(s->order->pinv, b, x, s->n);
        cs_di_lsolve(s->factor->L, x);
        cs_di_ltsolve(s->factor->L, x);
        cs_di_pvec(s->order->pinv, x, b, s->n);
    }
    for (size_t k = 0; k < s->n_vertices; k++)
        v[3 * k] = s->row[k] >= 0 ? b[s->row[k]] : 0;
}

void imp__smoother_derivative(const struct imp__smoother *s, double *g)
{
    for (int i = 0; i < 3; i++) solve(s, g + i, true);
}

void imp__smoother_step(const struct imp__smoother *s, double *step)
{
    for (int i = 0; i < 3; i++) solve(s, step + i, false);
}

#else

enum imp_status imp__smoother_create(imp_context *ctx, const struct imp__smooth_mesh *m,
                                     struct imp__smoother **out)
{
    (void)m;
    (void)out;
    return imp__error(ctx, IMP_E_UNSUPPORTED,
                      "smooth steps of a mesh need a sparse Cholesky factorisation, and "
                      "this build has none (it was made without CXSparse)");
}

void imp__smoother_destroy(imp_context *ctx, struct imp__smoother *s)
{
    (void)ctx;
    (void)s;
}
void imp__smoother_derivative(const struct imp__smoother *s, double *g)
{
    (void)s;
    (void)g;
}
void imp__smoother_step(const struct imp__smoother *s, double *step)
{
    (void)s;
    (void)step;
}

#endif
