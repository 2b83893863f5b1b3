/* SPDX-License-Identifier: Apache-2.0
 *
 * What the samples of one pixel send through a filter wider than a pixel: a patch of sums
 * (film_sums.h), which is a stratum of the errors. */
#ifndef IMP_FILM_PATCH_H
#define IMP_FILM_PATCH_H

#include "film_picture.h"
#include "film_sums.h"

struct imp_patch {
    const struct imp_film_desc *film;
    int n;         /* values of a sample */
    int border;    /* reach of the filter in pixels; 0: box, and there is no patch */
    int tile_side; /* pixels */
};

/* Pixels that samples of one pixel reach: `border` on each side, and one more, for a
 * position may be rounded up to the pixel's end. */
static inline int imp__patch_side(const struct imp_patch *p) { return 2 * p->border + 2; }
/* Doubles of a patch, [side][side][IMP_WIDE_SUMS]. */
static inline size_t imp__patch_size(const struct imp_patch *p)
{
    const int side = imp__patch_side(p);
    return (size_t)(side * side) * (size_t)IMP_WIDE_SUMS(p->n);
}

/* Weight a sample into the pixels that the filter reaches. */
void imp__patch_splat(const struct imp_patch *p, const struct imp_tile *t, double *patch,
                      const struct imp_sample *s);
/* A set is one sample whose w and w v are sums. `set` has them in the places that they
 * have in the sums of a pixel; it is cleared. */
void imp__patch_set(double *sums, double *set, int n);
/* Add what pixel (x, y) sent in m samples to the tile, whose corner is (x0, y0) minus the
 * border, and clear the patch. */
void imp__patch_add(const struct imp_patch *p, const struct imp_tile *t, double *patch,
                    int x, int y, int m, double *tile);

#endif
