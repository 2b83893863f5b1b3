/* SPDX-License-Identifier: Apache-2.0
 *
 * One, four or eight numbers, and functions of them that are not operators. The same bits on
 * every processor, and in every lane as alone. */
#ifndef IMP_MATH_REALS_H
#define IMP_MATH_REALS_H

#include "vec.h"
#include <string.h>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

/* What comparisons give: of vectors all bits of a lane that is true. */
typedef double imp_real_1;
typedef int imp_truth_1;
typedef imp_spec imp_real_4;
typedef int64_t imp_truth_4 __attribute__((vector_size(32)));
typedef double imp_real_8 __attribute__((vector_size(64)));
typedef int64_t imp_truth_8 __attribute__((vector_size(64)));

/* Their bits. */
typedef int64_t imp_whole_1;
typedef imp_truth_4 imp_whole_4;
typedef imp_truth_8 imp_whole_8;
static inline imp_whole_1 imp__whole_of_1(double x)
{
    imp_whole_1 bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
static inline double imp__real_of_1(imp_whole_1 bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}
static inline imp_whole_4 imp__whole_of_4(imp_real_4 x) { return (imp_whole_4)x; }
static inline imp_real_4 imp__real_of_4(imp_whole_4 bits) { return (imp_real_4)bits; }
static inline imp_whole_8 imp__whole_of_8(imp_real_8 x) { return (imp_whole_8)x; }
static inline imp_real_8 imp__real_of_8(imp_whole_8 bits) { return (imp_real_8)bits; }
/* 2^(a - b) of bits that count ones. */
static inline double imp__power_1(imp_whole_1 a, imp_whole_1 b)
{
    return imp__real_of_1((imp_whole_1)(((uint64_t)a - (uint64_t)b + 1023) << 52));
}
static inline imp_real_4 imp__power_4(imp_whole_4 a, imp_whole_4 b)
{
    return (imp_real_4)((a - b + 1023) << 52);
}
static inline imp_real_8 imp__power_8(imp_whole_8 a, imp_whole_8 b)
{
    return (imp_real_8)((a - b + 1023) << 52);
}

/* k 2^52: as bits, an exponent. */
static inline imp_whole_1 imp__exponent_1(imp_whole_1 k)
{
    return (imp_whole_1)((uint64_t)k << 52);
}
static inline imp_whole_4 imp__exponent_4(imp_whole_4 k) { return k << 52; }
static inline imp_whole_8 imp__exponent_8(imp_whole_8 k) { return k << 52; }

/* a where m is true, else b. */
static inline double imp__choose_1(int m, double a, double b) { return m ? a : b; }
static inline imp_real_4 imp__choose_4(imp_truth_4 m, imp_real_4 a, imp_real_4 b)
{
    return (imp_real_4)((m & (imp_truth_4)a) | (~m & (imp_truth_4)b));
}
static inline imp_real_8 imp__choose_8(imp_truth_8 m, imp_real_8 a, imp_real_8 b)
{
    return (imp_real_8)((m & (imp_truth_8)a) | (~m & (imp_truth_8)b));
}

static inline double imp__root_1(double x) { return sqrt(x); }
static inline imp_real_4 imp__root_4(imp_real_4 x)
{
#ifdef __AVX__
    return (imp_real_4)__builtin_ia32_sqrtpd256(x);
#else
    return (imp_real_4){sqrt(x[0]), sqrt(x[1]), sqrt(x[2]), sqrt(x[3])};
#endif
}
static inline imp_real_8 imp__root_8(imp_real_8 x)
{
#ifdef __AVX512F__
    return (imp_real_8)_mm512_sqrt_pd((__m512d)x);
#endif
    return (imp_real_8){sqrt(x[0]), sqrt(x[1]), sqrt(x[2]), sqrt(x[3]),
                        sqrt(x[4]), sqrt(x[5]), sqrt(x[6]), sqrt(x[7])};
}

/* The same number in all lanes. */
static inline double imp__real_1(double x) { return x; }
static inline imp_real_4 imp__real_4(double x) { return imp__spec(x); }
static inline imp_real_8 imp__real_8(double x)
{
    return (imp_real_8){x, x, x, x, x, x, x, x};
}

static inline double imp__magnitude_1(double x) { return fabs(x); }
static inline imp_real_4 imp__magnitude_4(imp_real_4 x) { return imp__abs(x); }
static inline imp_real_8 imp__magnitude_8(imp_real_8 x)
{
    return (imp_real_8)((imp_truth_8)x & INT64_MAX);
}

/* The greater; b where one is NAN. */
static inline double imp__larger_1(double a, double b) { return imp_max(a, b); }
static inline imp_real_4 imp__larger_4(imp_real_4 a, imp_real_4 b)
{
    return imp__choose_4(a > b, a, b);
}
static inline imp_real_8 imp__larger_8(imp_real_8 a, imp_real_8 b)
{
    return imp__choose_8(a > b, a, b);
}

/* The lesser; b where one is NAN. */
static inline double imp__lesser_1(double a, double b) { return imp_min(a, b); }
static inline imp_real_4 imp__lesser_4(imp_real_4 a, imp_real_4 b)
{
    return imp__choose_4(a < b, a, b);
}
static inline imp_real_8 imp__lesser_8(imp_real_8 a, imp_real_8 b)
{
    return imp__choose_8(a < b, a, b);
}

/* The magnitude of a with the sign of b. */
static inline double imp__signed_as_1(double a, double b) { return copysign(a, b); }
static inline imp_real_4 imp__signed_as_4(imp_real_4 a, imp_real_4 b)
{
    return (imp_real_4)(((imp_truth_4)a & INT64_MAX) | ((imp_truth_4)b & INT64_MIN));
}
static inline imp_real_8 imp__signed_as_8(imp_real_8 a, imp_real_8 b)
{
    return (imp_real_8)(((imp_truth_8)a & INT64_MAX) | ((imp_truth_8)b & INT64_MIN));
}

#endif
