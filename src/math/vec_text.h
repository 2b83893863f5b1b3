/* SPDX-License-Identifier: Apache-2.0
 *
 * Vectors of numbers in lanes, a text in lanes (lane_text.h): the operations of vec.h, in the same
 * order. */

struct WIDE(imp_real3) {
    real x, y, z;
};

static inline real3 WIDE(imp__vector)(real x, real y, real z) { return (real3){x, y, z}; }
/* The same in all lanes. */
static inline real3 WIDE(imp__vector_of)(imp_v3 v)
{
    return (real3){number(v[0]), number(v[1]), number(v[2])};
}
static inline real3 WIDE(imp__plus)(real3 a, real3 b)
{
    return (real3){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline real3 WIDE(imp__minus)(real3 a, real3 b)
{
    return (real3){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline real3 WIDE(imp__times)(real3 a, real c)
{
    return (real3){a.x * c, a.y * c, a.z * c};
}
static inline real3 WIDE(imp__opposite)(real3 a) { return (real3){-a.x, -a.y, -a.z}; }
static inline real WIDE(imp__inner)(real3 a, real3 b)
{
    return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
static inline real3 WIDE(imp__outer)(real3 a, real3 b)
{
    return (real3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline real WIDE(imp__norm)(real3 a) { return root_of(WIDE(imp__inner)(a, a)); }
static inline real3 WIDE(imp__unit)(real3 a)
{
    return WIDE(imp__times)(a, 1 / WIDE(imp__norm)(a));
}
static inline real3 WIDE(imp__choose3)(truth m, real3 a, real3 b)
{
    return (real3){choose(m, a.x, b.x), choose(m, a.y, b.y), choose(m, a.z, b.z)};
}

/* Frames (s, t, n): coordinates of a vector in one, and the vector of coordinates. */
struct WIDE(imp_frames) {
    real3 s, t, n;
};
static inline real3 WIDE(imp__into_frame)(const struct WIDE(imp_frames) * f, real3 v)
{
    return (real3){WIDE(imp__inner)(v, f->s), WIDE(imp__inner)(v, f->t),
                   WIDE(imp__inner)(v, f->n)};
}
static inline real3 WIDE(imp__out_of_frame)(const struct WIDE(imp_frames) * f, real3 v)
{
    const real3 s = WIDE(imp__times)(f->s, v.x), t = WIDE(imp__times)(f->t, v.y),
                n = WIDE(imp__times)(f->n, v.z);
    return WIDE(imp__plus)(WIDE(imp__plus)(s, t), n);
}
