/* SPDX-License-Identifier: Apache-2.0
 *
 * Picture files (docs/scene-format.md 13.5). All are read into films, whatever their
 * channels; the format is found by the first bytes, not from the name. */
#ifndef IMP_FORMAT_IMAGE_H
#define IMP_FORMAT_IMAGE_H

#include "base/file.h"
#include "base/film.h"

#define IMP_IMAGE_BYTES_MAX ((size_t)1 << 36)
#define IMP_IMAGE_ALWAYS    0x1p30 /* bytes in memory that a file of any size may become */

/* *srgb: an 8- or 16-bit file, values in [0,1] and still encoded. Messages begin with
 * `name`. @return IMP_E_SCENE for what is not a valid picture. */
enum imp_status imp__image_parse(imp_context *ctx, const char *name,
                                 const struct imp_bytes *file, imp_film **out,
                                 bool *srgb);
enum imp_status imp__image_read(imp_context *ctx, const char *path, imp_film **out,
                                bool *srgb);

/* The channels that make a picture: 3 (R, G, B or X, Y, Z) or 1, unprefixed names before
 * layers; 0 if there are none. */
struct imp_pick {
    int n, channel[3];
    bool xyz;
};
struct imp_pick imp__image_pick(const imp_film *film);

/* One file format each. */
enum imp_status imp__exr_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out);
enum imp_status imp__png_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out);
enum imp_status imp__jpeg_parse(imp_context *ctx, const char *name,
                                const struct imp_bytes *file, imp_film **out);
enum imp_status imp__pfm_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out);
enum imp_status imp__hdr_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out);
enum imp_status imp__bmp_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out);
/* *srgb is set in these: false for files of floats. */
enum imp_status imp__npy_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out, bool *srgb);
enum imp_status imp__tiff_parse(imp_context *ctx, const char *name,
                                const struct imp_bytes *file, imp_film **out, bool *srgb);
/* Is a TIFF file, of which it has the first four bytes, a DNG? Linear, white at 1. */
bool imp__dng_is(const struct imp_bytes *file);
enum imp_status imp__dng_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out);
/* PPM and PGM, of at least two bytes. */
enum imp_status imp__ppm_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out);
/* Can it be one? */
bool imp__tga_is(const struct imp_bytes *file);
enum imp_status imp__tga_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out);

enum imp_status imp__exr_encode(const imp_film *film,
                                const struct imp_write_options *options,
                                struct imp_bytes *out);
/* rgb [height][width][channels], 8-bit; channels 1 or 3. */
enum imp_status imp__png_encode(imp_context *ctx, int width, int height, int channels,
                                const unsigned char *pixels, struct imp_bytes *out);
enum imp_status imp__pfm_encode(const imp_film *film, struct imp_bytes *out);
enum imp_status imp__hdr_encode(const imp_film *film, struct imp_bytes *out);
enum imp_status imp__npy_encode(const imp_film *film, struct imp_bytes *out);

/* A film of width x height for a picture that `bytes` of file claim to hold; refused if
 * no file of that length can (`per_byte` pixels at most for every byte). */
enum imp_status imp__image_film(imp_context *ctx, const char *name, uint64_t width,
                                uint64_t height, const char *names, size_t bytes,
                                double per_byte, imp_film **out);

#endif
