/* SPDX-License-Identifier: Apache-2.0 */
#include "microfacet.h"

double imp__microfacet_d(const struct imp__microfacet *f, const imp_v3 *m, double d_log[2])
{
    const double au = f->au, av = f->av;
    const double x = (*m)[0] / au, y = (*m)[1] / av, z = (*m)[2];
    if (!(z > 0)) {
        if (d_log) d_log[0] = d_log[1] = 0;
        return 0;
    }
    const double q = x * x + y * y, z2 = z * z;
    if (f->type == IMP_BECKMANN) {
        /* exp(-q/z^2)/(pi au av z^4);  dq/dau = -2 x^2/au */
        if (d_log) {
            d_log[0] = (2 * x * x / z2 - 1) / au;
            d_log[1] = (2 * y * y / z2 - 1) / av;
        }
        return exp(-q / z2) / (IMP_PI * au * av * z2 * z2);
    }
    const double s = q + z2;
    if (d_log) {
        d_log[0] = (4 * x * x / s - 1) / au;
        d_log[1] = (4 * y * y / s - 1) / av;
    }
    return 1 / (IMP_PI * au * av * s * s);
}

double imp__microfacet_g1(const struct imp__microfacet *f, const imp_v3 *v, double d[2])
{
    const double z2 = (*v)[2] * (*v)[2], au = f->au, av = f->av;
    const double x2 = (*v)[0] * (*v)[0] / z2, y2 = (*v)[1] * (*v)[1] / z2;
    const double t2 = au * au * x2 + av * av * y2;
    double g, dg_dt2 = 0;
    if (f->type == IMP_GGX) {
        const double r = sqrt(1 + t2);
        g = 2 / (1 + r);
        dg_dt2 = -0.5 * g * g / (2 * r);
    } else {
        const double a = 1 / sqrt(t2); /* infinite at normal incidence */
        if (a >= 1.6) {
            g = 1;
        } else {
            const double n = (3.535 + 2.181 * a) * a, m = 1 + (2.276 + 2.577 * a) * a;
            g = n / m;
            dg_dt2 = ((3.535 + 4.362 * a) * m - n * (2.276 + 5.154 * a)) / (m * m) *
                     (-0.5 * a / t2);
        }
    }
    if (d) {
        d[0] = dg_dt2 * 2 * au * x2;
        d[1] = dg_dt2 * 2 * av * y2;
    }
    return g;
}

/* Exact Smith masking: GGX's closed form is; Beckmann's has an error function. */
static double g1_exact(const struct imp__microfacet *f, const imp_v3 *v)
{
    if (f->type == IMP_GGX) return imp__microfacet_g1(f, v, NULL);
    const double t = hypot(f->au * (*v)[0], f->av * (*v)[1]) / (*v)[2];
    if (t < 0.05) return 1; /* 1 - G1 < 1e-176 */
    const double a = 1 / t;
    return 2 / (1 + erf(a) + exp(-a * a) / (a * sqrt(IMP_PI)));
}

double imp__microfacet_pdf(const struct imp__microfacet *f, const imp_v3 *v, const imp_v3 *m)
{
    const double vm = imp__dot(*v, *m), D = imp__microfacet_d(f, m, NULL);
    if (!(vm > 0) || !((*v)[2] > 0)) return 0;
    return f->visible ? D * g1_exact(f, v) * vm / (*v)[2] : D * (*m)[2];
}

/* Inverse of the distribution function of the slope along v that is visible from v at unit
 * roughness. Its density on (-inf, cot] is proportional to (c - s x) exp(-x^2), with c, s
 * cosine and sine of v; the function rises from 0 to 1 without flat parts, so Newton's steps
 * inside a shrinking bracket find the root to rounding. */
static double beckmann_slope(double c, double s, double u)
{
    const double root_pi = sqrt(IMP_PI), end = s * 6 > c ? c / s : 6;
#define UNNORMALISED(x) (0.5 * c * erfc(-(x)) + 0.5 * s * exp(-(x) * (x)) / root_pi)
    const double target = u * UNNORMALISED(end);
    double lo = -6, hi = end, x = end > 0 ? 0 : end - 0.5;
    if (x < lo) x = 0.5 * (lo + hi);
    for (int i = 0; i < 100 && hi - lo > 1e-15 * (1 + fabs(x)); i++) {
        const double r = UNNORMALISED(x) - target;
        if (r > 0) hi = x; else lo = x;
        const double slope = (c - s * x) * exp(-x * x) / root_pi, step = r / slope;
        const double next = x - step;
        if (!(next > lo && next < hi)) {
            x = 0.5 * (lo + hi);
        } else {
            x = next;
            if (fabs(step) < 1e-15 * (1 + fabs(x))) break;
        }
    }
#undef UNNORMALISED
    return x;
}

/* Inverse error function, Newton from a logarithmic start (Winitzki 2008). */
static double erf_inverse(double y)
{
    y = imp_clamp(y, -1 + 1e-16, 1 - 1e-16);
    const double l = log1p(-y * y), b = 2 / (IMP_PI * 0.147) + 0.5 * l;
    double x = copysign(sqrt(sqrt(b * b - l / 0.147) - b), y);
    for (int i = 0; i < 3; i++) {
        const double slope = 2 / sqrt(IMP_PI) * exp(-x * x);
        if (!(slope > 1e-300)) break;
        /* Far out erfc keeps the digits that 1 - erf would lose. */
        const double r = y > 0 ? (1 - y) - erfc(x) : erfc(-x) - (1 + y);
        x -= r / slope;
    }
    return x;
}

/* Slopes visible from v at unit roughness are an independent normal deviate across v and the
 * one above along v (Heitz and d'Eon 2014); stretching v and the slopes by the roughness
 * gives all other cases. */
static imp_v3 beckmann_visible(const struct imp__microfacet *f, const imp_v3 *v,
                               const double u[2])
{
    const imp_v3 w = imp__normalize(imp__v3(f->au * (*v)[0], f->av * (*v)[1], (*v)[2]));
    const double s = hypot(w[0], w[1]);
    const double cp = s > 0 ? w[0] / s : 1, sp = s > 0 ? w[1] / s : 0;
    const double x = beckmann_slope(w[2], s, u[0]), y = erf_inverse(2 * u[1] - 1);
    return imp__normalize(imp__v3(-f->au * (cp * x - sp * y), -f->av * (sp * x + cp * y), 1));
}

/* Spherical caps (Dupuy and Benyoub 2023): mirror images of v, in the stretched space, are
 * uniform on a cap of the sphere. */
static imp_v3 ggx_visible(const struct imp__microfacet *f, const imp_v3 *v, const double u[2])
{
    const imp_v3 w = imp__normalize(imp__v3(f->au * (*v)[0], f->av * (*v)[1], (*v)[2]));
    const double phi = IMP_2PI * u[0], z = (1 - u[1]) * (1 + w[2]) - w[2];
    const double r = sqrt(fmax(0, (1 - z) * (1 + z)));
    const imp_v3 h = imp__v3(r * cos(phi), r * sin(phi), z) + w;
    return imp__normalize(imp__v3(f->au * h[0], f->av * h[1], fmax(h[2], 0)));
}

imp_v3 imp__microfacet_sample(const struct imp__microfacet *f, const imp_v3 *v,
                              const double u[2])
{
    if (f->visible)
        return f->type == IMP_GGX ? ggx_visible(f, v, u) : beckmann_visible(f, v, u);
    /* Slopes: radius from the distribution of all normals, angle uniform, then stretched. */
    const double r2 = f->type == IMP_GGX ? u[0] / (1 - u[0]) : -log1p(-u[0]);
    const double r = sqrt(r2), phi = IMP_2PI * u[1];
    return imp__normalize(imp__v3(f->au * r * cos(phi), f->av * r * sin(phi), 1));
}
