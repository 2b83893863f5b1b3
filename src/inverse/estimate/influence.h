/* SPDX-License-Identifier: Apache-2.0
 *
 * Standard errors of functionals of a picture, F = sum_p s_p I_p.
 *
 * Pixels of a filter wider than a pixel share samples, so their errors may not be added
 * as if they were independent. A pixel is a ratio, I_p = sum_i w_ip L_i / W_p with W_p =
 * sum_i w_ip, and to first order sample i moves F by
 *
 *     e_i = sum_p s_p w_ip / W_p (L_i - I_p)
 *
 * (linearised ratio estimator; Cochran, Sampling Techniques, 6.3). Samples are
 * independent, and every pixel q of the film sends the same number n of them, so that
 *
 *     Var F = sum_q n Var(e in q)                               (strata; Cochran, 5.3)
 *
 * I_p is known only when the picture is there, but e_i = A_i - B_i, where walks are in
 * one term and the picture in the other:
 *
 *     A_i = sum_p u_ip s_p L_i      B_i = sum_p u_ip s_p I_p      u_ip = w_ip / W_p
 *
 *     Var e = Var A - 2 sum_p s_p I_p Cov(A, u_p) + Var B
 *
 * A first pass makes some of the picture's walks again and finds the first term and the
 * covariances, one number a pixel, without the picture: ranks and parts share it. A
 * second pass finds Var B from the samples' positions, without a ray. Through a box
 * filter u is a constant of its stratum, and the first term is all. */
#ifndef IMP_INVERSE_INFLUENCE_H
#define IMP_INVERSE_INFLUENCE_H

#include "film/film_picture.h"
#include "inverse/problem/problem.h"

struct imp__moved_gradient;

struct imp__functional {
    struct imp_tracer tracer;
    const struct imp_film_desc *film;
    int channels, margin; /* extra pixels sampled on every side */
    int spp;              /* of the picture */
    const float *adjoint; /* s [height][width][channels] */
    double norm;          /* F = sum(adjoint * picture) / norm */
    const double *W;      /* [height][width]; NULL: box filter, spp everywhere */
    bool derivatives;     /* and sums of derivative pictures, in groups */
    const struct imp__moved_gradient *moved; /* of active poses, or NULL */
    const int *group;                        /* [tracer.active->n] */
    int n_groups;
    const imp_film *picture; /* when it is there; and the derivatives' */
    imp_film *const *films;  /* [tracer.active->n] */
};

/* Variances of F of the picture, and of the groups: n = 1 + n_groups numbers. */
struct imp__influence {
    double *variance; /* [n] sum over pixels of m/(m - 1) sum (A - mean A)^2 */
    double *cross;    /* [height][width][n] as well, with u_p; NULL: box filter */
};

/* Samples per pixel that errors of a picture of `spp` independent ones are taken from. */
int imp__error_spp(int spp);

/* The first pass. Release `out` with imp__influence_free, also after a failure.
 * @return as imp__picture_make; `out` is not whole for a part. */
enum imp_status imp__influence_sample(imp_context *ctx, const struct imp__functional *f,
                                      const struct imp_run *run,
                                      struct imp__influence *out);
/* The second: standard errors [n] of F. The picture is there. */
enum imp_status imp__influence_errors(imp_context *ctx, const struct imp__functional *f,
                                      const struct imp_run *run,
                                      const struct imp__influence *influence, double *se);
void imp__influence_free(imp_context *ctx, struct imp__influence *influence);

#endif
