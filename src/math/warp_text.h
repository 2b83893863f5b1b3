/* SPDX-License-Identifier: Apache-2.0
 *
 * Warps of warp.h, a text in lanes (lane_text.h). */

/* Cosine-weighted hemisphere about +z by the concentric map (imp__cosine_hemisphere). */
static inline real3 WIDE(imp__cosine_directions)(real u0, real u1)
{
    const real zero = number(0), a = 2 * u0 - 1, b = 2 * u1 - 1;
    const truth wide = magnitude(a) > magnitude(b);
    const real r = choose(wide, a, b), x = IMP_PI / 4 * (choose(wide, b, a) / r);
    const real s = WIDE(imp__sin_eighth)(x), c = WIDE(imp__cos_eighth)(x);
    const truth none = (a == 0) & (b == 0);
    const real dx = choose(none, zero, r * choose(wide, c, s)),
               dy = choose(none, zero, r * choose(wide, s, c));
    return (real3){dx, dy, root_of(larger(zero, 1 - dx * dx - dy * dy))};
}

/* Sine and cosine of 2 pi u, u in [0, 1) (imp__sincos_turn). */
static inline void WIDE(imp__sincos_turns)(real u, real *s, real *c)
{
    const real four = 4 * u, up = four + 0.5, zero = number(0), one = number(1);
    const real quarter = (choose(up >= 1, one, zero) + choose(up >= 2, one, zero)) +
                         (choose(up >= 3, one, zero) + choose(up >= 4, one, zero));
    const real x = (four - quarter) * 1.57079632679489661923;
    const real a = WIDE(imp__sin_eighth)(x), b = WIDE(imp__cos_eighth)(x);
    const truth odd = (quarter == 1) | (quarter == 3),
                low = (quarter == 2) | (quarter == 3),
                left = (quarter == 1) | (quarter == 2);
    const real sn = choose(odd, b, a), cs = choose(odd, a, b);
    *s = choose(low, -sn, sn);
    *c = choose(left, -cs, cs);
}

/* The uniform sphere (imp__uniform_sphere). */
static inline real3 WIDE(imp__sphere_directions)(real u0, real u1)
{
    const real z = 1 - 2 * u0, r = root_of(larger(number(0), 1 - z * z));
    real s, c;
    WIDE(imp__sincos_turns)(u1, &s, &c);
    return (real3){r * c, r * s, z};
}
