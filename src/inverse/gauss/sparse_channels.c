/* SPDX-License-Identifier: Apache-2.0
 *
 * What noise the channels of a target share, in normal equations of many values: a walk brings its
 * noise to all channels of a pixel, so that those of a rendered picture are correlated nearly fully. */
#include "gauss_newton.h"
#include "normal_tiles.h"
#include "sparse_rows.h"
#include <math.h>

/* Mean over pairs of different units of the product of two channels' residuals. */
static double residual_product(const struct imp__row_block *b,
                               const struct imp__row_pixel *p, size_t c, size_t d)
{
    const size_t S = (size_t)b->channels;
    const double M = p->units;
    double sc = 0, sd = 0, both = 0;
    for (size_t a = 0; a < (size_t)p->units; a++) {
        const double *r = b->r + p->row + a * S;
        sc += r[c];
        sd += r[d];
        both += r[c] * r[d];
    }
    return (sc * sd - both) / (M * (M - 1));
}

static double correlation_of(const struct imp__rows *rows, size_t c, size_t d)
{
    struct imp__channel_pair sums = {0};
    for (size_t k = 0; k < rows->n_blocks; k++) {
        const struct imp__row_block *b = &rows->block[k];
        if (imp_max(c, d) >= (size_t)b->channels) continue;
        for (size_t i = 0; i < b->n_pixels; i++) {
            const struct imp__row_pixel *p = &b->pixel[i];
            if (!(p->noise_se[c] >= 0 && p->noise_se[d] >= 0) ||
                p->weight[c] * p->weight[d] == 0)
                continue;
            sums.cc += p->share * residual_product(b, p, c, c);
            sums.dd += p->share * residual_product(b, p, d, d);
            sums.cd += p->share * residual_product(b, p, c, d);
            sums.c += p->share * imp__sqr((double)p->noise_se[c]);
            sums.d += p->share * imp__sqr((double)p->noise_se[d]);
            sums.pixels += p->share;
        }
    }
    return imp__channel_correlation(&sums);
}

/* mix mix^T is the matrix of correlations (Cholesky). Three that are found one by one need not be
 * those of any noise: then the last one gives way. */
void imp__rows_share_noise(struct imp__rows *rows, const struct imp_problem *p)
{
    double(*m)[3] = rows->mix;
    m[0][0] = m[1][1] = m[2][2] = 1;
    rows->n_pixels = imp__normal_pixel_count(p);
    if (rows->n_pixels < IMP_PIXELS_A_VALUE * (double)p->n) rows->n_pixels = 0;
    if (rows->n_pixels == 0) return;
    const double r01 = correlation_of(rows, 0, 1), r02 = correlation_of(rows, 0, 2),
                 r12 = correlation_of(rows, 1, 2);
    m[1][0] = r01;
    m[1][1] = sqrt(1 - r01 * r01);
    m[2][0] = r02;
    const double left = sqrt(1 - r02 * r02), wanted = r12 - r01 * r02;
    m[2][1] = m[1][1] > 1e-6 ? imp_clamp(wanted / m[1][1], -left, left) : 0;
    m[2][2] = sqrt(fmax(0, left * left - m[2][1] * m[2][1]));
}
