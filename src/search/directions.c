/* SPDX-License-Identifier: Apache-2.0
 *
 * Eigenvectors of the scaled Gauss-Newton matrix, the noise of its eigenvalues, and
 * the variables that the data leave undetermined. */
#include "directions.h"
#include "math/linalg.h"
#include <math.h>
#include <string.h>

/* A variable is loose if its component in a loose direction exceeds this, in units of the
 * scales. */
#define LOOSE_SHARE 0.1

void imp__directions_destroy(imp_context *ctx, struct imp__directions *a)
{
    imp__release(ctx, a->index);
    imp__release(ctx, a->values);
    imp__release(ctx, a->vectors);
    imp__release(ctx, a->se);
    imp__release(ctx, a->loose);
    imp__release(ctx, a->G);
    *a = (struct imp__directions){0};
}

/* v^T D H D v over the subset, v row j of the eigenvectors. */
static double along(const struct imp__sampled *s, const struct imp__directions *a,
                    const double *H, size_t j)
{
    double sum = 0;
    for (size_t p = 0; p < a->m; p++)
        for (size_t q = 0; q < a->m; q++) {
            const size_t k = a->index[p], l = a->index[q];
            sum += a->vectors[j * a->m + p] * a->vectors[j * a->m + q] * s->scale[k] *
                   s->scale[l] * H[k * s->n + l];
        }
    return sum;
}

/* Eigenvalues of the scaled data matrix, and which of them exceed their noise. */
static enum imp_status spectrum(const struct imp__sampled *s, struct imp__directions *a)
{
    enum imp_status st = IMP_OK;
    const size_t m = a->m, n = s->n;
    double *A = imp__alloc(s->ctx, m * m, sizeof *A);

    if (!A) IMP_TRY(imp__error(s->ctx, IMP_E_NOMEM, "no memory for a covariance"));
    for (size_t p = 0; p < m; p++)
        for (size_t q = 0; q < m; q++) {
            const size_t k = a->index[p], l = a->index[q];
            A[p * m + q] = s->scale[k] * s->scale[l] *
                           (s->mean.H[k * n + l] - s->mean.H_prior[k * n + l]);
        }
    if (!imp__eigen_symmetric(m, A, a->values, a->vectors))
        IMP_TRY(imp__error(s->ctx, IMP_E_NUMERIC, "J^T J is not finite"));
    for (size_t j = 0; j < m; j++) {
        double sum = 0;
        for (int b = 0; b < s->stages * IMP_DEVIATIONS; b++)
            sum += pow(along(s, a, s->deviations + (size_t)b * n * n, j), 2);
        a->se[j] = sqrt(sum);
        a->loose[j] =
            !(a->values[j] > 2 * a->se[j]) || a->values[j] <= 1e-12 * a->values[m - 1];
        a->n_loose += a->loose[j];
    }
out:
    imp__release(s->ctx, A);
    return st;
}

/* G = D V (V^T D H D V)^-1 V^T D, V the determined directions, H with its prior. */
static enum imp_status inverse(const struct imp__sampled *s, struct imp__directions *a)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = s->ctx;
    const size_t m = a->m, n = s->n, r = m - a->n_loose;
    double *V = imp__alloc(ctx, m * r + 1, sizeof *V); /* D V, [m][r] */
    double *HV = imp__alloc(ctx, m * r + 1, sizeof *HV);
    double *M = imp__alloc(ctx, r * r + 1, sizeof *M);
    double *row = imp__alloc(ctx, r + 1, sizeof *row);

    if (!V || !HV || !M || !row)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance"));
    for (size_t j = 0, c = 0; j < m; j++) {
        if (a->loose[j]) continue;
        for (size_t p = 0; p < m; p++)
            V[p * r + c] = s->scale[a->index[p]] * a->vectors[j * m + p];
        c++;
    }
    for (size_t p = 0; p < m; p++)
        for (size_t q = 0; q < m; q++) {
            const double h = s->mean.H[a->index[p] * n + a->index[q]];
            for (size_t c = 0; c < r; c++) HV[p * r + c] += h * V[q * r + c];
        }
    for (size_t p = 0; p < m; p++)
        for (size_t c = 0; c < r; c++)
            for (size_t d = 0; d < r; d++) M[c * r + d] += V[p * r + c] * HV[p * r + d];
    if (r > 0 && !imp__cholesky(r, M))
        IMP_TRY(imp__error(ctx, IMP_E_NUMERIC,
                           "J^T J is not positive where it is determined"));
    for (size_t p = 0; p < m; p++) {
        memcpy(row, V + p * r, r * sizeof *row);
        imp__cholesky_solve(r, M, row);
        for (size_t q = 0; q < m; q++) {
            double sum = 0;
            for (size_t c = 0; c < r; c++) sum += row[c] * V[q * r + c];
            a->G[a->index[p] * n + a->index[q]] = sum;
        }
    }
out:
    imp__release(ctx, V);
    imp__release(ctx, HV);
    imp__release(ctx, M);
    imp__release(ctx, row);
    return st;
}

/* A = sum max(lambda, 0) v v^T + D H_prior D, over all directions or over those alone
 * that the data determine, and its eigenvalues. */
static enum imp_status with_prior(const struct imp__sampled *s,
                                  const struct imp__directions *a, bool loose_too,
                                  double *A, double *values, double *vectors)
{
    const size_t m = a->m, n = s->n;
    for (size_t p = 0; p < m; p++)
        for (size_t q = 0; q < m; q++) {
            const size_t k = a->index[p], l = a->index[q];
            A[p * m + q] = s->scale[k] * s->scale[l] * s->mean.H_prior[k * n + l];
            for (size_t j = 0; j < m; j++)
                if (loose_too || !a->loose[j])
                    A[p * m + q] += fmax(a->values[j], 0) * a->vectors[j * m + p] *
                                    a->vectors[j * m + q];
        }
    return imp__eigen_symmetric(m, A, values, vectors)
               ? IMP_OK
               : imp__error(s->ctx, IMP_E_NUMERIC, "J^T J is not finite");
}

/* G = D A^-1 D, if data and prior together determine every direction. The data count in
 * the test only where they determine a direction: elsewhere their part is noise. */
#define PRIOR_LEAST 1e-10 /* eigenvalue over the largest */
static enum imp_status inverse_held(const struct imp__sampled *s,
                                    struct imp__directions *a)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = s->ctx;
    const size_t m = a->m, n = s->n;
    double *A = imp__alloc(ctx, 2 * m * m + m, sizeof *A);
    if (!A) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance"));
    double *vectors = A + m * m, *values = vectors + m * m;
    IMP_TRY(with_prior(s, a, false, A, values, vectors));
    a->held = values[0] > PRIOR_LEAST * values[m - 1];
    if (!a->held) goto out;
    IMP_TRY(with_prior(s, a, true, A, values, vectors));
    for (size_t p = 0; p < m; p++)
        for (size_t q = 0; q < m; q++) {
            double sum = 0;
            for (size_t j = 0; j < m; j++)
                sum += vectors[j * m + p] * vectors[j * m + q] / values[j];
            const size_t k = a->index[p], l = a->index[q];
            a->G[k * n + l] = s->scale[k] * s->scale[l] * sum;
        }
out:
    imp__release(ctx, A);
    return st;
}

enum imp_status imp__directions_find(const struct imp__sampled *s, const bool *fixed,
                                     struct imp__directions *a)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = s->ctx;
    const size_t n = s->n;

    a->index = imp__alloc(ctx, n, sizeof *a->index);
    a->values = imp__alloc(ctx, n, sizeof *a->values);
    a->vectors = imp__alloc(ctx, n * n, sizeof *a->vectors);
    a->se = imp__alloc(ctx, n, sizeof *a->se);
    a->loose = imp__alloc(ctx, n, sizeof *a->loose);
    a->G = imp__alloc(ctx, n * n, sizeof *a->G);
    if (!a->index || !a->values || !a->vectors || !a->se || !a->loose || !a->G)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance"));
    for (size_t k = 0; k < n; k++)
        if (!fixed || !fixed[k]) a->index[a->m++] = k;
    if (a->m == 0) goto out;
    IMP_TRY(spectrum(s, a));
    if (a->n_loose > 0) IMP_TRY(inverse_held(s, a));
    if (!a->held) IMP_TRY(inverse(s, a));
out:
    return st;
}

bool imp__is_loose(const struct imp__directions *a, size_t k)
{
    for (size_t p = 0; p < a->m; p++) {
        if (a->index[p] != k) continue;
        for (size_t j = 0; j < a->m; j++)
            if (a->loose[j] && fabs(a->vectors[j * a->m + p]) > LOOSE_SHARE) return true;
    }
    return false;
}
