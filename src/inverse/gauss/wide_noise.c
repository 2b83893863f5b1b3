/* SPDX-License-Identifier: Apache-2.0
 *
 * Noise of the target where pixels share walks. It is taken as correlated from pixel to
 * pixel as the filter makes it, since targets come through the same filter:
 *
 *     H_meas = sum_pq w_p w_q rho(p - q) sigma_p^2 J_p J_q
 *
 * with the squared residual for sigma^2 where that is not given. Channels of a pixel are correlated,
 * too, in pictures that were rendered nearly fully: sigma_p^2 J_p J_q is a sum over pairs of channels,
 * with the product of two residuals, or the given sigmas times a correlation. */
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

/* Mean over pairs of different replicates [b0, b1) of r_c r_d, the residuals of two channels. */
static double residual_product(const double *rc, const double *rd, int b0, int b1)
{
    const double n = b1 - b0;
    double sc = 0, sd = 0, both = 0;
    for (int b = b0; b < b1; b++) {
        sc += rc[b];
        sd += rd[b];
        both += rc[b] * rd[b];
    }
    return (sc * sd - both) / (n * (n - 1));
}

/* Residuals of a pixel and channel; its weight. */
static double residuals(struct imp__wide *w, size_t p, int c,
                        double r[IMP_WIDE_REPLICATES])
{
    double all = 0, T;
    imp__wide_radiances(w, p, c, r);
    for (int b = 0; b < w->R; b++) all += r[b];
    const double weight = imp__wide_weight(w, p, c, all / w->R, &T);
    for (int b = 0; b < w->R; b++) r[b] -= T;
    return weight;
}

static double channel_correlation(struct imp__wide *w, int c, int d)
{
    const size_t pixels = (size_t)w->width * (size_t)w->height, S = (size_t)w->seen;
    struct imp__channel_pair sums = {0};
    if (c == d) return 1;
    for (size_t p = 0; p < pixels; p++) {
        double rc[IMP_WIDE_REPLICATES], rd[IMP_WIDE_REPLICATES];
        if (residuals(w, p, c, rc) == 0 || residuals(w, p, d, rd) == 0) continue;
        sums.cc += residual_product(rc, rc, 0, w->R);
        sums.dd += residual_product(rd, rd, 0, w->R);
        sums.cd += residual_product(rc, rd, 0, w->R);
        sums.c += imp__sqr(w->noise_se[p * S + (size_t)c]);
        sums.d += imp__sqr(w->noise_se[p * S + (size_t)d]);
        sums.pixels++;
    }
    return imp__channel_correlation(&sums);
}

/* The covariance of the noise of two channels at each pixel, from half of the replicates. */
static void covariance_fill(struct imp__wide *w, int c, int d, int half)
{
    const size_t pixels = (size_t)w->width * (size_t)w->height, S = (size_t)w->seen;
    const int h = w->R / 2;
    const double rho = w->noise_se ? channel_correlation(w, c, d) : 0;
    for (size_t p = 0; p < pixels; p++) {
        double rc[IMP_WIDE_REPLICATES], rd[IMP_WIDE_REPLICATES];
        if (w->noise_se) {
            w->sigma2[p] =
                rho * w->noise_se[p * S + (size_t)c] * w->noise_se[p * S + (size_t)d];
            continue;
        }
        residuals(w, p, c, rc);
        residuals(w, p, d, rd);
        w->sigma2[p] = residual_product(rc, rd, half * h, half * h + h);
    }
}

/* w J of a channel, [K][pixels], from a quarter of the replicates in the half that is not `half`. */
static void derivatives_fill(struct imp__wide *w, int c, int half, int quarter,
                             double *out)
{
    const size_t K = w->K, pixels = (size_t)w->width * (size_t)w->height;
    const int q = w->R / 4, first = (half ? 0 : w->R / 2) + quarter * q;
    for (size_t p = 0; p < pixels; p++) {
        double all = 0, T;
        imp__wide_gather(w, p, c);
        for (int b = 0; b < w->R; b++) all += w->L[b];
        const double weight = imp__wide_weight(w, p, c, all / w->R, &T);
        for (size_t k = 0; k < K; k++) {
            double x = 0;
            for (int b = first; b < first + q; b++) x += w->X[(size_t)b * K + k];
            out[k * pixels + p] = weight * x / q;
        }
    }
}

/* Adds what channels c, of Xc, and d, of Xd, have together. */
static void products_add(const struct imp__wide *w, double *H)
{
    const size_t K = w->K, pixels = (size_t)w->width * (size_t)w->height;
    for (size_t k = 0; k < K; k++)
        for (size_t m = 0; m <= k; m++) {
            const double *ck = w->Xc + k * pixels, *cm = w->Xc + m * pixels,
                         *dk = w->Xd + k * pixels, *dm = w->Xd + m * pixels;
            double sum = 0;
            for (size_t p = 0; p < pixels; p++)
                sum += w->sigma2[p] * (ck[p] * dm[p] + cm[p] * dk[p]);
            H[k * K + m] += sum / 4; /* symmetric; two halves */
        }
}

/* sigma^2 from half of the replicates, w J from two quarters of the other half each, so that our own
 * noise is not correlated between the factors. */
void imp__wide_measurement(struct imp__wide *w, struct imp__normal_sums *out)
{
    const size_t K = w->K, pixels = (size_t)w->width * (size_t)w->height;
    double rho[TAPS];
    const int taps = correlation(&w->film->filter, rho);
    for (int half = 0; half < 2; half++)
        for (int d = 0; d < w->seen; d++) {
            derivatives_fill(w, d, half, 1, w->Xd);
            for (size_t k = 0; k < K; k++) {
                double *image = w->Xd + k * pixels;
                smooth(image, w->width, 1, w->height, (size_t)w->width, rho, taps,
                       w->row);
                smooth(image, w->height, (size_t)w->width, w->width, 1, rho, taps,
                       w->row);
            }
            for (int c = 0; c < w->seen; c++) {
                if (c != d && !w->pairs) continue;
                covariance_fill(w, c, d, half);
                derivatives_fill(w, c, half, 0, w->Xc);
                products_add(w, out->H_meas);
            }
        }
}
