/* SPDX-License-Identifier: Apache-2.0
 *
 * What the samples of one pixel send through a filter. */
#include "film_patch.h"
#include <string.h>

/* One sample, or the sums of a set: wv(c) = w value[c]. */
static void accumulate(double *sums, double w, const double *value, int n)
{
    sums[0] += w;
    sums[1] += w * w;
    for (int c = 0; c < n; c++) {
        const double wv = w * value[c];
        sums[2 + 3 * c] += wv;
        sums[3 + 3 * c] += w * wv;
        sums[4 + 3 * c] += wv * wv;
    }
}

void imp__patch_set(double *sums, double *set, int n)
{
    const double w = set[0];
    if (set[1] == 0) return;
    sums[0] += w;
    sums[1] += w * w;
    for (int c = 0; c < n; c++) {
        const double wv = set[2 + 3 * c];
        sums[2 + 3 * c] += wv;
        sums[3 + 3 * c] += w * wv;
        sums[4 + 3 * c] += wv * wv;
    }
    memset(set, 0, (size_t)IMP_WIDE_SUMS(n) * sizeof *set);
}

void imp__patch_splat(const struct imp_patch *p, const struct imp_tile *t, double *patch,
                      const struct imp_sample *s)
{
    const struct imp_filter *f = &p->film->filter;
    const int n = p->n, b = p->border, side = imp__patch_side(p);
    struct imp_taps across, down;
    imp__film_taps(f, s->px - p->film->crop_x, imp_max(s->x, t->x0) - b,
                   imp_min(s->x + 1, t->x1 - 1) + b, &across);
    imp__film_taps(f, s->py - p->film->crop_y, imp_max(s->y, t->y0) - b,
                   imp_min(s->y + 1, t->y1 - 1) + b, &down);
    for (int j = 0; j < down.n; j++)
        for (int i = 0; i < across.n; i++) {
            const double w = down.w[j] * across.w[i];
            const int u = across.first + i - s->x + b, v = down.first + j - s->y + b;
            if (w != 0)
                accumulate(patch + (size_t)(v * side + u) * (size_t)IMP_WIDE_SUMS(n), w,
                           s->value, n);
        }
}

void imp__patch_add(const struct imp_patch *p, const struct imp_tile *t, double *patch,
                    int x, int y, int m, double *tile)
{
    const int n = p->n, side = imp__patch_side(p), stride = p->tile_side + 2 * p->border;
    const size_t sums = (size_t)IMP_WIDE_SUMS(n);
    const double each = m > 1 ? 1. / m : 0, factor = m > 1 ? m / (m - 1.) : 1;
    for (int j = 0; j < side; j++)
        for (int i = 0; i < side; i++) {
            double *from = patch + (size_t)(j * side + i) * sums;
            if (from[1] == 0) continue;
            double *to = tile + (size_t)((y - t->y0 + j) * stride + x - t->x0 + i) * sums;
            const double W = from[0];
            to[0] += W;
            to[1] += factor * (from[1] - W * W * each);
            for (int c = 0; c < n; c++) {
                const double wv = from[2 + 3 * c];
                to[2 + 3 * c] += wv;
                to[3 + 3 * c] += factor * (from[3 + 3 * c] - W * wv * each);
                to[4 + 3 * c] += factor * (from[4 + 3 * c] - wv * wv * each);
            }
            memset(from, 0, sums * sizeof *from);
        }
}
