/* SPDX-License-Identifier: Apache-2.0
 *
 * What the units of one pixel add to the normal equations (gauss_newton.c has the formulas). */
#ifndef IMP_NORMAL_PIXEL_H
#define IMP_NORMAL_PIXEL_H

#include "normal_tiles.h"

struct imp__normal_pixel {
    struct imp__normal_worker *w;
    struct imp__tile_walks *walks;
    size_t index;         /* of the pixel */
    int M;                /* units */
    size_t T;             /* values touched */
    double share;         /* of the samples of the pixel that these are */
    double value, square; /* sums over replicates of the loss, and of its square */
};

/* The channels of L and x as the target sees them: its own, or their luminance. */
static inline int imp__normal_channels(const struct imp__normal_job *j)
{
    return j->target->desc.channels;
}

/* normal_channels.c: matrices and chi^2 of every channel, and what the noise of two has
 * together. */
void imp__normal_channels_add(const struct imp__normal_job *j,
                              const struct imp__normal_pixel *p,
                              struct imp__normal_sums *out);
/* normal_slope.c: the gradient with its covariance, and the variance of chi^2. */
void imp__normal_slope_add(const struct imp__normal_job *j,
                           const struct imp__normal_pixel *p,
                           struct imp__normal_sums *out);

#endif
