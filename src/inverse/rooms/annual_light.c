/* SPDX-License-Identifier: Apache-2.0
 *
 * The illuminances of a year's hours at some points, from their coefficients. Points take turns at each
 * block of hours, whose skies are read from memory once for all of them. */
#include "annual.h"
#include <string.h>

/* Row t becomes lane t. */
static inline void turn_over(imp__annual_lanes x[IMP__AT_ONCE])
{
    imp__annual_lanes y[IMP__AT_ONCE];
    for (int k = 0; k < 8; k += 2) {
        y[k] = __builtin_shufflevector(x[k], x[k + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        y[k + 1] = __builtin_shufflevector(x[k], x[k + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int k = 0; k < 8; k += k % 4 == 1 ? 3 : 1) {
        x[k] = __builtin_shufflevector(y[k], y[k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
        x[k + 2] = __builtin_shufflevector(y[k], y[k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
    for (int k = 0; k < 4; k++) {
        y[k] = __builtin_shufflevector(x[k], x[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        y[k + 4] = __builtin_shufflevector(x[k], x[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
    for (int k = 0; k < 8; k++) x[k] = y[k];
}

/* E_s I of the hours of a block, for the groups from `first` on. */
static inline void suns_light(const struct imp__annual_hours *h,
                              const struct imp__annual_at *at, size_t block, int first,
                              imp__annual_lanes out[IMP__AT_ONCE])
{
    for (size_t t = 0; t < IMP__AT_ONCE; t++) {
        const size_t k = block * IMP__AT_ONCE + t;
        out[t] = (imp__annual_lanes){0};
        if (k >= h->n || h->cell[k] < 0) continue;
        memcpy(&out[t], at->I[h->cell[k]] + first, sizeof out[t]);
        out[t] *= (float)h->sun[k];
    }
    turn_over(out);
}

/* The hours of two blocks. */
typedef float pair __attribute__((vector_size(8 * IMP__AT_ONCE)));
/* As many sums as there are registers for, beside what they are made of. */
#ifdef __AVX512F__
enum { SUMS = IMP__GROUPS / 2 };
#else
enum { SUMS = IMP__GROUPS / 4 };
#endif

static inline pair joined(imp__annual_lanes a, imp__annual_lanes b)
{
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14,
                                   15);
}

/* sum_p C_p L_p + S of the hours of two blocks, for the groups from `first` on. */
static void pair_light(const struct imp__annual *a, const struct imp__annual_at *at,
                       const int *seen, int n, size_t block, int first)
{
    const imp__annual_lanes(*L)[2] = a->hours.sky[block / 2];
    const size_t ahead = /* of the next blocks */
        block + 2 < a->hours.blocks ? IMP__PATCHES : 0;
    imp__annual_lanes(*E)[IMP__GROUPS] = &at->E[block];
    pair sum[SUMS];
    for (int g = 0; g < SUMS; g++) sum[g] = joined(E[0][first + g], E[1][first + g]);
    for (int i = 0; i < n; i++) {
        const float *C = at->C[seen[i]] + first;
        const pair here = joined(L[seen[i]][0], L[seen[i]][1]);
        if (first == 0) __builtin_prefetch(L + ahead + seen[i]);
        for (int g = 0; g < SUMS; g++) sum[g] += here * C[g];
    }
    for (int g = 0; g < SUMS; g++) {
        E[0][first + g] = __builtin_shufflevector(sum[g], sum[g], 0, 1, 2, 3, 4, 5, 6, 7);
        E[1][first + g] =
            __builtin_shufflevector(sum[g], sum[g], 8, 9, 10, 11, 12, 13, 14, 15);
    }
}

/* E = sum_p C_p L_p + S + E_s I of two blocks. */
static void blocks_light(const struct imp__annual *a, const struct imp__annual_at *at,
                         const int *seen, int n, size_t block)
{
    for (size_t b = block; b < block + 2; b++)
        for (int first = 0; first < IMP__GROUPS; first += IMP__AT_ONCE) {
            imp__annual_lanes x[IMP__AT_ONCE];
            suns_light(&a->hours, at, b, first, x);
            for (int g = 0; g < IMP__AT_ONCE; g++)
                at->E[b][first + g] = at->S[b][first + g] + x[g];
        }
    for (int first = 0; first < IMP__GROUPS; first += SUMS)
        pair_light(a, at, seen, n, block, first);
}

/* Patches from which any light comes. */
static int seen_of(const struct imp__annual_at *at, int seen[IMP__PATCHES])
{
    int n = 0;
    for (int p = 0; p < IMP__PATCHES; p++) {
        bool any = false;
        for (int g = 0; g < IMP__GROUPS; g++) any |= at->C[p][g] != 0;
        if (any) seen[n++] = p;
    }
    return n;
}

void imp__annual_hours_light(const struct imp__annual *a, const struct imp__annual_at *at,
                             size_t points)
{
    int seen[IMP__POINTS][IMP__PATCHES], n[IMP__POINTS];
    for (size_t i = 0; i < points; i++) n[i] = seen_of(&at[i], seen[i]);
    for (size_t b = 0; b < a->hours.blocks; b += 2)
        for (size_t i = 0; i < points; i++) blocks_light(a, &at[i], seen[i], n[i], b);
}
