/* SPDX-License-Identifier: Apache-2.0
 *
 * The Gauss-Newton matrix at the start of a search, and its eigenvectors as
 * coordinates. */
#include "basis.h"
#include "math/linalg.h"
#include <math.h>
#include <string.h>

enum imp_status imp__basis_matrix(const struct imp__goal *goal, const double *x,
                                  uint64_t seed, double *A, bool *known)
{
    enum imp_status st = IMP_OK;
    const size_t n = goal->n;
    struct imp__normal eq = {0};

    *known = false;
    if (!goal->normal || n < 2 || n > IMP_BASIS_MAX) return IMP_OK;
    IMP_TRY(imp__normal_create(goal->ctx, n, false, &eq));
    st = goal->normal(x, seed, 1, &eq, goal->payload);
    if (st == IMP_E_UNSUPPORTED || st == IMP_E_NUMERIC) { /* then without */
        st = IMP_OK;
        goto out;
    }
    if (st != IMP_OK) goto out;
    bool finite = true;
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) {
            const double h = eq.H_same[k * n + k] > 0 && eq.H_same[l * n + l] > 0
                                 ? eq.H[k * n + l]
                                 : 0;
            finite &= isfinite(h);
            A[k * n + l] = goal->scale[k] * h * goal->scale[l];
        }
    *known = finite;
out:
    imp__normal_destroy(goal->ctx, &eq);
    return st;
}

enum imp_status imp__basis_turn(imp_context *ctx, size_t n, const double *A,
                                const double *aligned, double *V, double *R)
{
    double *work = imp__alloc(ctx, 3 * n * n + n, sizeof *work);
    size_t free[IMP_BASIS_MAX], f = 0;
    if (!work) return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu directions", n);
    double *a = work, *e = a + n * n, *to = e + n * n, *values = to + n * n;

    for (size_t k = 0; k < n; k++) {
        to[k * n + k] = 1;
        if (aligned[k] == 0 && A[k * n + k] != 0) free[f++] = k;
    }
    for (size_t i = 0; i < f; i++)
        for (size_t j = 0; j < f; j++) a[i * f + j] = A[free[i] * n + free[j]];
    if (imp__eigen_symmetric(f, a, values, e)) /* else the axes */
        for (size_t i = 0; i < f; i++)
            for (size_t j = 0; j < f; j++) to[free[i] * n + free[j]] = e[i * f + j];
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            R[j * n + i] = 0;
            for (size_t k = 0; k < n; k++) R[j * n + i] += to[j * n + k] * V[i * n + k];
        }
    memcpy(V, to, n * n * sizeof *V);
    imp__release(ctx, work);
    return IMP_OK;
}

/* out_i = sum_j V[i row + j column] in_j */
static void rotate(size_t n, const double *V, size_t row, size_t column, const double *in,
                   double *out)
{
    memcpy(out, in, n * sizeof *out);
    for (size_t i = 0; V && i < n; i++) {
        out[i] = 0;
        for (size_t j = 0; j < n; j++) out[i] += V[i * row + j * column] * in[j];
    }
}

void imp__basis_along(size_t n, const double *V, const double *in, double *out)
{
    rotate(n, V, n, 1, in, out);
}

void imp__basis_back(size_t n, const double *V, const double *in, double *out)
{
    rotate(n, V, 1, n, in, out);
}
