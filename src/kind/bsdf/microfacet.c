/* SPDX-License-Identifier: Apache-2.0
 *
 * GGX and Beckmann: D and G1 with their derivatives, density and sampling of visible
 * normals. */
#include "microfacet.h"

#define IMP_WIDE 1
#define IMP_TEXT "math/vec_text.h"
#include "math/lane_text.h"
#define IMP_WIDE 1
#define IMP_TEXT "kind/bsdf/microfacet_text.h"
#include "math/lane_text.h"

static inline struct imp_real3_1 three(const imp_v3 *v)
{
    return (struct imp_real3_1){(*v)[0], (*v)[1], (*v)[2]};
}

double imp__microfacet_d(const struct imp__microfacet *f, const imp_v3 *m,
                         double d_log[2])
{
    const double au = f->au, av = f->av;
    const struct imp_real3_1 h = three(m);
    if (f->type == IMP_GGX) {
        if (d_log) imp__ggx_d_log_1(au, av, h, d_log);
        return imp__ggx_d_1(au, av, h);
    }
    if (d_log) imp__beckmann_d_log_1(au, av, h, d_log);
    if (!(h.z > 0)) return 0;
    return imp__beckmann_d_of_1(au, av, h.z, exp(-imp__beckmann_q_1(au, av, h)));
}

double imp__microfacet_d_turned(const struct imp__microfacet *f, const imp_v3 *m,
                                const imp_v3 *dm)
{
    const double au2 = f->au * f->au, av2 = f->av * f->av, z = (*m)[2], dz = (*dm)[2];
    const double q = (*m)[0] * (*m)[0] / au2 + (*m)[1] * (*m)[1] / av2;
    const double dq = 2 * ((*m)[0] * (*dm)[0] / au2 + (*m)[1] * (*dm)[1] / av2);
    if (f->type == IMP_GGX) return -2 * (dq + 2 * z * dz) / (q + z * z);
    return (2 * q * dz / z - dq) / (z * z) - 4 * dz / z;
}

double imp__microfacet_g1_of(const struct imp__microfacet *f, double t2, double *slope)
{
    return f->type == IMP_GGX ? imp__ggx_g1_of_1(t2, slope)
                              : imp__beckmann_g1_of_1(t2, slope);
}

double imp__microfacet_g1(const struct imp__microfacet *f, const imp_v3 *v, double d[2])
{
    double own[2];
    if (!d)
        return f->type == IMP_GGX ? imp__ggx_g1_1(f->au, f->av, three(v))
                                  : imp__beckmann_g1_d_1(f->au, f->av, three(v), own);
    return f->type == IMP_GGX ? imp__ggx_g1_d_1(f->au, f->av, three(v), d)
                              : imp__beckmann_g1_d_1(f->au, f->av, three(v), d);
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

double imp__microfacet_g1_exact(const struct imp__microfacet *f, const imp_v3 *v)
{
    return g1_exact(f, v);
}

/* With the part of normals that are drawn for the derivative. */
static double with_score(const struct imp__microfacet *f, const imp_v3 *m, double D,
                         double p)
{
    const double share = imp_unlikely(f->wanted) ? imp__score_share(f) : 0;
    return imp_likely(!(share > 0)) ? p : p + share * (imp__score_pdf(f, m, D) - p);
}

double imp__microfacet_pdf(const struct imp__microfacet *f, const imp_v3 *v,
                           const imp_v3 *m)
{
    const double vm = imp__dot(*v, *m), D = imp__microfacet_d(f, m, NULL);
    if (!(vm > 0) || !((*v)[2] > 0)) return 0;
    return with_score(f, m, D,
                      f->visible ? D * g1_exact(f, v) * vm / (*v)[2] : D * (*m)[2]);
}

double imp__microfacet_pdf_of(const struct imp__microfacet *f, const imp_v3 *v,
                              const imp_v3 *m, double D, double G1)
{
    const double vm = imp__dot(*v, *m);
    if (!(vm > 0) || !((*v)[2] > 0)) return 0;
    if (!f->visible) return with_score(f, m, D, D * (*m)[2]);
    return with_score(f, m, D,
                      D * (f->type == IMP_GGX ? G1 : g1_exact(f, v)) * vm / (*v)[2]);
}

/* Inverse error function to 2e-3 (Winitzki 2008): where Halley's steps begin. */
static double erf_inverse_start(double y)
{
    const double l = log1p(-y * y), b = 2 / (IMP_PI * 0.147) + 0.5 * l;
    return copysign(sqrt(sqrt(b * b - l / 0.147) - b), y);
}

/* A draw need not be exact to the last bit, as its density is evaluated where it fell;
 * two steps of third order leave 1e-13. */
double imp__erf_inverse(double y)
{
    y = imp_clamp(y, -1 + 1e-16, 1 - 1e-16);
    double x = erf_inverse_start(y);
    for (int i = 0; i < 2; i++) {
        const double slope = 2 / sqrt(IMP_PI) * exp(-x * x);
        /* Far out erfc keeps the digits that 1 - erf would lose. */
        const double r = (y > 0 ? (1 - y) - erfc(x) : erfc(-x) - (1 + y)) / slope;
        x -= r / (1 + x * r);
    }
    return x;
}

/* Inverse of the distribution function of the slope along v that is visible from v at
 * unit roughness. Its density on (-inf, cot] is g(x) (c - s x), g = exp(-x^2)/sqrt(pi), c
 * and s cosine and sine of v, up to the factor that makes it 1; the function
 *
 *   C(x) = c (1 + erf x)/2 + s g(x)/2
 *
 * rises without flat parts. Halley's steps inside a shrinking bracket, from between the
 * two closed cases: the normal distribution (s = 0) and Rayleigh's (c = 0). */
static double beckmann_slope(double c, double s, double u)
{
    const double inv_root_pi = 1 / sqrt(IMP_PI);
    double lo = -6, hi = s * 6 > c ? c / s : 6; /* beyond 6: 2e-17 */
    const double all = 0.5 * (c * erfc(-hi) + s * exp(-hi * hi) * inv_root_pi);
    const double target = u * all;
    const double normal = erf_inverse_start(imp_clamp(2 * u - 1, -1 + 1e-15, 1 - 1e-15));
    double x = c * normal - (1 - c) * sqrt(-log(imp_max(u, 1e-16)));
    if (!(x > lo && x < hi)) x = 0.5 * (lo + hi);
    for (int i = 0; i < 60; i++) {
        const double g = exp(-x * x) * inv_root_pi, t = c - s * x;
        const double r = 0.5 * (c * erfc(-x) + s * g) - target;
        if (r > 0) hi = x;
        else lo = x;
        const double n = r / (t * g), step = n / (1 + n * (0.5 * s / t + x));
        double next = x - step;
        if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
        const bool done = fabs(next - x) < 1e-6;
        x = next;
        if (done) break;
    }
    return x;
}

/* Slopes visible from v at unit roughness are an independent normal deviate across v and
 * the one above along v (Heitz and d'Eon 2014); stretching v and the slopes by the
 * roughness gives all other cases. */
static imp_v3 beckmann_visible(const struct imp__microfacet *f, const imp_v3 *v,
                               const double u[2])
{
    const imp_v3 w = imp__normalize(imp__v3(f->au * (*v)[0], f->av * (*v)[1], (*v)[2]));
    const double s = hypot(w[0], w[1]);
    const double cp = s > 0 ? w[0] / s : 1, sp = s > 0 ? w[1] / s : 0;
    const double x = beckmann_slope(w[2], s, u[0]), y = imp__erf_inverse(2 * u[1] - 1);
    return imp__normalize(
        imp__v3(-f->au * (cp * x - sp * y), -f->av * (sp * x + cp * y), 1));
}

/* Spherical caps (Dupuy and Benyoub 2023): mirror images of v, in the stretched space,
 * are uniform on a cap of the sphere. */
static imp_v3 ggx_visible(const struct imp__microfacet *f, const imp_v3 *v,
                          const double u[2])
{
    const imp_v3 w = imp__normalize(imp__v3(f->au * (*v)[0], f->av * (*v)[1], (*v)[2]));
    const double phi = IMP_2PI * u[0], z = (1 - u[1]) * (1 + w[2]) - w[2];
    const double r = sqrt(imp_max((1 - z) * (1 + z), 0));
    const imp_v3 h = imp__v3(r * cos(phi), r * sin(phi), z) + w;
    return imp__normalize(imp__v3(f->au * h[0], f->av * h[1], imp_max(h[2], 0)));
}

static imp_v3 normal_sample(const struct imp__microfacet *f, const imp_v3 *v,
                            const double u[2])
{
    if (f->visible)
        return f->type == IMP_GGX ? ggx_visible(f, v, u) : beckmann_visible(f, v, u);
    /* Slopes: radius from the distribution of all normals, angle uniform, then stretched.
     */
    const double r2 = f->type == IMP_GGX ? u[0] / (1 - u[0]) : -log1p(-u[0]);
    const double r = sqrt(r2), phi = IMP_2PI * u[1];
    return imp__normalize(imp__v3(f->au * r * cos(phi), f->av * r * sin(phi), 1));
}

imp_v3 imp__microfacet_sample(const struct imp__microfacet *f, const imp_v3 *v,
                              const double u[2])
{
    const double c = imp_unlikely(f->wanted) ? imp__score_share(f) : 0;
    const double below = 0x1.fffffffffffffp-1;
    if (imp_likely(!(c > 0))) return normal_sample(f, v, u);
    if (u[0] < c) return imp__score_sample(f, (double[]){imp_min(u[0] / c, below), u[1]});
    return normal_sample(f, v,
                         (double[]){imp_clamp((u[0] - c) / (1 - c), 0, below), u[1]});
}
