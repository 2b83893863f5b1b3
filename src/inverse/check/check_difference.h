/* SPDX-License-Identifier: Apache-2.0
 *
 * Differences of pictures with fresh random numbers, as fresh checks take them. */
#ifndef IMP_INVERSE_CHECK_DIFFERENCE_H
#define IMP_INVERSE_CHECK_DIFFERENCE_H

#include "check.h"

#define IMP_CHECK_BATCHES                                                                \
    16 /* independent differences behind an SE, known to 18 % then */

#define IMP_FRESH_STEP 0.3 /* of a value's scale (check_difference.c) */

/* The functional F = sum_pc s_pc I_pc that fresh checks differentiate, with a smooth positive
 * pattern s of mean 1/pixels. */
struct imp__fresh {
    struct imp__check *check;
    float *pattern; /* [height][width][channels] s */
    int channels;
    int more; /* samples per pixel of an evaluation, in units of the given number */
    uint64_t next_seed;
};
enum imp_status imp__fresh_begin(struct imp__fresh *f, struct imp__check *c);
void imp__fresh_end(struct imp__fresh *f); /* also after a failure */
uint64_t imp__fresh_seed(struct imp__fresh *f);
/* Samples per pixel of one batch. */
int imp__fresh_batch(const struct imp__fresh *f);

/* Derivative of F along x_dot [n active], from tangents. */
enum imp_status imp__fresh_slope(struct imp__fresh *f, const double *x_dot,
                                 struct imp_estimate *out);
/* F, by half as many samples. */
enum imp_status imp__fresh_value(struct imp__fresh *f, struct imp_estimate *out);

/* A parameter moved by step * weight[e]. */
struct imp__motion {
    const struct imp_param *param;
    const double *old, *weight; /* [count] */
    double scale;               /* of the values that move; 0: imp__check_scale */
};
struct imp__quotient {
    struct imp_estimate mean;
    double coarse;   /* by the formula of lower order; mean.value where there is none */
    double rounding; /* of the pictures' floats */
};
/* Difference quotient of F. `linear`: F is of first degree in the parameter. */
enum imp_status imp__fresh_difference(struct imp__fresh *f, const struct imp__motion *m,
                                      bool linear, double *step,
                                      struct imp__quotient *out);

#endif
