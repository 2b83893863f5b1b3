/* SPDX-License-Identifier: Apache-2.0
 *
 * Tables of rough coats (kind/bsdf/coat.h): against draws of visible normals, against
 * numbers computed elsewhere (docs/scene-format.md 16), and their derivatives against
 * differences of other tables. The mean reflectance of smooth ones (kind/bsdf/fresnel.h)
 * against quadrature. */
#include "imp_tap.h"
#include "kind/bsdf/coat.h"
#include "kind/bsdf/fresnel.h"
#include "math/quadrature.h"
#include "math/rng.h"

enum { DRAWS = 40000 };

static struct imp__coat table, above, below;

/* E over drawn normals of what passes (e = eta) or comes back (e = 1/eta). */
static void draw(enum imp__distribution type, double alpha, double e, double mu,
                 bool back, uint64_t seed, struct tap_stat *sum)
{
    const struct imp__microfacet f = {type, true, alpha, alpha, 0};
    const imp_v3 w = imp__v3(sqrt(1 - mu * mu), 0, mu);
    for (uint32_t i = 0; i < DRAWS; i++) {
        const struct imp_key key = imp__key(seed, i, 0);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        const imp_v3 m = imp__microfacet_sample(&f, &w, u);
        double cos_t, eta_t;
        const double c = imp__dot(w, m);
        const double F = imp__fresnel_dielectric(c, e, &cos_t, &eta_t);
        imp_v3 out = back ? m * (2 * c) - w : w * (1 / e) - m * (c / e - cos_t);
        const bool right = out[2] > 0 && (back || F < 1);
        tap_add(sum, right ? (back ? F : 1 - F) * imp__microfacet_g1(&f, &out, NULL) : 0);
    }
}

static void drawn(void)
{
    for (int k = 0; k < 8; k++) {
        const enum imp__distribution type = k & 1 ? IMP_GGX : IMP_BECKMANN;
        const double alpha = k & 2 ? 0.1 : 0.4, eta = k & 4 ? 0.7 : 1.5;
        struct tap_stat z = {0};
        imp__coat_make(&table, type, alpha, eta);
        for (int i = 6; i < IMP_COAT_NODES - 1; i += 19) {
            const double mu = i / (IMP_COAT_NODES - 1.0);
            struct tap_stat s = {0};
            draw(type, alpha, eta, mu, false, 10 + (uint64_t)k, &s);
            tap_add(&z, (s.mean - table.T[i][0]) / (tap_se(&s) + 2e-5));
        }
        tap_ok(fabs(z.mean) * sqrt(z.n) < 4.5 && z.m2 < 30,
               "T by draws, %s alpha %g eta %g # mean z %.2f", k & 1 ? "ggx" : "beckmann",
               alpha, eta, z.mean);
    }
    /* R_int is a mean over 64 cosines; all of them at once. */
    for (int k = 0; k < 4; k++) {
        const enum imp__distribution type = k & 1 ? IMP_GGX : IMP_BECKMANN;
        const double alpha = k & 2 ? 0.1 : 0.4;
        double mean = 0, variance = 0;
        imp__coat_make(&table, type, alpha, 1.5);
        for (int i = 0; i < IMP_COAT_NODES; i++) {
            const double mu = fmax(1e-6, i / (IMP_COAT_NODES - 1.0));
            struct tap_stat s = {0};
            draw(type, alpha, 1 / 1.5, mu, true, 30 + (uint64_t)i, &s);
            mean += 2 * mu / IMP_COAT_NODES * s.mean;
            variance += imp__sqr(2 * mu / IMP_COAT_NODES * tap_se(&s));
        }
        tap_ok(fabs(mean - table.R_int[0]) < 4.5 * sqrt(variance) + 3e-5,
               "R_int by draws, %s alpha %g # %.5f +- %.1e, table %.5f",
               k & 1 ? "ggx" : "beckmann", alpha, mean, sqrt(variance), table.R_int[0]);
    }
}

static void published(void)
{
    static const struct {
        enum imp__distribution type;
        double alpha, T[5], R;
    } rows[] = {{IMP_BECKMANN, 0.1, {.9613, .9540, .9108, .7447, .5248}, .5747},
                {IMP_BECKMANN, 0.3, {.9611, .9492, .9030, .8081, .7333}, .5235},
                {IMP_GGX, 0.1, {.9608, .9515, .9080, .7650, .6094}, .5473},
                {IMP_GGX, 0.3, {.9545, .9352, .8884, .7991, .7231}, .4120}};
    static const double mu[5] = {1, .75, .5, .25, .1};
    for (size_t r = 0; r < imp_count(rows); r++) {
        double worst = 0;
        imp__coat_make(&table, rows[r].type, rows[r].alpha, 1.49 / 1.000277);
        for (int i = 0; i < 5; i++)
            worst = fmax(worst, fabs(imp__coat_T(&table, mu[i])[0] - rows[r].T[i]));
        /* Those of GGX at grazing angles are themselves good to 1e-2. */
        const double limit = rows[r].type == IMP_GGX ? 1e-2 : 1.5e-3;
        tap_ok(worst < limit && fabs(table.R_int[0] - rows[r].R) < limit,
               "published numbers, %zu # %.1e, R %.5f", r, worst, table.R_int[0]);
    }
}

static void derivatives(void)
{
    double worst = 0;
    for (int k = 0; k < 24; k++) {
        const struct imp_key key = imp__key(7, (uint64_t)k, 0);
        const enum imp__distribution type = k & 1 ? IMP_GGX : IMP_BECKMANN;
        const double x[2] = {0.03 * pow(30, imp__u01(key, 0)),
                             1.1 + 1.5 * imp__u01(key, 1)};
        imp__coat_make(&table, type, x[0], x[1]);
        for (int j = 0; j < 2; j++) {
            const double h = 2e-5 * x[j];
            imp__coat_make(&above, type, x[0] + h * (j == 0), x[1] + h * (j == 1));
            imp__coat_make(&below, type, x[0] - h * (j == 0), x[1] - h * (j == 1));
            for (int i = 0; i <= IMP_COAT_NODES; i++) {
                const bool R = i == IMP_COAT_NODES;
                const imp__dual *a = R ? &above.R_int : &above.T[i],
                                *b = R ? &below.R_int : &below.T[i],
                                *t = R ? &table.R_int : &table.T[i];
                worst =
                    fmax(worst, x[j] * fabs(((*a)[0] - (*b)[0]) / (2 * h) - (*t)[1 + j]));
            }
        }
    }
    tap_ok(worst < 1e-6, "derivatives by alpha and eta # %.1e", worst);
}

/* int 2 c F(c, e) dc, with c = t^2 for the root at 0, and above total reflection c^2 =
 * 1 - e^2 + s^2 e^2, s the cosine on the far side: c dc = e^2 s ds. */
static double mean_by_quadrature(double e, double *d_e)
{
    enum { NODES = 200 };
    double x[NODES], w[NODES], sum = e < 1 ? 1 - e * e : 0;
    imp__gauss_legendre(NODES, 0, 1, x, w);
    *d_e = 0;
    for (int k = 0; k < NODES; k++) {
        const double t2 = x[k] * x[k];
        const double c = e < 1 ? sqrt(1 - e * e + t2 * t2 * e * e) : t2;
        const double by = e < 1 ? 4 * e * e * t2 * x[k] : 4 * t2 * x[k];
        double dF_c, dF_e, cos_t, eta_t;
        sum += w[k] * by * imp__fresnel_dielectric(c, e, &cos_t, &eta_t);
        imp__fresnel_dielectric_d(c, e, &dF_c, &dF_e);
        *d_e += w[k] * by * dF_e; /* the ends bring nothing: F is 1 there */
    }
    return sum;
}
static void smooth(void)
{
    static const double index[] = {.1,    .25,  1 / 1.4895, .9,     .999, 1, 1.00001,
                                   1.001, 1.02, 1.1,        1.4895, 3,    10};
    double worst = 0, worst_d = 0;
    for (size_t k = 0; k < sizeof index / sizeof *index; k++) {
        double d, d_e;
        const double e = index[k], F = imp__fresnel_diffuse(e, &d);
        worst = fmax(worst, fabs(F - mean_by_quadrature(e, &d_e)));
        if (e > 1.005 || e < 0.99) worst_d = fmax(worst_d, fabs(d - d_e) / (1 + fabs(d)));
    }
    tap_ok(worst < 2e-9, "mean reflectance by quadrature # %.1e", worst);
    tap_ok(worst_d < 1e-6, "and its derivative # %.1e", worst_d);
    double d, above_1, below_1; /* slopes 1/3 and 7/3, where it has a kink */
    above_1 = imp__fresnel_diffuse(1 + 1e-5, &d);
    below_1 = imp__fresnel_diffuse(1 - 1e-5, &d);
    tap_ok(imp__fresnel_diffuse(1, &d) == 0 && fabs(above_1 - 1e-5 / 3) < 1e-9 &&
               fabs(below_1 - 7e-5 / 3) < 1e-9,
           "and 0 where the indices are the same # %.3g, %.3g", above_1, below_1);
}

int main(void)
{
    drawn();
    published();
    derivatives();
    smooth();
    return tap_done();
}
