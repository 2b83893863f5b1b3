/* SPDX-License-Identifier: Apache-2.0
 *
 * The texels of a bitmap, for kinds that draw directions or points by them. */
#ifndef IMP_KIND_TEXTURE_BITMAP_H
#define IMP_KIND_TEXTURE_BITMAP_H

#include "kind/build.h"

struct imp__texels {
    int width, height, channels; /* 1 or 3 */
    const float *data;           /* [height][width][channels], lives as the texture */
    bool plain;                  /* bilinear and repeated, and to_uv does nothing */
    int64_t negative; /* first texel of which the picture has a negative number,
                                    whatever became of it (mono); -1: none */
    double negative_value;
};
/* False: t is another texture. */
bool imp__bitmap_texels(const struct imp_texture *t, struct imp__texels *out);

/* A lookup: up to four texels, the elements of its parameter that they begin at, and their
 * weights (1 - a)(1 - b), a (1 - b), (1 - a) b, a b; `n` 1: the first alone. */
struct imp__cell {
    int n;
    uint32_t element[4];
    double a, b;
};
/* False: t is another texture, or has too many numbers. */
bool imp__bitmap_cell(const struct imp_texture *t, const struct imp_texcoord *at,
                      struct imp__cell *out);

#endif
