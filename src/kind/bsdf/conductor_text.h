/* SPDX-License-Identifier: Apache-2.0
 *
 * Fresnel reflectance of a conductor in vacuum, a text in lanes (math/lane_text.h). c: cosine of
 * incidence. With
 *
 *   t = eta^2 - k^2 - sin^2,  A = sqrt(t^2 + 4 eta^2 k^2),  a = sqrt((A + t)/2),
 *
 *   Rs = (P - Q)/(P + Q),  P = A + c^2,  Q = 2 a c
 *   Rp = Rs (U - V)/(U + V),  U = A c^2 + sin^4,  V = Q sin^2,   F = (Rs + Rp)/2
 *
 * For t < 0 a is taken as eta k sqrt(2/(A - t)), which is the same number without the
 * cancellation in A + t, and whose derivatives exist at eta k = 0. */

struct WIDE(imp_conductor) {
    real c2, s2, ek, t, A;
    real root; /* sqrt(2/(A - t)) for t < 0, else a */
    real a, P, Q, U, V;
    real Rs, ratio; /* Rp/Rs */
};

static inline struct WIDE(imp_conductor)
    WIDE(imp__conductor_parts)(real c, real eta, real k)
{
    const real zero = number(0), one = number(1);
    struct WIDE(imp_conductor) x;
    x.c2 = c * c;
    x.s2 = larger(one - x.c2, zero);
    x.ek = eta * k;
    x.t = eta * eta - k * k - x.s2;
    x.A = root_of(x.t * x.t + 4 * x.ek * x.ek);
    const truth turned = x.t < zero;
    x.root = root_of(choose(turned, 2 / (x.A - x.t), 0.5 * (x.A + x.t)));
    x.a = choose(turned, x.ek * x.root, x.root);
    x.P = x.A + x.c2;
    x.Q = 2 * x.a * c;
    x.U = x.A * x.c2 + x.s2 * x.s2;
    x.V = x.Q * x.s2;
    const real s_sum = x.P + x.Q, p_sum = x.U + x.V;
    /* eta = 1, k = 0: P = Q */
    x.Rs = choose(s_sum > zero, larger(x.P - x.Q, zero) / s_sum, one);
    x.ratio = choose(p_sum > zero, (x.U - x.V) / p_sum, one);
    return x;
}

static inline real WIDE(imp__conductor)(real c, real eta, real k)
{
    const struct WIDE(imp_conductor) x = WIDE(imp__conductor_parts)(c, eta, k);
    return 0.5 * x.Rs * (1 + x.ratio);
}

/* With the derivatives by eta and k. At eta = 0 or k = 0 they are the one-sided ones. */
static inline real WIDE(imp__conductor_d)(real c, real eta, real k, real *d_eta,
                                          real *d_k)
{
    const struct WIDE(imp_conductor) x = WIDE(imp__conductor_parts)(c, eta, k);
    const real zero = number(0), s_sum = x.P + x.Q, p_sum = x.U + x.V;
    const real dt[2] = {2 * eta, -2 * k}, dek[2] = {k, eta};
    real dF[2];
    for (int j = 0; j < 2; j++) {
        const real dA = choose(x.A > zero, (x.t * dt[j] + 4 * x.ek * dek[j]) / x.A, zero);
        const real turned = dek[j] * x.root - 0.5 * x.a * (dA - dt[j]) / (x.A - x.t);
        const real straight = choose(x.a > zero, 0.25 * (dA + dt[j]) / x.a, zero);
        const real da = choose(x.t < zero, turned, straight);
        const real dQ = 2 * c * da;
        /* d((P - Q)/(P + Q)) = 2 (Q dP - P dQ)/(P + Q)^2 */
        const real dRs =
            choose(s_sum > zero, 2 * (x.Q * dA - x.P * dQ) / (s_sum * s_sum), zero);
        const real dr =
            choose(p_sum > zero,
                   2 * (x.V * x.c2 * dA - x.U * x.s2 * dQ) / (p_sum * p_sum), zero);
        dF[j] = 0.5 * (dRs * (1 + x.ratio) + x.Rs * dr);
    }
    *d_eta = dF[0];
    *d_k = dF[1];
    return 0.5 * x.Rs * (1 + x.ratio);
}

/* dF/dc, where dt/dc = 2 c, and eta k does not move. */
static inline real WIDE(imp__conductor_by_c)(real c, real eta, real k)
{
    const struct WIDE(imp_conductor) x = WIDE(imp__conductor_parts)(c, eta, k);
    const real zero = number(0), s_sum = x.P + x.Q, p_sum = x.U + x.V;
    const real dt = 2 * c;
    const real dA = choose(x.A > zero, x.t * dt / x.A, zero);
    const real turned = -0.5 * x.a * (dA - dt) / (x.A - x.t);
    const real straight = choose(x.a > zero, 0.25 * (dA + dt) / x.a, zero);
    const real da = choose(x.t < zero, turned, straight);
    const real dP = dA + 2 * c, dQ = 2 * (da * c + x.a);
    const real dU = dA * x.c2 + 2 * x.A * c - 4 * x.s2 * c, dV = dQ * x.s2 - 2 * x.Q * c;
    const real dRs = 2 * (x.Q * dP - x.P * dQ) / (s_sum * s_sum);
    const real dr = 2 * (x.V * dU - x.U * dV) / (p_sum * p_sum);
    return choose((s_sum > zero) & (p_sum > zero),
                  0.5 * (dRs * (1 + x.ratio) + x.Rs * dr), zero);
}
