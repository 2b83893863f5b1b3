/* SPDX-License-Identifier: Apache-2.0 */
#include "hash.h"
#include "rng.h"
#include <string.h>

uint64_t imp__hash(uint64_t h, const void *bytes, size_t n)
{
    const unsigned char *b = bytes;
    for (; n >= 8; n -= 8, b += 8) {
        uint64_t word;
        memcpy(&word, b, 8);
        h = imp__mix64(h ^ word) + 0x9e3779b97f4a7c15u;
    }
    for (; n > 0; n--, b++) h = imp__mix64(h ^ *b) + 0x9e3779b97f4a7c15u;
    return h;
}

uint64_t imp__hash_text(uint64_t h, const char *text)
{
    return text ? imp__hash(h, text, strlen(text) + 1) : imp__hash(h, "", 1);
}
