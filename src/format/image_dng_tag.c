/* SPDX-License-Identifier: Apache-2.0
 *
 * Which TIFF files are raw photographs: those whose first directory has DNG's version (tag 50706). */
#include "image.h"

#define DNG_VERSION 50706

static unsigned long number(const struct imp_bytes *f, size_t at, int n)
{
    unsigned long v = 0;
    for (int k = 0; k < n; k++)
        v = v << 8 | f->data[at + (size_t)(f->data[0] == 'I' ? n - 1 - k : k)];
    return v;
}

bool imp__dng_is(const struct imp_bytes *f)
{
    if (f->size < 10) return false;
    size_t at = number(f, 4, 4);
    if (at > f->size - 2) return false;
    for (unsigned long left = number(f, at, 2); left > 0; left--, at += 12) {
        if (f->size - at < 2 + 12) return false;
        if (number(f, at + 2, 2) == DNG_VERSION) return true;
    }
    return false;
}
