/* SPDX-License-Identifier: Apache-2.0
 *
 * BMP, uncompressed: 1, 4 and 8 bit with a palette, 24 and 32 bit as blue, green, red. What
 * a fourth byte holds is dropped. Rows go up from the bottom unless the height is negative,
 * and end at multiples of four bytes. */
#include "image.h"
#include <string.h>

static uint32_t little(const unsigned char *p, int n)
{
    uint32_t x = 0;
    for (int i = 0; i < n; i++) x |= (uint32_t)p[i] << (8 * i);
    return x;
}

struct bmp {
    size_t offset, header, colours; /* of the pixels; bytes; of the palette */
    int64_t width, height;          /* as written */
    unsigned bits, compression;
    const unsigned char *palette;
    int entry; /* bytes of a palette's colour */
};

static enum imp_status header_read(imp_context *ctx, const char *name,
                                   const struct imp_bytes *file, struct bmp *b)
{
    const unsigned char *d = file->data;
    if (file->size < 26) return imp__error(ctx, IMP_E_SCENE, "%s: cut off", name);
    b->offset = little(d + 10, 4);
    b->header = little(d + 14, 4);
    if (b->header != 12 && b->header < 40)
        return imp__error(ctx, IMP_E_SCENE, "%s: a header of %zu bytes", name, b->header);
    const bool core = b->header == 12;
    if (14 + b->header > file->size || (!core && file->size < 54))
        return imp__error(ctx, IMP_E_SCENE, "%s: cut off", name);
    b->width = core ? (int64_t)little(d + 18, 2) : (int32_t)little(d + 18, 4);
    b->height = core ? (int64_t)little(d + 20, 2) : (int32_t)little(d + 22, 4);
    b->bits = little(d + (core ? 24 : 28), 2);
    b->compression = core ? 0 : little(d + 30, 4);
    b->colours = core ? 0 : little(d + 46, 4);
    b->entry = core ? 3 : 4;
    const bool known =
        b->bits == 1 || b->bits == 4 || b->bits == 8 || b->bits == 24 || b->bits == 32;
    /* Bit fields of 32 bits, in the order that they have without them. */
    const bool fields = b->compression == 3 && b->bits == 32 && file->size >= 66 &&
                        little(d + 54, 4) == 0xff0000 && little(d + 58, 4) == 0xff00 &&
                        little(d + 62, 4) == 0xff;
    if (!known || (b->compression && !fields))
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "%s: a BMP picture of %u bits, compression %u; uncompressed "
                          "ones of 1, 4, 8, 24 and 32 bits are read",
                          name, b->bits, b->compression);
    if (b->bits > 8) return IMP_OK;
    const size_t most = (size_t)1 << b->bits;
    if (b->colours == 0 || b->colours > most) b->colours = most;
    b->palette = d + 14 + b->header;
    if (14 + b->header + b->colours * (size_t)b->entry > file->size)
        return imp__error(ctx, IMP_E_SCENE, "%s: the palette is cut off", name);
    return IMP_OK;
}

/* Blue, green and red of a pixel; NULL: a colour that the palette has not. */
static const unsigned char *pixel(const struct bmp *b, const unsigned char *row, size_t x)
{
    if (b->bits > 8) return row + x * (b->bits / 8);
    const size_t per = 8 / b->bits;
    const unsigned shift = (unsigned)(8 - b->bits * (1 + x % per));
    const size_t k = row[x / per] >> shift & ((1u << b->bits) - 1);
    return k < b->colours ? b->palette + k * (size_t)b->entry : NULL;
}

enum imp_status imp__bmp_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_film *film = NULL;
    struct bmp b = {0};
    IMP_TRY(header_read(ctx, name, file, &b));
    const uint64_t width = b.width > 0 ? (uint64_t)b.width : 0,
                   height = (uint64_t)(b.height < 0 ? -b.height : b.height);
    IMP_TRY(imp__image_film(ctx, name, width, height, "R,G,B", file->size, 8, &film));
    const size_t stride = (size_t)((width * b.bits + 31) / 32 * 4);
    if (b.offset > file->size || stride * height > file->size - b.offset)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: the pixels are cut off", name));
    for (size_t y = 0; y < height; y++) {
        const size_t from = b.height < 0 ? y : (size_t)height - 1 - y;
        const unsigned char *row = file->data + b.offset + from * stride;
        float *to = film->mean + 3 * y * (size_t)width;
        for (size_t x = 0; x < width; x++, to += 3) {
            const unsigned char *p = pixel(&b, row, x);
            if (!p)
                IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                                   "%s: pixel (%zu, %zu) is not in the palette of %zu",
                                   name, x, y, b.colours));
            for (int c = 0; c < 3; c++) to[c] = (float)(p[2 - c] / 255.0);
        }
    }
    *out = film;
    film = NULL;
out:
    imp_film_destroy(film);
    return st;
}
