/* SPDX-License-Identifier: Apache-2.0
 *
 * Covariance of a gradient that is a sum over pixels and pairs of replicates,
 *
 *     g = sum_p  mean over a < b of h_p,ab,    h_ab = w/2 (r_a X_b + r_b X_a),  r = L - T
 *
 * where neighbouring pixels share walks. With g1 and g2 the parts of h of first and second
 * order (one replicate, two at once) and s2 the covariance of g2,
 *
 *     Cov(g) = 4 Cov(g1)/R + 2 s2/(R (R - 1))
 *     jackknife over replicates:   4 Cov(g1)/R + 4 s2/(R (R - 2))
 *
 * (Efron and Stein, Ann. Statist. 9, 1981): the jackknife is too large, of s2 by
 * 2 (R - 1)/(R - 2), 3 for four replicates. s2 is what pairs have beyond a sum of one
 * number a replicate,
 *
 *     s2 = 2/(R (R - 3)) sum over a < b of (h_ab - m - e_a - e_b)^2
 *
 * and the excess is 2 s2/((R - 1)(R - 2)). Sums over tiles of pixels are multiplied with those
 * of the tiles around, as far as a filter makes pixels share walks (docs/estimators.md 15). */
#ifndef IMP_INVERSE_PAIR_NOISE_H
#define IMP_INVERSE_PAIR_NOISE_H

#include "base/context.h"

struct imp__pair_noise {
    imp_context *ctx;
    size_t K;
    int R, pairs; /* replicates, at least 4; R (R - 1)/2 */
    int tiles_x, tiles_y;
    double *h; /* [tiles][pairs][K] */
};

enum imp_status imp__pair_noise_create(imp_context *ctx, int width, int height, int R,
                                       size_t K, struct imp__pair_noise *out);
void imp__pair_noise_destroy(struct imp__pair_noise *n);
/* Pixel (x, y): r [R] = L - T of the replicates, X [R][K], and the weight w. */
void imp__pair_noise_add(struct imp__pair_noise *n, int x, int y, double w,
                         const double *r, const double *X);
/* Adds the jackknife and its excess [K][K], lower triangles, where pixels share walks up to
 * `reach` pixels apart. Uses up the sums. */
enum imp_status imp__pair_noise_covariance(struct imp__pair_noise *n, int reach,
                                           double *covariance, double *excess);

#endif
