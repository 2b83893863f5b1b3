/* SPDX-License-Identifier: Apache-2.0
 *
 * PFM: "PF" or "Pf", size, scale whose sign is the byte order, rows from the bottom
 * up. */
#include "base/number.h"
#include "image.h"
#include <stdio.h>
#include <string.h>

static bool blank(unsigned char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

enum imp_status imp__pfm_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    const char *s = (const char *)file->data, *end = s + file->size;
    const int channels = file->data[1] == 'F' ? 3 : 1;
    double header[3]; /* width, height, scale */
    s += 2;
    for (int i = 0; i < 3; i++) {
        while (s < end && blank((unsigned char)*s)) s++;
        if (!imp__number(&s, end, &header[i]) || s >= end || !blank((unsigned char)*s))
            return imp__error(ctx, IMP_E_SCENE, "%s: malformed PFM header", name);
    }
    s++; /* one blank ends the header */
    if (!(header[0] >= 1 && header[0] <= IMP_FILM_SIDE_MAX && header[1] >= 1 &&
          header[1] <= IMP_FILM_SIDE_MAX) ||
        !(header[2] != 0))
        return imp__error(ctx, IMP_E_SCENE, "%s: PFM of %g x %g, scale %g", name,
                          header[0], header[1], header[2]);
    const size_t width = (size_t)header[0], height = (size_t)header[1],
                 row = width * (size_t)channels;
    if ((size_t)(end - s) / sizeof(float) / row < height)
        return imp__error(ctx, IMP_E_SCENE, "%s: cut off", name);
    imp_film *film;
    const enum imp_status st = imp__image_film(
        ctx, name, width, height, channels == 3 ? "R,G,B" : "Y", file->size, 1, &film);
    if (st != IMP_OK) return st;
    const unsigned char *d = (const unsigned char *)s;
    const bool little = header[2] < 0;
    for (size_t y = 0; y < height; y++)
        for (size_t i = 0; i < row; i++, d += 4) {
            const uint32_t bits =
                little ? d[0] | d[1] << 8 | d[2] << 16 | (uint32_t)d[3] << 24
                       : d[3] | d[2] << 8 | d[1] << 16 | (uint32_t)d[0] << 24;
            memcpy(&film->mean[(height - 1 - y) * row + i], &bits, sizeof bits);
        }
    *out = film;
    return IMP_OK;
}

enum imp_status imp__pfm_encode(const imp_film *f, struct imp_bytes *out)
{
    const struct imp_pick pick = imp__image_pick(f);
    if (!pick.n)
        return imp__error(f->ctx, IMP_E_ARG,
                          "PFM: the film has no R, G, B and no Y channel");
    /* The format has no comments. No other program spells -1 like this, and every parser
     * of numbers reads it: the command recognises its own files by it. */
    char header[64];
    const int n = snprintf(header, sizeof header, "%s\n%d %d\n-0.1e+1\n",
                           pick.n == 3 ? "PF" : "Pf", f->width, f->height);
    const size_t row = (size_t)f->width * (size_t)pick.n, height = (size_t)f->height;
    struct imp_bytes b = {.size = (size_t)n + row * height * sizeof(float)};
    b.capacity = b.size;
    b.data = imp__alloc(f->ctx, b.size, 1);
    if (!b.data) return imp__error(f->ctx, IMP_E_NOMEM, "PFM: no memory for the picture");
    memcpy(b.data, header, (size_t)n);
    unsigned char *d = b.data + n;
    for (size_t y = height; y-- > 0;)
        for (size_t x = 0; x < (size_t)f->width; x++)
            for (int c = 0; c < pick.n; c++, d += 4) {
                uint32_t bits;
                memcpy(&bits,
                       &f->mean[(y * (size_t)f->width + x) * (size_t)f->channels +
                                (size_t)pick.channel[c]],
                       sizeof bits);
                for (int k = 0; k < 4; k++) d[k] = (unsigned char)(bits >> (8 * k));
            }
    *out = b;
    return IMP_OK;
}
