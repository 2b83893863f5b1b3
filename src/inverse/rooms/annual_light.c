/* SPDX-License-Identifier: Apache-2.0
 *
 * The illuminances of some hours at a point, from its coefficients. */
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

/* The hours of two blocks, and how many such pairs a coefficient is read for: as sums wait for each
 * other, and there are registers. */
typedef float pair __attribute__((vector_size(8 * IMP__AT_ONCE)));
#ifdef __AVX__
enum { PAIRS = 4 };
#else
enum { PAIRS = 2 };
#endif

static inline pair joined(imp__annual_lanes a, imp__annual_lanes b)
{
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14,
                                   15);
}

/* E += sum_p C_p L_p of so many pairs of blocks. At 1,024 samples one group in nine has light from
 * a patch from which some have. */
static inline __attribute__((always_inline)) void
pairs_add(const struct imp__annual_at *at, const imp__annual_skies *L,
          imp__annual_lanes (*E)[IMP__GROUPS], const int pairs)
{
    for (int g = 0; g < IMP__GROUPS; g++) {
        const struct imp__annual_part *part = at->part[g];
        pair sum[PAIRS];
        for (int k = 0; k < pairs; k++) sum[k] = joined(E[2 * k][g], E[2 * k + 1][g]);
        for (int i = 0; i < at->parts[g]; i++)
            for (int k = 0; k < pairs; k++) {
                pair here;
                memcpy(&here, L[k][part[i].patch], sizeof here);
                sum[k] += here * part[i].C;
            }
        for (int k = 0; k < pairs; k++) {
            E[2 * k][g] = __builtin_shufflevector(sum[k], sum[k], 0, 1, 2, 3, 4, 5, 6, 7);
            E[2 * k + 1][g] =
                __builtin_shufflevector(sum[k], sum[k], 8, 9, 10, 11, 12, 13, 14, 15);
        }
    }
}

/* E += E_s I of a block. */
static void suns_add(const struct imp__annual_hours *h, const struct imp__annual_at *at,
                     size_t block, imp__annual_lanes E[IMP__GROUPS])
{
    for (int first = 0; first < IMP__GROUPS; first += IMP__AT_ONCE) {
        imp__annual_lanes x[IMP__AT_ONCE];
        suns_light(h, at, block, first, x);
        for (int g = 0; g < IMP__AT_ONCE; g++) E[first + g] += x[g];
    }
}

void imp__annual_light_add(const struct imp__annual *a, const struct imp__annual_at *at,
                           const imp__annual_skies *sky, size_t block, size_t blocks,
                           imp__annual_lanes (*E)[IMP__GROUPS])
{
    size_t b = 0;
    for (size_t k = 0; k < blocks; k++) suns_add(&a->hours, at, block + k, E[k]);
    for (; b + 2 * PAIRS <= blocks; b += 2 * PAIRS)
        pairs_add(at, &sky[b / 2], &E[b], PAIRS);
    for (; b < blocks; b += 2) pairs_add(at, &sky[b / 2], &E[b], 1);
}
