/* SPDX-License-Identifier: Apache-2.0
 *
 * GGX (microfacet.h), a text in lanes (math/lane_text.h): D of normals m, and G1 of directions v. */

static inline real WIDE(imp__ggx_d)(real au, real av, real3 m)
{
    const real x = m.x / au, y = m.y / av, z = m.z;
    const real s = (x * x + y * y) + z * z;
    return choose(z > 0, 1 / (IMP_PI * au * av * s * s), number(0));
}

static inline real WIDE(imp__ggx_g1)(real au, real av, real3 v)
{
    const real z2 = v.z * v.z, x2 = v.x * v.x / z2, y2 = v.y * v.y / z2;
    return 2 / (1 + root_of(1 + (au * au * x2 + av * av * y2)));
}
