/* SPDX-License-Identifier: Apache-2.0
 *
 * Phase functions about the direction of travel, a text in lanes (lane_text.h). */

/* imp_phase_cos */
static inline real WIDE(imp__turn_cosines)(real3 wo, real3 wi)
{
    return -inner(wo, wi) / root_of(inner(wo, wo) * inner(wi, wi));
}

/* Light that travels along -wo has turned by an angle of this cosine, about the axis by the angle of
 * this sine and cosine; frame as of imp_frame_about. */
static inline real3 WIDE(imp__turned)(real3 wo, real cosine, real sin_u, real cos_u)
{
    const real3 n = WIDE(imp__unit)(WIDE(imp__opposite)(wo));
    const real sign = signed_as(number(1), n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
    const real3 s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x},
                t = {b, sign + n.y * n.y * a, -n.y};
    const real r = root_of(larger(1 - cosine * cosine, number(0)));
    return plus3(plus3(times3(s, r * cos_u), times3(t, r * sin_u)), times3(n, cosine));
}

/* hg (hg.c): its value, and the cosine that u in [0, 1) draws. */
static inline real WIDE(imp__hg_value)(real g, real c)
{
    const real D = 1 + g * g - 2 * g * c;
    return (1 - g * g) * IMP_INV_PI / (4 * D * root_of(D));
}
static inline real WIDE(imp__hg_cosine)(real g, real u)
{
    const truth even =
        magnitude(g) <= 1e-4; /* else the inverse of the cumulative density */
    const real q = (1 - g * g) / (1 - g + 2 * g * u);
    const real c = lesser(larger((1 + g * g - q * q) / (2 * g), number(-1)), number(1));
    return choose(even, 1 - 2 * u, c);
}
