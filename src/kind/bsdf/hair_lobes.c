/* SPDX-License-Identifier: Apache-2.0
 *
 * Values, draws and attenuations A_p of the lobes of a fibre (hair_lobes.h), with derivatives with
 * respect to roughness, tilt, reflectance F and transmittance T. */
#include "hair_lobes.h"
#include "fresnel.h"
#include "math/bessel.h"
#include <stdlib.h>

/* x^n and its derivative. */
static double power(double x, int n, double *d)
{
    double y = 1;
    for (int k = 1; k < n; k++) y *= x;
    *d = n * y;
    return x * y;
}

/* Fits of Chiang et al. (2016), eqs. 7 and 8. */
void imp__hair_shape(double longitudinal, double azimuthal, double tilt,
                     struct imp__hair_shape *out)
{
    static const double factor[] = {1, 0.25, 4, 4}, turn[] = {-2, 1, 4, 0};
    double turned[5][2]; /* cosine and sine of as many tilts */
    const double degree = IMP_PI / 180, root = sqrt(IMP_PI / 8);
    double d;
    const double m = longitudinal, n = azimuthal, high = power(m, 20, &d);
    const double w = 0.726 * m + 0.812 * m * m + 3.7 * high,
                 dw = 0.726 + 1.624 * m + 3.7 * d;
    turned[0][0] = 1;
    turned[0][1] = 0;
    turned[1][0] = cos(tilt * degree);
    turned[1][1] = sin(tilt * degree);
    for (int k = 2; k <= 4; k *= 2) {
        const double c = turned[k / 2][0], s = turned[k / 2][1];
        turned[k][0] = (c - s) * (c + s);
        turned[k][1] = 2 * c * s;
    }
    for (int p = 0; p < IMP_HAIR_LOBES; p++) {
        out->v[p] = factor[p] * w * w;
        out->dv[p] = factor[p] * 2 * w * dw;
        out->norm[p] = 1 / (out->v[p] * (out->v[p] < 0.05 ? 1 : -expm1(-2 / out->v[p])));
        out->turn[p][0] = turned[abs((int)turn[p])][0];
        out->turn[p][1] = turned[abs((int)turn[p])][1] * (turn[p] < 0 ? -1 : 1);
        out->dturn[p] = turn[p] * degree;
    }
    const double last = power(n, 22, &d);
    out->s = root * (0.265 * n + 1.194 * n * n + 5.372 * last);
    out->ds = root * (0.265 + 2.388 * n + 5.372 * d);
    out->share = tanh(IMP_PI / (2 * out->s));
}

/* In the section, where light is refracted as by the index eta' = sqrt(eta^2 - sin^2
 * theta)/cos theta (Marschner et al. 2003). What is reflected totally (F = 1) has no
 * passage. */
void imp__hair_sight(imp_v3 wo, double eta, struct imp__hair_sight *out)
{
    double d_c;
    const double across = hypot(wo[0], wo[2]), h = across > 0 ? -wo[0] / across : 0;
    const double s = wo[1], inside = eta * eta - s * s;
    *out = (struct imp__hair_sight){
        .sin_theta = s, .cos_theta = across, .phi = atan2(wo[2], wo[0]), .F = 1};
    out->gamma = across > 0 ? out->phi - IMP_PI / 2 : 0;
    if (out->gamma < -IMP_PI) out->gamma += IMP_2PI;
    const double sine = inside > 0 ? h * across / sqrt(inside) : 1;
    if (!(fabs(sine) < 1)) return;
    out->F = imp__fresnel_dielectric_d(across * sqrt(imp_max(0, 1 - h * h)), eta, &d_c,
                                       &out->dF);
    const double cos_gamma = sqrt(1 - sine * sine), cos_theta = sqrt(inside) / eta;
    const double dsine = -sine * eta / inside,
                 dcos = s * s / (eta * eta * eta * cos_theta);
    out->gamma_t = asin(sine);
    out->dgamma_t = dsine / cos_gamma;
    out->length = 2 * cos_gamma / cos_theta;
    out->dlength = (-2 * sine * out->dgamma_t - out->length * dcos) / cos_theta;
}

/* F, (1 - F)^2 T, (1 - F)^2 F T^2, and the rest (1 - F)^2 F^2 T^3/(1 - F T). */
void imp__hair_parts(double F, imp_spec T, struct imp__hair_parts *out)
{
    const double in = 1 - F;
    for (int p = 0; p < IMP_HAIR_LOBES; p++)
        out->A[p] = out->dF[p] = out->dT[p] = imp__spec(0);
    out->A[0] = imp__spec(F);
    out->dF[0] = imp__spec(1);
    if (!(in > 0)) return;
    const imp_spec T2 = T * T, q = 1 / (1 - F * T), rest = F * T2 * T * q;
    out->A[1] = in * in * T;
    out->dF[1] = -2 * in * T;
    out->dT[1] = imp__spec(in * in);
    out->A[2] = in * in * F * T2;
    out->dF[2] = in * (in - 2 * F) * T2;
    out->dT[2] = 2 * in * in * F * T;
    out->A[3] = in * in * F * rest;
    out->dF[3] = in * (2 * (in - F) + in * F * T * q) * rest;
    out->dT[3] = in * in * F * F * T2 * q * (3 + F * T * q);
}

/* Where light of lobe p leaves, after it was refracted without roughness. */
static double azimuth(const struct imp__hair_sight *o, int p)
{
    return o->phi + 2 * p * o->gamma_t - 2 * o->gamma + p * IMP_PI;
}

/* With x = c/v, c and s the products of the cosines and of the sines of the two angles,
 *
 *     M = e^(-s/v) I_0(x)/(2 v sinh(1/v))                          (d'Eon et al. 2011)
 *     N = e/(s_N (1 + e)^2 share),   e = e^(-|phi|/s_N),           (Chiang et al. 2016)
 *
 * phi from where light would leave without roughness. */
double imp__hair_lobe(const struct imp__hair_shape *h, const struct imp__hair_sight *o,
                      int p, const struct imp__hair_exit *i, double by[4])
{
    const double v = h->v[p], ct = h->turn[p][0], st = h->turn[p][1];
    const double sin_o = o->sin_theta * ct + o->cos_theta * st,
                 cos_o = o->cos_theta * ct - o->sin_theta * st;
    const double c = fabs(cos_o) * i->cos_theta, s = sin_o * i->sin_theta;
    double ratio, x = 0, e = 0;
    const double M =
        h->norm[p] * imp__bessel_i0(c / v, by ? &ratio : NULL) * exp((c - s - 1) / v);
    double value = M / IMP_2PI;
    if (p < IMP_HAIR_LOBES - 1) {
        x = i->phi - azimuth(o, p);
        x = imp_clamp(x - IMP_2PI * rint(x / IMP_2PI), -IMP_PI, IMP_PI);
        e = exp(-fabs(x) / h->s);
        value = M * e / (h->s * (1 + e) * (1 + e) * h->share);
    }
    if (!by) return value;
    const double rest = exp(-2 / v), scaled = x / h->s;
    const double by_v = (s - c * ratio + 1 + 2 * rest / (1 - rest)) / (v * v) - 1 / v;
    const double sign = cos_o < 0 ? -1 : 1;
    const double by_turn =
        -(cos_o * i->sin_theta + sign * ratio * sin_o * i->cos_theta) / v;
    by[0] = value * by_v * h->dv[p];
    by[1] = by[3] = 0;
    by[2] = value * by_turn * h->dturn[p];
    if (p == IMP_HAIR_LOBES - 1) return value;
    const double slope = (x < 0 ? -1 : 1) * (1 - e) / (1 + e); /* tanh(x/2 s_N) */
    const double cut = IMP_PI / (2 * h->s) * (1 - h->share * h->share) / h->share;
    by[1] = value * (scaled * slope - 1 + cut) / h->s * h->ds;
    by[3] = value * slope / h->s * 2 * p * o->dgamma_t;
    return value;
}

/* theta_i about -theta_o as a von Mises-Fisher lobe about the cone (d'Eon et al. 2013). */
imp_v3 imp__hair_draw(const struct imp__hair_shape *h, const struct imp__hair_sight *o,
                      int p, const double u[3])
{
    const double ct = h->turn[p][0], st = h->turn[p][1], v = h->v[p];
    const double sin_o = o->sin_theta * ct + o->cos_theta * st,
                 cos_o = fabs(o->cos_theta * ct - o->sin_theta * st);
    const double c = 1 + v * log(u[1] + (1 - u[1]) * exp(-2 / v)),
                 s = sqrt(imp_max(0, 1 - c * c));
    const double sin_i = imp_clamp(-c * sin_o + s * cos(IMP_2PI * u[2]) * cos_o, -1, 1),
                 cos_i = sqrt(1 - sin_i * sin_i);
    double phi = o->phi + IMP_2PI * u[0];
    if (p < IMP_HAIR_LOBES - 1) {
        const double x = h->share * (2 * u[0] - 1);
        phi = azimuth(o, p) + h->s * log((1 + x) / (1 - x)); /* s logit((1 + x)/2) */
    }
    return imp__v3(cos_i * cos(phi), sin_i, cos_i * sin(phi));
}
