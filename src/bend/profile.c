/* SPDX-License-Identifier: Apache-2.0
 *
 * Analytic fields. Each is a function f(u; p) of one coordinate: u = |x - c|^2 about a
 * centre, u = |P(x - c)|^2 about an axis a (P projects across it), or u = a.(x - c) along
 * one. Then, with y = x - c or P(x - c),
 *
 *     g = 2 f' y,   H = 2 f' P + 4 f'' y y^T        (along: g = f' a, H = f'' a a^T)
 *
 * which has no singularity at r = 0, and d/dc = -grad. A profile gives f, f', f'' and the
 * derivatives of f and f' with respect to its own parameters (docs/bent-rays.md 3.2). */
#include "bend_rays.h"
#include <string.h>

#define OWN_MAX 8 /* parameters of a profile besides the centre */

struct shape_at {
    double f, f1, f2, fp[OWN_MAX], f1p[OWN_MAX];
};

enum about { ABOUT_CENTRE, ABOUT_AXIS, ALONG_AXIS };

struct kind {
    const char *name;
    enum about about;
    int n_own;
    const char *names[OWN_MAX];
    void (*at)(const double *p, double u, struct shape_at *s);
};

/* eta = n0 */
static void constant_at(const double *p, double u, struct shape_at *s)
{
    (void)u;
    s->f = p[0];
    s->fp[0] = 1;
}
/* sqrt(2 - r^2/R^2) inside R, 1 outside. The gradient jumps at R. Rays start and end at R
 * to rounding, and a scheme that begins or ends with a kick evaluates the gradient there.
 * It is that of the inside, up to a tolerance RIM, else such a scheme would be of first
 * order. */
#define RIM 1e-12
static void luneburg_at(const double *p, double u, struct shape_at *s)
{
    const double R = p[0], q = u / (R * R);
    s->f = 1;
    if (q > 1 + RIM) return;
    const double f = q < 1 ? sqrt(2 - q) : 1;
    s->f = f;
    s->f1 = -0.5 / (f * R * R);
    s->f2 = s->f1 * 0.5 / (f * f * R * R);
    s->fp[0] = q / (f * R); /* -(1/2f) dq/dR, dq/dR = -2 q/R */
    s->f1p[0] = -s->f1 / f * s->fp[0] - 2 * s->f1 / R;
}
/* n0/(1 + r^2/a^2) */
static void maxwell_at(const double *p, double u, struct shape_at *s)
{
    const double n0 = p[0], a = p[1], a2 = a * a, q = 1 + u / a2, qa = -2 * u / (a2 * a);
    s->f = n0 / q;
    s->f1 = -n0 / (a2 * q * q);
    s->f2 = 2 * n0 / (a2 * a2 * q * q * q);
    s->fp[0] = 1 / q;
    s->f1p[0] = -1 / (a2 * q * q);
    s->fp[1] = -n0 / (q * q) * qa;
    s->f1p[1] = -2 * s->f1 / a - 2 * s->f1 / q * qa;
}
/* n^2 = n0^2 [1 - (gr)^2 + h4 (gr)^4 + h6 (gr)^6] */
static void power_at(const double *p, double u, struct shape_at *s)
{
    const double n0 = p[0], g = p[1], w = g * g * u;
    const double B = 1 + w * (-1 + w * (p[2] + w * p[3]));
    const double B1 = -1 + w * (2 * p[2] + w * 3 * p[3]), B2 = 2 * p[2] + 6 * p[3] * w;
    const double r = sqrt(B), g2 = g * g;
    const double F1 = B1 / (2 * r),
                 F2 = B2 / (2 * r) - B1 * B1 / (4 * r * B); /* d/dw of r */
    s->f = n0 * r;
    s->f1 = n0 * F1 * g2;
    s->f2 = n0 * F2 * g2 * g2;
    s->fp[0] = r;
    s->f1p[0] = F1 * g2;
    s->fp[1] = n0 * F1 * 2 * g * u;
    s->f1p[1] = n0 * (F2 * 2 * g * u * g2 + F1 * 2 * g);
    for (int k = 0; k < 2; k++) { /* dB/dh = w^2, w^3 */
        const double b = k ? w * w * w : w * w, b1 = k ? 3 * w * w : 2 * w;
        s->fp[2 + k] = n0 * b / (2 * r);
        s->f1p[2 + k] = n0 * g2 * (b1 / (2 * r) - B1 * b / (4 * r * B));
    }
}
/* n0 sqrt(1 - g^2 r^2) */
static void rod_at(const double *p, double u, struct shape_at *s)
{
    const double q[4] = {p[0], p[1], 0, 0};
    power_at(q, u, s);
}
/* n0 (1 - A r^2/2) */
static void vendor_at(const double *p, double u, struct shape_at *s)
{
    s->f = p[0] * (1 - p[1] * u / 2);
    s->f1 = -p[0] * p[1] / 2;
    s->fp[0] = 1 - p[1] * u / 2;
    s->f1p[0] = -p[1] / 2;
    s->fp[1] = -p[0] * u / 2;
    s->f1p[1] = -p[0] / 2;
}
/* n0/cosh(g r) = n0 c(q), q = g^2 u: c' = -c T/2 with T = tanh(s)/s, s = sqrt q */
static void sech_at(const double *p, double u, struct shape_at *s)
{
    const double n0 = p[0], g = p[1], g2 = g * g, q = g2 * fmax(u, 0);
    const double r = sqrt(q), c = 1 / cosh(r);
    double T, T1;
    if (q < 1e-3) { /* series: the closed form cancels */
        T = 1 - q / 3 + q * q * (2.0 / 15) - q * q * q * (17.0 / 315);
        T1 = -1.0 / 3 + q * (4.0 / 15) - q * q * (17.0 / 105) +
             q * q * q * (4 * 62.0 / 2835);
    } else {
        T = tanh(r) / r;
        T1 = (c * c - T) / (2 * q);
    }
    const double c1 = -c * T / 2, c2 = -(c1 * T + c * T1) / 2;
    s->f = n0 * c;
    s->f1 = n0 * g2 * c1;
    s->f2 = n0 * g2 * g2 * c2;
    s->fp[0] = c;
    s->f1p[0] = g2 * c1;
    s->fp[1] = n0 * c1 * 2 * g * u;
    s->f1p[1] = n0 * (2 * g * c1 + g2 * c2 * 2 * g * u);
}
/* n0 + b exp(-r^2/2s^2) */
static void plume_at(const double *p, double u, struct shape_at *s)
{
    const double b = p[1], w = p[2], k = -0.5 / (w * w), e = exp(k * u),
                 kw = 1 / (w * w * w);
    s->f = p[0] + b * e;
    s->f1 = b * k * e;
    s->f2 = b * k * k * e;
    s->fp[0] = 1;
    s->fp[1] = e;
    s->f1p[1] = k * e;
    s->fp[2] = b * u * e * kw;
    s->f1p[2] = b * e * kw * (1 + k * u);
}
/* sum of p_k u^k: n0, nr2, nr4, nr6, nr8 about an axis; n0, nz1 .. nz4 along it */
static void polynomial_at(const double *p, double u, struct shape_at *s)
{
    double pw = 1, pw1 = 0, pw2 = 0; /* u^k and its derivatives */
    for (int k = 0; k < 5; k++) {
        s->f += p[k] * pw, s->f1 += p[k] * pw1, s->f2 += p[k] * pw2;
        s->fp[k] = pw, s->f1p[k] = pw1;
        pw2 = (k + 1) * k * (k > 1 ? pow(u, k - 1) : 1);
        pw1 = (k + 1) * pw;
        pw *= u;
    }
}
/* sqrt(n0^2 + 2 b s): rays are parabolas */
static void linear_at(const double *p, double u, struct shape_at *s)
{
    const double f = sqrt(p[0] * p[0] + 2 * p[1] * u);
    s->f = f;
    s->f1 = p[1] / f;
    s->f2 = -p[1] * p[1] / (f * f * f);
    s->fp[0] = p[0] / f;
    s->f1p[0] = -p[1] * p[0] / (f * f * f);
    s->fp[1] = u / f;
    s->f1p[1] = 1 / f - p[1] * u / (f * f * f);
}

static const struct kind kinds[] = {
    {"constant", ABOUT_CENTRE, 1, {"n0"}, constant_at},
    {"luneburg", ABOUT_CENTRE, 1, {"radius"}, luneburg_at},
    {"maxwell", ABOUT_CENTRE, 2, {"n0", "radius"}, maxwell_at},
    {"rod", ABOUT_AXIS, 2, {"n0", "g"}, rod_at},
    {"rod-vendor", ABOUT_AXIS, 2, {"n0", "a"}, vendor_at},
    {"rod-power", ABOUT_AXIS, 4, {"n0", "g", "h4", "h6"}, power_at},
    {"sech", ABOUT_AXIS, 2, {"n0", "g"}, sech_at},
    {"plume", ABOUT_CENTRE, 3, {"n0", "b", "width"}, plume_at},
    {"polynomial", ABOUT_AXIS, 5, {"n0", "nr2", "nr4", "nr6", "nr8"}, polynomial_at},
    {"axial", ALONG_AXIS, 5, {"n0", "nz1", "nz2", "nz3", "nz4"}, polynomial_at},
    {"linear", ALONG_AXIS, 2, {"n0", "b"}, linear_at},
};
static const char *const centre_names[3] = {"x", "y", "z"};

struct profile {
    imp_field base;
    const struct kind *kind;
    imp_v3 axis;
};

/* y and u of the coordinate above. The centre follows the profile's own parameters in
 * theta. */
static inline imp_v3 offset_of(const struct profile *p, imp_v3 x, double *u)
{
    const double *c = p->base.theta + p->kind->n_own;
    imp_v3 y = x - imp__v3(c[0], c[1], c[2]);
    y[3] = 0;
    if (p->kind->about == ALONG_AXIS) {
        *u = imp__dot(y, p->axis);
        return y;
    }
    if (p->kind->about == ABOUT_AXIS) y -= p->axis * imp__dot(y, p->axis);
    *u = imp__dot(y, y);
    return y;
}

/* H m */
static inline imp_v3 hess_times(const struct profile *p, const struct shape_at *s,
                                imp_v3 y, imp_v3 m)
{
    if (p->kind->about == ALONG_AXIS) return p->axis * (s->f2 * imp__dot(p->axis, m));
    imp_v3 pm = m;
    if (p->kind->about == ABOUT_AXIS) pm -= p->axis * imp__dot(p->axis, m);
    return 2 * s->f1 * pm + y * (4 * s->f2 * imp__dot(y, m));
}

static void profile_eval(const imp_field *f, int n, const imp_v3 *x, int order,
                         struct imp__jet *jet)
{
    const struct profile *p = (const struct profile *)f;
    for (int i = 0; i < n; i++) {
        struct shape_at s = {0};
        double u;
        const imp_v3 y = offset_of(p, x[i], &u);
        p->kind->at(f->theta, u, &s);
        jet[i].eta = s.f;
        jet[i].g = p->kind->about == ALONG_AXIS ? p->axis * s.f1 : y * (2 * s.f1);
        if (order < 2) continue;
        for (int k = 0; k < 3; k++) {
            imp_v3 e = {0};
            e[k] = 1;
            jet[i].h[k] = hess_times(p, &s, y, e);
        }
    }
}

static void profile_splat(const imp_field *f, const imp_v3 *x, double a, const imp_v3 *b,
                          struct imp__bar *bar)
{
    const struct profile *p = (const struct profile *)f;
    struct shape_at s = {0};
    double u;
    const imp_v3 y = offset_of(p, *x, &u);
    p->kind->at(f->theta, u, &s);
    double *theta_bar = imp__bar_reach(bar, 0, f->n_theta);
    const bool along = p->kind->about == ALONG_AXIS;
    /* g = 2 f' y or f' a, so b.g = slope f' */
    const double slope = along ? imp__dot(*b, p->axis) : 2 * imp__dot(*b, y);
    for (int k = 0; k < p->kind->n_own; k++)
        theta_bar[k] += a * s.fp[k] + slope * s.f1p[k];
    const imp_v3 g = along ? p->axis * s.f1 : y * (2 * s.f1);
    const imp_v3 c = -(g * a + hess_times(p, &s, y, *b));
    for (int k = 0; k < 3; k++) theta_bar[p->kind->n_own + k] += c[k];
}

static void profile_tangent(const imp_field *f, const imp_v3 *x, const double *theta_dot,
                            double *eta_dot, imp_v3 *g_dot)
{
    const struct profile *p = (const struct profile *)f;
    struct shape_at s = {0};
    double u, df = 0, df1 = 0;
    const imp_v3 y = offset_of(p, *x, &u);
    p->kind->at(f->theta, u, &s);
    for (int k = 0; k < p->kind->n_own; k++)
        df += s.fp[k] * theta_dot[k], df1 += s.f1p[k] * theta_dot[k];
    const double *cd = theta_dot + p->kind->n_own;
    const imp_v3 c = imp__v3(cd[0], cd[1], cd[2]);
    const bool along = p->kind->about == ALONG_AXIS;
    const imp_v3 g = along ? p->axis * s.f1 : y * (2 * s.f1);
    *eta_dot = df - imp__dot(g, c);
    *g_dot = (along ? p->axis * df1 : y * (2 * df1)) - hess_times(p, &s, y, c);
}

static const char *profile_param_name(const imp_field *f, size_t i)
{
    const struct kind *k = ((const struct profile *)f)->kind;
    return i < (size_t)k->n_own ? k->names[i] : centre_names[i - (size_t)k->n_own];
}

/* All kinds have the same functions; only their names and what jumps differ. */
#define PROFILE_THAT(text, why)                                                          \
    {                                                                                    \
        .name = text, .eval = profile_eval, .splat = profile_splat,                      \
        .tangent = profile_tangent, .param_name = profile_param_name, .jumps = why       \
    }
#define PROFILE(text) PROFILE_THAT(text, NULL)
#define AT_RADIUS                                                                        \
    "the gradient of this profile jumps at its radius; radial splines do not"
static const struct imp__field_ops profile_ops[] = {
    PROFILE("constant"),   PROFILE_THAT("luneburg", AT_RADIUS),
    PROFILE("maxwell"),    PROFILE("rod"),
    PROFILE("rod-vendor"), PROFILE("rod-power"),
    PROFILE("sech"),       PROFILE("plume"),
    PROFILE("polynomial"), PROFILE("axial"),
    PROFILE("linear")};
_Static_assert(imp_count(profile_ops) == imp_count(kinds), "one table a kind");

static int kind_find(const char *name)
{
    for (size_t i = 0; i < imp_count(kinds); i++)
        if (strcmp(kinds[i].name, name) == 0) return (int)i;
    return -1;
}

const char *imp__profile_param(const char *kind, size_t i)
{
    const int k = kind_find(kind);
    if (k < 0 || i >= (size_t)kinds[k].n_own + 3) return NULL;
    return i < (size_t)kinds[k].n_own ? kinds[k].names[i]
                                      : centre_names[i - kinds[k].n_own];
}

size_t imp_field_profile_count(const char *kind)
{
    const int k = kind ? kind_find(kind) : -1;
    return k < 0 ? 0 : (size_t)kinds[k].n_own + 3;
}

enum imp_status imp_field_profile_create(imp_context *ctx, const char *kind,
                                         const double *params, const double *axis,
                                         imp_field **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, kind, "kind");
    IMP_REQUIRE(ctx, params, "params");
    IMP_REQUIRE(ctx, out, "out");
    IMP_FLOAT_MODE;
    const int k = kind_find(kind);
    imp_v3 a = imp__v3(0, 0, 1);
    imp_field *f = NULL;
    if (k < 0)
        return imp__error(
            ctx, IMP_E_ARG,
            "no index profile '%s': there are constant, luneburg, maxwell, rod, "
            "rod-vendor, rod-power, sech, plume, polynomial, axial, linear",
            kind);
    const size_t n = (size_t)kinds[k].n_own + 3;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(params[i]))
            return imp__error(ctx, IMP_E_ARG, "%s profile: params[%zu], '%s', is %g",
                              kind, i, imp__profile_param(kind, i), params[i]);
    for (int i = 0; i < kinds[k].n_own; i++) {
        const char *name = kinds[k].names[i];
        const bool part =
            kinds[k].at == plume_at ||
            kinds[k].at == polynomial_at; /* may be 0 or negative as a part of a sum */
        if ((!strcmp(name, "radius") || !strcmp(name, "width") ||
             (!strcmp(name, "n0") && !part)) &&
            !(params[i] > 0))
            return imp__error(ctx, IMP_E_ARG, "%s profile: %s = %g must be positive",
                              kind, name, params[i]);
    }
    if (axis) {
        a = imp__v3_load(axis);
        const double length = imp__length(a);
        if (!(length > 0) || !isfinite(length))
            return imp__error(ctx, IMP_E_ARG, "%s profile: the axis has no direction",
                              kind);
        a *= 1 / length;
    }
    enum imp_status st =
        imp__field_new(ctx, &profile_ops[k], sizeof(struct profile), n, &f);
    if (st != IMP_OK) return st;
    struct profile *p = (struct profile *)f;
    p->kind = &kinds[k];
    p->axis = a;
    memcpy(f->theta, params, n * sizeof *params);
    *out = f;
    return IMP_OK;
}
