/* SPDX-License-Identifier: Apache-2.0
 *
 * Errata of Stam's formulas (docs/estimators.md 3): what is printed beside what is right,
 * each by quadrature or a small simulation of its own, and what the library does.
 * docs/stam.md quotes what this prints. */
#include "imp_kinds.h"
#include "imp_tap.h"
#include "math/sphere_cells.h"

enum { AMBIENT, DIFFUSE, SPECULAR, EXPONENT };

/* ---- The normal distribution --------------------------------------------------- */

struct power {
    double alpha;
    int with_cosine, with_sine;
};

/* (alpha + 2)/2pi cos^alpha, times cosine and sine where asked for. */
static double distribution(imp_v3 m, void *payload)
{
    const struct power *p = payload;
    const double s = sqrt(fmax(0, 1 - m[2] * m[2]));
    return (p->alpha + 2) / IMP_2PI * pow(fmax(0, m[2]), p->alpha + p->with_cosine) *
           (p->with_sine ? s : 1);
}

static void normal_distribution(void)
{
    char what[128];
    static const double alphas[] = {0, 1, 10, 100};
    for (int k = 0; k < 4; k++) {
        struct power p = {alphas[k], 1, 0};
        snprintf(what, sizeof what,
                 "E11: int D cos dw = 1 with (alpha + 2)/2pi, alpha %g", p.alpha);
        tap_near(imp__sphere_integral(distribution, &p, 0, 1, 1e-9, IMP_SPHERE_SMOOTH), 1,
                 1e-6, 0, what);
    }
    /* Throughput of the lobe under its own sampling with the printed D: E[sin theta_m].
     */
    static const struct {
        double alpha, published;
    } ring[] = {{0, .667}, {10, .341}, {100, .123}};
    for (int k = 0; k < 3; k++) {
        struct power p = {ring[k].alpha, 1, 1};
        const double albedo =
            imp__sphere_integral(distribution, &p, 0, 1, 1e-9, IMP_SPHERE_SMOOTH);
        const double beta =
            exp(lgamma(1.5) + lgamma(p.alpha / 2 + 1) - lgamma(p.alpha / 2 + 2.5));
        snprintf(what, sizeof what, "E10: albedo with the sine, alpha %g (without: 1)",
                 p.alpha);
        tap_near(albedo, (p.alpha + 2) / 2 * beta, 1e-5, 0, what);
        tap_near(albedo, ring[k].published, 0, 6e-4, "E10: as published");
    }
    struct power sharp = {1e4, 1, 1};
    const double a =
        (sharp.alpha + 2) / 2 *
        exp(lgamma(1.5) + lgamma(sharp.alpha / 2 + 1) - lgamma(sharp.alpha / 2 + 2.5));
    tap_near(a, sqrt(M_PI / 2 / sharp.alpha), 1e-3, 0,
             "E10: the mirror is black, alpha 10000");
}

/* E12: (cos phi cos t, sin phi cos t, sin t) has z = sin t where cos t was meant. */
static void vector(void)
{
    static const struct {
        double alpha, distance;
    } row[] = {{0, 0}, {1, .29}, {5, .82}, {50, 1}};
    for (int k = 0; k < 4; k++) {
        double largest = 0;
        char what[128];
        for (int i = 0; i <= 100000; i++) {
            const double z = i / 1e5; /* P(z' <= z) of both */
            const double right = pow(z, row[k].alpha + 2);
            const double printed = 1 - pow(1 - z * z, (row[k].alpha + 2) / 2);
            largest = fmax(largest, fabs(right - printed));
        }
        snprintf(what, sizeof what, "E12: Kolmogorov distance of printed draws, alpha %g",
                 row[k].alpha);
        tap_near(largest, row[k].distance, 0, 6e-3, what);
    }
}

/* ---- The Phong-Blinn draw ------------------------------------------------------ */

/* Albedo seen at angle t: the weight is 1 for every draw that is kept. */
static double albedo(double alpha, double t, int flip)
{
    enum { N = 1500 };
    const imp_v3 wo = imp__v3(sin(t), 0, cos(t));
    double kept = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double c = pow(1 - (i + .5) / N, 1 / (alpha + 2)),
                         phi = IMP_2PI * (j + .5) / N;
            const double s = sqrt(1 - c * c);
            imp_v3 m = imp__v3(s * cos(phi), s * sin(phi), c);
            double mo = imp__dot(m, wo);
            if (mo < 0 && flip) { /* 2 (m.n) n - m */
                m = imp__v3(-m[0], -m[1], m[2]);
                mo = imp__dot(m, wo);
            }
            kept += mo > 0 && 2 * mo * m[2] - wo[2] > 0;
        }
    return kept / N / N;
}

static void flipping(void)
{
    static const struct {
        double alpha, right, flipped;
    } row[] = {{0, .500, .843}, {5, .610, .860}};
    for (int k = 0; k < 2; k++) {
        char what[128];
        const double t = 75 * M_PI / 180;
        snprintf(what, sizeof what, "E21: albedo at 75 degrees, alpha %g", row[k].alpha);
        tap_near(albedo(row[k].alpha, t, 0), row[k].right, 0, 1e-3, what);
        snprintf(what, sizeof what, "E21: with the flip, alpha %g", row[k].alpha);
        tap_near(albedo(row[k].alpha, t, 1), row[k].flipped, 0, 1e-3, what);
    }
    /* E20: handed the ray's own direction, the reflection goes into the surface. */
    const imp_v3 d = imp__v3(.6, 0, -.8), n = imp__v3(0, 0, 1);
    const imp_v3 printed = n * (2 * imp__dot(n, d)) - d;
    const imp_v3 right = n * (2 * imp__dot(n, -d)) + d;
    tap_ok(printed[2] < 0 && right[2] > 0,
           "E20: reflection of the ray # printed z %.1f, of its "
           "opposite %.1f",
           printed[2], right[2]);
}

/* ---- E4 and E28: M2 is not reciprocal, nor does it conserve energy ------------- */

struct lobe {
    const struct imp_bsdf *b;
    imp_spec in[4];
    imp_v3 wi;
};

static double f_of(const struct lobe *l, imp_v3 wi, imp_v3 wo)
{
    const struct imp_dirs d = {wo, wi, IMP_SMOOTH, 0};
    imp_spec f;
    l->b->ops->eval(l->b, l->in, &d, &f);
    return f[0] / wi[2];
}
static double light_side(imp_v3 wo, void *payload)
{
    const struct lobe *l = payload;
    return wo[2] > 0 ? f_of(l, l->wi, wo) * wo[2] : 0;
}

static void reciprocity(struct kind_factory *factory)
{
    static const struct {
        double angle, published;
    } row[] = {{75, 1.08}, {85, 3.0}, {89, 14.7}};
    const char *const variant[] = {"variant=microfacet", "variant=reciprocal"};
    for (int v = 0; v < 2; v++) {
        struct imp_bsdf b;
        struct lobe l = {.b = &b,
                         .in = {imp__spec(0), imp__spec(0), imp__spec(1), imp__spec(1)}};
        for (int k = 0; imp__bsdf_kinds[k]; k++)
            if (strcmp(imp__bsdf_kinds[k]->name, "stam_m2") == 0)
                tap_ok(
                    kind_make(factory, imp__bsdf_kinds[k], &variant[v], 1, NULL, 0, &b),
                    "stam_m2, %s", variant[v]);
        const imp_v3 i = imp__v3(sin(1.3), 0, cos(1.3)),
                     o = imp__v3(-sin(.2), 0, cos(.2));
        const double io = f_of(&l, i, o), oi = f_of(&l, o, i);
        tap_ok(v == 0 ? fabs(io / oi - o[2] / i[2]) < 1e-12 : fabs(io / oi - 1) < 1e-12,
               "E4: %s one way and the other # f(i,o) %.4f f(o,i) %.4f", variant[v], io,
               oi);
        for (int k = 0; k < 3; k++) {
            const double t = row[k].angle * M_PI / 180;
            l.wi = imp__v3(sin(t), 0, cos(t));
            const double a =
                imp__sphere_integral(light_side, &l, 0, 1, 1e-7, IMP_SPHERE_SMOOTH);
            if (v == 0)
                tap_ok(fabs(a / row[k].published - 1) < .01,
                       "E28: light-side albedo at %g degrees # %.3f, published %.2f",
                       row[k].angle, a, row[k].published);
            else tap_ok(a <= 1, "E28: reciprocal, at %g degrees # %.3f", row[k].angle, a);
        }
    }
}

/* ---- E15 and E16: the adjoint's step ------------------------------------------- */

/* A glowing sphere from inside, rho 1/2, e 3/10, directions uniform over the hemisphere:
 * dL/drho is e/(1 - rho)^2 = 1.2. A chord meets the sphere at equal angles at both ends,
 * so a walk is a list of cosines; the camera's is 0.3. */
static void transpose(void)
{
    enum { N = 400000, DEPTH = 40 };
    const double rho = .5, e = .3;
    struct tap_stat right = {0, 0, 0}, printed = {0, 0, 0}, literal = {0, 0, 0};
    for (int k = 0; k < N; k++) {
        double c[DEPTH + 1], lin[DEPTH + 1], P = 1, Q = 1, g[3] = {0};
        c[0] = .3;
        for (int i = 1; i <= DEPTH; i++)
            c[i] = imp__u01(imp__key(15, (uint64_t)k, 0), (uint32_t)i);
        lin[DEPTH] = e;
        for (int i = DEPTH - 1; i >= 0; i--) lin[i] = e + 2 * rho * c[i + 1] * lin[i + 1];
        for (int i = 1; i <= DEPTH; i++) { /* f cos/p = rho/pi cos 2pi */
            g[0] += P * 2 * c[i] * lin[i];
            g[1] += Q * 2 * c[i] * lin[i];
            g[2] += Q * lin[i] / M_PI; /* (P . L) d rho_k, without cos/p */
            P *= 2 * rho * c[i];
            Q *= 2 * rho * c[i - 1];
        }
        tap_add(&right, g[0]);
        tap_add(&printed, g[1]);
        tap_add(&literal, g[2]);
    }
    tap_z(&right, 1.2, .01, "E15: transpose of the forward step");
    tap_z(&printed, .96, .01,
          "E15: as printed, with the other side's cosine (truth 1.2)");
    tap_z(&literal, .96 / M_PI, .01, "E16: as printed, without cos/p (truth 1.2)");
}

/* E27: a frame from a normal along (.1, .2, .3). */
static void frame(void)
{
    const imp_v3 z = imp__normalize(imp__v3(.1, .2, .3));
    const imp_v3 c = imp__cross(z, z + imp__v3(.1, .2, .3));
    const struct imp_frame f = imp__frame_from_normal(z);
    const double off = fabs(imp__dot(f.s, f.t)) + fabs(imp__dot(f.s, z)) +
                       fabs(imp__dot(f.t, z)) + fabs(imp__length(f.s) - 1) +
                       fabs(imp__length(f.t) - 1);
    tap_ok(imp__length(c) < 1e-15, "E27: the printed frame divides by the length %.0e",
           imp__length(c));
    tap_ok(off < 1e-14, "E27: the library's frame is orthonormal there # off by %.0e",
           off);
}

int main(void)
{
    struct kind_factory f;
    if (!kinds_open(&f)) return 1;
    normal_distribution();
    vector();
    flipping();
    reciprocity(&f);
    transpose();
    frame();
    kinds_close(&f);
    return tap_done();
}
