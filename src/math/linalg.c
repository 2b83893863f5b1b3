/* SPDX-License-Identifier: Apache-2.0
 *
 * Cholesky factorisation, and eigenvectors of a symmetric matrix by Jacobi's
 * rotations. */
#include "linalg.h"
#include <math.h>

bool imp__cholesky(size_t n, double *a)
{
    for (size_t j = 0; j < n; j++) {
        double *row = a + j * n;
        double d = row[j];
        for (size_t k = 0; k < j; k++) d -= row[k] * row[k];
        /* What is left of the diagonal is rounding: singular. */
        if (!(d > 1e-15 * fabs(row[j])) || !isfinite(d)) return false;
        row[j] = sqrt(d);
        for (size_t i = j + 1; i < n; i++) {
            double s = a[i * n + j];
            for (size_t k = 0; k < j; k++) s -= a[i * n + k] * row[k];
            a[i * n + j] = s / row[j];
        }
        for (size_t k = j + 1; k < n; k++) row[k] = 0;
    }
    return true;
}

void imp__cholesky_solve(size_t n, const double *l, double *b)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < i; k++) b[i] -= l[i * n + k] * b[k];
        b[i] /= l[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; k++) b[i] -= l[k * n + i] * b[k];
        b[i] /= l[i * n + i];
    }
}

void imp__cholesky_inverse(size_t n, const double *l, double *inverse)
{
    for (size_t j = 0; j < n; j++) {
        /* Row j holds column j of the inverse while it is solved for: it is symmetric. */
        double *x = inverse + j * n;
        for (size_t i = 0; i < n; i++) x[i] = i == j;
        imp__cholesky_solve(n, l, x);
    }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < i; j++)
            inverse[i * n + j] = inverse[j * n + i] =
                0.5 * (inverse[i * n + j] + inverse[j * n + i]);
}

/* Rotate rows and columns p, q so that a[p][q] becomes 0 (Golub and Van Loan, 8.5). */
static void jacobi_rotate(size_t n, double *a, double *v, size_t p, size_t q)
{
    const double apq = a[p * n + q];
    const double theta = (a[q * n + q] - a[p * n + p]) / (2 * apq);
    const double t = copysign(1, theta) / (fabs(theta) + sqrt(1 + theta * theta));
    const double c = 1 / sqrt(1 + t * t), s = t * c;
    for (size_t k = 0; k < n; k++) {
        const double x = a[k * n + p], y = a[k * n + q];
        a[k * n + p] = c * x - s * y;
        a[k * n + q] = s * x + c * y;
    }
    for (size_t k = 0; k < n; k++) {
        const double x = a[p * n + k], y = a[q * n + k];
        a[p * n + k] = c * x - s * y;
        a[q * n + k] = s * x + c * y;
    }
    a[p * n + q] = a[q * n + p] = 0;
    for (size_t k = 0; k < n; k++) {
        const double x = v[p * n + k], y = v[q * n + k];
        v[p * n + k] = c * x - s * y;
        v[q * n + k] = s * x + c * y;
    }
}

bool imp__eigen_symmetric(size_t n, double *a, double *values, double *vectors)
{
    for (size_t i = 0; i < n * n; i++) vectors[i] = i / n == i % n;
    bool done = n < 2;
    for (int sweep = 0; sweep < 60 && !done; sweep++) {
        done = true;
        for (size_t p = 0; p < n; p++)
            for (size_t q = p + 1; q < n; q++) {
                const double apq = fabs(a[p * n + q]);
                /* Relative to the two diagonals, so that small eigenvalues keep their
                 * digits (Demmel and Veselic 1992). */
                if (apq <= 1e-16 * sqrt(fabs(a[p * n + p])) * sqrt(fabs(a[q * n + q])) ||
                    apq < 1e-300)
                    continue;
                if (!isfinite(apq)) return false;
                done = false;
                jacobi_rotate(n, a, vectors, p, q);
            }
    }
    for (size_t k = 0; k < n; k++) {
        values[k] = a[k * n + k];
        if (!isfinite(values[k])) return false;
    }
    for (size_t k = 0; k < n; k++) { /* ascending, by selection */
        size_t least = k;
        for (size_t j = k + 1; j < n; j++)
            if (values[j] < values[least]) least = j;
        if (least == k) continue;
        const double t = values[k];
        values[k] = values[least];
        values[least] = t;
        for (size_t i = 0; i < n; i++) {
            const double x = vectors[k * n + i];
            vectors[k * n + i] = vectors[least * n + i];
            vectors[least * n + i] = x;
        }
    }
    return done;
}
