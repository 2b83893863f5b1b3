/* SPDX-License-Identifier: Apache-2.0
 *
 * GGX (microfacet.h), a text in lanes (math/lane_text.h): D of normals m, and G1 of directions v, with
 * d ln D and dG1 by au and av. Beckmann's facets likewise, but for the exponential in D. */

static inline real WIDE(imp__ggx_d)(real au, real av, real3 m)
{
    const real x = m.x / au, y = m.y / av, z = m.z;
    const real s = (x * x + y * y) + z * z;
    return choose(z > 0, 1 / (IMP_PI * au * av * s * s), number(0));
}

/* G1 and its slope, of t2 = (au^2 x^2 + av^2 y^2)/z^2. */
static inline real WIDE(imp__ggx_g1_of)(real t2, real *slope)
{
    const real r = root_of(1 + t2), g = 2 / (1 + r);
    *slope = -0.5 * g * g / (2 * r);
    return g;
}
static inline real WIDE(imp__beckmann_g1_of)(real t2, real *slope)
{
    const real a = 1 / root_of(t2); /* infinite at normal incidence */
    const real n = (3.535 + 2.181 * a) * a, m = 1 + (2.276 + 2.577 * a) * a;
    const truth all = a >= 1.6;
    *slope = choose(all, number(0),
                    ((3.535 + 4.362 * a) * m - n * (2.276 + 5.154 * a)) / (m * m) *
                        (-0.5 * a / t2));
    return choose(all, number(1), n / m);
}

static inline real WIDE(imp__ggx_g1)(real au, real av, real3 v)
{
    const real z2 = v.z * v.z, x2 = v.x * v.x / z2, y2 = v.y * v.y / z2;
    real slope;
    return WIDE(imp__ggx_g1_of)(au * au * x2 + av * av * y2, &slope);
}

static inline void WIDE(imp__ggx_d_log)(real au, real av, real3 m, real d[2])
{
    const real x = m.x / au, y = m.y / av, z = m.z;
    const real s = (x * x + y * y) + z * z;
    d[0] = choose(z > 0, (4 * x * x / s - 1) / au, number(0));
    d[1] = choose(z > 0, (4 * y * y / s - 1) / av, number(0));
}

static inline real WIDE(imp__ggx_g1_d)(real au, real av, real3 v, real d[2])
{
    const real z2 = v.z * v.z, x2 = v.x * v.x / z2, y2 = v.y * v.y / z2;
    real slope;
    const real g = WIDE(imp__ggx_g1_of)(au * au * x2 + av * av * y2, &slope);
    d[0] = slope * 2 * au * x2;
    d[1] = slope * 2 * av * y2;
    return g;
}

/* D by its exponential, exp(-q), q = tan^2 of the stretched normal. */
static inline real WIDE(imp__beckmann_q)(real au, real av, real3 m)
{
    const real x = m.x / au, y = m.y / av;
    return (x * x + y * y) / (m.z * m.z);
}
static inline real WIDE(imp__beckmann_d_of)(real au, real av, real z, real exponential)
{
    const real z2 = z * z;
    return choose(z > 0, exponential / (IMP_PI * au * av * z2 * z2), number(0));
}

static inline void WIDE(imp__beckmann_d_log)(real au, real av, real3 m, real d[2])
{
    const real x = m.x / au, y = m.y / av, z2 = m.z * m.z;
    d[0] = choose(m.z > 0, (2 * x * x / z2 - 1) / au, number(0));
    d[1] = choose(m.z > 0, (2 * y * y / z2 - 1) / av, number(0));
}

static inline real WIDE(imp__beckmann_g1_d)(real au, real av, real3 v, real d[2])
{
    const real z2 = v.z * v.z, x2 = v.x * v.x / z2, y2 = v.y * v.y / z2;
    real slope;
    const real g = WIDE(imp__beckmann_g1_of)(au * au * x2 + av * av * y2, &slope);
    d[0] = slope * 2 * au * x2;
    d[1] = slope * 2 * av * y2;
    return g;
}
