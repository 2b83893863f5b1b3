/* SPDX-License-Identifier: Apache-2.0
 *
 * Vectors and spectra are four doubles (GCC/Clang vector types), so formulas read as in
 * the papers: f * (cos_i / p). The fourth lane of an imp_v3 is 0. The types come from
 * kinds.h. */
#ifndef IMP_MATH_VEC_H
#define IMP_MATH_VEC_H

#include "base/compiler.h"
#include <importon/kinds.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define IMP_PI     3.14159265358979323846
#define IMP_INV_PI 0.31830988618379067154
#define IMP_2PI    6.28318530717958647693

static inline imp_v3 imp__v3(double x, double y, double z)
{
    return (imp_v3){x, y, z, 0};
}
static inline imp_spec imp__spec(double c) { return (imp_spec){c, c, c, c}; }

/* Four floats and four doubles. */
typedef float imp_float4 __attribute__((vector_size(16)));
static inline imp_float4 imp__narrow(imp_v3 v)
{
    return __builtin_convertvector(v, imp_float4);
}
static inline imp_v3 imp__widen(imp_float4 v)
{
#if defined(__AVX__) &&                                                                  \
    !defined(__clang__) /* GCC 12 would convert the halves one by one */
    return (imp_v3)__builtin_ia32_cvtps2pd256(v);
#else
    return __builtin_convertvector(v, imp_v3);
#endif
}

/* A bit for each lane of what a comparison of two vectors gives. */
#define imp__lanes_of(mask) imp__lanes((imp_v3)(mask))
static inline unsigned imp__lanes(imp_v3 mask)
{
#ifdef __AVX__
    return (unsigned)__builtin_ia32_movmskpd256(mask);
#else
    typedef int64_t bits __attribute__((vector_size(32)));
    const bits m = (bits)mask;
    return (unsigned)((m[0] & 1) | (m[1] & 2) | (m[2] & 4) | (m[3] & 8));
#endif
}

static inline imp_v3 imp__abs(imp_v3 v)
{
    typedef int64_t bits __attribute__((vector_size(32)));
    return (imp_v3)((bits)v & INT64_MAX);
}
/* The lesser, or the greater, in each lane; that of b where one is NAN. */
static inline imp_v3 imp__lesser(imp_v3 a, imp_v3 b)
{
    typedef int64_t bits __attribute__((vector_size(32)));
    const bits m = a < b;
    return (imp_v3)((m & (bits)a) | (~m & (bits)b));
}
static inline imp_v3 imp__greater(imp_v3 a, imp_v3 b) { return -imp__lesser(-a, -b); }
static inline double imp__dot(imp_v3 a, imp_v3 b)
{
    const imp_v3 p = a * b;
    return (p[0] + p[1]) + p[2];
}
static inline imp_v3 imp__cross(imp_v3 a, imp_v3 b)
{
    return imp__v3(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                   a[0] * b[1] - a[1] * b[0]);
}
static inline double imp__length(imp_v3 a) { return sqrt(imp__dot(a, a)); }
static inline imp_v3 imp__normalize(imp_v3 a) { return a * (1 / imp__length(a)); }

static inline double imp__max3(imp_spec s) { return imp_max(s[0], imp_max(s[1], s[2])); }
static inline double imp__sum3(imp_spec s) { return (s[0] + s[1]) + s[2]; }
static inline bool imp__is_zero(imp_spec s)
{
    return s[0] == 0 && s[1] == 0 && s[2] == 0;
}
/* Sum of the first n lanes, n = 1, 3 or 4. */
static inline double imp__sum_used(imp_spec s, int n)
{
    return n == 3 ? imp__sum3(s) : n == 1 ? s[0] : (s[0] + s[1]) + (s[2] + s[3]);
}
/* Largest of the lanes in use: four for wavelengths, three for colours. */
static inline double imp__max_used(imp_spec s, bool four)
{
    return four ? imp_max(imp__max3(s), s[3]) : imp__max3(s);
}
static inline bool imp__is_zero_used(imp_spec s, bool four)
{
    return imp__is_zero(s) && (!four || s[3] == 0);
}
static inline bool imp__is_finite(imp_spec s)
{
    return isfinite(s[0]) && isfinite(s[1]) && isfinite(s[2]);
}
/* Are all four lanes in [0, most]? */
static inline bool imp__is_within(imp_spec s, double most)
{
    const __typeof__(s >= s) in = (s >= imp__spec(0)) & (s <= imp__spec(most));
    return (in[0] & in[1]) & (in[2] & in[3]);
}
static inline double imp__sqr(double x) { return x * x; }

/* Orthonormal frame; local (x, y, z) is x s + y t + z n. */
struct imp_frame {
    imp_v3 s, t, n;
};

static inline imp_v3 imp__to_local(const struct imp_frame *f, imp_v3 v)
{
    return imp__v3(imp__dot(v, f->s), imp__dot(v, f->t), imp__dot(v, f->n));
}
static inline imp_v3 imp__to_world(const struct imp_frame *f, imp_v3 v)
{
    return f->s * v[0] + f->t * v[1] + f->n * v[2];
}
/* Branch-free basis about n (Duff et al., "Building an Orthonormal Basis, Revisited",
 * 2017). */
static inline struct imp_frame imp__frame_from_normal(imp_v3 n)
{
    const double sign = copysign(1, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    return (struct imp_frame){imp__v3(1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]),
                              imp__v3(b, sign + n[1] * n[1] * a, -n[1]), n};
}

#endif
