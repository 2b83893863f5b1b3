/* SPDX-License-Identifier: Apache-2.0
 *
 * What light at a film position, brought by a draw from an edge, counts in an objective, and what
 * the noise of that adds to the variance of a gradient.
 *
 * Of a loss, the adjoint of a pixel is made of its walks, which are independent of the draws: the
 * mean A over the replicates' adjoints A_b, with nothing left out. The gradient is then
 *
 *     g = mean_b sum_p x_pb + sum_p A_p B_p
 *
 * with x_pb what replicate b of pixel p gives inside of its walks, and B_p the boundary's
 * derivative. The spread of x has the variance of the first term, that of the draws the variance
 * of the second at a fixed A. The rest, of A with x, is estimated by random contrasts: with signs
 * s of pixels and of pairs of replicates, e_m of contrast m,
 *
 *     i_m = sum_pb s x_pb / R      e_m = sum_p sum_b s A_pb B_p / R
 *     Var g = (both of the above) + mean over m of (i_m + e_m)^2 - i_m^2
 *
 * where e_m^2 is the product of two halves of the draws, so that their own noise is not counted
 * twice. Where pixels share walks, the signs are those of tiles. */
#ifndef IMP_INVERSE_MOVED_ADJOINT_H
#define IMP_INVERSE_MOVED_ADJOINT_H

#include "film/film_light.h"
#include "inverse/estimate/splat.h"
#include "walk/moved/boundary.h"

#define IMP_CONTRASTS IMP_FLUX_CONTRASTS /* signs are the bits of a word */
#define IMP_CONTRASTS_MANY                                                               \
    16 /* of gradients of many numbers: each has one of every number */

struct imp__moved_adjoint {
    imp_context *ctx;
    const struct imp_film_desc *film;
    int channels, margin;
    bool wide;     /* pixels share walks */
    int pairs;     /* of replicates; 0: a fixed adjoint, without noise */
    int contrasts; /* IMP_CONTRASTS at most */
    double *image; /* [crop_h][crop_w][channels] */
    double *apart; /* [pairs][crop_h][crop_w][channels]: (A_2q - A_2q+1)/R */
};

/* Adjoints of a fixed image, [crop_h][crop_w][channels], and of the pictures of a loss's R
 * replicates, an even number, which may be there later: `read` takes them (a merge of parts, which makes
 * no draw, has none: splat->n 0). Either is ended by imp__moved_adjoint_free. IMP_E_NOMEM. */
enum imp_status imp__moved_adjoint_fixed(imp_context *ctx,
                                         const struct imp_film_desc *film, int channels,
                                         const float *image,
                                         struct imp__moved_adjoint *out);
enum imp_status imp__moved_adjoint_loss(imp_context *ctx,
                                        const struct imp_film_desc *film, int channels,
                                        int R, int contrasts,
                                        struct imp__moved_adjoint *out);
void imp__moved_adjoint_read(struct imp__moved_adjoint *a,
                             const struct imp__splat *splat);
void imp__moved_adjoint_free(struct imp__moved_adjoint *a);

/* Signs of pixel (x, y), also of one in the margin, and of a pair: bit m of contrast m. */
uint64_t imp__contrast_signs(const struct imp__moved_adjoint *a, int x, int y, int pair);
static inline double imp__contrast_sign(uint64_t signs, int m)
{
    return signs >> m & 1 ? 1 : -1;
}

/* What light L at a film position counts; contrast [a->contrasts]: by each contrast of A (NULL:
 * not wanted). */
double imp__moved_adjoint_at(const struct imp__moved_adjoint *a,
                             const struct imp_splat_scale *scale, double px, double py,
                             const imp_spec *L, double *contrast);

#endif
