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

double imp__fresnel_diffuse(double e, double *d_e)
{
    const double x = 1 / e;
    if (e < 1) {
        *d_e = -2 * 1.4399 * e + 0.7099 - 0.0636 * x * x;
        return (-1.4399 * e + 0.7099) * e + 0.6681 + 0.0636 * x;
    }
    static const double c[6] = {0.919317, -3.4793, 6.75335, -7.80989, 4.98554, -1.36881};
    double sum = 0, d = 0; /* Horner's scheme, and its derivative */
    for (int k = 5; k >= 0; k--) {
        d = d * x + sum;
        sum = sum * x + c[k];
    }
    *d_e = -d * x * x;
    return sum;
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
    const double c2 = c * c, s2 = fmax(0, 1 - c2);
    const double ek = eta * k, t = eta * eta - k * k - s2;
    const double A = sqrt(t * t + 4 * ek * ek);
    const double q = t < 0 ? sqrt(2 / (A - t)) : 0;
    const double a = t < 0 ? ek * q : sqrt(0.5 * (A + t));
    const double P = A + c2, Q = 2 * a * c, U = A * c2 + s2 * s2, V = Q * s2;
    const double s_sum = P + Q, p_sum = U + V;
    const double Rs = s_sum > 0 ? fmax(P - Q, 0) / s_sum : 1; /* eta = 1, k = 0: P = Q */
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

/* Lanes that differ: one where all are equal; of colours, whose fourth is 0, three. */
static int lanes_of(const imp_spec *eta, const imp_spec *k)
{
    bool equal = true;
    for (int i = 1; i < 4; i++) equal &= (*eta)[i] == (*eta)[0] && (*k)[i] == (*k)[0];
    return equal ? 1 : (*eta)[3] == 0 && (*k)[3] == 0 ? 3 : 4;
}

void imp__fresnel_conductor(double c, const imp_spec *eta, const imp_spec *k, imp_spec *f)
{
    const int n = lanes_of(eta, k);
    *f = imp__spec(n == 1 ? conductor(c, (*eta)[0], (*k)[0], NULL, NULL) : 0);
    for (int i = 0; n > 1 && i < n; i++)
        (*f)[i] = conductor(c, (*eta)[i], (*k)[i], NULL, NULL);
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
