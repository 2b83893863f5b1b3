/* SPDX-License-Identifier: Apache-2.0
 *
 * The film of a meter, whose pixels are read: how its channels make a reading. */
#ifndef IMP_INVERSE_GRID_FILM_H
#define IMP_INVERSE_GRID_FILM_H

#include "film/film_measure.h"

struct imp_grid_film {
    const struct imp_sensor *sensor;
    double weight[4]; /* of the channels in the luminance */
    int channels;
    int alone;   /* the first channel of points that do not share (imp__render_grid) */
    bool shared; /* walks reach many pixels, whose errors are not independent */
};
/* What imp_grid_read refuses. run: checked. */
enum imp_status imp__grid_film_of(const struct imp_scene *scene,
                                  const struct imp_run *run, struct imp_grid_film *out);
/* IMP_E_UNSUPPORTED for a film without errors. */
enum imp_status imp__grid_film_check(const struct imp_grid_film *grid,
                                     const imp_film *film);
/* Reading and error of a pixel. */
void imp__grid_film_take(const struct imp_grid_film *grid, const imp_film *film,
                         size_t pixel, double *value, double *se);
/* Mean of all pixels, where none depends on another or they share: error and degrees of freedom. */
enum imp_status imp__grid_film_mean(const struct imp_grid_film *grid,
                                    const imp_film *film, struct imp_estimate *out);
/* Degrees of freedom of the sum of n independent variances se^2, each of k. */
double imp__grid_freedom(size_t n, const double *se, double k);
/* Independent sets of samples of a pixel. */
static inline int64_t imp__grid_film_sets(const imp_film *film)
{
    return film->sets > 0 ? film->sets : film->spp;
}

#endif
