/* SPDX-License-Identifier: Apache-2.0
 *
 * Two doubles, and a choice between two such pairs without a branch: one that goes by a
 * random number is predicted wrong every other time, which costs as much as a root. */
#ifndef IMP_MATH_PAIR_H
#define IMP_MATH_PAIR_H

#include <stdint.h>

typedef double imp_pair __attribute__((vector_size(16)));
typedef int64_t imp_pair_mask __attribute__((vector_size(16)));

/* a > b, as a mask. */
static inline imp_pair_mask imp__pair_exceeds(double a, double b)
{
    return (imp_pair){a, a} > (imp_pair){b, b};
}
static inline imp_pair imp__pair_choose(imp_pair_mask first, imp_pair a, imp_pair b)
{
    return (imp_pair)(((imp_pair_mask)a & first) | ((imp_pair_mask)b & ~first));
}

#endif
