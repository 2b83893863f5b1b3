/* SPDX-License-Identifier: Apache-2.0
 *
 * TGA (Truevision): grey of 8 bits, colours of 24 and 32 bits as blue, green, red, a palette
 * of these, each run-length coded or not. What a fourth byte holds is dropped. The format
 * has no first bytes of its own: a picture is one if all of its header can be. */
#include "image.h"
#include <string.h>

#define HEADER 18

static unsigned word(const unsigned char *p) { return p[0] | (unsigned)p[1] << 8; }

struct tga {
    unsigned type, bits, first, colours, entry; /* of the palette: its first index, ... */
    unsigned width, height;
    bool packed, palette, grey, from_right, from_top;
    const unsigned char *table, *at, *end;
};

static bool header_read(const struct imp_bytes *file, struct tga *t)
{
    const unsigned char *d = file->data;
    if (file->size < HEADER) return false;
    *t = (struct tga){.type = d[2] & 7u,
                      .bits = d[16],
                      .first = word(d + 3),
                      .colours = word(d + 5),
                      .entry = d[7],
                      .width = word(d + 12),
                      .height = word(d + 14),
                      .packed = d[2] & 8,
                      .from_right = d[17] & 16,
                      .from_top = d[17] & 32};
    t->palette = t->type == 1;
    t->grey = t->type == 3;
    const bool wide = t->bits == 24 || t->bits == 32;
    if (d[1] > 1 || (d[2] & ~11u) || t->type < 1 || t->type > 3 || d[17] & 0xc0)
        return false;
    if (t->palette ? !(d[1] == 1 && t->bits == 8 && (t->entry == 24 || t->entry == 32))
                   : !(t->grey ? t->bits == 8 : wide))
        return false;
    const size_t skipped = HEADER + (size_t)d[0],
                 table = d[1] ? (size_t)t->colours * ((t->entry + 7u) / 8) : 0;
    if (t->width < 1 || t->height < 1 || skipped + table > file->size) return false;
    t->table = d + skipped;
    t->at = t->table + table;
    t->end = d + file->size;
    return true;
}

bool imp__tga_is(const struct imp_bytes *file)
{
    struct tga t;
    return header_read(file, &t);
}

/* Blue, green and red, or grey thrice, of the pixel that p begins. */
static bool colour(const struct tga *t, const unsigned char *p, float out[3])
{
    if (t->palette) {
        if (*p < t->first || *p - t->first >= t->colours) return false;
        p = t->table + (*p - t->first) * (size_t)(t->entry / 8);
    }
    for (int c = 0; c < 3; c++) out[c] = (float)(p[t->grey ? 0 : 2 - c] / 255.0);
    return true;
}

enum imp_status imp__tga_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_film *film = NULL;
    struct tga t;
    if (!header_read(file, &t))
        return imp__error(ctx, IMP_E_SCENE, "%s: not a TGA picture", name);
    IMP_TRY(imp__image_film(ctx, name, t.width, t.height, t.grey ? "Y" : "R,G,B",
                            file->size, 128, &film));
    const size_t width = t.bits / 8, n = (size_t)t.width * t.height;
    const int channels = t.grey ? 1 : 3;
    size_t run = 0;        /* pixels left of a packet */
    bool repeated = false; /* they are one pixel */
    for (size_t k = 0; k < n; k++) {
        if (t.packed && run == 0 && t.at < t.end) {
            repeated = *t.at & 128;
            run = (*t.at++ & 127u) + 1;
        }
        if ((size_t)(t.end - t.at) < width)
            IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: the pixels are cut off", name));
        float rgb[3];
        if (!colour(&t, t.at, rgb))
            IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                               "%s: pixel %zu is not in the palette of %u", name, k,
                               t.colours));
        const size_t i = k % t.width, j = k / t.width,
                     x = t.from_right ? t.width - 1 - i : i,
                     y = t.from_top ? j : t.height - 1 - j;
        memcpy(film->mean + (y * t.width + x) * (size_t)channels, rgb,
               (size_t)channels * sizeof *rgb);
        if (!t.packed || !repeated || run == 1) t.at += width;
        if (run) run--;
    }
    *out = film;
    film = NULL;
out:
    imp_film_destroy(film);
    return st;
}
