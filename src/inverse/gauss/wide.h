/* SPDX-License-Identifier: Apache-2.0
 *
 * Normal equations where pixels share walks: what wide.c and wide_noise.c have in common. */
#ifndef IMP_INVERSE_WIDE_H
#define IMP_INVERSE_WIDE_H

#include "gauss_newton.h"
#include "inverse/estimate/replicates.h"
#include "pair_noise.h"

struct imp__wide {
    imp_context *ctx;
    const struct imp__target *of;
    const struct imp_target *target; /* its description */
    const float *noise_se;
    const struct imp_film_desc *film;
    int width, height, channels, seen;       /* of the scene, of the target */
    bool luminance;                          /* that is what the target sees */
    bool pairs;                              /* channels may share their noise */
    const struct imp__moved_gradient *moved; /* NULL: no pose is active */
    int R;
    size_t K;
    imp_film *films[IMP_WIDE_REPLICATES]; /* channels: the radiance, then [K][channels] */
    double *rows[IMP_WIDE_REPLICATES];    /* the same of light walks */
    double *L, *X;                        /* of a pixel and channel: [R], [R][K] */
    double *sum;                          /* [K] */
    struct imp__pair_noise noise, loss_noise; /* of the gradient; of chi^2 */
    /* For H_meas, of two channels: [pixels], [K][pixels] each. */
    double *sigma2, *Xc, *Xd, *row;
};

/* L, X of a pixel and channel, as the target sees them. */
void imp__wide_gather(struct imp__wide *w, size_t pixel, int c);
/* The L alone. */
void imp__wide_radiances(const struct imp__wide *w, size_t pixel, int c,
                         double L[IMP_WIDE_REPLICATES]);
/* Weight of a pixel and channel, and the target that makes its loss 1/2 w (I - T)^2. */
double imp__wide_weight(const struct imp__wide *w, size_t pixel, int c, double mean,
                        double *T);
/* wide_noise.c: adds H_meas. */
void imp__wide_measurement(struct imp__wide *w, struct imp__normal_sums *out);

#endif
