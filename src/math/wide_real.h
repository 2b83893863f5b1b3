/* SPDX-License-Identifier: Apache-2.0
 *
 * As many numbers as a register of the processor holds, which walks in bundles are worked on
 * with: imp_wide, a vector of IMP_WIDE_LANES doubles. Operators and the words of lane_text.h make
 * formulas; here is what takes lanes out of columns and puts them back. */
#ifndef IMP_MATH_WIDE_REAL_H
#define IMP_MATH_WIDE_REAL_H

#include "points.h"
#include "reals.h"
#include <string.h>
#if defined(__AVX2__) || defined(__AVX512F__)
#include <immintrin.h>
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#define IMP_WIDE_LANES 8
typedef imp_real_8 imp_wide;
typedef imp_truth_8 imp_wide_truth;
typedef uint64_t imp_wide_word __attribute__((vector_size(64)));
typedef float imp_wide_float __attribute__((vector_size(32)));
#else
#define IMP_WIDE_LANES 4
typedef imp_real_4 imp_wide;
typedef imp_truth_4 imp_wide_truth;
typedef uint64_t imp_wide_word __attribute__((vector_size(32)));
typedef float imp_wide_float __attribute__((vector_size(16)));
#endif

#define IMP_WIDE IMP_WIDE_LANES
#define IMP_TEXT "math/vec_text.h"
#include "lane_text.h"
#define IMP_WIDE_OF(name) IMP_WIDE_JOIN(name, IMP_WIDE_LANES)

typedef struct IMP_WIDE_OF(imp_real3) imp_wide3;
typedef struct IMP_WIDE_OF(imp_frames) imp_wide_frame;

static inline imp_wide imp__wide(double x) { return IMP_WIDE_OF(imp__real)(x); }
static inline imp_wide imp__wide_choose(imp_wide_truth m, imp_wide a, imp_wide b)
{
    return IMP_WIDE_OF(imp__choose)(m, a, b);
}
static inline imp_wide imp__wide_root(imp_wide x) { return IMP_WIDE_OF(imp__root)(x); }
static inline imp_wide3 imp__wide3_of(imp_v3 v) { return IMP_WIDE_OF(imp__vector_of)(v); }

#define imp__wide3_plus        IMP_WIDE_OF(imp__plus)
#define imp__wide3_minus       IMP_WIDE_OF(imp__minus)
#define imp__wide3_times       IMP_WIDE_OF(imp__times)
#define imp__wide3_opposite    IMP_WIDE_OF(imp__opposite)
#define imp__wide3_inner       IMP_WIDE_OF(imp__inner)
#define imp__wide3_outer       IMP_WIDE_OF(imp__outer)
#define imp__wide3_norm        IMP_WIDE_OF(imp__norm)
#define imp__wide3_unit        IMP_WIDE_OF(imp__unit)
#define imp__wide3_choose      IMP_WIDE_OF(imp__choose3)
#define imp__into_wide_frame   IMP_WIDE_OF(imp__into_frame)
#define imp__out_of_wide_frame IMP_WIDE_OF(imp__out_of_frame)
#define imp__wide_larger       IMP_WIDE_OF(imp__larger)
#define imp__wide_lesser       IMP_WIDE_OF(imp__lesser)
#define imp__wide_magnitude    IMP_WIDE_OF(imp__magnitude)
#define imp__wide_signed_as    IMP_WIDE_OF(imp__signed_as)

/* ---- Truth ------------------------------------------------------------------------------- */

/* A bit for each lane. */
static inline unsigned imp__wide_bits(imp_wide_truth m)
{
#if IMP_WIDE_LANES == 8
    return (unsigned)_mm512_movepi64_mask((__m512i)m);
#else
    return imp__lanes((imp_v3)m);
#endif
}
/* A bit for each of the first n lanes. */
static inline unsigned imp__bits_first(int n)
{
    return n >= IMP_WIDE_LANES ? (1u << IMP_WIDE_LANES) - 1 : (1u << n) - 1;
}

/* ---- Rounding ---------------------------------------------------------------------------- */

/* To float and back: what decisions store (walk/core/step.h). */
static inline imp_wide imp__wide_decide(imp_wide x)
{
#if IMP_WIDE_LANES == 8
    return (imp_wide)_mm512_cvtps_pd(_mm512_cvtpd_ps((__m512d)x));
#else
    return imp__widen(imp__narrow(x));
#endif
}
static inline imp_wide3 imp__wide3_decide(imp_wide3 v)
{
    return (imp_wide3){imp__wide_decide(v.x), imp__wide_decide(v.y),
                       imp__wide_decide(v.z)};
}

static inline imp_wide_float imp__wide_narrow(imp_wide x)
{
#if IMP_WIDE_LANES == 8
    return (imp_wide_float)_mm512_cvtpd_ps((__m512d)x);
#else
    return imp__narrow(x);
#endif
}

/* The whole number below. */
static inline imp_wide imp__wide_floor(imp_wide x)
{
#if IMP_WIDE_LANES == 8
    return (imp_wide)_mm512_floor_pd((__m512d)x);
#elif defined(__AVX__)
    return (imp_wide)_mm256_floor_pd((__m256d)x);
#else
    return (imp_wide){floor(x[0]), floor(x[1]), floor(x[2]), floor(x[3])};
#endif
}

/* ---- Columns ----------------------------------------------------------------------------- */

static inline imp_wide imp__wide_load(const double *from)
{
    imp_wide x;
    memcpy(&x, from, sizeof x);
    return x;
}
static inline void imp__wide_store(double *to, imp_wide x) { memcpy(to, &x, sizeof x); }

static inline void imp__wide3_store(double *const to[3], int at, imp_wide3 v)
{
    imp__wide_store(&to[0][at], v.x);
    imp__wide_store(&to[1][at], v.y);
    imp__wide_store(&to[2][at], v.z);
}

/* Numbers at[k] of a column. */
static inline imp_wide imp__wide_taken(const double *column, const int32_t *at)
{
#if IMP_WIDE_LANES == 8
    return (imp_wide)_mm512_i32gather_pd(_mm256_loadu_si256((const void *)at), column, 8);
#else
    return (imp_wide){column[at[0]], column[at[1]], column[at[2]], column[at[3]]};
#endif
}
static inline imp_wide3 imp__wide3_taken(double *const column[3], const int32_t *at)
{
    return (imp_wide3){imp__wide_taken(column[0], at), imp__wide_taken(column[1], at),
                       imp__wide_taken(column[2], at)};
}

/* Numbers at index, whole numbers below 2^31; and floats. */
static inline imp_wide imp__wide_found(const double *from, imp_wide index)
{
#if IMP_WIDE_LANES == 8
    return (imp_wide)_mm512_i32gather_pd(_mm512_cvtpd_epi32((__m512d)index), from, 8);
#else
    return (imp_wide){from[(int32_t)index[0]], from[(int32_t)index[1]],
                      from[(int32_t)index[2]], from[(int32_t)index[3]]};
#endif
}
static inline imp_wide imp__wide_gathered(const float *from, imp_wide index)
{
#if IMP_WIDE_LANES == 8
    const __m256i at = _mm512_cvtpd_epi32((__m512d)index);
    return (imp_wide)_mm512_cvtps_pd(_mm256_i32gather_ps(from, at, 4));
#else
    return (imp_wide){from[(int32_t)index[0]], from[(int32_t)index[1]],
                      from[(int32_t)index[2]], from[(int32_t)index[3]]};
#endif
}

/* The lanes with bits, side by side; writes all lanes. */
static inline void imp__wide_append(double *to, unsigned bits, imp_wide x)
{
#if IMP_WIDE_LANES == 8
    _mm512_storeu_pd(to, _mm512_maskz_compress_pd((__mmask8)bits, (__m512d)x));
#else
    for (int k = 0, n = 0; k < IMP_WIDE_LANES; n += (int)(bits >> k++ & 1)) to[n] = x[k];
#endif
}
static inline void imp__wide3_append(double *const to[3], int n, unsigned bits,
                                     imp_wide3 v)
{
    imp__wide_append(&to[0][n], bits, v.x);
    imp__wide_append(&to[1][n], bits, v.y);
    imp__wide_append(&to[2][n], bits, v.z);
}

/* Lane k of a vector. */
static inline imp_v3 imp__wide3_lane(const imp_wide3 *v, int k)
{
    return imp__v3(v->x[k], v->y[k], v->z[k]);
}
static inline void imp__wide3_set(imp_wide3 *v, int k, imp_v3 x)
{
    v->x[k] = x[0];
    v->y[k] = x[1];
    v->z[k] = x[2];
}

/* ---- Random numbers (points.h) ----------------------------------------------------------- */

struct imp_wide_block {
    imp_wide_word hash, low, high; /* the numbers' leading bits, four in each */
};

static inline imp_wide_word imp__wide_mix64(imp_wide_word z)
{
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static inline uint64_t imp__four_leads(const uint16_t *lead)
{
    return (uint64_t)lead[0] | (uint64_t)lead[1] << 16 | (uint64_t)lead[2] << 32 |
           (uint64_t)lead[3] << 48;
}

/* A block of the points index[at[k]] of the sets with hash set[at[k]]; points NULL: all numbers of
 * the keys set[at[k]] (rng.h), of which number k is that of dimension k. */
static inline struct imp_wide_block imp__wide_block(const struct imp_point_table *points,
                                                    const uint64_t *set,
                                                    const uint32_t *index,
                                                    const int32_t *at, uint32_t block)
{
    struct imp_wide_block b;
    for (int k = 0; k < IMP_WIDE_LANES; k++) b.hash[k] = set[at[k]];
    b.low = b.high = (imp_wide_word){0};
    if (!points) return b;
    b.hash = imp__wide_mix64(b.hash + (uint64_t)(block + 1) * 0x9e3779b97f4a7c15u);
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const uint64_t h = b.hash[k], i = (index[at[k]] ^ h) & (IMP_SET_POINTS - 1);
        const uint16_t *lead = points->number[h >> 58][i];
        b.low[k] = imp__four_leads(lead);
        b.high[k] = imp__four_leads(lead + 4);
    }
    return b;
}

/* Number k of each, on [0, 1). */
static inline imp_wide imp__wide_number(const struct imp_wide_block *b, uint32_t k)
{
    const imp_wide_word shift =
        imp__wide_mix64(b->hash + (uint64_t)(k + 1) * 0x9e3779b97f4a7c15u);
    const imp_wide_word lead = (k < 4 ? b->low : b->high) >> 16 * (int)(k & 3) << 48;
    const imp_wide_word whole = (shift ^ lead) >> 11;
#if IMP_WIDE_LANES == 8
    return (imp_wide)_mm512_cvtepi64_pd((__m512i)whole) * 0x1p-53;
#else
    /* Below 2^53: its upper and its lower half are exact, and so is their sum. */
    const imp_wide_word half = whole >> 32, rest = whole & 0xffffffffu,
                        at = (imp_wide_word)imp__wide(0x1p52);
    const imp_wide high = (imp_wide)(half | at) - 0x1p52,
                   low = (imp_wide)(rest | at) - 0x1p52;
    return (high * 0x1p32 + low) * 0x1p-53;
#endif
}

#endif
