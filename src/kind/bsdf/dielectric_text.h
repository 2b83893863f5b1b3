/* SPDX-License-Identifier: Apache-2.0
 *
 * Fresnel reflectance of a dielectric, a text in lanes (math/lane_text.h). c: cosine on the side of the
 * ray, its sign the side (c > 0: outside); eta: inside/outside. *cos_t: cosine of refraction, >= 0, 0
 * under total reflection; *eta_t: index on the far side over index on the near side.
 *
 *   F = (a^2 + b^2)/2,  a = (c - e t)/(c + e t),  b = (t - e c)/(t + e c),  t = cos_t, e = eta_t */

static inline real WIDE(imp__dielectric)(real c, real eta, real *cos_t, real *eta_t)
{
    const real zero = number(0), one = number(1);
    const real e = choose(c >= zero, eta, 1 / eta), ci = magnitude(c);
    const real ct2 = 1 - (1 - ci * ci) / (e * e);
    const truth passes = ct2 > zero;
    const real ct = root_of(choose(passes, ct2, zero));
    const real a = (ci - e * ct) / (ci + e * ct), b = (ct - e * ci) / (ct + e * ci);
    *eta_t = e;
    *cos_t = ct;
    return choose(e == one, zero, choose(passes, 0.5 * (a * a + b * b), one));
}
