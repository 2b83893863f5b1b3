/* SPDX-License-Identifier: Apache-2.0
 *
 * Variances of sums over pixels that share walks.
 *
 * Through a filter wider than a pixel the terms of neighbouring pixels are correlated, by
 * k(d) at a distance of d pixels along an axis. The variance of their sum is estimated
 * from replicates: from the spread V_0 of each pixel's terms, and from the spread V_T of
 * sums over tiles, which has the covariances within tiles too. Those between tiles are
 * taken as the kernel k has them where they are positive (docs/estimators.md 14):
 *
 *     V = V_T + (factor - 1) max(0, V_T - V_0)
 *
 *     factor = sum of k over all pairs of two pixels / the same over pairs in one tile
 *
 * V_T has R - 1 degrees of freedom for every tile of R replicates. Where these are few, V
 * is not taken below V_0. */
#ifndef IMP_INVERSE_OVERLAP_H
#define IMP_INVERSE_OVERLAP_H

#include "film/film_filter.h"

struct imp__overlap {
    double gradient; /* factor for what each pixel of the film sends */
    double loss;     /* factor for losses of pixels */
    bool few;        /* degrees of freedom */
};

/* The overlap in a picture whose film is sampled `margin` pixels beyond it on every side. */
struct imp__overlap imp__overlap_of(const struct imp_film_desc *film, int margin, int R);

static inline double imp__overlap_variance(double factor, bool few, double pixels,
                                           double tiles)
{
    const double most = few ? fmax(pixels, tiles) : tiles;
    return most + (factor - 1) * fmax(0, tiles - pixels);
}

#endif
