/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses seen through filters wider than a pixel. A sample then reaches several pixels,
 * so its adjoint is known only when all of them are: pass 1 makes the picture of each
 * replicate, pass 2 walks the same random numbers again and weights sample i by (box filters
 * too, where draws from edges need the adjoints of all pixels, moved_adjoint.h; a few walks of a pixel
 * can then be kept until they have made its pictures, in one pass)
 *
 *     P_i = sum_p  w_ip / W_p  l'_p( (S_p - w_ip L_i) / (W_p - w_ip) )
 *
 * over the pixels p it reaches: its own part left out, the normaliser W fixed (it depends
 * on positions only; docs/estimators.md 5.4).
 *
 * Where the samples of a replicate are m sets of points, each set has a picture, and a
 * sample of set s takes the mean of the other sets' pictures:
 *
 *     P_i = 1/m sum_p  w_ip / W_p,s  l'_p( mean of S_p,t / W_p,t over t != s ) */
#ifndef IMP_INVERSE_SPLAT_H
#define IMP_INVERSE_SPLAT_H

#include "replicates.h"

struct imp__splat {
    const struct imp__target *target; /* NULL: a fixed adjoint image */
    const float *seed;
    const struct imp_film_desc *film;
    int channels;
    int n; /* pictures: of the replicates, or of their sets of points, m each */
    int m; /* 1: pictures of replicates */
    double **weights; /* [n][height][width] W_p */
    imp_film **films; /* [n] pictures; NULL entries with a fixed adjoint */
    double objective, objective_variance;
};

/* Two to four replicates of half the samples or fewer. */
enum imp_status imp__splat_create(const struct imp_problem *p,
                                  const struct imp_tracer *tracer,
                                  const struct imp__target *target, const float *seed,
                                  struct imp__replicates plan, const struct imp_run *run,
                                  struct imp__splat *out);
void imp__splat_destroy(imp_context *ctx, struct imp__splat *s);

/* The same pictures, to the bit, where a pixel's samples are its own, from walks that are traced for
 * another end: they take n of one set and pixel at once, IMP_SPLAT_SET at most. Walks that no
 * picture can hold are dropped before. Different pixels may be taken at once. `end`: all are there.
 * Ended by imp__splat_destroy. */
#define IMP_SPLAT_SET 64 /* walks of a pass of a picture (film/film_picture.c) */
enum imp_status imp__splat_begin(const struct imp_problem *p,
                                 const struct imp_tracer *tracer,
                                 const struct imp__target *target,
                                 struct imp__replicates plan, struct imp__splat *out);
void imp__splat_take(const struct imp__splat *s, int b, int set, size_t pixel, int n,
                     const struct imp_walk *walks);
void imp__splat_end(struct imp__splat *s, struct imp__replicates plan);

/* P_i of a sample of replicate b, set k of it, at film position (px, py). */
imp_spec imp__splat_adjoint(const struct imp__splat *s, int b, int k, double px,
                            double py, imp_spec L);
/* l' of pixel p at the mean of replicate b, or of all (b -1), as an adjoint of radiance: for what
 * is independent of the walks. */
imp_spec imp__splat_pixel(const struct imp__splat *s, int b, size_t p);

#endif
