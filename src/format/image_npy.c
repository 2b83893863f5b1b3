/* SPDX-License-Identifier: Apache-2.0
 *
 * NumPy arrays (H, W, C) or (H, W), rows or columns first. Floats, <f4 and <f8, are linear; whole
 * numbers, |u1 and <u2, are those of a picture file, parts of 255 or 65535 in sRGB, as Mitsuba's
 * Bitmap and Pillow take them. <f4 is written. The header is a Python dictionary, of which three
 * entries are read. */
#include "base/little.h"
#include "base/number.h"
#include "image.h"
#include <stdio.h>
#include <string.h>

#define HEADER_MAX 65536

/* Text after 'key': in the dictionary; NULL: no such key. */
static const char *entry(const char *header, const char *key)
{
    char quoted[32];
    snprintf(quoted, sizeof quoted, "'%s'", key);
    const char *s = strstr(header, quoted);
    if (!s) return NULL;
    s += strlen(quoted);
    s += strspn(s, " ");
    if (*s != ':') return NULL;
    s++;
    return s + strspn(s, " ");
}

/* "(2, 3, 4)" -> sizes; their count, 0 if malformed or more than three. */
static int shape_read(const char *s, uint64_t size[3])
{
    int n = 0;
    if (!s || *s++ != '(') return 0;
    for (;;) {
        s += strspn(s, " ,");
        if (*s == ')') return n;
        int64_t v;
        const char *end = s + strlen(s);
        if (n == 3 || !imp__integer(&s, end, &v) || v < 0) return 0;
        size[n++] = (uint64_t)v;
    }
}

static const struct kind {
    const char *descr;
    int bytes;
    double most; /* of whole numbers, which is 1 in the picture; 0: floats */
} kinds[] = {
    {"<f4", 4, 0}, {"<f8", 8, 0}, {"|u1", 1, 255}, {"<u1", 1, 255}, {"<u2", 2, 65535}};

/* Text of a dictionary's value without its quotes, cut to the room that there is. */
static void unquoted(const char *s, char *text, size_t size)
{
    const size_t n = s && *s == '\'' ? strcspn(s + 1, "'") : 0;
    snprintf(text, size, "%.*s", (int)imp_min(n, size - 1), n ? s + 1 : "");
}

static const struct kind *kind_of(const char *descr)
{
    for (size_t k = 0; k < imp_count(kinds); k++)
        if (strcmp(descr, kinds[k].descr) == 0) return &kinds[k];
    return NULL;
}

static double number_at(const unsigned char *d, const struct kind *kind)
{
    uint64_t bits = 0;
    for (int k = 0; k < kind->bytes; k++) bits |= (uint64_t)d[k] << (8 * k);
    if (kind->most > 0) return (double)bits / kind->most;
    if (kind->bytes == 8) {
        double v;
        memcpy(&v, &bits, sizeof v);
        return v;
    }
    const uint32_t word = (uint32_t)bits;
    float v;
    memcpy(&v, &word, sizeof v);
    return v;
}

enum imp_status imp__npy_parse(imp_context *ctx, const char *name,
                               const struct imp_bytes *file, imp_film **out, bool *srgb)
{
    const unsigned char *d = file->data;
    if (file->size < 12) return imp__error(ctx, IMP_E_SCENE, "%s: cut off", name);
    const int version = d[6];
    const size_t start = version == 1 ? 10 : 12, length = version == 1
                                                              ? (size_t)(d[8] | d[9] << 8)
                                                              : imp__little_u32(d + 8);
    if (version < 1 || version > 3 || length > HEADER_MAX || length > file->size - start)
        return imp__error(ctx, IMP_E_SCENE, "%s: malformed NPY header", name);
    char *header = imp__alloc(ctx, length + 1, 1);
    if (!header) return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", name);
    memcpy(header, d + start, length);
    char descr[32];
    unquoted(entry(header, "descr"), descr, sizeof descr);
    const struct kind *kind = kind_of(descr);
    const char *order = entry(header, "fortran_order");
    uint64_t size[3] = {0, 0, 1};
    const int dims = shape_read(entry(header, "shape"), size);
    const bool fortran = order && strncmp(order, "True", 4) == 0;
    const bool known = fortran || (order && strncmp(order, "False", 5) == 0);
    imp__release(ctx, header);
    if (!known || dims < 2)
        return imp__error(ctx, IMP_E_SCENE, "%s: must be an array (H, W) or (H, W, C)",
                          name);
    if (!kind)
        return imp__error(ctx, IMP_E_SCENE,
                          "%s: an array of '%s': pictures are '<f4' or '<f8' (linear), "
                          "'|u1' or '<u2' (sRGB); convert it with astype",
                          name, descr);
    const uint64_t c = size[2], left = file->size - start - length;
    if (c < 1 || c > 4)
        return imp__error(ctx, IMP_E_SCENE, "%s: %llu channels; 1 to 4 are read", name,
                          (unsigned long long)c);
    if (size[0] > IMP_FILM_SIDE_MAX || size[1] > IMP_FILM_SIDE_MAX ||
        size[0] * size[1] > left / ((uint64_t)kind->bytes * c))
        return imp__error(ctx, IMP_E_SCENE, "%s: cut off", name);
    static const char *const names[] = {"Y", "Y,A", "R,G,B", "R,G,B,A"};
    imp_film *film;
    const enum imp_status st =
        imp__image_film(ctx, name, size[1], size[0], names[c - 1], file->size, 1, &film);
    if (st != IMP_OK) return st;
    d += start + length;
    /* In Fortran's order the row varies first: element (y, x, k) is y + H (x + W k). */
    const size_t H = (size_t)size[0], W = (size_t)size[1], C = (size_t)c;
    for (size_t i = 0; i < imp__film_values(film); i++) {
        const size_t y = i / (W * C), x = i / C % W, k = i % C;
        const size_t at = fortran ? y + H * (x + W * k) : i;
        film->mean[i] = (float)number_at(d + at * (size_t)kind->bytes, kind);
    }
    *srgb = kind->most > 0;
    *out = film;
    return IMP_OK;
}

enum imp_status imp__npy_encode(const imp_film *f, struct imp_bytes *out)
{
    char header[192]; /* magic, version, length; padded so that the data begin at 128 */
    memset(header, ' ', sizeof header);
    memcpy(header, "\x93NUMPY\x01\x00\x76\x00", 10);
    const int n =
        snprintf(header + 10, sizeof header - 10,
                 "{'descr': '<f4', 'fortran_order': False, 'shape': (%d, %d, %d), }",
                 f->height, f->width, f->channels);
    header[10 + n] = ' ';
    memcpy(header + 123, "\t\t\t\t\n",
           5); /* by this padding the command recognises its own files */
    struct imp_bytes b = {.size = 128 + imp__film_values(f) * 4};
    b.capacity = b.size;
    b.data = imp__alloc(f->ctx, b.size, 1);
    if (!b.data) return imp__error(f->ctx, IMP_E_NOMEM, "NPY: no memory for the picture");
    memcpy(b.data, header, 128);
    unsigned char *d = b.data + 128;
    for (size_t i = 0; i < imp__film_values(f); i++, d += 4) {
        uint32_t bits;
        memcpy(&bits, &f->mean[i], sizeof bits);
        for (int k = 0; k < 4; k++) d[k] = (unsigned char)(bits >> (8 * k));
    }
    *out = b;
    return IMP_OK;
}
