/* SPDX-License-Identifier: Apache-2.0
 *
 * Matrices of the normal equations from the units of a pixel, channel by channel, and what the
 * noise of two channels has together (gauss_newton.c has the formulas). */
#include "inverse/problem/loss.h"
#include "normal_pixel.h"
#include <math.h>
#include <string.h>

/* ---- One channel ---------------------------------------------------------------- */

/* Mean over pairs of different units of [a0, a1) of the residuals' product, of two channels. */
static double residual_product(const struct imp__normal_pixel *p, size_t c, size_t d,
                               int a0, int a1)
{
    const double n = a1 - a0;
    double sc = 0, sd = 0, both = 0;
    for (int a = a0; a < a1; a++) {
        sc += p->w->r[a][c];
        sd += p->w->r[a][d];
        both += p->w->r[a][c] * p->w->r[a][d];
    }
    return (sc * sd - both) / (n * (n - 1));
}
static double square_residual(const struct imp__normal_pixel *p, size_t c, int a0, int a1)
{
    return residual_product(p, c, c, a0, a1);
}

/* Sums of x and x x^T over units [a0, a1). */
static void products(const struct imp__normal_job *j, const struct imp__normal_pixel *p,
                     size_t c, int a0, int a1, double *sum, double *xx)
{
    const size_t T = p->T, S = (size_t)imp__normal_channels(j);
    memset(sum, 0, T * sizeof *sum);
    memset(xx, 0, T * T * sizeof *xx);
    for (int a = a0; a < a1; a++) {
        const double *x = p->w->X + ((size_t)a * S + c) * T;
        for (size_t k = 0; k < T; k++) {
            if (x[k] == 0) continue;
            sum[k] += x[k];
            for (size_t l = 0; l <= k; l++) xx[k * T + l] += x[k] * x[l];
        }
    }
}

/* What the jackknife over groups of units g makes of J^T W J: ((M - u)/M)^(1/2) times its
 * change when group g, u of the M units, is left out. */
static void deviations_add(const struct imp__normal_job *j,
                           const struct imp__normal_pixel *p, size_t c, double weight,
                           const double *sum, const double *xx, double *deviations)
{
    const size_t K = j->K, T = p->T, *touched = p->w->touched;
    const double M = p->M;
    double *own = p->w->own, *own_xx = own + T;
    for (int g = 0; g < IMP_DEVIATIONS; g++) {
        const int a0 = g * p->M / IMP_DEVIATIONS, a1 = (g + 1) * p->M / IMP_DEVIATIONS;
        const double n = M - (a1 - a0), scale = weight * p->share * sqrt(n / M);
        const double f = scale / (n * (n - 1)), all = scale / (M * (M - 1));
        double *H = deviations + (size_t)g * K * K;
        products(j, p, c, a0, a1, own, own_xx);
        for (size_t k = 0; k < T; k++) {
            const double xk = sum[k] - own[k];
            double *row = H + touched[k] * K;
            for (size_t l = 0; l <= k; l++) {
                const size_t kl = k * T + l;
                row[touched[l]] += f * (xk * (sum[l] - own[l]) - (xx[kl] - own_xx[kl])) -
                                   all * (sum[k] * sum[l] - xx[kl]);
            }
        }
    }
}

static void channel_add(const struct imp__normal_job *j,
                        const struct imp__normal_pixel *p, size_t c,
                        struct imp__normal_sums *out)
{
    struct imp__normal_worker *w = p->w;
    const size_t K = j->K, S = (size_t)imp__normal_channels(j), T = p->T;
    const size_t *touched = w->touched;
    const int half = p->M / 2;
    const double M = p->M, pairs = M * (M - 1), n0 = half, n1 = M - half;
    double factor[IMP_NORMAL_UNITS];
    const double weight =
        imp__normal_residuals(j->target, p->index, c, p->M, p->w->r, factor);
    const bool quadratic = imp__loss_quadratic(j->target->desc.loss);
    const bool known = j->target->noise_se != NULL;
    const double sigma = known ? j->target->noise_se[p->index * S + c] : 0;
    double *sum = w->sum, *xx = w->sum_xx, *sum1 = w->sum1, *xx1 = w->sum1_xx;
    w->weight[c] = weight;
    products(j, p, c, 0, half, sum, xx);
    products(j, p, c, half, p->M, sum1, xx1);
    /* Cross-fitted: J^T J of each half times the squared residual of the other. */
    const double meas = 0.5 * weight * weight * p->share;
    const double m0 =
        known ? 0 : meas / (n0 * (n0 - 1)) * square_residual(p, c, half, p->M);
    const double m1 = known ? 0 : meas / (n1 * (n1 - 1)) * square_residual(p, c, 0, half);
    const double m = 2 * meas * sigma * sigma / pairs;
    const double h = weight * p->share / pairs, same = weight * p->share / (M * M);
    for (size_t k = 0; k < T; k++)
        for (size_t l = 0; l <= k; l++) {
            const size_t kl = k * T + l, to = touched[k] * K + touched[l];
            const double u0 = sum[k] * sum[l] - xx[kl], u1 = sum1[k] * sum1[l] - xx1[kl];
            const double all = (sum[k] + sum1[k]) * (sum[l] + sum1[l]);
            const double u = all - xx[kl] - xx1[kl];
            out->H[to] += h * u;
            out->H_same[to] += same * all;
            out->H_meas[to] += known ? m * u : m0 * u0 + m1 * u1;
        }
    out->scalars[IMP_NORMAL_CHI2] += weight * p->share * square_residual(p, c, 0, p->M);
    for (size_t i = 0; i < T * T; i++) xx[i] += xx1[i];
    for (size_t k = 0; k < T; k++) sum[k] += sum1[k];
    if (out->deviations) deviations_add(j, p, c, weight, sum, xx, out->deviations);
    for (size_t k = 0; !quadratic && k < T; k++)
        for (int a = 0; a < p->M; a++)
            out->g[touched[k]] +=
                p->share * factor[a] * w->X[((size_t)a * S + c) * T + k];
}

/* ---- Two channels ------------------------------------------------------------------ */

/* Sums of x of two channels, and of x_c x_d^T, over units [a0, a1). */
static void pair_products(const struct imp__normal_job *j,
                          const struct imp__normal_pixel *p, size_t c, size_t d, int a0,
                          int a1, double *sum_c, double *sum_d, double *xx)
{
    const size_t T = p->T, S = (size_t)imp__normal_channels(j);
    memset(sum_c, 0, T * sizeof *sum_c);
    memset(sum_d, 0, T * sizeof *sum_d);
    memset(xx, 0, T * T * sizeof *xx);
    for (int a = a0; a < a1; a++) {
        const double *xc = p->w->X + ((size_t)a * S + c) * T;
        const double *xd = p->w->X + ((size_t)a * S + d) * T;
        for (size_t k = 0; k < T; k++) {
            sum_c[k] += xc[k];
            sum_d[k] += xd[k];
            if (xc[k] == 0) continue;
            for (size_t l = 0; l < T; l++) xx[k * T + l] += xc[k] * xd[l];
        }
    }
}

/* What the noise of channels c < d has together: the cross-fitted product of residuals in place of
 * sigma^2; with given sigmas these, for a correlation that is known at the end. */
static void pair_add(const struct imp__normal_job *j, const struct imp__normal_pixel *p,
                     size_t c, size_t d, struct imp__normal_sums *out)
{
    const struct imp__normal_worker *w = p->w;
    const size_t K = j->K, S = (size_t)imp__normal_channels(j), T = p->T;
    const float *se = j->target->noise_se;
    const int half = p->M / 2;
    const double M = p->M, n0 = half, n1 = M - half;
    const double weight = w->weight[c] * w->weight[d] * p->share;
    double *c0 = w->sum, *c1 = w->sum1, *d0 = w->e, *d1 = w->e + T, *xx0 = w->sum_xx,
           *xx1 = w->sum1_xx, *to = out->H_meas, m0 = 0, m1 = 0, m = 0;
    if (weight == 0) return;
    if (se) {
        const double sc = se[p->index * S + c], sd = se[p->index * S + d];
        const double share = p->share;
        double *z = out->scalars + IMP_NORMAL_CHANNELS + 6 * (c + d - 1);
        z[0] += share * square_residual(p, c, 0, p->M);
        z[1] += share * square_residual(p, d, 0, p->M);
        z[2] += share * residual_product(p, c, d, 0, p->M);
        z[3] += share * sc * sc;
        z[4] += share * sd * sd;
        z[5] += share;
        m = weight * sc * sd / (M * (M - 1));
        to = out->cross + (c + d - 1) * K * K;
    } else {
        m0 = 0.5 * weight / (n0 * (n0 - 1)) * residual_product(p, c, d, half, p->M);
        m1 = 0.5 * weight / (n1 * (n1 - 1)) * residual_product(p, c, d, 0, half);
    }
    pair_products(j, p, c, d, 0, half, c0, d0, xx0);
    pair_products(j, p, c, d, half, p->M, c1, d1, xx1);
    for (size_t k = 0; k < T; k++)
        for (size_t l = 0; l <= k; l++) {
            const size_t kl = k * T + l, lk = l * T + k;
            const double same0 = xx0[kl] + xx0[lk], same1 = xx1[kl] + xx1[lk];
            const double u0 = c0[k] * d0[l] + c0[l] * d0[k] - same0,
                         u1 = c1[k] * d1[l] + c1[l] * d1[k] - same1;
            const double u = (c0[k] + c1[k]) * (d0[l] + d1[l]) +
                             (c0[l] + c1[l]) * (d0[k] + d1[k]) - same0 - same1;
            to[w->touched[k] * K + w->touched[l]] += se ? m * u : m0 * u0 + m1 * u1;
        }
}

void imp__normal_channels_add(const struct imp__normal_job *j,
                              const struct imp__normal_pixel *p,
                              struct imp__normal_sums *out)
{
    const size_t S = (size_t)imp__normal_channels(j);
    for (size_t c = 0; c < S; c++) channel_add(j, p, c, out);
    for (size_t c = 0; j->pairs && c < S; c++)
        for (size_t d = c + 1; d < S; d++) pair_add(j, p, c, d, out);
}

void imp__normal_cross(const struct imp__normal_job *j, struct imp__normal_sums *sums)
{
    const size_t KK = j->K * j->K;
    for (size_t pair = 0; sums->cross && pair < 3; pair++) {
        struct imp__channel_pair z;
        memcpy(&z, sums->scalars + IMP_NORMAL_CHANNELS + 6 * pair, sizeof z);
        const double rho = imp__channel_correlation(&z);
        for (size_t i = 0; i < KK; i++)
            sums->H_meas[i] += rho * sums->cross[pair * KK + i];
    }
}
