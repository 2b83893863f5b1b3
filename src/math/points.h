/* SPDX-License-Identifier: Apache-2.0
 *
 * Points that cover the unit square more evenly than random ones: nets of Sobol's
 * sequence, scrambled by Owen's method (Owen, "Randomly permuted (t,m,s)-nets and
 * (t,s)-sequences", 1995).
 *
 * A set has up to IMP_SET_POINTS points. A point has numbers without end, in blocks of
 * eight: four pairs, each a (0,2)-sequence in an order of its own, so that the first 2^m
 * points of a set have one in each of the 2^m rectangles of every elementary partition of
 * the square of a pair. Pairs and blocks are combined at random.
 *
 * A block of a set is one of the 64 of a table, made once: its points in an order shifted
 * at random (i xor s, which keeps the first 2^m points a net), each number shifted at
 * random (x xor r, a digital shift, which keeps nets and makes every point uniform).
 * Given the table, shifts are independent between sets and between blocks; means over a
 * set have no bias, whatever the table holds. */
#ifndef IMP_MATH_POINTS_H
#define IMP_MATH_POINTS_H

#include "rng.h"

enum { IMP_SET_POINTS = 64, IMP_BLOCK_NUMBERS = 8, IMP_POINT_BLOCKS = 64 };

/* The leading 16 bits of numbers. */
struct imp_point_table {
    uint16_t number[IMP_POINT_BLOCKS][IMP_SET_POINTS][IMP_BLOCK_NUMBERS];
};
void imp__points_make(struct imp_point_table *points);
/* The one that walks take, made at its first use. */
const struct imp_point_table *imp__points(void);

/* Point `index` of the set with hash `set`. */
struct imp_point {
    const struct imp_point_table *points; /* NULL: no such point, numbers are random */
    uint64_t set;
    uint32_t index;
};

/* A block of a point. */
struct imp_point_block {
    uint64_t hash;
    const uint16_t *lead; /* [IMP_BLOCK_NUMBERS] of its numbers, before their shift */
};
static inline struct imp_point_block imp__point_block(struct imp_point p, uint32_t block)
{
    const uint64_t h = imp__mix64(p.set + (uint64_t)(block + 1) * 0x9e3779b97f4a7c15u);
    const uint64_t index = (p.index ^ h) & (IMP_SET_POINTS - 1);
    return (struct imp_point_block){h, p.points->number[h >> 58][index]};
}
/* Its number k, on [0, 1). */
static inline double imp__block_number(struct imp_point_block b, int k)
{
    const uint64_t shift = imp__mix64(b.hash + (uint64_t)(k + 1) * 0x9e3779b97f4a7c15u);
    return (double)((shift ^ (uint64_t)b.lead[k] << 48) >> 11) * 0x1p-53;
}
static inline double imp__point_number(struct imp_point p, uint32_t block, int k)
{
    return imp__block_number(imp__point_block(p, block), k);
}

#endif
