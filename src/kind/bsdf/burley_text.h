/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of the principled materials (burley.h, principled.c), a text in lanes (math/lane_text.h). */

/* Schlick's weight (1 - c)^5, and its slope. */
static inline real WIDE(imp__schlick)(real c)
{
    const real x = larger(lesser(1 - c, number(1)), number(0)), x2 = x * x;
    return x2 * x2 * x;
}
static inline real WIDE(imp__schlick_slope)(real c)
{
    const real x = larger(lesser(1 - c, number(1)), number(0)), x2 = x * x;
    return choose(c > 0, -5 * x2 * x2, number(0));
}
/* The weight at the angle on the side of the lower index, e = behind over before. */
static inline real WIDE(imp__schlick_at)(real e, real c)
{
    const real s2 = 1 - c * c, ct2 = 1 - s2 / (e * e);
    const truth passes = ct2 > 0;
    const real ct = root_of(choose(passes, ct2, number(0)));
    return choose(e > 1, WIDE(imp__schlick)(c),
                  choose(passes, WIDE(imp__schlick)(ct), number(1)));
}
/* Its derivative by e. */
static inline real WIDE(imp__schlick_by_index)(real e, real c)
{
    const real s2 = 1 - c * c, ct2 = 1 - s2 / (e * e);
    const truth passes = (ct2 > 0) & (e <= 1);
    const real ct = root_of(choose(passes, ct2, number(1)));
    return choose(passes, WIDE(imp__schlick_slope)(ct) * s2 / (e * e * e * ct),
                  number(0));
}

/* Diffuse lobe over base_color cos_i/pi: Burley's with its retro-reflection, and the
 * flat one that imitates scattering below the surface. */
struct WIDE(imp_burley) {
    real value, d_roughness, d_flatness;
};
static inline __attribute__((always_inline)) struct WIDE(imp_burley)
    WIDE(imp__burley)(real cos_o, real cos_i, real cos_d, real roughness, real flatness)
{
    const real Fo = WIDE(imp__schlick)(cos_o), Fi = WIDE(imp__schlick)(cos_i);
    const real R = 2 * roughness * cos_d * cos_d, dR = 2 * cos_d * cos_d;
    const real full = (1 - 0.5 * Fo) * (1 - 0.5 * Fi) + R * (Fo + Fi + Fo * Fi * (R - 1));
    const real d_full = Fo + Fi + Fo * Fi * (2 * R - 1);
    const real q_o = 1 + Fo * (0.5 * R - 1), q_i = 1 + Fi * (0.5 * R - 1);
    const real slab = 1 / (cos_o + cos_i) - 0.5;
    const real flat = 1.25 * (q_o * q_i * slab + 0.5);
    const real d_flat = 1.25 * slab * 0.5 * (Fo * q_i + Fi * q_o);
    return (struct WIDE(imp_burley)){full + (flat - full) * flatness,
                                     dR * (d_full + (d_flat - d_full) * flatness),
                                     flat - full};
}

/* Roughness along s and t of the GGX lobe, by `roughness` and `anisotropic`, and the derivatives of
 * both by each of the two. */
static inline void WIDE(imp__burley_alpha)(real roughness, real anisotropic,
                                           real alpha[2])
{
    const real a = root_of(1 - 0.9 * anisotropic), r2 = roughness * roughness;
    alpha[0] = larger(r2 / a, number(1e-3));
    alpha[1] = larger(r2 * a, number(1e-3));
}
static inline void WIDE(imp__burley_alpha_d)(real roughness, real anisotropic,
                                             real by_roughness[2], real by_anisotropic[2])
{
    const real a = root_of(1 - 0.9 * anisotropic), r2 = roughness * roughness;
    const truth u = r2 / a > 1e-3, v = r2 * a > 1e-3;
    by_roughness[0] = choose(u, 2 * roughness / a, number(0));
    by_roughness[1] = choose(v, 2 * roughness * a, number(0));
    by_anisotropic[0] = choose(u, 0.45 * r2 / (a * a * a), number(0));
    by_anisotropic[1] = choose(v, -0.45 * r2 / a, number(0));
}

/* D1 of the clearcoat (GTR1 with A = alpha^2, log_A = ln A) of a normal's cosine, and d ln D1/d gloss. */
static inline real WIDE(imp__clearcoat_d)(real alpha, real log_A, real z, real *d_log)
{
    const real A = alpha * alpha, q = 1 + (A - 1) * z * z;
    *d_log = (1 / (A - 1) - 1 / (A * log_A) - z * z / q) * 2 * alpha * -0.099;
    return (A - 1) / (IMP_PI * log_A * q);
}
