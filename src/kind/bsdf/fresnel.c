/* SPDX-License-Identifier: Apache-2.0
 *
 * Fresnel reflectance of dielectrics and conductors, and its derivatives with respect
 * to angle and index. */
#include "fresnel.h"

double imp__fresnel_dielectric(double c, double eta, double *cos_t, double *eta_t)
{
    const double e = c >= 0 ? eta : 1 / eta, ci = fabs(c);
    const double ct2 = 1 - (1 - ci * ci) / (e * e);
    *eta_t = e;
    *cos_t = ct2 > 0 ? sqrt(ct2) : 0;
    if (e == 1) return 0;
    if (!(ct2 > 0)) return 1; /* total reflection */
    const double ct = *cos_t;
    const double a = (ci - e * ct) / (ci + e * ct), b = (ct - e * ci) / (ct + e * ci);
    return 0.5 * (a * a + b * b);
}

double imp__fresnel_dielectric_d(double c, double e, double *d_c, double *d_e)
{
    const double ct2 = 1 - (1 - c * c) / (e * e);
    *d_c = *d_e = 0;
    if (!(ct2 > 0)) return 1;
    const double t = sqrt(ct2), s = c + e * t, p = t + e * c;
    const double a = (c - e * t) / s, b = (t - e * c) / p;
    const double dt[2] = {c / (e * e * t), (1 - c * c) / (e * e * e * t)}; /* by c, e */
    double *const out[2] = {d_c, d_e};
    for (int k = 0; k < 2; k++) {
        const double dc = k == 0, de = k == 1;
        const double et = e * dt[k] + de * t, ec = e * dc + de * c;
        const double da = ((dc - et) - a * (dc + et)) / s;
        const double db = ((dt[k] - ec) - b * (dt[k] + ec)) / p;
        *out[k] = a * da + b * db;
    }
    return 0.5 * (a * a + b * b);
}

/* int_0^1 2 c F(c, n) dc for n >= 1, and its derivative (Walsh, Dept. Sci. Ind. Res.
 * Illum. Res. Tech. Pap. 2, 1926; Duntley, J. Opt. Soc. Am. 32, 1942):
 *
 *   1/2 + (n - 1)(3 n + 1)/(6 (n + 1)^2) + P ln((n - 1)/(n + 1)) - Q + R ln n
 *
 *   P = n^2 (n^2 - 1)^2/(n^2 + 1)^3,    Q = 2 n^3 (n^2 + 2 n - 1)/((n^2 + 1)(n^4 - 1)),
 *   R = 8 n^4 (n^4 + 1)/((n^2 + 1)(n^4 - 1)^2)
 *
 * Near n = 1 its terms cancel: there it is (n - 1)/3. */
static double diffuse_from_outside(double n, double *d)
{
    if (n - 1 < 2e-5) {
        *d = 1. / 3;
        return (n - 1) / 3;
    }
    const double n2 = n * n, n3 = n * n2, n4 = n2 * n2, above = n2 + 1,
                 below = (n - 1) * (n + 1), both = below * above; /* n^4 - 1 */
    const double P = n2 * below * below / (above * above * above),
                 Q = 2 * n3 * (n2 + 2 * n - 1) / (above * both),
                 R = 8 * n4 * (n4 + 1) / (above * both * both);
    const double lnP = log((n - 1) / (n + 1)), lnR = log1p(n - 1);
    const double dP = P * (2 / n + 4 * n / below - 6 * n / above),
                 dQ = Q * (3 / n + (2 * n + 2) / (n2 + 2 * n - 1) - 2 * n / above -
                           4 * n3 / both),
                 dR = R * (4 / n + 4 * n3 / (n4 + 1) - 2 * n / above - 8 * n3 / both);
    *d = 4 * n / (3 * (n + 1) * (n + 1) * (n + 1)) + dP * lnP + P * 2 / below - dQ +
         dR * lnR + R / n;
    return 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) + P * lnP - Q + R * lnR;
}

/* From the denser side: 1 - F(e) = e^2 (1 - F(1/e)), since as much light passes one way
 * as the other. */
double imp__fresnel_diffuse(double e, double *d_e)
{
    if (e >= 1) return diffuse_from_outside(e, d_e);
    double d_n;
    const double passes = 1 - diffuse_from_outside(1 / e, &d_n);
    *d_e = -2 * e * passes - d_n;
    return 1 - e * e * passes;
}

/* One lane. With
 *
 *   t = eta^2 - k^2 - sin^2,  A = sqrt(t^2 + 4 eta^2 k^2),  a = sqrt((A + t)/2),
 *
 *   Rs = (P - Q)/(P + Q),  P = A + c^2,  Q = 2 a c
 *   Rp = Rs (U - V)/(U + V),  U = A c^2 + sin^4,  V = Q sin^2,   F = (Rs + Rp)/2
 *
 * For t < 0 a is taken as eta k sqrt(2/(A - t)), which is the same number without the
 * cancellation in A + t, and whose derivatives exist at eta k = 0. */
static double conductor(double c, double eta, double k, double *d_eta, double *d_k)
{
    const double c2 = c * c, s2 = imp_max(1 - c2, 0);
    const double ek = eta * k, t = eta * eta - k * k - s2;
    const double A = sqrt(t * t + 4 * ek * ek);
    const double q = t < 0 ? sqrt(2 / (A - t)) : 0;
    const double a = t < 0 ? ek * q : sqrt(0.5 * (A + t));
    const double P = A + c2, Q = 2 * a * c, U = A * c2 + s2 * s2, V = Q * s2;
    const double s_sum = P + Q, p_sum = U + V;
    const double Rs =
        s_sum > 0 ? imp_max(P - Q, 0) / s_sum : 1; /* eta = 1, k = 0: P = Q */
    const double ratio = p_sum > 0 ? (U - V) / p_sum : 1;
    if (d_eta) {
        const double dt[2] = {2 * eta, -2 * k};
        const double dek[2] = {k, eta};
        double dF[2];
        for (int j = 0; j < 2; j++) {
            const double dA = A > 0 ? (t * dt[j] + 4 * ek * dek[j]) / A : 0;
            double da = 0;
            if (t < 0) da = dek[j] * q - 0.5 * a * (dA - dt[j]) / (A - t);
            else if (a > 0) da = 0.25 * (dA + dt[j]) / a;
            const double dQ = 2 * c * da;
            /* d((P - Q)/(P + Q)) = 2 (Q dP - P dQ)/(P + Q)^2 */
            const double dRs = s_sum > 0 ? 2 * (Q * dA - P * dQ) / (s_sum * s_sum) : 0;
            const double dr =
                p_sum > 0 ? 2 * (V * c2 * dA - U * s2 * dQ) / (p_sum * p_sum) : 0;
            dF[j] = 0.5 * (dRs * (1 + ratio) + Rs * dr);
        }
        *d_eta = dF[0];
        *d_k = dF[1];
    }
    return 0.5 * Rs * (1 + ratio);
}

/* a where the lanes of `mask` are set, else b. */
typedef int64_t lanes_mask __attribute__((vector_size(32)));
static inline imp_spec pick(lanes_mask mask, imp_spec a, imp_spec b)
{
    return (imp_spec)((mask & (lanes_mask)a) | (~mask & (lanes_mask)b));
}
static inline imp_spec roots(imp_spec x)
{
    imp_spec r;
    for (int i = 0; i < 4; i++) r[i] = sqrt(x[i]);
    return r;
}

/* The value of all lanes at once, operation by operation as in one. */
static imp_spec conductors(double c, imp_spec eta, imp_spec k)
{
    const double c2 = c * c, s2 = imp_max(1 - c2, 0);
    const imp_spec zero = {0}, one = imp__spec(1);
    const imp_spec ek = eta * k, t = eta * eta - k * k - s2;
    const imp_spec A = roots(t * t + 4 * ek * ek);
    const lanes_mask turned = t < zero;
    const imp_spec a = pick(turned, ek * roots(pick(turned, 2 / (A - t), zero)),
                            roots(pick(turned, zero, 0.5 * (A + t))));
    const imp_spec P = A + c2, Q = 2 * a * c, U = A * c2 + s2 * s2, V = Q * s2;
    const imp_spec s_sum = P + Q, p_sum = U + V, rest = P - Q;
    const imp_spec Rs = pick(s_sum > zero, pick(rest > zero, rest, zero) / s_sum, one);
    const imp_spec ratio = pick(p_sum > zero, (U - V) / p_sum, one);
    return 0.5 * Rs * (1 + ratio);
}

/* Lanes that differ: one where all are equal; three for colours, whose fourth lane is
 * 0. */
static int lanes_of(const imp_spec *eta, const imp_spec *k)
{
    bool equal = true;
    for (int i = 1; i < 4; i++) equal &= (*eta)[i] == (*eta)[0] && (*k)[i] == (*k)[0];
    return equal ? 1 : (*eta)[3] == 0 && (*k)[3] == 0 ? 3 : 4;
}

void imp__fresnel_conductor(double c, const imp_spec *eta, const imp_spec *k, imp_spec *f)
{
    const int n = lanes_of(eta, k);
    if (n == 1) {
        *f = imp__spec(conductor(c, (*eta)[0], (*k)[0], NULL, NULL));
        return;
    }
    *f = conductors(c, *eta, *k);
    if (n == 3) (*f)[3] = 0;
}

void imp__fresnel_conductor_d(double c, const imp_spec *eta, const imp_spec *k,
                              imp_spec *f, imp_spec *df_deta, imp_spec *df_dk)
{
    *f = *df_deta = *df_dk = imp__spec(0);
    const int n = lanes_of(eta, k) == 3 ? 3 : 4;
    for (int i = 0; i < n; i++) {
        double de, dk;
        (*f)[i] = conductor(c, (*eta)[i], (*k)[i], &de, &dk);
        (*df_deta)[i] = de;
        (*df_dk)[i] = dk;
    }
}

/* As in `conductor`; of what is there, dt/dc = 2 c, and eta k does not move. */
static double conductor_by_c(double c, double eta, double k)
{
    const double c2 = c * c, s2 = imp_max(1 - c2, 0);
    const double ek = eta * k, t = eta * eta - k * k - s2;
    const double A = sqrt(t * t + 4 * ek * ek);
    const double a = t < 0 ? ek * sqrt(2 / (A - t)) : sqrt(0.5 * (A + t));
    const double P = A + c2, Q = 2 * a * c, U = A * c2 + s2 * s2, V = Q * s2;
    const double s_sum = P + Q, p_sum = U + V;
    if (!(s_sum > 0) || !(p_sum > 0)) return 0;
    const double Rs = imp_max(P - Q, 0) / s_sum, ratio = (U - V) / p_sum;
    const double dt = 2 * c, dA = A > 0 ? t * dt / A : 0;
    double da = 0;
    if (t < 0) da = -0.5 * a * (dA - dt) / (A - t);
    else if (a > 0) da = 0.25 * (dA + dt) / a;
    const double dP = dA + 2 * c, dQ = 2 * (da * c + a);
    const double dU = dA * c2 + 2 * A * c - 4 * s2 * c, dV = dQ * s2 - 2 * Q * c;
    const double dRs = 2 * (Q * dP - P * dQ) / (s_sum * s_sum);
    const double dr = 2 * (V * dU - U * dV) / (p_sum * p_sum);
    return 0.5 * (dRs * (1 + ratio) + Rs * dr);
}

void imp__fresnel_conductor_turned(double c, const imp_spec *eta, const imp_spec *k,
                                   imp_spec *f, imp_spec *df_dc)
{
    *df_dc = imp__spec(0);
    imp__fresnel_conductor(c, eta, k, f);
    const int n = lanes_of(eta, k) == 3 ? 3 : 4;
    for (int i = 0; i < n; i++) (*df_dc)[i] = conductor_by_c(c, (*eta)[i], (*k)[i]);
}
