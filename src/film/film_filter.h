/* SPDX-License-Identifier: Apache-2.0
 *
 * Which pixels a sample reaches through the film's filter. */
#ifndef IMP_FILM_FILTER_H
#define IMP_FILM_FILTER_H

#include "kind/filter/filter.h"
#include <math.h>

/* How many pixels beyond its own a sample may reach. */
static inline int imp__film_border(const struct imp_film_desc *f)
{
    return f->filter.radius > 0.5 ? (int)ceil(f->filter.radius - 0.5) : 0;
}

/* What a filter gives, along one axis, of a sample at film coordinate x to the pixels
 * [first, first + n) that it reaches, no further than [lo, hi]. Filters are separable: n
 * + n of these make the weights of n n pixels. */
struct imp_taps {
    int first, n;
    double w[2 * (int)IMP_FILTER_RADIUS_MAX + 2];
};
static inline void imp__film_taps(const struct imp_filter *f, double x, int lo, int hi,
                                  struct imp_taps *out)
{
    out->first = imp_max((int)ceil(x - f->radius - 0.5), lo);
    out->n = imp_min((int)floor(x + f->radius - 0.5), hi) - out->first + 1;
    for (int k = 0; k < out->n; k++)
        out->w[k] = f->ops->eval(f, x - (out->first + k + 0.5));
}

#endif
