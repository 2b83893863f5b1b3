/* SPDX-License-Identifier: Apache-2.0
 *
 * Recursive control variates of pictures whose parameters change little from one evaluation
 * to the next (Nicolet et al. 2023; docs/estimators.md 21). The walks of evaluation t are
 * evaluated at the parameters of evaluation t - 1, too, and what was known of the picture
 * there is carried on:
 *
 *     I_t = F + w (I_{t-1} - H)       F, H: means of the walks at theta_t and theta_{t-1}
 *
 * The residual that weighs a walk's derivative is made of the other walks' F - w H, and
 * of I_{t-1}. w is cross-fitted, known before the walks are drawn and independent of the
 * pixel: that of the pixels where x + y is even is estimated from the others, and the
 * other way round. Where its expected gain is too small, it is disabled for that half:
 * its pictures are F alone, and in the other half few pixels are evaluated at
 * theta_{t-1}, by which it is enabled again. */
#ifndef IMP_INVERSE_VARIATE_H
#define IMP_INVERSE_VARIATE_H

#include "inverse/estimate/replicates.h"

/* Sums over half of the pixels, with the weights of the loss: variances of F and of H,
 * covariance. */
enum { IMP_VARIATE_F, IMP_VARIATE_H, IMP_VARIATE_BOTH, IMP_VARIATE_KINDS };
/* Groups of pixels: the even ones, the few among them, the odd ones, the few among them. */
enum { IMP_VARIATE_MOMENTS = 4 * IMP_VARIATE_KINDS };
/* Pixels whose walks are evaluated at theta_{t-1}, too. */
enum imp__variate_looks { IMP_VARIATE_AT_NONE, IMP_VARIATE_AT_FEW, IMP_VARIATE_AT_ALL };

/* The picture of a target, or of a part of one. */
struct imp__variate_view {
    const struct imp__target *target;
    size_t n; /* numbers of the picture */
    int width, channels;
    size_t chunks;                 /* work items that a pixel has at most */
    double *last;                  /* [n] I_{t-1} */
    double *sum;                   /* [chunks][n] parts of F - w H of this evaluation */
    enum imp__variate_looks looks; /* in this evaluation */
    struct {
        bool rests;                       /* disabled in this evaluation: w is 0 */
        double w;                         /* of this evaluation */
        double variance;                  /* of `last`, estimated from the other half */
        double before[IMP_VARIATE_KINDS]; /* moments of the other half, so far */
    } half[2];
    double moments[IMP_VARIATE_MOMENTS]; /* of this evaluation */
};

struct imp__variate {
    imp_context *ctx;
    struct imp_scene *there; /* the scene at the parameters of the last evaluation */
    int evaluations;         /* so far; 0: `last` is empty */
    int n_views;
    struct imp__variate_view *views;
};

/* Nothing is known yet. IMP_E_UNSUPPORTED: not possible, by name. */
enum imp_status imp__variate_create(const struct imp_problem *p,
                                    const struct imp_run *run, struct imp__variate **out);
void imp__variate_destroy(struct imp__variate *v);

/* Targets have changed what pictures are: begin anew. v may be NULL. */
void imp__variate_forget(struct imp__variate *v);

/* Around the estimates of all targets: what they have so far is cleared; when they are
 * complete, the pictures take a step, and `there` takes the scene's present parameters. */
void imp__variate_begin(struct imp__variate *v);
enum imp_status imp__variate_end(struct imp__variate *v, const struct imp_problem *p);

/* The view of a target, whose walks `here` traces from now on; `there` evaluates them. */
struct imp__variate_view *imp__variate_use(struct imp__variate *v,
                                           const struct imp__target *target,
                                           struct imp_tracer *here,
                                           struct imp_tracer *there);
/* Room for pixels of so many work items. */
enum imp_status imp__variate_room(imp_context *ctx, struct imp__variate_view *view,
                                  size_t chunks);

/* One of eight squares of 2 x 2 pixels. */
static inline bool imp__variate_few(const struct imp__variate_view *view, size_t pixel)
{
    const size_t x = pixel % (size_t)view->width, y = pixel / (size_t)view->width;
    return (x / 2 + 3 * (y / 2)) % 8 == 0;
}
/* Are the walks of this pixel evaluated at theta_{t-1}? */
static inline bool imp__variate_looks(const struct imp__variate_view *view, size_t pixel)
{
    return view->looks == IMP_VARIATE_AT_ALL ||
           (view->looks == IMP_VARIATE_AT_FEW && imp__variate_few(view, pixel));
}
/* A replicate's m sets at a pixel: L and H [m] are means of their walks at the two sets
 * of parameters; H is 0 where it is not evaluated. Adds to the sums of chunk k and to `moments`
 * (NULL: to neither); H becomes L + w (last - H). */
void imp__variate_replicate(struct imp__variate_view *view, const struct imp__target *t,
                            struct imp__replicates plan, int k, size_t pixel,
                            const imp_spec *L, imp_spec *H, double *moments);

/* The state that an evaluation leaves to the next, as so many doubles: for
 * checkpoints. */
size_t imp__variate_numbers(const struct imp__variate *v, const struct imp_problem *p);
void imp__variate_save(const struct imp__variate *v, const struct imp_problem *p,
                       double *numbers);
void imp__variate_restore(struct imp__variate *v, const struct imp_problem *p,
                          const double *numbers);

/* Variance of the walks of one evaluation over that of the pictures that are carried on;
 * 1 where there are none yet. */
double imp__variate_gain(const struct imp__variate *v);

#endif
