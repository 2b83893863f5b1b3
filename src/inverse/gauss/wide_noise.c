/* SPDX-License-Identifier: Apache-2.0
 *
 * Noise of the target where pixels share walks. It is taken as correlated from pixel to
 * pixel as the filter makes it, since targets come through the same filter:
 *
 *     H_meas = sum_pq w_p w_q rho(p - q) sigma_p^2 J_p J_q
 *
 * with the squared residual for sigma^2 where that is not given. */
#include "inverse/problem/loss.h"
#include "wide.h"
#include <stdlib.h>

#define TAPS 16 /* reach of rho in pixels, at most */

/* rho at 0, 1, 2, ... pixels along one axis; returns how many are not 0. */
static int correlation(const struct imp_filter *f, double rho[TAPS])
{
    const int n = 512;
    int taps = 0;
    for (int d = 0; d < TAPS && d < 2 * f->radius; d++) {
        rho[d] = 0;
        for (int i = 0; i < n; i++) {
            const double t = f->radius * (2 * (i + 0.5) / n - 1);
            if (fabs(t - d) < f->radius)
                rho[d] += f->ops->eval(f, t) * f->ops->eval(f, t - d);
        }
        taps = d + 1;
    }
    for (int d = taps - 1; d >= 0; d--) rho[d] /= rho[0];
    return taps;
}

/* image = rho * image along one axis: `count` lines of n numbers, `stride` apart. */
static void smooth(double *image, int n, size_t stride, int count, size_t step,
                   const double *rho, int taps, double *row)
{
    for (int l = 0; l < count; l++) {
        double *line = image + (size_t)l * step;
        for (int i = 0; i < n; i++) row[i] = line[(size_t)i * stride];
        for (int i = 0; i < n; i++) {
            double sum = 0;
            for (int j = imp_max(0, i - taps + 1); j <= imp_min(n - 1, i + taps - 1); j++)
                sum += rho[abs(i - j)] * row[j];
            line[(size_t)i * stride] = sum;
        }
    }
}

/* sigma^2 from half of the replicates, w J from two quarters each, so that our own noise
 * is not correlated between the factors. */
static void measurement_fill(struct imp__wide *w, int c, int half)
{
    const size_t K = w->K, pixels = (size_t)w->width * (size_t)w->height;
    const int h = w->R / 2, quarter = w->R / 4;
    for (size_t p = 0; p < pixels; p++) {
        double S = 0, S2 = 0, all = 0, T;
        imp__wide_gather(w, p, c);
        for (int b = 0; b < w->R; b++) {
            all += w->L[b];
            if (b / h != half) continue;
            S += w->L[b];
            S2 += w->L[b] * w->L[b];
        }
        const double weight = imp__wide_weight(w, p, c, all / w->R, &T);
        w->sigma2[p] = w->noise_se
                           ? imp__sqr(w->noise_se[p * (size_t)w->seen + (size_t)c])
                           : 2 * imp__loss_unbiased(1, T, h, S, S2);
        for (size_t k = 0; k < K; k++) {
            double x[2] = {0, 0};
            for (int b = 0; b < w->R; b++)
                if (b / h != half)
                    x[b % h / quarter] += w->X[(size_t)b * K + k] / quarter;
            w->Xc[k * pixels + p] = weight * x[0];
            w->Xd[k * pixels + p] = weight * x[1];
        }
    }
}

void imp__wide_measurement(struct imp__wide *w, struct imp__normal_sums *out)
{
    const size_t K = w->K, pixels = (size_t)w->width * (size_t)w->height;
    double rho[TAPS];
    const int taps = correlation(&w->film->filter, rho);
    for (int c = 0; c < w->seen; c++)
        for (int half = 0; half < 2; half++) {
            measurement_fill(w, c, half);
            for (size_t k = 0; k < K; k++) {
                double *image = w->Xd + k * pixels;
                smooth(image, w->width, 1, w->height, (size_t)w->width, rho, taps,
                       w->row);
                smooth(image, w->height, (size_t)w->width, w->width, 1, rho, taps,
                       w->row);
            }
            for (size_t k = 0; k < K; k++)
                for (size_t m = 0; m <= k; m++) {
                    double sum = 0;
                    for (size_t p = 0; p < pixels; p++)
                        sum += w->sigma2[p] *
                               (w->Xc[k * pixels + p] * w->Xd[m * pixels + p] +
                                w->Xc[m * pixels + p] * w->Xd[k * pixels + p]);
                    out->H_meas[k * K + m] += sum / 4; /* symmetric; two halves */
                }
        }
}
