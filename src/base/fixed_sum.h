/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of millions of numbers in fixed point: integers, so that neither the order nor the
 * thread of an addition changes a bit, and no tree of partial sums is needed (Demmel and
 * Nguyen, IEEE Trans. Comput. 64, 2015, compare such sums). The unit is a power of two,
 * agreed before the sum: a term is rounded to it, and one that is larger than 2^62 units
 * over the number of terms is counted and left out, so that no sum can overflow. The
 * caller then takes a larger unit and adds again: what is the largest term is known. */
#ifndef IMP_BASE_FIXED_SUM_H
#define IMP_BASE_FIXED_SUM_H

#include "context.h"
#include <math.h>

#define IMP_FIXED_FINE 0x1p40

/* Overlays the double that it becomes in the end. */
typedef int64_t __attribute__((may_alias)) imp_fixed;

struct imp_fixed_sum {
    size_t n;
    imp_fixed *sum; /* [n]; NULL: terms are measured, not added */
    /* [n] what is below the unit, in 2^-40 of it, for terms of many sizes; or NULL. */
    imp_fixed *fine;
    size_t apart; /* numbers that lie between two of sum, and of fine */
    double unit, per_unit, limit;
    uint64_t too_large; /* terms left out */
    uint64_t bits;      /* of the largest |term| so far, a double */
    bool clear;         /* nothing was added to sum and fine yet: they are 0 */
    bool alone;         /* one thread adds: additions need no lock */
};

/* Largest term that is expected, times 2^spare_bits, of at most n_terms a sum: sets the
 * unit and clears sum and counts. */
void imp__fixed_begin(struct imp_fixed_sum *f, double largest, int spare_bits,
                      double n_terms);

/* Number k of f->sum or f->fine. */
static inline imp_fixed *imp__fixed_at(const struct imp_fixed_sum *f, imp_fixed *row,
                                       size_t k)
{
    return &row[k * (1 + f->apart)];
}

/* ... as a double. */
static inline double imp__fixed_value(const struct imp_fixed_sum *f, size_t k)
{
    const double units = (double)*imp__fixed_at(f, f->sum, k),
                 below =
                     f->fine ? (double)*imp__fixed_at(f, f->fine, k) / IMP_FIXED_FINE : 0;
    return (units + below) * f->unit;
}

static inline double imp__fixed_largest(const struct imp_fixed_sum *f)
{
    union {
        uint64_t bits;
        double value;
    } u = {.bits = f->bits};
    return u.value;
}

/* Prefetches number k, to which a term is added soon: terms lie far apart in memory. (GCC 12
 * drops calls of functions that prefetch and do nothing else, unless it inlines them
 * first.) */
static inline __attribute__((always_inline)) void
imp__fixed_prefetch(const struct imp_fixed_sum *f, size_t k)
{
    if (f->sum) __builtin_prefetch((void *)imp__fixed_at(f, f->sum, k), 1);
    if (f->fine) __builtin_prefetch((void *)imp__fixed_at(f, f->fine, k), 1);
}

/* By any thread. */
static inline void imp__fixed_add(struct imp_fixed_sum *f, size_t k, double term)
{
    const union {
        double value;
        uint64_t bits;
    } size = {.value = fabs(term)};
    /* Doubles that are not negative have the order of their bits, NaN above all. */
    uint64_t seen = __atomic_load_n(&f->bits, __ATOMIC_RELAXED);
    while (imp_unlikely(size.bits > seen) &&
           !__atomic_compare_exchange_n(&f->bits, &seen, size.bits, true,
                                        __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
    if (!f->sum) return;
    if (imp_unlikely(!(size.value <= f->limit))) {
        __atomic_fetch_add(&f->too_large, 1, __ATOMIC_RELAXED);
        return;
    }
    const double units = term * f->per_unit;
    const imp_fixed whole = llrint(units);
    const imp_fixed below =
        f->fine ? (imp_fixed)llrint((units - (double)whole) * IMP_FIXED_FINE) : 0;
    if (f->alone) {
        *imp__fixed_at(f, f->sum, k) += whole;
        if (f->fine) *imp__fixed_at(f, f->fine, k) += below;
        return;
    }
    __atomic_fetch_add(imp__fixed_at(f, f->sum, k), whole, __ATOMIC_RELAXED);
    if (f->fine)
        __atomic_fetch_add(imp__fixed_at(f, f->fine, k), below, __ATOMIC_RELAXED);
}

#endif
