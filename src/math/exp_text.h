/* SPDX-License-Identifier: Apache-2.0
 *
 * Exponential function and logarithm, a text in lanes (lane_text.h). */

/* exp(x) to 2^-52.5 of itself; 0 below -708, where it would be less than the least normal number,
 * and infinite above 709. With k the nearest integer to x/ln 2,
 *
 *     exp(x) = 2^k exp(r),    r = x - k ln 2,  |r| <= ln(2)/2,
 *
 * where ln 2 is the sum of a number of 20 bits, whose product with k is exact, and a small one; then
 * Taylor's series, cut where the next term is below 2^-57. */
static inline real WIDE(imp__exp)(real x)
{
    const real shift = number(0x1.8p52); /* its last bit counts ones */
    const real t = x * 1.44269504088896340736 + shift, k = t - shift;
    const real r = (x - k * 0x1.62e4p-1) - k * 0x1.7f7d1cf79abcap-20;
    const real z = r * r, z2 = z * z, z4 = z2 * z2;
    const real a = (1. / 2 + r * (1. / 6)) + z * (1. / 24 + r * (1. / 120));
    const real b = (1. / 720 + r * (1. / 5040)) + z * (1. / 40320 + r * (1. / 362880));
    const real c = (1. / 3628800 + r * (1. / 39916800)) +
                   z * (1. / 479001600 + r * (1. / 6227020800));
    const real e = 1 + (r + z * ((a + z2 * b) + z4 * c));
    const real power = power_of(whole_of(t), whole_of(shift));
    const real least = choose(x < -708, number(0), e * power);
    return choose(x > 709, number(INFINITY), least);
}

/* log(x) of normal x > 0, to 2^-52 of itself. With x = 2^k m, 1/sqrt(2) <= m < sqrt(2) or nearly,
 *
 *     log x = k ln 2 + 2 artanh s,    s = (m - 1)/(m + 1),  |s| < .1716,
 *
 * the series of artanh cut where the next term is below 2^-57, and ln 2 as above: the sum of its first
 * part times k, which is exact, and of all that is small. s = f/(2 + f) with f = m - 1 has its rounding
 * in the second term alone, since 2 s = f - s f. */
static inline real WIDE(imp__log)(real x)
{
    /* The exponent that leaves the rest of the number in that range. */
    const whole high = (whole_of(x) - INT64_C(0x3fe6a09e00000000)) >> 52;
    const real k = real_of(high + INT64_C(0x4338000000000000)) - 0x1.8p52;
    const real f = real_of(whole_of(x) - exponent(high)) - 1;
    const real s = f / (2 + f), z = s * s, z2 = z * z, z4 = z2 * z2;
    const real a = (2. / 3 + z * (2. / 5)) + z2 * (2. / 7 + z * (2. / 9));
    const real b = (2. / 11 + z * (2. / 13)) + z2 * (2. / 15 + z * (2. / 17));
    const real small =
        k * 0x1.7f7d1cf79abcap-20 + s * (z * (a + z4 * (b + z4 * (2. / 19))) - f);
    return (k * 0x1.62e4p-1 + f) + small;
}
