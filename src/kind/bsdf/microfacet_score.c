/* SPDX-License-Identifier: Apache-2.0
 *
 * Normals where D changes with the roughness (Belhe et al. 2024, "Importance sampling BRDF
 * derivatives", who draw the positive and the negative part each by its own distribution;
 * here both are one density). In slopes over roughness, (x, y) = (m_x/au, m_y/av)/m_z =
 * r (cos phi, sin phi), normals with density D cos(theta) are such that
 *
 *   GGX        v = r^2/(1 + r^2) is uniform on [0, 1)
 *   Beckmann   t = r^2 has density exp(-t), and x sqrt(2), y sqrt(2) are normal deviates
 *
 * and phi is uniform and independent. With a = cos^2 phi the derivative of ln D is
 *
 *               scale              au           aspect
 *   GGX         2 (2 v - 1)        4 v a - 1    4 v (2 a - 1)
 *   Beckmann    2 (t - 1)          2 t a - 1    2 t (2 a - 1)
 *
 * by ln au + ln av, ln au, and ln au - ln av; that by ln av has 1 - a for a. The density is
 * |d ln D| D cos(theta) over its integral. All are drawn by closed forms but for one
 * equation, y = t exp(-t) (Lambert's function) or a cubic one. */
#include "microfacet.h"

#define IMP_WIDE 1
#define IMP_TEXT "kind/bsdf/microfacet_score_text.h"
#include "math/lane_text.h"

/* ---- Density --------------------------------------------------------------------- */

/* As IMP_GGX_SCORE_SCALE and those that follow it. */
#define BECKMANN_SCALE  0.73575888234288467 /* 2/e */
#define BECKMANN_AU     0.96788289807657199 /* 4 exp(-1/2)/sqrt(2 pi) */
#define BECKMANN_ASPECT 0.63661977236758134 /* 2/pi: of t |2 a - 1| */

double imp__score_share(const struct imp__microfacet *f)
{
    return f->wanted ? imp__facets_share_1(f->au, f->av) : 0;
}

double imp__score_pdf(const struct imp__microfacet *f, const imp_v3 *m, double D)
{
    const double x = (*m)[0] / f->au, y = (*m)[1] / f->av, z = (*m)[2];
    if (f->type == IMP_GGX)
        return imp__ggx_score_pdf_1(f->au, f->av, (*m)[0], (*m)[1], z, D, f->wanted);
    if (!(z > 0)) return 0;
    const double s = 1 / (z * z), tx = x * x * s, ty = y * y * s;
    double sum = 0;
    if (f->wanted & IMP_SCORE_SCALE) sum += fabs(tx + ty - 1) / BECKMANN_SCALE;
    if (f->wanted & IMP_SCORE_U) sum += fabs(2 * tx - 1) / BECKMANN_AU;
    if (f->wanted & IMP_SCORE_V) sum += fabs(2 * ty - 1) / BECKMANN_AU;
    if (f->wanted & IMP_SCORE_ASPECT) sum += fabs(tx - ty) / BECKMANN_ASPECT;
    return D * z * sum / __builtin_popcount(f->wanted);
}

/* ---- Drawing --------------------------------------------------------------------- */

/* t exp(-t) = y for y on (0, 1/e]; above: t >= 1, else t <= 1. From the series about the
 * branch point, or logarithms far out, by Halley's steps in ln t - t = ln y. */
static double lambert_t(double y, bool above)
{
    y = imp_clamp(y, 1e-300, exp(-1));
    const double p = copysign(sqrt(imp_max(2 * (1 - exp(1) * y), 0)), above ? 1 : -1);
    if (fabs(p) < 1e-4) return 1 + p + p * p / 3;
    const double l = log(y);
    double t = above && p > 1.2 ? -l + log(-l) : 1 + p * (1 + p * (1. / 3 + p * 11 / 72));
    if (!above && p < -1) t = y * (1 + y * (1 + 1.5 * y)); /* p > -sqrt 2 */
    for (int i = 0; i < 4; i++) {
        const double g = log(t) - t - l, g1 = 1 / t - 1, g2 = -1 / (t * t);
        const double next = t - 2 * g * g1 / (2 * g1 * g1 - g * g2);
        t = above ? imp_max(next, 1) : imp_clamp(next, 0.5 * t, 1);
    }
    return t;
}

/* |t - 1| exp(-t): both halves have the distribution function e/2 t exp(-t). */
static double beckmann_scale(double u)
{
    return u < 0.5 ? lambert_t(2 * u / exp(1), false)
                   : lambert_t(2 * (1 - u) / exp(1), true);
}
/* Slope x with density |2 x^2 - 1| exp(-x^2): for z = x sqrt(2) > 0 that of |z^2 - 1| under
 * the normal distribution, whose halves have z exp(-z^2/2) up to a factor. */
static double beckmann_au(double u)
{
    const double side = u < 0.5 ? -1 : 1, w = u < 0.5 ? 2 * u : 2 * u - 1;
    const double q = 2 * (w < 0.5 ? w : 1 - w);
    return side * sqrt(0.5 * lambert_t(q * q / exp(1), w >= 0.5));
}
/* t with density t exp(-t): (1 + t) exp(-(1 + t)) = (1 - u)/e. */
static double beckmann_aspect(double u) { return lambert_t((1 - u) / exp(1), true) - 1; }

/* 2 |2 v - 1|. */
static double ggx_scale(double u)
{
    return u < 0.5 ? 0.5 * (1 - sqrt(1 - 2 * u)) : 0.5 * (1 + sqrt(2 * u - 1));
}

/* tan phi in the first quarter, where |4 v cos^2 phi - 1| over v has the integrals
 *
 *   sin(2 phi)/2 + tan(phi)/4 from 0 to phi <= pi/3,   sin(2 phi)/2 from phi to pi/2 beyond
 *
 * of 3 sqrt(3)/4 in all. The first is y for T = tan phi with T^3 - 4 y T^2 + 5 T - 4 y = 0,
 * which rises. */
static double ggx_au_tangent(double u)
{
    const double all = 0.75 * sqrt(3.);
    if (u >= 2. / 3) return tan(0.5 * (IMP_PI - asin(imp_min(2 * all * (1 - u), 1))));
    const double y = all * u;
    double lo = 0, hi = sqrt(3.), T = 0.9 * y;
    for (int i = 0; i < 30; i++) {
        const double g = T / (1 + T * T) + 0.25 * T - y;
        const double slope = (1 - T * T) / imp__sqr(1 + T * T) + 0.25;
        if (g > 0) hi = T;
        else lo = T;
        double next = T - g / slope;
        if (!(next >= lo && next <= hi)) next = 0.5 * (lo + hi);
        const bool done = fabs(next - T) < 1e-12;
        T = next;
        if (done) break;
    }
    return T;
}
/* v with density |4 v a - 1|. */
static double ggx_au(double a, double u)
{
    const double fall = 4 * a > 1 ? 1 / (8 * a) : 1 - 2 * a; /* up to the zero */
    const double all = 4 * a > 1 ? 2 * a - 1 + 2 * fall : fall, w = u * all;
    if (w < fall || 4 * a <= 1) return 2 * w / (1 + sqrt(imp_max(1 - 8 * a * w, 0)));
    return 0.25 / a + sqrt((w - fall) / (2 * a));
}

/* Angle with density |cos(2 phi)|. */
static double aspect_angle(double u)
{
    const double q = 4 * u, k = floor(q); /* quarters that are centred on the axes */
    return 0.5 * IMP_PI * k + 0.5 * asin(2 * (q - k) - 1);
}

imp_v3 imp__score_sample(const struct imp__microfacet *f, const double u[2])
{
    /* Each of those wanted alike often. */
    const int n = __builtin_popcount(f->wanted), k = imp_min((int)(u[0] * n), n - 1);
    const double u0 = imp_clamp(u[0] * n - k, 0, 0x1.fffffffffffffp-1);
    unsigned left = f->wanted;
    for (int i = 0; i < k; i++) left &= left - 1;
    const unsigned by = left & -left;
    const bool ggx = f->type == IMP_GGX;
    double x, y, r2, c, s;
    if (by == IMP_SCORE_U || by == IMP_SCORE_V) {
        if (ggx) {
            const double q = 4 * u0, quarter = floor(q);
            const double T = ggx_au_tangent(q - quarter);
            c = 1 / sqrt(1 + T * T);
            s = T * c;
            const double v = imp_min(ggx_au(c * c, u[1]), 0x1.fffffffffffffp-1);
            const double r = sqrt(v / (1 - v));
            x = (int)quarter & 1 ? -r * c : r * c;
            y = (int)quarter & 2 ? -r * s : r * s;
        } else {
            x = beckmann_au(u0);
            y = imp__erf_inverse(2 * u[1] - 1);
        }
        if (by == IMP_SCORE_V) {
            const double swap = x;
            x = y;
            y = swap;
        }
    } else {
        const bool scale = by == IMP_SCORE_SCALE;
        const double phi = scale ? IMP_2PI * u0 : aspect_angle(u0);
        if (ggx) {
            const double v =
                imp_min(scale ? ggx_scale(u[1]) : sqrt(u[1]), 0x1.fffffffffffffp-1);
            r2 = v / (1 - v);
        } else {
            r2 = scale ? beckmann_scale(u[1]) : beckmann_aspect(u[1]);
        }
        x = sqrt(r2) * cos(phi);
        y = sqrt(r2) * sin(phi);
    }
    return imp__normalize(imp__v3(f->au * x, f->av * y, 1));
}
