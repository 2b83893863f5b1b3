/* SPDX-License-Identifier: Apache-2.0
 *
 * Intel's Open Image Denoise, found when it is first used: the library has no need of it
 * otherwise. */
#ifndef IMP_FILM_DENOISER_H
#define IMP_FILM_DENOISER_H

#include "base/context.h"

/* Is there one? IMP_E_UNSUPPORTED, with what to do. */
enum imp_status imp__denoiser_find(imp_context *ctx);
/* Colour, albedo and normal are [height][width][3]; out too, and may be colour.
 * IMP_E_UNSUPPORTED, with what to do, where there is none. */
enum imp_status imp__denoise(imp_context *ctx, int width, int height, float *colour,
                             float *albedo, float *normal, float *out);

#endif
