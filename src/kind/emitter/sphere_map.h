/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of all directions. Columns are angles phi about the axis up (+y), rows go from
 * up to down; with u = phi/2pi and theta the angle to up,
 *
 *     d = (sin phi sin theta, cos theta, -cos phi sin theta),
 *
 * so that u = 1/2, the middle of the picture, is +z and u = 1/4 is +x. The centre of
 * column j is at u = (j + 1/2)/W. Row i is
 *
 *     latlong     at theta = pi i/(H - 1): the first and the last row are the poles, as
 *                 in Mitsuba's envmap
 *     equal_area  at cos theta = 1 - 2 (i + 1/2)/H: Lambert's cylindrical projection, in
 *                 which all texels have the solid angle 4 pi/(W H) (Morley et al. 2006)
 *
 * Between the centres a map is bilinear: in u and theta, or in u and cos theta, constant
 * above the first and below the last row. It is a sum over texels of hat functions, a
 * hat of the column times a hat of the row. */
#ifndef IMP_KIND_EMITTER_SPHERE_MAP_H
#define IMP_KIND_EMITTER_SPHERE_MAP_H

#include "math/vec.h"
#include <importon/importon.h>

struct imp__sphere_map {
    enum imp_sky_projection projection;
    int width, height; /* at least 2 */
};

/* u in [0, 1), and the row coordinate: i at the centre of row i, in [0, H - 1]. */
void imp__sphere_map_place(const struct imp__sphere_map *m, imp_v3 d, double *u,
                           double *row);
imp_v3 imp__sphere_direction(double u, double cos_theta, double sin_theta);
/* Cosine of theta at a row coordinate. */
double imp__sphere_map_cosine(const struct imp__sphere_map *m, double row);

/* Solid angle of the hat of a texel in row i, Int hat dw; the sum over all texels is 4 pi. */
double imp__sphere_map_weight(const struct imp__sphere_map *m, int i);
/* What draws in a row need of it, for maps that are IMP_LATLONG: sine and cosine of theta, and half the
 * hat's integral, towards the next row [0] and, with pi - theta, towards the one before [1]. */
struct imp__sphere_row {
    double sine[2], cosine[2], hat[2];
};
struct imp__sphere_row imp__sphere_map_row(const struct imp__sphere_map *m, int i);
/* theta with the density of the hat of row i per solid angle, from a uniform number; row: as above. */
void imp__sphere_map_draw(const struct imp__sphere_map *m,
                          const struct imp__sphere_row *row, int i, double r,
                          double *cos_theta, double *sin_theta);
/* Offset in columns with the density of a hat, 1 - |x|. */
static inline double imp__hat_draw(double r)
{
    return r < 0.5 ? sqrt(2 * r) - 1 : 1 - sqrt(2 * (1 - r));
}

#endif
