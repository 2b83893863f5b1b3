/* SPDX-License-Identifier: Apache-2.0
 *
 * What no picture determines: the directions that the sum of all informations leaves, without those
 * that one picture by itself determines. The sum has the noise of the noisiest picture, which hides
 * what others see well; true informations have no negative eigenvalues, so that what one determines
 * is determined with the others, too. */
#include "math/linalg.h"
#include "planning.h"
#include <math.h>
#include <string.h>

/* V A V^T of rows V [r][n]. */
static void project(size_t n, size_t r, const double *V, const double *A, double *row,
                    double *out)
{
    for (size_t a = 0; a < r; a++) {
        for (size_t l = 0; l < n; l++) {
            row[l] = 0;
            for (size_t k = 0; k < n; k++) row[l] += V[a * n + k] * A[k * n + l];
        }
        for (size_t b = 0; b < r; b++) {
            out[a * r + b] = 0;
            for (size_t l = 0; l < n; l++) out[a * r + b] += row[l] * V[b * n + l];
        }
    }
}

/* v^T A v, A [r][r]. */
static double along(size_t r, const double *A, const double *v)
{
    double sum = 0;
    for (size_t a = 0; a < r; a++)
        for (size_t b = 0; b < r; b++) sum += v[a] * A[a * r + b] * v[b];
    return sum;
}

static bool determines(double value, double variance)
{
    return value >= IMP_PLAN_LOOSE && value > 2 * sqrt(variance);
}

/* Takes from rows V [*r][n] the directions that an item determines. work [4 n n + 2 n]. */
static enum imp_status narrow(const struct imp__plan_model *m,
                              const struct imp__plan_data *item, double *work, double *V,
                              size_t *r)
{
    const size_t n = m->n, old = *r;
    double *A = work, *vectors = A + n * n, *D = vectors + n * n, *next = D + n * n,
           *values = next + n * n, *row = values + n;
    project(n, old, V, item->H, row, A);
    if (!imp__eigen_symmetric(old, A, values, vectors))
        return imp__error(m->ctx, IMP_E_NUMERIC, "the information is not finite");
    /* A has been used up: variances of the eigenvalues. */
    memset(A, 0, old * sizeof *A);
    for (size_t g = 0; g < IMP_DEVIATIONS; g++) {
        project(n, old, V, item->deviations + g * n * n, row, D);
        for (size_t j = 0; j < old; j++) A[j] += pow(along(old, D, vectors + j * old), 2);
    }
    *r = 0;
    for (size_t j = 0; j < old; j++) {
        if (determines(values[j], A[j])) continue;
        double *to = next + (*r)++ * n;
        memset(to, 0, n * sizeof *to);
        for (size_t a = 0; a < old; a++)
            for (size_t k = 0; k < n; k++) to[k] += vectors[j * old + a] * V[a * n + k];
    }
    memcpy(V, next, *r * n * sizeof *V);
    return IMP_OK;
}

enum imp_status imp__plan_loose(const struct imp__plan_model *m,
                                const struct imp__plan_data *const *items, size_t n_items,
                                struct imp__plan_known *scratch, double *out, size_t *r)
{
    const size_t n = m->n;
    enum imp_status st = imp__plan_evaluate(m, items, n_items, scratch);
    if (st != IMP_OK) return st;
    double *work = imp__alloc(m->ctx, 4 * n * n + 2 * n, sizeof *work);
    if (!work) return imp__error(m->ctx, IMP_E_NOMEM, "no memory for a plan");
    *r = 0;
    for (size_t j = 0; j < n; j++)
        if (scratch->loose[j] || scratch->values[j] < IMP_PLAN_LOOSE)
            memcpy(out + (*r)++ * n, scratch->vectors + j * n, n * sizeof *out);
    for (size_t i = 0; i<n_items && * r> 0 && st == IMP_OK; i++)
        st = narrow(m, items[i], work, out, r);
    imp__release(m->ctx, work);
    return st;
}
