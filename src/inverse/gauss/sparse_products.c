/* SPDX-License-Identifier: Apache-2.0
 *
 * Products with the rows of a problem, and vectors with their covariances. All are
 * combinations of rows, X^T f: f is found pixel by pixel, and rows are added up in groups
 * of blocks whose sums are then added in order.
 *
 * The gradient's covariance (pair_noise.h): with h_ab = w/2 (r_a X_b + r_b X_a), their sum
 * over a < b  H = w/2 sum_b (R - r_b) X_b, R = sum r, and e_a = (sum_b h_ab - 2 H/M)/(M - 2),
 * the jackknife's covariance is s^2 4/(M (M-1)) sum_a e_a e_a^T, s the share, so that of
 *
 *     z = s (4/(M (M-1)))^1/2 sum_a xi_a e_a,      xi_a = -1 or 1 at random,
 *
 * and the excess that of  s (4/(M (M-1) (M-2) (M-3)))^1/2 sum_a<b xi_ab (h_ab - m - e_a - e_b),
 * m = 2 H/(M (M-1)). */
#include "math/hash.h"
#include "math/rng.h"
#include "normal_tiles.h"
#include "sparse_rows.h"
#include <math.h>
#include <string.h>

enum { UNITS = IMP_NORMAL_UNITS, WIDTH = IMP_SPARSE_WIDTH, RANGES = 64 };

/* f [units][channels][width] of a pixel. */
typedef void factors_fn(const struct imp__row_block *b, const struct imp__row_pixel *p,
                        int width, const void *payload, double *f);

struct job {
    const struct imp__rows *rows;
    int width;
    factors_fn *factors;
    const void *payload;
    double *out; /* [n][width] */
};

static inline uint32_t row_begin(const struct imp__row_block *b, size_t row)
{
    return row ? b->end[row - 1] : 0;
}

/* sum += X^T f of rows [row, row + count). */
static inline __attribute__((always_inline)) void scatter(const struct imp__row_block *b,
                                                          size_t row, size_t count,
                                                          int width, const double *f,
                                                          double *sum)
{
    uint32_t i = row_begin(b, row);
    for (size_t k = 0; k < count; k++, f += width)
        for (; i < b->end[row + k]; i++) {
            double *to = sum + (size_t)b->number[i] * (size_t)width;
            for (int v = 0; v < width; v++) to[v] += (double)b->value[i] * f[v];
        }
}

static enum imp_status group_work(size_t group, int worker, int slot, void *payload)
{
    const struct job *j = payload;
    const struct imp__rows *rows = j->rows;
    const int width = j->width;
    double *sum = rows->sums + group * rows->n * (size_t)width;
    double f[UNITS * 3 * WIDTH];
    (void)worker;
    (void)slot;
    memset(sum, 0, rows->n * (size_t)width * sizeof *sum);
    const size_t end = rows->n_blocks * (group + 1) / IMP_ROW_GROUPS;
    for (size_t k = rows->n_blocks * group / IMP_ROW_GROUPS; k < end; k++) {
        const struct imp__row_block *b = &rows->block[k];
        for (size_t i = 0; i < b->n_pixels; i++) {
            const struct imp__row_pixel *p = &b->pixel[i];
            const size_t count = (size_t)p->units * (size_t)b->channels;
            j->factors(b, p, width, j->payload, f);
            if (width == 1) scatter(b, p->row, count, 1, f, sum);
            else scatter(b, p->row, count, WIDTH, f, sum);
        }
    }
    return IMP_OK;
}

static enum imp_status range_work(size_t range, int worker, int slot, void *payload)
{
    const struct job *j = payload;
    const size_t all = j->rows->n * (size_t)j->width;
    (void)worker;
    (void)slot;
    for (size_t k = all * range / RANGES; k < all * (range + 1) / RANGES; k++) {
        double sum = 0;
        for (size_t g = 0; g < IMP_ROW_GROUPS; g++) sum += j->rows->sums[g * all + k];
        j->out[k] = sum;
    }
    return IMP_OK;
}

/* out [n][width] = sum over pixels of X^T f. */
static enum imp_status combine(const struct imp__rows *rows, int width,
                               factors_fn *factors, const void *payload, double *out)
{
    struct job j = {rows, width, factors, payload, out};
    const struct imp_loop groups = {
        .n_items = IMP_ROW_GROUPS, .work = group_work, .payload = &j};
    const struct imp_loop ranges = {.n_items = RANGES, .work = range_work, .payload = &j};
    enum imp_status st = imp__parallel(rows->ctx, &groups, NULL);
    if (st == IMP_OK) st = imp__parallel(rows->ctx, &ranges, NULL);
    return st;
}

/* ---- H v ------------------------------------------------------------------------ */

/* f_a = h (D - d_a), d_a = X_a . v. */
static inline __attribute__((always_inline)) void
product_factors(const struct imp__row_block *b, const struct imp__row_pixel *p, int width,
                const double *v, double *f)
{
    const size_t S = (size_t)b->channels, M = (size_t)p->units;
    double D[3 * WIDTH] = {0};
    uint32_t i = row_begin(b, p->row);
    for (size_t row = 0; row < M * S; row++) {
        double d[WIDTH] = {0};
        for (; i < b->end[p->row + row]; i++) {
            const double *x = v + (size_t)b->number[i] * (size_t)width;
            for (int k = 0; k < width; k++) d[k] += (double)b->value[i] * x[k];
        }
        for (int k = 0; k < width; k++) {
            f[row * (size_t)width + (size_t)k] = d[k];
            D[row % S * (size_t)width + (size_t)k] += d[k];
        }
    }
    for (size_t row = 0; row < M * S; row++) {
        const size_t c = row % S;
        const double h = p->weight[c] * p->share / ((double)M * (double)(M - 1));
        for (size_t k = 0; k < (size_t)width; k++) {
            double *d = &f[row * (size_t)width + k];
            *d = h * (D[c * (size_t)width + k] - *d);
        }
    }
}
static void product_of(const struct imp__row_block *b, const struct imp__row_pixel *p,
                       int width, const void *payload, double *f)
{
    if (width == 1) product_factors(b, p, 1, payload, f);
    else product_factors(b, p, WIDTH, payload, f);
}

enum imp_status imp__rows_product(const struct imp__rows *rows, int width,
                                  const double *v, double *y)
{
    return combine(rows, width, product_of, v, y);
}

static void gradient_of(const struct imp__row_block *b, const struct imp__row_pixel *p,
                        int width, const void *payload, double *f)
{
    const size_t count = (size_t)p->units * (size_t)b->channels;
    (void)width;
    (void)payload;
    for (size_t i = 0; i < count; i++) f[i] = b->push[p->row + i];
}

enum imp_status imp__rows_gradient(const struct imp__rows *rows, double *g)
{
    return combine(rows, 1, gradient_of, NULL, g);
}

/* ---- Draws ---------------------------------------------------------------------- */

struct noise_draw {
    uint64_t seed;
    const struct imp__rows *rows;
};

/* Signs of a pixel: bit k of number n of the vector `of`. */
static uint64_t bits(uint64_t seed, uint64_t key, int of, int number)
{
    return imp__mix64(imp__mix64(seed ^ imp__mix64(key)) +
                      (uint64_t)(of * 64 + number + 1) * 0x9e3779b97f4a7c15u);
}
static double sign(uint64_t word, int k) { return word >> k & 1 ? 1 : -1; }

/* f_b of sum over a of xi_a e_a, with P = sum xi_a r_a and Xi = sum xi_a. */
static double jackknife(double w, double M, double R, double r, double P, double Xi,
                        double xi)
{
    return w / 2 * (P + xi * (R - 2 * r) - 2 / M * Xi * (R - r)) / (M - 2);
}

struct residuals {
    double r[UNITS], R;
};
static struct residuals residuals_of(const struct imp__row_block *b,
                                     const struct imp__row_pixel *p, size_t c)
{
    struct residuals s = {.R = 0};
    for (int a = 0; a < p->units; a++) {
        s.r[a] = b->r[p->row + (size_t)a * (size_t)b->channels + c];
        s.R += s.r[a];
    }
    return s;
}

static void gradient_draw(const struct imp__row_block *b, const struct imp__row_pixel *p,
                          int width, const void *payload, double *f)
{
    const uint64_t seed = ((const struct noise_draw *)payload)->seed;
    const size_t S = (size_t)b->channels;
    const double M = p->units, scale = p->share * sqrt(4 / (M * (M - 1)));
    for (size_t c = 0; c < S; c++) {
        const struct residuals s = residuals_of(b, p, c);
        for (int v = 0; v < width; v++) {
            const uint64_t word = bits(seed, p->own, v, 0);
            double P = 0, Xi = 0;
            for (int a = 0; a < p->units; a++) {
                P += sign(word, a) * s.r[a];
                Xi += sign(word, a);
            }
            for (int a = 0; a < p->units; a++)
                f[((size_t)a * S + c) * (size_t)width + (size_t)v] =
                    scale * jackknife(p->weight[c], M, s.R, s.r[a], P, Xi, sign(word, a));
        }
    }
}

static void excess_draw(const struct imp__row_block *b, const struct imp__row_pixel *p,
                        int width, const void *payload, double *f)
{
    const uint64_t seed = ((const struct noise_draw *)payload)->seed;
    const size_t S = (size_t)b->channels;
    const double M = p->units, pairs = M * (M - 1) / 2;
    const double scale = p->share * sqrt(4 / (M * (M - 1) * (M - 2) * (M - 3)));
    for (size_t c = 0; c < S; c++) {
        const struct residuals s = residuals_of(b, p, c);
        for (int v = 0; v < width; v++) {
            double own[UNITS] = {0}, eta[UNITS] = {0}, P = 0, Xi = 0;
            for (int a = 0; a < p->units; a++) {
                const uint64_t word = bits(seed, p->own, v, 1 + a);
                for (int k = a + 1; k < p->units; k++) {
                    const double xi = sign(word, k);
                    own[a] += xi * s.r[k];
                    own[k] += xi * s.r[a];
                    eta[a] += xi;
                    eta[k] += xi;
                    Xi += xi;
                }
            }
            for (int a = 0; a < p->units; a++) P += eta[a] * s.r[a];
            for (int a = 0; a < p->units; a++)
                f[((size_t)a * S + c) * (size_t)width + (size_t)v] =
                    scale * (p->weight[c] / 2 * (own[a] - Xi / pairs * (s.R - s.r[a])) -
                             jackknife(p->weight[c], M, s.R, s.r[a], P, 2 * Xi, eta[a]));
        }
    }
}

/* xi of channel c. Residuals of one pixel have one sign: their products are the noise that channels
 * share (White 1980, by groups). */
static double channel_sign(const struct imp__rows *rows, uint64_t word, size_t c,
                           bool known)
{
    double xi = 0;
    if (!known) return sign(word, rows->n_pixels > 0 ? 0 : (int)c);
    for (size_t k = 0; k <= c; k++) xi += rows->mix[c][k] * sign(word, (int)k);
    return xi;
}

/* Noise of the target moves g by -w X sigma xi, X the mean over units; where sigma is not
 * known the residual replaces it, less what walks make of it. Parts of a pixel share
 * its signs. */
static void measurement_draw(const struct imp__row_block *b,
                             const struct imp__row_pixel *p, int width,
                             const void *payload, double *f)
{
    const struct noise_draw *draw = payload;
    const size_t S = (size_t)b->channels;
    const double M = p->units;
    for (size_t c = 0; c < S; c++) {
        const struct residuals s = residuals_of(b, p, c);
        const bool known = p->noise_se[c] >= 0;
        const double sigma =
            known ? (double)p->noise_se[c] : s.R / M * sqrt(b->noise_share);
        for (int v = 0; v < width; v++) {
            const double xi =
                channel_sign(draw->rows, bits(draw->seed, p->key, v, 63), c, known);
            for (int a = 0; a < p->units; a++)
                f[((size_t)a * S + c) * (size_t)width + (size_t)v] =
                    p->share * p->weight[c] * sigma * xi / M;
        }
    }
}

enum imp_status imp__rows_draw(const struct imp__rows *rows, enum imp__draw what,
                               uint64_t seed, double *z)
{
    factors_fn *const factors[] = {[IMP_DRAW_GRADIENT] = gradient_draw,
                                   [IMP_DRAW_EXCESS] = excess_draw,
                                   [IMP_DRAW_MEASUREMENT] = measurement_draw};
    const struct noise_draw draw = {seed, rows};
    return combine(rows, WIDTH, factors[what], &draw, z);
}
