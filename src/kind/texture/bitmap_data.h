/* SPDX-License-Identifier: Apache-2.0
 *
 * What a bitmap is made of (bitmap.c, bitmap_build.c, bitmap_lanes.c). */
#ifndef IMP_KIND_TEXTURE_BITMAP_DATA_H
#define IMP_KIND_TEXTURE_BITMAP_DATA_H

#include "kind/build.h"
#include "lifted_texels.h"
#include "uv.h"

enum wrap { WRAP_REPEAT, WRAP_MIRROR, WRAP_CLAMP };
enum filter { FILTER_BILINEAR, FILTER_NEAREST };

struct bitmap {
    int width, height, channels; /* 1 or 3 */
    enum wrap wrap;
    enum filter filter;
    bool identity; /* to_uv does nothing */
    struct imp__to_uv to_uv;
    float *data;      /* [height][width][channels], and one number more */
    int64_t negative; /* as of struct imp__texels */
    double negative_value;
    bool spectral;                    /* walks carry wavelengths */
    bool daylight;                    /* ... in which it is times daylight */
    struct imp__lifted_texels lifted; /* of three channels in a spectral mode */
};

/* ---- bitmap_build.c: as of struct imp_texture_ops ---- */
enum imp_status imp__bitmap_build(const struct imp_build *b, void *self,
                                  struct imp_texture *tex);
void imp__bitmap_changed(const struct imp_texture *tex);

#endif
