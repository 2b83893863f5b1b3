/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures by poses: what a walk of a pixel has inside, and pictures of what draws from
 * edges bring (moved_gradient.h), which lie anywhere on the film. For every walk of a pixel there is
 * a sample of all kinds of draws, which are independent of the walks, so the pictures are added, and
 * the squares of their errors. Samples are strata along the list of edges, in sweeps that are
 * independent of each other: the spread of these is the error (film_light.h). */
#ifndef IMP_INVERSE_MOVED_PICTURES_H
#define IMP_INVERSE_MOVED_PICTURES_H

#include "film/film_picture.h"
#include "influence.h"
#include "moved_gradient.h"

/* x [active->n][channels] += derivatives of the walk's channels by poses. False: no memory. */
bool imp__moved_rows(const struct imp__moved_gradient *m, struct imp_arena *arena,
                     const struct imp_walk *walk, double *x);
/* A walk's radiance and its derivatives, [1 + active][channels], as a sample of a picture.
 * m NULL: no pose is active. */
void imp__moved_sample(const struct imp__moved_gradient *m,
                       const struct imp_tracer *tracer, struct imp_sample *s);

/* Which samples of draws make a picture: of each pixel of the film and its margin, `spp` from number
 * `first` on. */
struct imp__moved_run {
    const struct imp_run *run;
    const char *stage;
    int64_t first, spp;
};
/* mean, se [crop_h][crop_w][active->n][channels]; se may be NULL. Along x_dot [active->n]: with one
 * number in place of all, [channels]. As imp__light_picture_make; for a part nothing is set. */
enum imp_status imp__moved_pictures(const struct imp__moved_gradient *m,
                                    const struct imp__moved_run *r, const double *x_dot,
                                    double *mean, double *se);
/* Adds the numbers' pictures to films: to channels at, at + 1, .. of film, from column k of n
 * numbers. se NULL: the film's stay. */
void imp__moved_film_add(imp_film *film, int at, int channels, size_t k, size_t n,
                         const double *mean, const double *se);
/* The standard errors [f->n_groups] of sums over derivative pictures, of the draws alone. */
enum imp_status imp__moved_sums(const struct imp__moved_gradient *m,
                                const struct imp__functional *f,
                                const struct imp__moved_run *r, double *se);

#endif
