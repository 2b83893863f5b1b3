/* SPDX-License-Identifier: Apache-2.0
 *
 * The gradient from the units of a pixel, its covariance, and the variance of chi^2
 * (gauss_newton.c has the formulas). */
#include "inverse/problem/loss.h"
#include "normal_pixel.h"
#include "pair_noise.h"
#include <math.h>
#include <string.h>

/* v += 1/2 sum over channels of w (r_a x_b + r_b x_a). */
static void pair(const struct imp__normal_job *j, const struct imp__normal_pixel *p,
                 int a, int b, double *v)
{
    const struct imp__normal_worker *w = p->w;
    const size_t T = p->T, S = (size_t)imp__normal_channels(j);
    for (size_t c = 0; c < S; c++) {
        const double *xa = w->X + ((size_t)a * S + c) * T;
        const double *xb = w->X + ((size_t)b * S + c) * T;
        const double ra = 0.5 * w->weight[c] * w->r[a][c];
        const double rb = 0.5 * w->weight[c] * w->r[b][c];
        for (size_t k = 0; k < T; k++) v[k] += ra * xb[k] + rb * xa[k];
    }
}

/* Adds v v^T over the values touched, v [T]. */
static void square_add(const struct imp__normal_job *j, const struct imp__normal_pixel *p,
                       double scale, const double *v, double *out)
{
    const size_t *touched = p->w->touched;
    for (size_t k = 0; k < p->T; k++) {
        if (v[k] == 0) continue;
        const double f = scale * v[k];
        double *row = out + touched[k] * j->K;
        for (size_t l = 0; l <= k; l++) row[touched[l]] += f * v[l];
    }
}

/* The mean over pairs, its jackknife, and what that has too much (pair_noise.h). */
static void gradient_add(const struct imp__normal_job *j,
                         const struct imp__normal_pixel *p, struct imp__normal_sums *out)
{
    struct imp__normal_worker *w = p->w;
    const size_t T = p->T;
    const double M = p->M, s2 = p->share * p->share;
    double *h = w->h, *e = w->e, *total = w->total;
    memset(h, 0, IMP_NORMAL_PAIRS * T * sizeof *h);
    memset(e, 0, IMP_NORMAL_UNITS * T * sizeof *e);
    memset(total, 0, T * sizeof *total);
    for (int a = 0; a < p->M; a++)
        for (int b = a + 1; b < p->M; b++, h += T) {
            pair(j, p, a, b, h);
            for (size_t k = 0; k < T; k++) {
                e[(size_t)a * T + k] += h[k];
                e[(size_t)b * T + k] += h[k];
                total[k] += h[k];
            }
        }
    if (imp__loss_quadratic(j->target->desc.loss))
        for (size_t k = 0; k < T; k++)
            out->g[w->touched[k]] += p->share * total[k] / (M * (M - 1) / 2);
    for (int a = 0; a < p->M; a++) {
        double *own = e + (size_t)a * T;
        for (size_t k = 0; k < T; k++) own[k] = (own[k] - 2 * total[k] / M) / (M - 2);
        square_add(j, p, s2 * 4 / (M * (M - 1)), own, out->cov_g);
    }
    const double scale = s2 * 4 / (M * (M - 1) * (M - 2) * (M - 3));
    h = w->h;
    for (int a = 0; a < p->M; a++)
        for (int b = a + 1; b < p->M; b++, h += T) {
            for (size_t k = 0; k < T; k++)
                h[k] -= total[k] / (M * (M - 1) / 2) + e[(size_t)a * T + k] +
                        e[(size_t)b * T + k];
            square_add(j, p, scale, h, out->cov_excess);
        }
}

/* Variance of chi^2, of the mean over pairs of sum over channels of w r_a r_b: its
 * jackknife, and what that has too much. */
static void chi2_variance_add(const struct imp__normal_job *j,
                              const struct imp__normal_pixel *p, double *variance,
                              double *excess)
{
    const struct imp__normal_worker *w = p->w;
    const size_t S = (size_t)imp__normal_channels(j);
    const double M = p->M;
    double h[IMP_NORMAL_UNITS][IMP_NORMAL_UNITS], e[IMP_NORMAL_UNITS] = {0}, total = 0;
    double first = 0, second = 0;
    for (int a = 0; a < p->M; a++)
        for (int b = a + 1; b < p->M; b++) {
            double product = 0;
            for (size_t c = 0; c < S; c++)
                product += w->weight[c] * w->r[a][c] * w->r[b][c];
            h[a][b] = product;
            e[a] += product;
            e[b] += product;
            total += product;
        }
    for (int a = 0; a < p->M; a++) {
        e[a] = (e[a] - 2 * total / M) / (M - 2);
        first += e[a] * e[a];
    }
    for (int a = 0; a < p->M; a++)
        for (int b = a + 1; b < p->M; b++)
            second += imp__sqr(h[a][b] - total / (M * (M - 1) / 2) - e[a] - e[b]);
    const double scale = p->share * p->share * 4 / (M * (M - 1));
    *variance += scale * first;
    *excess += scale * second / ((M - 2) * (M - 3));
}

void imp__normal_slope_add(const struct imp__normal_job *j,
                           const struct imp__normal_pixel *p,
                           struct imp__normal_sums *out)
{
    gradient_add(j, p, out);
    chi2_variance_add(j, p, &out->scalars[IMP_NORMAL_CHI2_VARIANCE],
                      &out->scalars[IMP_NORMAL_CHI2_EXCESS]);
}
