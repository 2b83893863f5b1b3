/* SPDX-License-Identifier: Apache-2.0
 *
 * Fresnel reflectance of a dielectric, a text in lanes (math/lane_text.h). c: cosine on the side of the
 * ray, its sign the side (c > 0: outside); eta: inside/outside. *cos_t: cosine of refraction, >= 0, 0
 * under total reflection; *eta_t: index on the far side over index on the near side.
 *
 *   F = (a^2 + b^2)/2,  a = (c - e t)/(c + e t),  b = (t - e c)/(t + e c),  t = cos_t, e = eta_t */

/* c > 0, e far/near, as of imp__fresnel_dielectric_d: at e = 1 it is 0 up to rounding. */
static inline real WIDE(imp__dielectric_from)(real c, real e, real *cos_t)
{
    const real zero = number(0), ct2 = 1 - (1 - c * c) / (e * e);
    const truth passes = ct2 > zero;
    const real ct = root_of(choose(passes, ct2, zero));
    const real a = (c - e * ct) / (c + e * ct), b = (ct - e * c) / (ct + e * c);
    *cos_t = ct;
    return choose(passes, 0.5 * (a * a + b * b), number(1));
}

/* Likewise, with derivatives by c and e. */
static inline real WIDE(imp__dielectric_d)(real c, real e, real *d_c, real *d_e)
{
    const real zero = number(0), one = number(1);
    const real ct2 = 1 - (1 - c * c) / (e * e);
    const truth passes = ct2 > zero;
    const real t = root_of(choose(passes, ct2, one)), s = c + e * t, p = t + e * c;
    const real a = (c - e * t) / s, b = (t - e * c) / p;
    const real dt[2] = {c / (e * e * t), (1 - c * c) / (e * e * e * t)}; /* by c, e */
    const real dc[2] = {one, zero}, de[2] = {zero, one};
    real d[2];
    for (int k = 0; k < 2; k++) {
        const real et = e * dt[k] + de[k] * t, ec = e * dc[k] + de[k] * c;
        const real da = ((dc[k] - et) - a * (dc[k] + et)) / s;
        const real db = ((dt[k] - ec) - b * (dt[k] + ec)) / p;
        d[k] = choose(passes, a * da + b * db, zero);
    }
    *d_c = d[0];
    *d_e = d[1];
    return choose(passes, 0.5 * (a * a + b * b), one);
}

static inline real WIDE(imp__dielectric)(real c, real eta, real *cos_t, real *eta_t)
{
    const real zero = number(0), one = number(1);
    const real e = choose(c >= zero, eta, 1 / eta);
    const real F = WIDE(imp__dielectric_from)(magnitude(c), e, cos_t);
    *eta_t = e;
    return choose(e == one, zero, F);
}
