/* SPDX-License-Identifier: Apache-2.0
 *
 * Parameters as grids: textures, volumes, spectra. A coarse grid has one value for each
 * 2^level cells along an axis, at their middle; the fine values are linear between them,
 * x = P c, with weights that are positive and add up to 1, so that bounds of c are bounds
 * of x. */
#ifndef IMP_INVERSE_CELLS_H
#define IMP_INVERSE_CELLS_H

#include <importon/importon.h>
#include <stdbool.h>

struct imp__cells {
    size_t n[3]; /* z, y, x; the last is the fastest */
    size_t channels;
};

struct imp__cells imp__cells_of(const struct imp_param_info *info);
/* Texels of a picture or cells of a volume, which may be taken together. */
bool imp__cells_are_many(const struct imp_param_info *info);

struct imp__cells imp__cells_coarse(const struct imp__cells *fine, int level);
size_t imp__cells_count(const struct imp__cells *cells);
/* c: means of the fine values. */
void imp__cells_average(const struct imp__cells *fine, int level, const double *x,
                        double *c);
/* x = P c */
void imp__cells_prolong(const struct imp__cells *fine, int level, const double *c,
                        double *x);
/* c = P^T x: the gradient with respect to c from that with respect to x. */
void imp__cells_restrict(const struct imp__cells *fine, int level, const double *x,
                         double *c);

#endif
