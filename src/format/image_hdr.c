/* SPDX-License-Identifier: Apache-2.0
 *
 * RGBE (.hdr; Ward, "Real pixels", Graphics Gems II): three mantissas and one exponent in
 * a byte each, (r, g, b, e) -> (m + 1/2) 2^(e - 136), 0 for e = 0. Rows are run-length
 * coded by component, or flat. Written flat. */
#include "base/number.h"
#include "image.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define RLE_WIDTH_MIN 8
#define RLE_WIDTH_MAX 32767

struct hdr {
    imp_context *ctx;
    const char *name;
    const unsigned char *at, *end;
    size_t width, height;
};

static enum imp_status hdr_error(const struct hdr *h, const char *what)
{
    return imp__error(h->ctx, IMP_E_SCENE, "%s: %s", h->name, what);
}

/* The next line, its end moved past; false at the end of the file. */
static bool line_next(struct hdr *h, char *line, size_t size)
{
    const unsigned char *stop = memchr(h->at, '\n', (size_t)(h->end - h->at));
    if (!stop) return false;
    const size_t n = imp_min((size_t)(stop - h->at), size - 1);
    memcpy(line, h->at, n);
    line[n] = 0;
    h->at = stop + 1;
    return true;
}

static enum imp_status header_read(struct hdr *h)
{
    char line[256];
    do {
        if (!line_next(h, line, sizeof line))
            return hdr_error(h, "the header does not end");
        if (strncmp(line, "FORMAT=", 7) == 0 &&
            strncmp(line + 7, "32-bit_rle_rgbe", 15) != 0)
            return hdr_error(h, "only 32-bit_rle_rgbe is read");
    } while (*line && strcmp(line, "\r") != 0);
    if (!line_next(h, line, sizeof line)) return hdr_error(h, "the header does not end");
    int64_t height, width;
    const char *s = line + 3, *end = line + strlen(line);
    if (strncmp(line, "-Y ", 3) != 0 || !imp__integer(&s, end, &height) ||
        strncmp(s, " +X ", 4) != 0 || (s += 4, !imp__integer(&s, end, &width)))
        return hdr_error(h, "the size is not '-Y height +X width'");
    if (width < 1 || height < 1 || width > IMP_FILM_SIDE_MAX ||
        height > IMP_FILM_SIDE_MAX)
        return hdr_error(h, "a size that cannot be");
    h->width = (size_t)width;
    h->height = (size_t)height;
    return IMP_OK;
}

/* One component of a row: runs (count > 128: count - 128 times one value) and literals.
 */
static bool component_read(struct hdr *h, unsigned char *to)
{
    for (size_t x = 0; x < h->width;) {
        if (h->end - h->at < 2) return false;
        size_t n = *h->at++;
        const bool run = n > 128;
        if (run) n -= 128;
        if (n == 0 || n > h->width - x || (!run && (size_t)(h->end - h->at) < n))
            return false;
        if (run) memset(to + x, *h->at, n);
        else memcpy(to + x, h->at, n);
        h->at += run ? 1 : n;
        x += n;
    }
    return true;
}

/* A row as four planes of `width` bytes. */
static bool row_read(struct hdr *h, unsigned char *planes)
{
    const size_t w = h->width;
    if ((size_t)(h->end - h->at) < 4) return false;
    if (w >= RLE_WIDTH_MIN && w <= RLE_WIDTH_MAX && h->at[0] == 2 && h->at[1] == 2 &&
        (size_t)(h->at[2] << 8 | h->at[3]) == w) {
        h->at += 4;
        for (int c = 0; c < 4; c++)
            if (!component_read(h, planes + (size_t)c * w)) return false;
        return true;
    }
    if ((size_t)(h->end - h->at) / 4 < w) return false;
    for (size_t x = 0; x < w; x++, h->at += 4)
        for (size_t c = 0; c < 4; c++) planes[c * w + x] = h->at[c];
    return true;
}

enum imp_status imp__hdr_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out)
{
    enum imp_status st = IMP_OK;
    struct hdr h = {
        .ctx = ctx, .name = name, .at = file->data, .end = file->data + file->size};
    imp_film *film = NULL;
    unsigned char *planes = NULL;
    IMP_TRY(header_read(&h));
    /* A run of 127 pixels takes two bytes in each of four components. */
    IMP_TRY(
        imp__image_film(ctx, name, h.width, h.height, "R,G,B", file->size, 16, &film));
    planes = imp__alloc(ctx, h.width, 4);
    if (!planes) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", name));
    for (size_t y = 0; y < h.height; y++) {
        if (!row_read(&h, planes)) IMP_TRY(hdr_error(&h, "cut off, or a malformed row"));
        float *to = film->mean + y * h.width * 3;
        for (size_t x = 0; x < h.width; x++) {
            const int e = planes[3 * h.width + x];
            for (size_t c = 0; c < 3; c++)
                *to++ = e ? (float)ldexp(planes[c * h.width + x] + 0.5, e - 136) : 0;
        }
    }
    *out = film;
    film = NULL;
out:
    imp__release(ctx, planes);
    imp_film_destroy(film);
    return st;
}

static void pixel_pack(const double rgb[3], unsigned char to[4])
{
    double c[3];
    for (int k = 0; k < 3; k++)
        c[k] = rgb[k] > 0 ? imp_min(rgb[k], 1e38) : 0; /* NaN: 0 */
    const double most = imp_max(c[0], imp_max(c[1], c[2]));
    int e = 0;
    if (most > 1e-38) {
        const double scale = frexp(most, &e) * 256 / most;
        for (int k = 0; k < 3; k++) to[k] = (unsigned char)imp_min(c[k] * scale, 255.0);
        to[3] = (unsigned char)(e + 128);
    } else memset(to, 0, 4);
}

enum imp_status imp__hdr_encode(const imp_film *f, struct imp_bytes *out)
{
    const struct imp_pick pick = imp__image_pick(f);
    if (!pick.n || pick.xyz)
        return imp__error(f->ctx, IMP_E_ARG,
                          "HDR: the film has no R, G, B and no Y channel");
    char header[96];
    const int n =
        snprintf(header, sizeof header,
                 "#?RADIANCE\n# importon\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n",
                 f->height, f->width);
    const size_t pixels = (size_t)f->width * (size_t)f->height;
    struct imp_bytes b = {.size = (size_t)n + 4 * pixels};
    b.capacity = b.size;
    b.data = imp__alloc(f->ctx, b.size, 1);
    if (!b.data) return imp__error(f->ctx, IMP_E_NOMEM, "HDR: no memory for the picture");
    memcpy(b.data, header, (size_t)n);
    for (size_t i = 0; i < pixels; i++) {
        double rgb[3];
        for (int k = 0; k < 3; k++)
            rgb[k] = (double)f->mean[i * (size_t)f->channels +
                                     (size_t)pick.channel[pick.n == 3 ? k : 0]];
        pixel_pack(rgb, b.data + (size_t)n + 4 * i);
    }
    *out = b;
    return IMP_OK;
}
