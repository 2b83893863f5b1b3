/* SPDX-License-Identifier: Apache-2.0
 *
 * Running hash of bytes, in one chain or four: xor with a word, multiply by an odd constant,
 * mix. */
#include "hash.h"
#include "rng.h"
#include <string.h>

static inline uint64_t take(uint64_t h, uint64_t word)
{
    return imp__mix64(h ^ word) + 0x9e3779b97f4a7c15u;
}

uint64_t imp__hash(uint64_t h, const void *bytes, size_t n)
{
    const unsigned char *b = bytes;
    for (; n >= 8; n -= 8, b += 8) {
        uint64_t word;
        memcpy(&word, b, 8);
        h = take(h, word);
    }
    for (; n > 0; n--, b++) h = take(h, *b);
    return h;
}

/* Both halves of a product, one onto the other: mixed by one multiplication, though not all
 * 2^64 values come out. */
static inline uint64_t take_quickly(uint64_t h, uint64_t word)
{
    const unsigned __int128 z = (unsigned __int128)(h ^ word) * 0xbf58476d1ce4e5b9u;
    return ((uint64_t)z ^ (uint64_t)(z >> 64)) + 0x9e3779b97f4a7c15u;
}

/* In four chains: a word waits for the one before it in its own alone. */
uint64_t imp__hash_array(uint64_t h, const void *bytes, size_t n)
{
    const unsigned char *b = bytes;
    uint64_t chain[5] = {h, 0, 0, 0, n}, word[4];
    for (; n >= sizeof word; n -= sizeof word, b += sizeof word) {
        memcpy(word, b, sizeof word);
        for (int k = 0; k < 4; k++) chain[k] = take_quickly(chain[k], word[k]);
    }
    return imp__hash(imp__hash(0, chain, sizeof chain), b, n);
}

uint64_t imp__hash_text(uint64_t h, const char *text)
{
    return text ? imp__hash(h, text, strlen(text) + 1) : imp__hash(h, "", 1);
}
