/* SPDX-License-Identifier: Apache-2.0
 *
 * Radix sort by digits of eleven bits, each of which the list is dealt out by, in its order. */
#include "radix.h"
#include <stdbool.h>

enum { BITS = 11, DIGITS = 1 << BITS, PASSES = (64 + BITS - 1) / BITS };

static inline size_t digit(uint64_t key, int pass)
{
    return (size_t)(key >> (pass * BITS)) & (DIGITS - 1);
}

/* From how many of each digit to the place of its first. False: all have one digit. */
static bool places_find(size_t *count, size_t n)
{
    size_t sum = 0;
    for (size_t d = 0; d < DIGITS; d++) {
        const size_t own = count[d];
        if (own == n) return false;
        count[d] = sum;
        sum += own;
    }
    return true;
}

void imp__radix_sort(struct imp_keyed *list, size_t n, struct imp_keyed *spare)
{
    struct imp_keyed *from = list, *to = spare;
    for (int pass = 0; pass < PASSES; pass++) {
        size_t place[DIGITS] = {0};
        for (size_t k = 0; k < n; k++) place[digit(from[k].key, pass)]++;
        if (!places_find(place, n)) continue;
        for (size_t k = 0; k < n; k++) to[place[digit(from[k].key, pass)]++] = from[k];
        struct imp_keyed *const dealt = to;
        to = from;
        from = dealt;
    }
    if (from != list) memcpy(list, from, n * sizeof *list);
}

void imp__keyed_order(struct imp_keyed *list, size_t n, void *things, size_t size,
                      void *spare)
{
    char *at = things;
    for (size_t k = 0; k < n; k++) { /* each cycle from its first place on */
        if (list[k].value == k) continue;
        size_t to = k;
        memcpy(spare, at + k * size, size);
        for (size_t from = list[to].value; from != k; from = list[to].value) {
            memcpy(at + to * size, at + from * size, size);
            list[to].value = to;
            to = from;
        }
        memcpy(at + to * size, spare, size);
        list[to].value = to;
    }
}
