/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids of Mitsuba's .vol files, version 3: "VOL", the version as a byte, then little-endian
 * 32-bit integers type (1: floats), sizes in x, y and z, channels; a box of six floats,
 * corner by corner; and the values, channels first, then x, y, z. */
#ifndef IMP_FORMAT_VOL_FILE_H
#define IMP_FORMAT_VOL_FILE_H

#include "base/file.h"
#include "base/props.h"

/* Written behind the values of our files, where other readers do not read. */
#define IMP_VOL_MARK      "importon"
#define IMP_VOL_BYTES_MAX ((size_t)1 << 34)

/* Values are copied to the arena and finite. IMP_E_SCENE with what is wrong; IMP_E_UNSUPPORTED
 * for other types and 6 channels; IMP_E_NOMEM. */
enum imp_status imp__vol_parse(imp_context *ctx, struct imp_arena *keep, const char *name,
                               const struct imp_bytes *bytes, struct imp_grid_data *out);

/* Layers below each other, those of the smallest z first; channels Y, or R, G, B. */
enum imp_status imp__vol_picture(imp_context *ctx, const char *name,
                                 const struct imp_bytes *file, imp_film **out);

#endif
