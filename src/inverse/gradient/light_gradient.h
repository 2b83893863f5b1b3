/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses and gradients of pictures made by light walks. A walk reaches many pixels, so
 * the adjoint of a pixel cannot leave out one walk at a time; it leaves out a set of
 * walks. A group has two sets A, B, of n walks a pixel each, and estimates
 *
 *     loss   of a quadratic l:  w/2 (I_A - T)(I_B - T)
 *     gradient:                 1/2 [ l'(I_A) dI_B + l'(I_B) dI_A ]
 *
 * The factors of each product come from different sets, so both are unbiased where l is
 * quadratic. Groups share no walk, and their spread gives the standard errors (G - 1
 * degrees of freedom). */
#ifndef IMP_INVERSE_LIGHT_GRADIENT_H
#define IMP_INVERSE_LIGHT_GRADIENT_H

#include "film/film_light.h"
#include "inverse/estimate/replicates.h"
#include "inverse/estimate/totals.h"

#define IMP_LIGHT_GROUPS 8 /* most of a loss */

struct imp_tile_worker;
struct imp__gradient_job;
struct imp__functional;

/* Adjoints of light walks: replicate b of a job has image b % n_images. */
struct imp__light_adjoints {
    const struct imp_film_desc *film;
    int channels;
    const struct imp_splat_scale *scale;
    int64_t first; /* number of the first walk */
    int n_images;
    const double *image[2]; /* [crop_h][crop_w][channels] */
};

/* What an adjoint image makes of light at a film position, by channels. */
imp_spec imp__light_adjoint_at(const struct imp__light_adjoints *a, const double *image,
                               double px, double py);

/* The walks of replicate b of a pixel, swept (gradient_job.c). Pixels only number walks:
 * walk i of pixel q in replicate b is first + (b n + i) pixels + q. */
void imp__light_replicate(struct imp__gradient_job *job, struct imp_tile_worker *worker,
                          int x, int y, int b);

/* imp_problem_reverse; adds to the totals, which are to be shared and ended. */
enum imp_status imp__light_reverse(struct imp_problem *p, const struct imp_tracer *tracer,
                                   const float *adjoint, const struct imp_run *run,
                                   struct imp__totals *totals);
/* Loss of one target: adds value and variance to *objective and *variance, and to gradient
 * and gradient_variance [n], which may be NULL. */
enum imp_status imp__light_objective(struct imp_problem *p,
                                     const struct imp__target *target,
                                     const struct imp_tracer *tracer,
                                     const struct imp_run *run, double *objective,
                                     double *variance, double *gradient,
                                     double *gradient_variance);
/* F of the picture and, with f->derivatives, of groups of derivative pictures: mean, se
 * [1 + n_groups]. */
enum imp_status imp__light_functional(const struct imp__functional *f,
                                      const struct imp_run *run, double *mean,
                                      double *se);

/* ---- light_rows.c: derivative pictures ---------------------------------------------- */

/* What a reach brings, and its derivatives: value [1 + active][channels]. value[0] is NaN
 * where there is no memory. */
void imp__light_row(const struct imp_tracer *tracer, const struct imp_light_walk *walk,
                    const struct imp_reach *reach, double *value);
/* The picture of light walks first, first + 1, .., first + walks - 1 with its derivative
 * pictures: mean [height][width][1 + active][channels]; lo, hi: part of the progress. */
enum imp_status imp__light_rows(const struct imp_tracer *tracer,
                                const struct imp_run *run, int64_t first, int64_t walks,
                                double lo, double hi, double *mean);
/* The same as films, out [1 + active]; and the derivative picture along x_dot. */
enum imp_status imp__light_jacobian(const struct imp_tracer *tracer,
                                    const struct imp_run *run, imp_film **out);
enum imp_status imp__light_forward(const struct imp_tracer *tracer, const double *x_dot,
                                   const struct imp_run *run, imp_film **out);

/* Groups of two sets of n walks a pixel. */
struct imp__light_plan {
    int groups, n;
};
struct imp__light_plan imp__light_plan_of(const struct imp_sensor *sensor, int spp);

#endif
