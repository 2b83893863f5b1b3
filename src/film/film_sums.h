/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of a picture's samples, from which means and errors follow.
 *
 * A sample counts in its own pixel where the filter is no wider than one (box): sums of v
 * and v^2 are in two arrays, 16 bytes per value. Wider filters weight it into all pixels
 * within their radius (docs/scene-format.md 10), and the pixel is the ratio sum w v / sum
 * w.
 *
 * Error of the ratio, with e = w (v - mean):  sum e^2 / (sum w)^2  if the samples were
 * spread over the filter at random. But every pixel sends the same number of them, and
 * what pixels differ by is no noise: beside a lamp the plain formula is too large many
 * times. So e is taken about its mean over the m samples that a pixel of the film sends
 * here in a pass (strata of Cochran, Sampling Techniques, 5.3 and 6.10):
 *     sum over strata  m/(m - 1) [sum e^2 - (sum e)^2/m] / (sum w)^2.
 *
 * Samples that depend on each other come in sets; then a set takes the place of a
 * sample, with the sums of its w and w v. With a box filter and sets of q samples the
 * squares are those of sets:  se^2 = R/(R - 1) [sum S^2 - q m^2 N] / N^2,  R = N/q.
 *
 * Order of the sums: over the passes of a tile in a fixed binary tree; then, of the tiles
 * that reach a pixel through a wide filter, in the tiles' order. Tiles keep their sums
 * apart until the end, so that parts of a picture, by tiles or by passes, can be made
 * elsewhere and merged to the bit. */
#ifndef IMP_FILM_SUMS_H
#define IMP_FILM_SUMS_H

#include "base/film.h"
#include "film_filter.h"
#include "film_tiles.h"
#include <float.h>

struct imp_film_sums {
    imp_context *ctx;
    int width, height;
    int n, n_films;                 /* values of a sample; films they are cut into */
    int border;                     /* reach of the filter in pixels; 0: box */
    int margin, side, across, down; /* of the tiles */
    double set;                     /* samples of a set, in the mean */
    int32_t *count; /* [tiles] samples of a pixel that are in, 0: nothing is known */
    /* box: of film f, [height][width][n / n_films] */
    double **sum, **square;
    /* wide: rows of tiles, [across][side + 2 border]^2[IMP_WIDE_SUMS] */
    double **rows;
};

/* Wide filters, a pixel: sum w, sum w^2, then for each channel sum w v, sum w^2 v, sum
 * w^2 v^2; the squares and products about their strata's means. */
#define IMP_WIDE_SUMS(n) (2 + 3 * (n))

/* Doubles of the pixels of a tile's result: box [side^2][n][2], wide
 * [(side + 2 border)^2][sums]. */
static inline size_t imp__film_sums_pixels(const struct imp_film_sums *s)
{
    const size_t side = (size_t)(s->side + 2 * s->border), n = (size_t)s->n;
    return side * side * (s->border ? IMP_WIDE_SUMS(n) : 2 * n);
}
/* Bytes of it all, the films made in the end included. */
double imp__film_sums_bytes(const struct imp_film_sums *s);
/* Sizes are set. Memory is not touched before a tile needs it. */
enum imp_status imp__film_sums_create(struct imp_film_sums *s);
void imp__film_sums_destroy(struct imp_film_sums *s);
/* Add the sums of `count` samples a pixel of a tile; different tiles at once. */
void imp__film_sums_add(struct imp_film_sums *s, size_t tile, const double *sums,
                        int count);
/* Means and errors of the films [n_films], which have none yet; the sums are used
 * up. `strata`: errors were taken within them. weights: as in struct imp_picture. */
enum imp_status imp__film_sums_finish(struct imp_film_sums *s, bool strata,
                                      double *weights, imp_film **films);
/* The same of what is there so far, into films with room for both; the sums stay. */
enum imp_status imp__film_sums_look(struct imp_film_sums *s, bool strata,
                                    imp_film **films);

/* ---- A pixel of a box filter ---------------------------------------------------------- */

/* Can a picture, of floats, hold them? Else their walk is dropped. */
static inline bool imp__fits_float(const double *value, int n)
{
    bool fine = true;
    for (int c = 0; c < n; c++) fine &= fabs(value[c]) <= FLT_MAX;
    return fine;
}
/* Sums of n values and of their squares, [n][2]. */
static inline void imp__box_add(const double *restrict value, int n,
                                double *restrict sums)
{
    for (int c = 0; c < n; c++) {
        sums[2 * c] += value[c];
        sums[2 * c + 1] += value[c] * value[c];
    }
}
/* The mean of W samples and its error, of the sums of a value and its squares; of W sums of q samples the
 * same per sample. */
float imp__box_mean(double sum, double W);
float imp__box_error(double sum, double square, double W, double q);

#endif
