/* SPDX-License-Identifier: Apache-2.0
 *
 * bitmap: its texels, made of a picture's. */
#include "base/required.h"
#include "bitmap_data.h"
#include "color/rgb.h"
#include "input.h"
#include <math.h>
#include <string.h>

/* Pixels with one more value than needed: three channels are read with one load of four.
 */
static enum imp_status data_convert(const struct imp_build *b,
                                    const struct imp_image_data *im, bool raw,
                                    struct bitmap *t)
{
    const size_t n = (size_t)im->width * (size_t)im->height;
    const bool grey = im->channels == 3 && b->mode == IMP_MONO && !b->node->vector;
    t->channels = grey ? 1 : im->channels;
    t->data = imp__arena_take(b->arena, n * (size_t)t->channels + 1, sizeof *t->data);
    if (!t->data) return imp__error(b->ctx, IMP_E_NOMEM, "bitmap does not fit");
    t->data[n * (size_t)t->channels] = 0;
    t->negative = -1;
    /* 8-bit files have no other values, and pow takes its time. */
    float byte[256];
    double decoded[256];
    for (int k = 0; k < 256 && im->srgb; k++) {
        byte[k] = (float)(k / 255.0);
        decoded[k] = imp__srgb_decode(k / 255.0);
    }
    for (size_t i = 0; i < n; i++) {
        double p[3] = {0, 0, 0};
        for (int c = 0; c < im->channels; c++) {
            p[c] = im->pixels[i * (size_t)im->channels + (size_t)c];
            if (!isfinite(p[c]))
                return imp_build_error(b, NULL, IMP_E_SCENE,
                                       "pixel (%zu, %zu) of the picture is not finite",
                                       i % (size_t)im->width, i / (size_t)im->width);
            if (p[c] < 0 && t->negative < 0) {
                t->negative = (int64_t)i;
                t->negative_value = p[c];
            }
            if (im->srgb && !raw) {
                const double k = rint(p[c] * 255);
                const bool of_byte = k >= 0 && k <= 255 && byte[(int)k] == (float)p[c];
                p[c] = of_byte ? decoded[(int)k] : imp__srgb_decode(p[c]);
            }
        }
        if (grey) p[0] = imp__luminance(p[0], p[1], p[2]);
        for (int c = 0; c < t->channels; c++)
            t->data[i * (size_t)t->channels + (size_t)c] = (float)p[c];
    }
    return IMP_OK;
}

/* Another input may be the first that reads it, or texels be set. */
void imp__bitmap_changed(const struct imp_texture *tex)
{
    struct bitmap *t = tex->self;
    t->daylight = t->spectral && tex->asked && tex->asked->flags & IMP_INPUT_DAYLIGHT;
    if (t->channels != 3 || !t->spectral) return;
    imp__lifted_texels_update(&t->lifted,
                              t->daylight ? IMP__LIFT_ANY_SIZE : IMP__LIFT_BY_SIZE);
}

enum imp_status imp__bitmap_build(const struct imp_build *b, void *self,
                                  struct imp_texture *tex)
{
    static const char *const wraps[] = {"repeat", "mirror", "clamp"};
    static const char *const filters[] = {"bilinear", "nearest"};
    static const char *const formats[] = {"auto", "variant", "float16", "fp16", "uint8"};
    enum imp_status st = IMP_OK;
    struct bitmap *t = self;
    const struct imp_image_data *im = b->node->image;
    const char *filename;
    bool raw, accel;
    int wrap, filter, format;

    IMP_TRY(imp_build_string(b, "filename", NULL, &filename));
    IMP_TRY(imp_build_bool(b, "raw", false, &raw));
    IMP_TRY(imp_build_choice(b, "wrap_mode", wraps, 3, WRAP_REPEAT, &wrap));
    IMP_TRY(imp_build_choice(b, "filter_type", filters, 2, FILTER_BILINEAR, &filter));
    /* Mitsuba's options of texel storage and lookup: accepted, without effect here. */
    IMP_TRY(imp_build_choice(b, "format", formats, 5, 0, &format));
    IMP_TRY(imp_build_bool(b, "accel", true, &accel));
    IMP_TRY(imp__to_uv_read(b, &t->to_uv));
    if (!im) IMP_TRY(imp__node_missing(b->ctx, b->node, "filename"));
    if (im->width < 1 || im->height < 1 || (im->channels != 1 && im->channels != 3))
        IMP_TRY(
            imp_build_error(b, NULL, IMP_E_SCENE,
                            "picture of %d x %d with %d channels; 1 or 3 are possible",
                            im->width, im->height, im->channels));
    t->width = im->width;
    t->height = im->height;
    t->wrap = (enum wrap)wrap;
    t->filter = (enum filter)filter;
    const struct imp__to_uv id = {{{1, 0, 0}, {0, 1, 0}}};
    t->identity = memcmp(&id, &t->to_uv, sizeof id) == 0;
    IMP_TRY(data_convert(b, im, raw, t));

    t->spectral = b->mode == IMP_SPECTRAL || b->mode == IMP_SINGLE;
    if (t->channels == 3 && t->spectral)
        IMP_TRY(imp__lifted_texels_make(b, t->data, (size_t)t->width * (size_t)t->height,
                                        &t->lifted));
    imp__bitmap_changed(tex);

    const size_t dims[3] = {(size_t)t->height, (size_t)t->width, (size_t)t->channels};
    float lo = 0;
    for (size_t i = 0; i < dims[0] * dims[1] * dims[2]; i++) lo = imp_min(lo, t->data[i]);
    IMP_TRY(imp_build_texels(b, "data", t->data, 3, dims,
                             IMP_PARAM_DIFFERENTIABLE | IMP_PARAM_COLOR,
                             lo < 0 ? -INFINITY : 0.0, INFINITY, &tex->param));
out:
    return st;
}
