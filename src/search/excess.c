/* SPDX-License-Identifier: Apache-2.0
 *
 * With A the covariance, S the excess and M = A^-1/2 S A^-1/2 = U diag(m) U^T, the result is
 *
 *     A - A^1/2 U diag(clamp(m, 0, 2/3)) U^T A^1/2 */
#include "excess.h"
#include "math/linalg.h"
#include <math.h>
#include <string.h>

#define MOST (2.0 / 3)

/* out = a b, or a b^T. */
static void product(size_t n, const double *a, const double *b, bool transposed,
                    double *out)
{
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double sum = 0;
            for (size_t k = 0; k < n; k++)
                sum += a[i * n + k] * (transposed ? b[j * n + k] : b[k * n + j]);
            out[i * n + j] = sum;
        }
}

enum imp_status imp__excess_take(imp_context *ctx, size_t n, double *covariance,
                                 const double *excess)
{
    enum imp_status st = IMP_OK;
    const size_t nn = n * n;
    double *work = NULL;
    bool any = false;
    for (size_t i = 0; i < nn; i++) any |= excess[i] != 0;
    if (!any) return IMP_OK;
    work = imp__alloc(ctx, 3 * nn + 2 * n, sizeof *work);
    if (!work) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a covariance"));
    double *Q = work, *M = Q + nn, *P = M + nn, *values = P + nn, *part = values + n;

    /* A = Q^T diag(values) Q */
    memcpy(P, covariance, nn * sizeof *P);
    if (!imp__eigen_symmetric(n, P, values, Q)) goto numeric;
    const double least = 1e-12 * fmax(-values[0], values[n - 1]);
    product(n, Q, excess, false, P);
    product(n, P, Q, true, M);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            M[i * n + j] = values[i] > least && values[j] > least
                               ? M[i * n + j] / sqrt(values[i] * values[j])
                               : 0;
    if (!imp__eigen_symmetric(n, M, part, P)) goto numeric;

    /* Rows of P are u^T diag(values)^1/2, those of M (A^1/2 u)^T. */
    for (size_t e = 0; e < n; e++)
        for (size_t i = 0; i < n; i++) P[e * n + i] *= sqrt(fmax(values[i], 0));
    product(n, P, Q, false, M);
    for (size_t e = 0; e < n; e++) {
        const double *v = M + e * n, m = imp_clamp(part[e], 0.0, MOST);
        for (size_t k = 0; k < n; k++)
            for (size_t l = 0; l < n; l++) covariance[k * n + l] -= m * v[k] * v[l];
    }
out:
    imp__release(ctx, work);
    return st;
numeric:
    st = imp__error(ctx, IMP_E_NUMERIC, "a covariance is not finite");
    goto out;
}
