/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures of anything that can be sampled: radiance, derivatives, first hits. */
#ifndef IMP_FILM_PICTURE_H
#define IMP_FILM_PICTURE_H

#include "base/film.h"
#include "kind/filter/filter.h"
#include "walk/walk.h"

struct imp_picture {
    const struct imp_sensor *sensor;
    const char *stage; /* for progress */
    const char *names; /* channels, "R,G,B" */
    int n;             /* how many */
    /* Sample number `sample` of pixel (x, y): value [n] and its film position. The arena
     * is rewound afterwards. False: dropped, value is 0. Called by many threads at once.
     */
    bool (*sample)(const void *payload, struct imp_arena *arena, int x, int y,
                   int64_t sample, double *value, double *px, double *py);
    const void *payload;
    double *weights; /* [height][width] sums of filter weights; NULL: not wanted */
};

/* @return IMP_OK; IMP_CANCELLED with a valid picture; IMP_E_PATHS; IMP_E_NOMEM. */
enum imp_status imp__picture_make(imp_context *ctx, const struct imp_picture *picture,
                                  const struct imp_run *run, imp_film **out);

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

/* IMP_E_PATHS if more walks of all `walks` were dropped than the run allows; one is
 * always forgiven. */
enum imp_status imp__drops_check(imp_context *ctx, const struct imp_run *run,
                                 uint64_t dropped, double walks);

#endif
