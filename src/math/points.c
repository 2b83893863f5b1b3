/* SPDX-License-Identifier: Apache-2.0
 *
 * The table of 64 scrambled blocks that sets of points are made from: a (0,2)-sequence by radical
 * inverse and Sobol's second dimension, scrambled by Owen's method. */
#include "points.h"
#include <pthread.h>

enum { BITS = 6 }; /* of a point's index */
_Static_assert(1 << BITS == IMP_SET_POINTS, "bits of an index");

/* Owen's nested scrambling of all x < 2^BITS: each bit is flipped at random, by what the bits above
 * it are. */
static void scramble(uint64_t seed, uint32_t out[IMP_SET_POINTS])
{
    for (uint32_t x = 0; x < IMP_SET_POINTS; x++) out[x] = x;
    for (int b = BITS - 1; b >= 0; b--)
        for (uint32_t high = 0; high < 1u << (BITS - 1 - b); high++) {
            const uint64_t above = (uint64_t)1 << (BITS - b) | high;
            const uint32_t flip = (uint32_t)(imp__mix64(seed + above) & 1) << b;
            for (uint32_t low = 0; low < 2u << b; low++)
                out[high << (b + 1) | low] ^= flip;
        }
}

/* Radical inverse of i in base 2, times 2^BITS. */
static uint32_t reversed(uint32_t i)
{
    uint32_t x = 0;
    for (int b = 0; b < BITS; b++) x |= (i >> b & 1) << (BITS - 1 - b);
    return x;
}

/* The second coordinate of Sobol's sequence: direction numbers of x + 1, which with
 * `reversed` make a (0,2)-sequence. */
static uint32_t second(uint32_t i)
{
    uint32_t x = 0;
    for (uint32_t v = 1u << (BITS - 1); i; i >>= 1, v ^= v >> 1)
        if (i & 1) x ^= v;
    return x;
}

void imp__points_make(struct imp_point_table *points)
{
    for (uint64_t b = 0; b < IMP_POINT_BLOCKS; b++)
        for (uint64_t k = 0; k < IMP_BLOCK_NUMBERS; k++) {
            const uint64_t order = imp__mix64(0x5eed0001 + (b << 8 | k >> 1));
            const uint64_t digits = imp__mix64(0x5eed0002 + (b << 8 | k));
            uint32_t place[IMP_SET_POINTS], scrambled[IMP_SET_POINTS];
            scramble(order, place);
            scramble(digits, scrambled);
            for (uint32_t i = 0; i < IMP_SET_POINTS; i++) {
                const uint32_t at = place[i];
                const uint32_t x = scrambled[k & 1 ? second(at) : reversed(at)];
                /* Bits below those of the net are random. */
                const uint64_t rest = imp__mix64(digits + ((uint64_t)(i + 1) << 32));
                points->number[b][i][k] =
                    (uint16_t)(x << (16 - BITS) | (rest & ((1u << (16 - BITS)) - 1)));
            }
        }
}

static struct imp_point_table table;
static void table_make(void) { imp__points_make(&table); }

const struct imp_point_table *imp__points(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, table_make);
    return &table;
}
