/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers in rising order, digit by digit, the last one first: a million of them in some ten
 * milliseconds, and those that are equal stay in their order. */
#ifndef IMP_BASE_RADIX_H
#define IMP_BASE_RADIX_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

struct imp_keyed {
    uint64_t key;
    size_t value; /* what it is the key of */
};

/* spare [n]: room. */
void imp__radix_sort(struct imp_keyed *list, size_t n, struct imp_keyed *spare);
/* Puts things [n] of this size in the order of a sorted list, whose values are where they are and become
 * where they will be. In place: a second list of large things would cost more than its order does. spare: room
 * for one. */
void imp__keyed_order(struct imp_keyed *list, size_t n, void *things, size_t size,
                      void *spare);

/* Keys of finite doubles, which rise with them; the same of both zeros. */
static inline uint64_t imp__radix_key(double x)
{
    uint64_t bits;
    x += 0.0;
    memcpy(&bits, &x, sizeof bits);
    return bits ^ (bits >> 63 ? UINT64_MAX : (uint64_t)1 << 63);
}

#endif
