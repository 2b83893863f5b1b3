/* SPDX-License-Identifier: Apache-2.0
 *
 * Base64, and the channels of a picture as 16-bit floats in planes of low and of high bytes. */
#include "planes.h"
#include <half.h> /* of Imath, which comes with OpenEXR */
#include <math.h>
#include <zlib.h>

enum { GROUP = 3 * 1024 }; /* bytes; a multiple of 3 needs no padding inside the text */

static void put_group(struct imp_text *t, const unsigned char *bytes, size_t n)
{
    static const char digit[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char text[GROUP / 3 * 4];
    size_t used = 0;
    for (size_t i = 0; i < n; i += 3) {
        const unsigned b = i + 1 < n ? bytes[i + 1] : 0, c = i + 2 < n ? bytes[i + 2] : 0;
        const unsigned v = (unsigned)bytes[i] << 16 | b << 8 | c;
        text[used++] = digit[v >> 18];
        text[used++] = digit[v >> 12 & 63];
        text[used++] = i + 1 < n ? digit[v >> 6 & 63] : '=';
        text[used++] = i + 2 < n ? digit[v & 63] : '=';
    }
    t->failed = t->failed || !imp__bytes_add(t->ctx, &t->bytes, text, used);
}

void imp__base64_put(struct imp_text *t, const unsigned char *bytes, size_t n)
{
    for (size_t i = 0; i < n; i += GROUP)
        put_group(t, bytes + i, imp_min(n - i, (size_t)GROUP));
}

/* All low bytes, then all high ones, which are much alike: so they pack to three quarters of
 * their size, and to four fifths as they are. */
static void put_packed(struct imp_text *t, const unsigned char *bytes, size_t n)
{
    uLongf used = compressBound((uLong)n);
    unsigned char *packed = imp__alloc_raw(t->ctx, used, 1);
    if (packed && compress2(packed, &used, bytes, (uLong)n, 3) == Z_OK)
        imp__base64_put(t, packed, used);
    else t->failed = true;
    imp__release(t->ctx, packed);
}

double imp__planes_put(struct imp_text *t, const imp_film *f, const float *values)
{
    const size_t n = (size_t)f->width * (size_t)f->height, c = (size_t)f->channels;
    unsigned char *bytes = imp__alloc_raw(t->ctx, n * c, 2);
    float largest = 0;
    int exponent = 0;
    for (size_t i = 0; i < n * c; i++)
        if (isfinite(values[i])) largest = fmaxf(largest, fabsf(values[i]));
    if (largest > 0) (void)frexpf(largest, &exponent); /* largest < 2^exponent */
    const double scale = largest > 0 ? ldexp(1, exponent - 15) : 1;
    if (!bytes) {
        t->failed = true;
        return scale;
    }
    for (size_t k = 0; k < c; k++)
        for (size_t i = 0; i < n; i++) {
            const uint16_t h = imath_float_to_half((float)(values[i * c + k] / scale));
            bytes[k * n + i] = (unsigned char)h;
            bytes[(c + k) * n + i] = (unsigned char)(h >> 8);
        }
    put_packed(t, bytes, 2 * n * c);
    imp__release(t->ctx, bytes);
    return scale;
}
