/* SPDX-License-Identifier: Apache-2.0
 *
 * How far pixels share walks, from the filter. A sample anywhere in pixel 0 weighs
 *
 *     a(d) = Int_-1/2^1/2 f(d + t) dt
 *
 * in pixel d. With * for the correlation, h = a * a is that of two pixels of the picture,
 * and also the part that walks of film pixel 0 have in the adjoints of those of film
 * pixel d; h * h is then the correlation of two such adjoints. */
#include "overlap.h"
#include "film/film_tiles.h"
#include <stdlib.h>

#define STEPS 64
#define FEW   8 /* degrees of freedom: the error itself is known to 25 % */
#define REACH ((int)IMP_FILTER_RADIUS_MAX + 1) /* numbers of a */
/* out(d) = sum over j of a(j) a(j + d) of an even a, both for 0 <= d; out ends at 2 n. */
static void correlate(const double *a, int n, double *out)
{
    for (int d = 0; d <= 2 * n; d++) {
        out[d] = 0;
        for (int j = -n; j <= n; j++)
            if (abs(j + d) <= n) out[d] += a[abs(j)] * a[abs(j + d)];
    }
}

/* Sum of k over the pairs of pixels within one tile, along an axis of `width` pixels in
 * tiles of `side`. */
static double pairs(const double *k, int n, int width, int side)
{
    double sum = 0;
    for (int x = 0; x < width; x += side) {
        const int w = imp_min(side, width - x);
        for (int d = -imp_min(n, w - 1); d <= imp_min(n, w - 1); d++)
            sum += k[abs(d)] * (w - abs(d));
    }
    return sum;
}

static double factor(const double *k, int n, int width, int height)
{
    const int side = IMP_TILE_SIDE;
    const double alone = k[0] * k[0] * width * height;
    const double in_tiles = pairs(k, n, width, side) * pairs(k, n, height, side) - alone;
    const double all = pairs(k, n, width, width) * pairs(k, n, height, height) - alone;
    /* A filter with negative lobes can make these cancel. */
    return in_tiles > 0 ? fmax(1, all / in_tiles) : 1;
}

struct imp__overlap imp__overlap_of(const struct imp_film_desc *film, int margin, int R)
{
    const int n = imp__film_border(film);
    const int width = film->crop_w + 2 * margin, height = film->crop_h + 2 * margin;
    double a[REACH], h[2 * REACH], hh[4 * REACH];
    for (int d = 0; d <= n; d++) {
        a[d] = 0;
        for (int i = 0; i < STEPS; i++) {
            const double x = d + (i + 0.5) / STEPS - 0.5;
            if (fabs(x) < film->filter.radius)
                a[d] += film->filter.ops->eval(&film->filter, x) / STEPS;
        }
    }
    correlate(a, n, h);
    correlate(h, 2 * n, hh);
    const int side = IMP_TILE_SIDE;
    const int64_t tiles =
        (int64_t)((width + side - 1) / side) * ((height + side - 1) / side);
    return (struct imp__overlap){.few = (R - 1) * tiles < FEW,
                                 .gradient = factor(hh, 4 * n, width, height),
                                 .loss = factor(h, 2 * n, film->crop_w, film->crop_h)};
}
