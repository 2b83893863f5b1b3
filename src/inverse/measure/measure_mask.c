/* SPDX-License-Identifier: Apache-2.0
 *
 * Blocks of pixels that do not fit where most others do. The logarithms of the blocks' mean squared
 * residuals have a median and a spread, by the median of their deviations from it; noise alone
 * makes the latter sqrt(2/n) for n values. What is many of these above the median has moved, or is not
 * in the scene; what a wrong number of the scene does is spread over many blocks, and raises the
 * median and the spread. */
#include "measuring.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST 0.25 /* of the blocks; more are no outliers */

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* of [n] is sorted. */
static double median(double *of, size_t n)
{
    qsort(of, n, sizeof *of, ascending);
    return n % 2 ? of[n / 2] : (of[n / 2 - 1] + of[n / 2]) / 2;
}

/* Logarithm of a block's squared residuals over what noise makes of them; NAN: nothing is compared. */
static double block_level(const struct imp__photo *p, int column, int row, int *values)
{
    double square = 0, expected = 0;
    int n = 0;
    for (int y = row * p->block; y < imp_min((row + 1) * p->block, p->desc.height); y++)
        for (int x = column * p->block;
             x < imp_min((column + 1) * p->block, p->desc.width); x++) {
            const size_t at = (size_t)y * (size_t)p->desc.width + (size_t)x;
            if (!(p->expected[at] > 0) || (p->desc.weights && !(p->desc.weights[at] > 0)))
                continue;
            square += (double)p->square[at];
            expected += (double)p->expected[at] + (double)p->edges[at];
            n++;
        }
    *values = n * p->desc.channels;
    return square > 0 ? log(square / expected) : NAN;
}

/* level [n] of blocks; marks those above `high`, those that are masked and above `low`, so that a block near
 * the limit does not come and go, and neighbours of these above `low`. */
static size_t blocks_mark(const struct imp__photo *p, const double *level, double high,
                          double low, uint8_t *mark)
{
    size_t n = 0;
    bool grown = true;
    for (int k = 0; k < p->columns * p->rows; k++)
        mark[k] = level[k] > high || (p->masked[k] && level[k] > low);
    while (grown) {
        grown = false;
        for (int k = 0; k < p->columns * p->rows; k++) {
            const int x = k % p->columns, y = k / p->columns;
            if (mark[k] || !(level[k] > low)) continue;
            for (int j = imp_max(0, y - 1); j <= imp_min(p->rows - 1, y + 1); j++)
                for (int i = imp_max(0, x - 1); i <= imp_min(p->columns - 1, x + 1); i++)
                    if (mark[j * p->columns + i]) mark[k] = 1, grown = true;
        }
    }
    for (int k = 0; k < p->columns * p->rows; k++) n += mark[k];
    return n;
}

void imp__measure_weights(struct imp__photo *p)
{
    for (size_t i = 0; i < p->n_pixels; i++) {
        const int x = (int)(i % (size_t)p->desc.width) / p->block,
                  y = (int)(i / (size_t)p->desc.width) / p->block;
        p->weights[i] = p->masked[y * p->columns + x] ? 0
                        : p->desc.weights             ? p->desc.weights[i]
                                                      : 1;
    }
}

static enum imp_status mask_say(struct imp__measure *m, const struct imp__photo *p,
                                const double *level, double middle)
{
    int left = p->desc.width, right = 0, top = p->desc.height, bottom = 0;
    double most = -INFINITY;
    for (int k = 0; k < p->columns * p->rows; k++) {
        if (!p->masked[k]) continue;
        left = imp_min(left, k % p->columns * p->block);
        right = imp_max(right, (k % p->columns + 1) * p->block);
        top = imp_min(top, k / p->columns * p->block);
        bottom = imp_max(bottom, (k / p->columns + 1) * p->block);
        most = fmax(most, level[k]);
    }
    if (p->n_masked == 0)
        return imp__measure_say(m, "%s: no block is masked any more", p->name);
    return imp__measure_say(
        m,
        "%s: %zu of %d blocks of %d x %d pixels are masked, within "
        "columns %d to %d and rows %d to %d: their residuals are up to "
        "%.3g times the median",
        p->name, p->n_masked, p->columns * p->rows, p->block, p->block, left,
        imp_min(right, p->desc.width) - 1, top, imp_min(bottom, p->desc.height) - 1,
        exp((most - middle) / 2));
}

enum imp_status imp__measure_mask(struct imp__measure *m, struct imp__photo *p,
                                  bool *changed)
{
    enum imp_status st = IMP_OK;
    const size_t n = (size_t)p->columns * (size_t)p->rows;
    double *level = imp__alloc(m->ctx, 2 * n, sizeof *level), *sorted = level + n;
    uint8_t *mark = imp__alloc(m->ctx, n, 1);
    size_t known = 0;
    double values = 0;
    if (!level || !mark) IMP_TRY(imp__error(m->ctx, IMP_E_NOMEM, "no memory for masks"));
    for (size_t k = 0; k < n; k++) {
        int count;
        level[k] = block_level(p, (int)(k % (size_t)p->columns),
                               (int)(k / (size_t)p->columns), &count);
        if (isnan(level[k])) continue;
        sorted[known++] = level[k];
        values = fmax(values, count);
    }
    if (known == 0 || m->o.mask < 0) goto out;
    const double middle = median(sorted, known);
    for (size_t k = 0; k < known; k++) sorted[k] = fabs(sorted[k] - middle);
    const double spread = fmax(1.4826 * median(sorted, known), sqrt(2 / values));
    const size_t found = blocks_mark(p, level, middle + m->o.mask * spread,
                                     middle + 0.5 * m->o.mask * spread, mark);
    if ((double)found > MOST * (double)known) {
        IMP_TRY(imp__measure_say(m,
                                 "%s: %zu of %zu blocks do not fit like the others: too "
                                 "many for outliers, none is masked",
                                 p->name, found, known));
        memset(mark, 0, n);
    }
    if (!memcmp(mark, p->masked, n)) goto out;
    *changed = true;
    memcpy(p->masked, mark, n);
    p->n_masked = 0;
    for (size_t k = 0; k < n; k++) p->n_masked += mark[k];
    imp__measure_weights(p);
    IMP_TRY(mask_say(m, p, level, middle));
out:
    imp__release(m->ctx, level);
    imp__release(m->ctx, mark);
    return st;
}
