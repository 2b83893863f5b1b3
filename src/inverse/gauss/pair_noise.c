/* SPDX-License-Identifier: Apache-2.0
 *
 * Hoeffding's decomposition of products of replicates, tile by tile, and the covariance of their
 * sum (pair_noise.h). */
#include "pair_noise.h"
#include <string.h>

#define TILE 8 /* pixels */

enum imp_status imp__pair_noise_create(imp_context *ctx, int width, int height, int R,
                                       size_t K, struct imp__pair_noise *out)
{
    struct imp__pair_noise n = {.ctx = ctx,
                                .K = K,
                                .R = R,
                                .pairs = R * (R - 1) / 2,
                                .tiles_x = (width + TILE - 1) / TILE,
                                .tiles_y = (height + TILE - 1) / TILE};
    n.h = imp__alloc(ctx, (size_t)n.tiles_x * (size_t)n.tiles_y * (size_t)n.pairs,
                     K * sizeof *n.h);
    if (!n.h)
        return imp__error(ctx, IMP_E_NOMEM,
                          "no memory for the errors of %zu derivative pictures", K);
    *out = n;
    return IMP_OK;
}

void imp__pair_noise_destroy(struct imp__pair_noise *n)
{
    if (n->h) imp__release(n->ctx, n->h);
    n->h = NULL;
}

static size_t tile_size(const struct imp__pair_noise *n)
{
    return (size_t)n->pairs * n->K;
}

void imp__pair_noise_add(struct imp__pair_noise *n, int x, int y, double w,
                         const double *r, const double *X)
{
    const size_t K = n->K;
    double *h = n->h + (size_t)(y / TILE * n->tiles_x + x / TILE) * tile_size(n);
    for (int a = 0; a < n->R; a++)
        for (int b = a + 1; b < n->R; b++, h += K) {
            const double *xa = X + (size_t)a * K, *xb = X + (size_t)b * K;
            const double wa = 0.5 * w * r[a], wb = 0.5 * w * r[b];
            for (size_t k = 0; k < K; k++) h[k] += wa * xb[k] + wb * xa[k];
        }
}

/* Hoeffding decomposition of one tile and value: with m the mean over pairs, h_ab becomes
 * h_ab - m - e_a - e_b, in place, and e [R] the first-order terms. */
static void split(const struct imp__pair_noise *n, double *h, double *e)
{
    const int R = n->R;
    double total = 0;
    for (int a = 0; a < R; a++) e[a * (ptrdiff_t)n->K] = 0;
    const double *from = h;
    for (int a = 0; a < R; a++)
        for (int b = a + 1; b < R; b++, from += n->K) {
            e[a * (ptrdiff_t)n->K] += *from;
            e[b * (ptrdiff_t)n->K] += *from;
            total += *from;
        }
    for (int a = 0; a < R; a++) {
        double *own = e + a * (ptrdiff_t)n->K;
        *own = (*own - 2 * total / R) / (R - 2);
    }
    const double mean = total / n->pairs;
    for (int a = 0; a < R; a++)
        for (int b = a + 1; b < R; b++, h += n->K)
            *h -= mean + e[a * (ptrdiff_t)n->K] + e[b * (ptrdiff_t)n->K];
}

/* out [K][K] += scale * sum over tiles, `count` vectors each, of v times the sum of v
 * over the tiles around: the lower triangle of the symmetric part. */
static void products(const struct imp__pair_noise *n, const double *v, int count,
                     int around, double scale, double *sum, double *out)
{
    const size_t K = n->K;
    for (int y = 0; y < n->tiles_y; y++)
        for (int x = 0; x < n->tiles_x; x++)
            for (int i = 0; i < count; i++) {
                memset(sum, 0, K * sizeof *sum);
                for (int t = imp_max(0, y - around);
                     t <= imp_min(n->tiles_y - 1, y + around); t++)
                    for (int s = imp_max(0, x - around);
                         s <= imp_min(n->tiles_x - 1, x + around); s++) {
                        const double *u =
                            v +
                            ((size_t)(t * n->tiles_x + s) * (size_t)count + (size_t)i) *
                                K;
                        for (size_t k = 0; k < K; k++) sum[k] += u[k];
                    }
                const double *own =
                    v + ((size_t)(y * n->tiles_x + x) * (size_t)count + (size_t)i) * K;
                for (size_t k = 0; k < K; k++)
                    for (size_t m = 0; m <= k; m++)
                        out[k * K + m] +=
                            0.5 * scale * (own[k] * sum[m] + own[m] * sum[k]);
            }
}

enum imp_status imp__pair_noise_covariance(struct imp__pair_noise *n, int reach,
                                           double *covariance, double *excess)
{
    const size_t K = n->K, tiles = (size_t)n->tiles_x * (size_t)n->tiles_y;
    const int around = (reach + TILE - 1) / TILE;
    const double R = n->R;
    double *e = imp__alloc(n->ctx, (tiles * (size_t)n->R + 1) * K, sizeof *e);
    if (!e) return imp__error(n->ctx, IMP_E_NOMEM, "no memory for a covariance");
    double *sum = e + tiles * (size_t)n->R * K;
    for (size_t t = 0; t < tiles; t++)
        for (size_t k = 0; k < K; k++)
            split(n, n->h + t * tile_size(n) + k, e + t * (size_t)n->R * K + k);
    /* Without replicate b the mean over pairs is m - 2 e_b/(R - 1). */
    products(n, e, n->R, around, 4 / (R * (R - 1)), sum, covariance);
    products(n, n->h, n->pairs, around, 4 / (R * (R - 1) * (R - 2) * (R - 3)), sum,
             excess);
    imp__release(n->ctx, e);
    return IMP_OK;
}
