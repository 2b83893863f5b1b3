/* SPDX-License-Identifier: Apache-2.0
 *
 * What is known with a sum A of informations and the unit prior: covariance
 *
 *     C = sum_j v_j v_j^T / (1 + lambda_j),     A = sum_j lambda_j v_j v_j^T
 *
 * where eigenvalues that are not above twice their error count as 0, as in the intervals of a fit
 * (search/directions.c). With S the m wanted numbers,
 *
 *     D:  phi = -log det(C_SS)/m      d phi = tr( C_SS^-1 (Q dA Q)_SS )/m
 *     A:  phi = -log tr(C_SS)         d phi = tr( (Q dA Q)_SS ) / tr(C_SS)
 *
 * Q the part of C in the directions that count. In the others phi could be larger, with eigenvalues
 * of lambda + 2 se: with |v_S|^2 the part of such a direction in the wanted numbers, by
 * |v_S|^2 log(1 + lambda + 2 se)/m, or, of traces, |v_S|^2 (1 - 1/(1 + lambda + 2 se))/tr(C_SS). */
#include "math/linalg.h"
#include "planning.h"
#include <math.h>
#include <string.h>

#define RELATIVE_LEAST 1e-12 /* of the largest eigenvalue: below, it is rounding */

enum imp_status imp__plan_known_create(const struct imp__plan_model *m,
                                       struct imp__plan_known *out)
{
    const size_t n = m->n;
    *out = (struct imp__plan_known){0};
    out->C = imp__alloc(m->ctx, 7 * n * n + 2 * n + 1, sizeof *out->C);
    out->loose = imp__alloc(m->ctx, n, sizeof *out->loose);
    if (!out->C || !out->loose)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for a plan of %zu numbers", n);
    out->pull = out->C + n * n;
    out->vectors = out->pull + n * n;
    out->work = out->vectors + n * n;
    out->values = out->work + 4 * n * n;
    return IMP_OK;
}

void imp__plan_known_destroy(imp_context *ctx, struct imp__plan_known *k)
{
    imp__release(ctx, k->C);
    imp__release(ctx, k->loose);
    *k = (struct imp__plan_known){0};
}

/* v^T A v. */
static double along(size_t n, const double *A, const double *v)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++) {
        double row = 0;
        for (size_t l = 0; l < n; l++) row += A[k * n + l] * v[l];
        sum += v[k] * row;
    }
    return sum;
}

static enum imp_status spectrum(const struct imp__plan_model *m,
                                const struct imp__plan_data *const *items, size_t n_items,
                                struct imp__plan_known *out)
{
    const size_t n = m->n;
    double *A = out->work;
    memset(A, 0, n * n * sizeof *A);
    for (size_t i = 0; i < n_items; i++)
        for (size_t k = 0; k < n * n; k++) A[k] += items[i]->H[k];
    if (!imp__eigen_symmetric(n, A, out->values, out->vectors))
        return imp__error(m->ctx, IMP_E_NUMERIC, "the information is not finite");
    out->hidden = 0;
    for (size_t j = 0; j < n; j++) {
        const double *v = out->vectors + j * n;
        double square = 0, part = 0;
        for (size_t i = 0; i < n_items; i++)
            for (size_t g = 0; g < IMP_DEVIATIONS; g++)
                square += pow(along(n, items[i]->deviations + g * n * n, v), 2);
        out->loose[j] = !(out->values[j] > 2 * sqrt(square)) ||
                        out->values[j] <= RELATIVE_LEAST * out->values[n - 1];
        if (!out->loose[j]) continue;
        const double most = fmax(out->values[j], 0) + 2 * sqrt(square);
        for (size_t a = 0; a < m->n_of; a++) part += v[m->of[a]] * v[m->of[a]];
        out->hidden += part * (m->kind == IMP_PLAN_A ? most / (1 + most) : log1p(most));
    }
    return IMP_OK;
}

/* pull += scale Q_:S B Q_S: with B [m][m] of the wanted numbers; B NULL: the unit matrix. */
static void pull_add(const struct imp__plan_model *m, const double *Q, const double *B,
                     double scale, double *work, double *pull)
{
    const size_t n = m->n, s = m->n_of;
    for (size_t a = 0; a < s; a++) /* work [s][n]: B Q_S: */
        for (size_t l = 0; l < n; l++) {
            double sum = B ? 0 : Q[m->of[a] * n + l];
            for (size_t b = 0; B && b < s; b++) sum += B[a * s + b] * Q[m->of[b] * n + l];
            work[a * n + l] = sum;
        }
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) {
            double sum = 0;
            for (size_t a = 0; a < s; a++) sum += Q[m->of[a] * n + k] * work[a * n + l];
            pull[k * n + l] += scale * sum;
        }
}

enum imp_status imp__plan_evaluate(const struct imp__plan_model *m,
                                   const struct imp__plan_data *const *items,
                                   size_t n_items, struct imp__plan_known *out)
{
    const size_t n = m->n, s = m->n_of;
    double *Q = out->work, *L = Q + n * n, *B = L + n * n, *work = B + n * n;
    const enum imp_status st = spectrum(m, items, n_items, out);
    if (st != IMP_OK) return st;
    memset(out->C, 0, n * n * sizeof *out->C);
    memset(out->pull, 0, n * n * sizeof *out->pull);
    memset(Q, 0, n * n * sizeof *Q);
    for (size_t j = 0; j < n; j++) {
        const double *v = out->vectors + j * n;
        const double c = 1 / (1 + (out->loose[j] ? 0 : out->values[j]));
        for (size_t k = 0; k < n; k++)
            for (size_t l = 0; l < n; l++) {
                out->C[k * n + l] += c * v[k] * v[l];
                if (!out->loose[j]) Q[k * n + l] += c * v[k] * v[l];
            }
    }
    double trace = 0, log_det = 0;
    for (size_t a = 0; a < s; a++) {
        trace += out->C[m->of[a] * n + m->of[a]];
        for (size_t b = 0; b < s; b++) L[a * s + b] = out->C[m->of[a] * n + m->of[b]];
    }
    if (m->kind == IMP_PLAN_A) {
        out->phi = -log(trace);
        out->hidden /= trace;
        pull_add(m, Q, NULL, 1 / trace, work, out->pull);
        return IMP_OK;
    }
    if (!imp__cholesky(s, L))
        return imp__error(m->ctx, IMP_E_NUMERIC,
                          "the covariance of the wanted numbers is singular");
    for (size_t a = 0; a < s; a++) log_det += 2 * log(L[a * s + a]);
    imp__cholesky_inverse(s, L, B);
    out->phi = -log_det / (double)s;
    out->hidden /= (double)s;
    pull_add(m, Q, B, 1 / (double)s, work, out->pull);
    return IMP_OK;
}

void imp__plan_deviations(size_t n, const double *pull, const struct imp__plan_data *item,
                          double *out)
{
    for (size_t g = 0; g < IMP_DEVIATIONS; g++) {
        const double *D = item->deviations + g * n * n;
        out[g] = 0;
        for (size_t k = 0; k < n * n; k++) out[g] += pull[k] * D[k];
    }
}
