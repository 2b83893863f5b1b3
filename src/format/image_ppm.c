/* SPDX-License-Identifier: Apache-2.0
 *
 * PGM and PPM (Netpbm), binary: P5 and P6, of 8 or 16 bits, the higher byte first. */
#include "base/number.h"
#include "image.h"

/* The next number of the header: behind blanks and comments. */
static bool header_number(const unsigned char **at, const unsigned char *end,
                          int64_t *out)
{
    const unsigned char *s = *at;
    for (bool comment = false; s < end; s++) {
        if (comment) comment = *s != '\n';
        else if (*s == '#') comment = true;
        else if (*s != ' ' && *s != '\t' && *s != '\n' && *s != '\r') break;
    }
    const char *text = (const char *)s;
    const bool ok = imp__integer(&text, (const char *)end, out);
    *at = (const unsigned char *)text;
    return ok && *out > 0;
}

enum imp_status imp__ppm_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_film *film = NULL;
    const unsigned char *at = file->data + 2, *end = file->data + file->size;
    const bool grey = file->data[1] == '5';
    int64_t width, height, top;
    if (!header_number(&at, end, &width) || !header_number(&at, end, &height) ||
        !header_number(&at, end, &top) || top > 65535 || at >= end)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                           "%s: the header is not width, height and largest number",
                           name));
    at++; /* one blank */
    IMP_TRY(imp__image_film(ctx, name, (uint64_t)width, (uint64_t)height,
                            grey ? "Y" : "R,G,B", file->size, 1, &film));
    const size_t n = (size_t)width * (size_t)height * (grey ? 1 : 3);
    const size_t bytes = top > 255 ? 2 : 1;
    if ((size_t)(end - at) / bytes < n)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: the pixels are cut off", name));
    for (size_t k = 0; k < n; k++, at += bytes) {
        const int64_t v = bytes == 2 ? at[0] << 8 | at[1] : at[0];
        film->mean[k] = (float)((double)imp_min(v, top) / (double)top);
    }
    *out = film;
    film = NULL;
out:
    imp_film_destroy(film);
    return st;
}
