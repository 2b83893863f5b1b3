/* SPDX-License-Identifier: Apache-2.0
 *
 * Albedo of every material by quadrature and by its own sampling: one number, and not
 * more than 1; reciprocity where the model has it; and the published numbers of the
 * models. */
#include "imp_kinds.h"
#include "imp_tap.h"
#include "kind/bsdf/fresnel.h"
#include "kind/bsdf/microfacet.h"
#include "kind/bsdf/presets.h"
#include "math/quadrature.h"
#include "math/sphere_cells.h"
#include "math/stat.h"
#include <complex.h>

struct point {
    const struct imp_bsdf *b;
    const imp_spec *in;
    imp_v3 fixed;
    int lane;
    bool from_light; /* wi is fixed and wo runs: f cos_o/cos_i */
};
static double index_ratio(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    return b->ops->index_ratio ? b->ops->index_ratio(b, in, d) : 1;
}
static double value(imp_v3 w, void *payload)
{
    const struct point *p = payload;
    struct imp_dirs d = {p->fixed, w, IMP_SMOOTH, 0};
    imp_spec f;
    if (p->from_light) d = (struct imp_dirs){w, p->fixed, IMP_SMOOTH, 0};
    p->b->ops->eval(p->b, p->in, &d, &f);
    /* Power: radiance that passes a refraction is divided by the squared index ratio. */
    const double e = index_ratio(p->b, p->in, &d);
    return f[p->lane] * e * e * (p->from_light ? fabs(w[2] / p->fixed[2]) : 1);
}

/* Two of stam_m2 by their formulas (E28), tables over one of the two directions,
 * and fibres, in which the place is told by one of them. */
static bool is_one_way(const struct kind_case *c)
{
    return kind_has_config(c, "variant=microfacet") ||
           kind_has_config(c, "variant=paper") || strstr(c->label, "measured") ||
           strstr(c->label, "hair");
}

/* ---- Albedo: two ways, and at most 1 ------------------------------------------- */

static void albedo_visit(const struct kind_case *c, void *payload)
{
    const struct imp_bsdf *b = &c->bsdf;
    const char *tint = NULL;
    double most = 0;
    struct tap_stat z = {0};
    (void)payload;
    for (int i = 0; i < 8; i++) {
        imp_spec in[IMP_INPUTS_MAX];
        kind_inputs(b, KIND_RANDOM, 70 + (uint64_t)i, in);
        struct imp_dirs d = {kind_direction(i, 31), {0}, IMP_SMOOTH, 0};
        const imp_v3 wo = d.wo;
        struct kind_draw s;
        /* One reflectance at a time is 1 and the others are 0: the lobes one by one. */
        for (int j = 0; j < b->n_in; j++) {
            const struct imp_input_desc *q = kind_input(b, j);
            if (q->role != IMP_REFLECTANCE || kind_is_scalar(q)) continue;
            for (int k = 0; k < b->n_in; k++) {
                const struct imp_input_desc *o = kind_input(b, k);
                if (o->role == IMP_REFLECTANCE && !kind_is_scalar(o))
                    in[k] = imp__spec(k == j);
            }
            struct point p = {b, in, wo, 0, false};
            const double smooth =
                b->flags & IMP_BSDF_SMOOTH
                    ? imp__sphere_integral(value, &p, -1, 1, 1e-4,
                                           kind_steps(c) ? IMP_SPHERE_STEPS
                                                         : IMP_SPHERE_SMOOTH)
                    : 0;
            struct tap_stat mc = {0};
            for (uint32_t n = 0; n < 4000; n++) {
                const struct imp_key key = imp__key(33, (uint64_t)(100 * i + j), n);
                const double u[3] = {imp__u01(key, 0), imp__u01(key, 1),
                                     imp__u01(key, 2)};
                d.wo = wo;
                const bool ok = kind_draw(b, in, u, &d, &s);
                if (b->flags &
                    IMP_BSDF_DELTA) /* the delta lobes alone; power, not radiance */
                    tap_add(&mc, ok && d.lobe >= 0 ? s.f[0] / s.pdf * s.eta * s.eta : 0);
                else tap_add(&mc, ok ? s.f[0] / s.pdf * s.eta * s.eta : 0);
            }
            /* Lambert drawn from a narrow lobe: the tails are too heavy for a z-test. */
            const bool heavy =
                kind_has_config(c, "sampling=phong") && strcmp(q->name, "diffuse") == 0;
            if (!(b->flags & IMP_BSDF_DELTA) && tap_se(&mc) > 0 && smooth > 1e-3 &&
                !heavy)
                tap_add(&z, (mc.mean - smooth) / (tap_se(&mc) + 1e-5));
            const double all =
                smooth + (b->flags & IMP_BSDF_DELTA ? mc.mean - 4 * tap_se(&mc) : 0);
            if (all > most) {
                most = all;
                tint = q->name;
            }
        }
    }
    const bool adds = strstr(c->label, "principled"); /* principled_visit */
    /* The fit of Beckmann's masking exceeds 1 by 6e-5 at its end. */
    if (!adds)
        tap_ok(most <= 1 + 2e-4, "%s: energy # largest albedo %.6f (%s)", c->label, most,
               tint ? tint : "-");
    if (z.n > 3)
        tap_ok(fabs(z.mean) * sqrt(z.n) < 4.5 &&
                   imp__chi2_tail(z.m2 + z.n * z.mean * z.mean, z.n) > 1e-4,
               "%s: albedo by sampling is albedo by quadrature # mean z %.2f, sd %.2f of "
               "%.0f",
               c->label, z.mean, sqrt(z.m2 / (z.n - 1)), z.n);
}

/* The Disney models gain energy by themselves: sheen, clearcoat and diffuse lobe are added to
 * the facets, with nothing taken from them (Burley, "Physically Based Shading at Disney",
 * 2012). What has to keep energy is the rest: facets of metal, and of glass. A thin sheet
 * reflects by facets of one roughness and transmits by those of another, so that F and
 * 1 - F do not add up to 1 (by 10 % at most): there each side by itself does. */
static void principled_visit(const struct kind_case *c, void *payload)
{
    const struct imp_bsdf *b = &c->bsdf;
    double most = 0;
    (void)payload;
    if (strncmp(c->kind, "principled", 10) != 0) return;
    const bool thin = strcmp(c->kind, "principledthin") == 0;
    const bool glass = b->flags & IMP_BSDF_TRANSMIT;
    for (int i = 0; i < 16; i++) {
        imp_spec in[IMP_INPUTS_MAX];
        const bool metal = !glass || (i % 2 == 0 && !thin);
        kind_inputs(b, KIND_RANDOM, 170 + (uint64_t)i, in);
        for (int j = 0; j < b->n_in; j++) {
            const char *name = kind_input(b, j)->name;
            if (strcmp(name, "base_color") == 0) in[j] = imp__spec(1);
            if (strcmp(name, "sheen") == 0 || strcmp(name, "clearcoat") == 0)
                in[j] = imp__spec(0);
            if (strcmp(name, "metallic") == 0) in[j] = imp__spec(metal);
            if (strcmp(name, "spec_trans") == 0) in[j] = imp__spec(!metal);
        }
        struct point p = {b, in, kind_direction(i, 33), 0, false};
        for (int side = 0; side < (thin ? 2 : 1); side++)
            most = fmax(most, imp__sphere_integral(value, &p, thin && side == 0 ? 0 : -1,
                                                   thin && side == 1 ? 0 : 1, 1e-4,
                                                   IMP_SPHERE_SMOOTH));
    }
    tap_ok(most <= 1 + 2e-4, "%s: energy of the facets # largest albedo %.6f%s", c->label,
           most, thin ? " of one side" : "");
}

/* ---- Reciprocity --------------------------------------------------------------- */

static void reciprocity_visit(const struct kind_case *c, void *payload)
{
    const struct imp_bsdf *b = &c->bsdf;
    double worst = 0;
    int n = 0;
    (void)payload;
    if (!(b->flags & IMP_BSDF_SMOOTH)) return;
    /* The condition that the format has for its transmission. */
    if (strstr(c->label, "principledthin")) return;
    /* The turned frame depends on wo, the shadowing on wi. */
    if (strcmp(c->kind, "normalmap") == 0 || strcmp(c->kind, "bumpmap") == 0) return;
    /* Light that comes through two-sided glass has seen another material. */
    if (strcmp(c->kind, "twosided") == 0 && b->flags & IMP_BSDF_TRANSMIT) return;
    for (int i = 0; i < 400; i++) {
        imp_spec in[IMP_INPUTS_MAX], f, g;
        kind_inputs(b, KIND_RANDOM, 70 + (uint64_t)i, in);
        const imp_v3 wo = kind_direction(i, 31);
        imp_v3 wi = kind_direction(i, 32);
        if (i % 4 < 2) wi = imp__v3(-wo[0] + 0.1 * wi[0], -wo[1] + 0.1 * wi[1], wo[2]);
        if (i % 8 > 4 && b->flags & IMP_BSDF_TRANSMIT) wi[2] = -wi[2];
        wi = imp__normalize(wi);
        const struct imp_dirs d = {wo, wi, IMP_SMOOTH, 0}, e = {wi, wo, IMP_SMOOTH, 0};
        b->ops->eval(b, in, &d, &f);
        b->ops->eval(b, in, &e, &g);
        for (int l = 0; l < 3; l++) {
            /* Radiance over n^2: the one is n_o^2/n_i^2 of the other. */
            const double x = f[l] / fabs(wi[2]) * index_ratio(b, in, &d),
                         y = g[l] / fabs(wo[2]) * index_ratio(b, in, &e);
            if (fmax(x, y) < 1e-280) continue; /* nothing, or without digits */
            n++;
            /* Facets that refract are differences of directions: what is left of a lobe
             * far from its peak has few digits. */
            const imp_v3 h = wo + wi * index_ratio(b, in, &d);
            const double least =
                b->flags & IMP_BSDF_TRANSMIT ? 1e-5 / imp_min(1, imp__dot(h, h)) : 0;
            worst = fmax(worst, fabs(x - y) / (fmax(x, y) + least));
        }
    }
    if (is_one_way(c))
        tap_ok(worst > 0.1, "%s: not reciprocal, as documented # %.2g", c->label, worst);
    else
        tap_ok(worst < 1e-10 && n > 100, "%s: reciprocal # %.1e in %d", c->label, worst,
               n);
}

/* ---- Published numbers --------------------------------------------------------- */

static struct imp_bsdf m2[3];
static void find_m2(const struct kind_case *c, void *payload)
{
    (void)payload;
    if (strcmp(c->kind, "stam_m2") != 0) return;
    m2[kind_has_config(c, "variant=paper") ? 2
                                           : kind_has_config(c, "variant=microfacet")] =
        c->bsdf;
}
static double m2_albedo(int variant, double alpha, double degrees, bool from_light)
{
    const imp_spec in[4] = {{0}, {0}, imp__spec(1), imp__spec(alpha)};
    const double t = degrees * IMP_PI / 180;
    struct point p = {&m2[variant], in, imp__v3(sin(t), 0, cos(t)), 0, from_light};
    return imp__sphere_integral(value, &p, 0, 1, 1e-7, IMP_SPHERE_SMOOTH);
}

static void stam_numbers(void)
{
    /* docs/estimators.md 2.1, and E10, E21, E28 of section 3. */
    tap_near(m2_albedo(0, 10, 0, false), 0.717, 0, 6e-4, "M2r: albedo at 0 degrees");
    tap_near(m2_albedo(0, 10, 60, false), 0.623, 0, 6e-4, "M2r: albedo at 60 degrees");
    tap_near(m2_albedo(0, 10, 89, false), 0.504, 0, 6e-4, "M2r: albedo at 89 degrees");
    tap_near(m2_albedo(1, 0, 75, false), 0.500, 0, 6e-4,
             "M2: lobe albedo, 75 degrees, 0");
    tap_near(m2_albedo(1, 5, 75, false), 0.610, 0, 6e-4,
             "M2: lobe albedo, 75 degrees, 5");
    tap_near(m2_albedo(1, 1, 75, true), 1.08, 0, 6e-3,
             "M2: light-side albedo, 75 degrees");
    tap_near(m2_albedo(1, 1, 85, true), 3.0, 0, 6e-2,
             "M2: light-side albedo, 85 degrees");
    tap_near(m2_albedo(1, 1, 89, true), 14.7, 0, 6e-2,
             "M2: light-side albedo, 89 degrees");
    tap_near(m2_albedo(2, 100, 0, false), 0.123, 0, 6e-4,
             "M2p: lobe albedo at alpha 100");

    /* With the sine, over all half-vectors: (alpha + 2)/2 B(3/2, (alpha + 2)/2). */
    static const double published[3][2] = {{0, 0.667}, {10, 0.341}, {100, 0.123}};
    for (int i = 0; i < 3; i++) {
        const double a = published[i][0];
        double x[64], w[64], sum = 0, cut = 0;
        int sg;
        imp__gauss_legendre(64, 0, IMP_PI / 2, x, w);
        for (int k = 0; k < 64; k++)
            sum += w[k] * (a + 2) * pow(cos(x[k]), a + 1) * sin(x[k]) * sin(x[k]);
        const double beta = exp(lgamma_r(1.5, &sg) + lgamma_r(0.5 * a + 1, &sg) -
                                lgamma_r(0.5 * a + 2.5, &sg));
        tap_near(sum, 0.5 * (a + 2) * beta, 1e-10, 0, "M2p: E[sin] is a beta function");
        tap_near(sum, published[i][1], 0, 6e-4, "M2p: its published value");
        /* Seen from the normal, half-vectors beyond 45 degrees mirror below the horizon.
         */
        imp__gauss_legendre(64, 0, IMP_PI / 4, x, w);
        for (int k = 0; k < 64; k++)
            cut += w[k] * (a + 2) * pow(cos(x[k]), a + 1) * sin(x[k]) * sin(x[k]);
        tap_near(m2_albedo(2, a, 0, false), cut, 1e-5, 0,
                 "M2p: albedo at normal incidence");
    }
}

/* |r|^2 from the complex amplitudes: another way to the same reflectance. */
static double conductor_amplitudes(double c, double eta, double k)
{
    const double complex n = eta + I * k;
    const double complex ct = csqrt(1 - (1 - c * c) / (n * n));
    const double complex rs = (c - n * ct) / (c + n * ct),
                         rp = (n * c - ct) / (n * c + ct);
    return 0.5 * (creal(rs * conj(rs)) + creal(rp * conj(rp)));
}

static void fresnel_numbers(void)
{
    double ct, et;
    tap_near(imp__fresnel_dielectric(1, 1.5046 / 1.000277, &ct, &et), 0.0405364, 0, 1e-7,
             "bk7 in air, normal incidence");
    tap_near(imp__fresnel_dielectric(0.5, 1.5046 / 1.000277, &ct, &et), 0.0898799, 0,
             1e-7, "bk7 in air at cos 0.5");
    const double R = imp__fresnel_dielectric(1, 1.5046 / 1.000277, &ct, &et);
    tap_near(2 * R / (1 + R), 0.0779144, 0, 1e-7, "bk7: a thin sheet");
    tap_near(imp__fresnel_dielectric(1, 1.3330 / 1.000277, &ct, &et), 0.0203345, 0, 1e-7,
             "water in air");
    tap_near(imp__fresnel_dielectric(-1, 1.5, &ct, &et), 0.04, 1e-14, 0,
             "from inside: the same");
    tap_ok(imp__fresnel_dielectric(-0.5, 1.5, &ct, &et) == 1 && ct == 0,
           "total reflection");
    tap_ok(imp__fresnel_dielectric(0.3, 1, &ct, &et) == 0, "no boundary, no reflection");

    /* A reflected ray and the one refracted into it carry the same share (Stokes). */
    double worst = 0;
    for (int i = 1; i < 100; i++) {
        const double c = i / 100.0;
        double ct2, et2;
        const double out = imp__fresnel_dielectric(c, 1.5, &ct, &et);
        worst = fmax(worst, fabs(out - imp__fresnel_dielectric(-ct, 1.5, &ct2, &et2)));
        worst = fmax(worst, fabs(ct2 - c));
    }
    tap_ok(worst < 1e-13, "both sides of a boundary agree # %.1e", worst);

    worst = 0;
    for (int i = 1; i <= 200; i++) {
        const struct imp_key key = imp__key(3, 3, (uint64_t)i);
        const double c = i / 200.0;
        const imp_spec eta = {0.02 + 5 * imp__u01(key, 0), 0.02 + 2 * imp__u01(key, 1),
                              0.1, 0},
                       k = {8 * imp__u01(key, 2), imp__u01(key, 3), 0, 0};
        imp_spec f;
        imp__fresnel_conductor(c, &eta, &k, &f);
        for (int l = 0; l < 3; l++)
            worst = fmax(worst, fabs(f[l] - conductor_amplitudes(c, eta[l], k[l])));
    }
    tap_ok(worst < 1e-12, "conductor: |amplitude|^2 # %.1e", worst);
    double error = 0, most = 0;
    for (size_t i = 0; imp__conductor_at(i); i++) {
        const struct imp__conductor *m = imp__conductor_at(i);
        for (int l = 0; l < 3; l++) {
            const imp_spec eta = imp__spec(m->eta[l]), k = imp__spec(m->k[l]);
            const double e = m->eta[l], kk = m->k[l];
            imp_spec f;
            imp__fresnel_conductor(1, &eta, &k, &f);
            const double R0 =
                ((e - 1) * (e - 1) + kk * kk) / ((e + 1) * (e + 1) + kk * kk);
            error = fmax(error, fabs(f[0] - R0));
            most = fmax(most, f[0]);
        }
    }
    tap_ok(error < 1e-14 && most <= 1, "all presets at normal incidence # %.1e", error);
    const imp_spec zero = imp__spec(0), one = imp__spec(1);
    imp_spec f;
    imp__fresnel_conductor(0.3, &zero, &one, &f);
    tap_near(f[0], 1, 1e-15, 0, "the default conductor is a perfect mirror");
    double least = 1;
    most = 0;
    for (int i = 1; i <= 100000; i++) { /* where rounding decides the sign */
        imp__fresnel_conductor(i * 1e-5, &one, &zero, &f);
        least = fmin(least, f[0]);
        most = fmax(most, f[0]);
    }
    tap_ok(least >= 0 && most < 1e-9, "the conductor that is not there # %g .. %g", least,
           most);
    tap_ok(imp__conductor_find("Cu_palik") != imp__conductor_find("Cu") &&
               imp__conductor_find("TiO2_palik") == imp__conductor_find("TiO2") &&
               !imp__conductor_find("Ag_palik") && !imp__conductor_find("Na") &&
               imp__conductor_find("Na_palik") && !imp__conductor_find("_palik") &&
               !imp__conductor_find("unobtainium"),
           "names of conductors");
}

/* ---- Microfacets --------------------------------------------------------------- */

struct facet_point {
    const struct imp__microfacet *f;
    imp_v3 v;
    int what;
};
static double facet_value(imp_v3 m, void *payload)
{
    const struct facet_point *p = payload;
    return p->what == 0 ? imp__microfacet_d(p->f, &m, NULL) * m[2]
                        : imp__microfacet_pdf(p->f, &p->v, &m);
}
static void microfacets(void)
{
    const struct imp__microfacet unit = {IMP_BECKMANN, true, 1, 1, 0};
    const double t = 1; /* a = 1/(alpha tan) = 1 */
    const imp_v3 v = imp__normalize(imp__v3(t, 0, 1));
    tap_near(imp__microfacet_g1(&unit, &v, NULL), 0.976593, 0, 1e-6 * 1,
             "Beckmann G1 at a = 1");
    for (int i = 0; i < 8; i++) {
        const struct imp__microfacet f = {i & 1 ? IMP_GGX : IMP_BECKMANN, true,
                                          i & 2 ? 0.1 : 0.5, i & 4 ? 0.9 : 0.5, 0};
        const struct facet_point d = {&f, {0}, 0},
                                 g = {&f, imp__normalize(imp__v3(0.7, -0.4, 0.2)), 1};
        const char *name = f.type == IMP_GGX ? "ggx" : "beckmann";
        tap_ok(fabs(imp__sphere_integral(facet_value, (void *)&d, 0, 1, 1e-7,
                                         IMP_SPHERE_SMOOTH) -
                    1) < 1e-6,
               "%s %g %g: int D cos = 1", name, f.au, f.av);
        /* Heitz' weak white furnace: visible normals make up the whole view. */
        tap_ok(fabs(imp__sphere_integral(facet_value, (void *)&g, 0, 1, 1e-7,
                                         IMP_SPHERE_SMOOTH) -
                    1) < 1e-6,
               "%s %g %g: visible normals integrate to 1", name, f.au, f.av);
    }
}

/* c n_wi^2 is the same both ways through a refraction (radiance over n^2 is conserved).
 */
static void dielectric_visit(const struct kind_case *c, void *payload)
{
    const struct imp_bsdf *b = &c->bsdf;
    double reciprocal = 0, snell = 0, sum = 0;
    int n = 0;
    (void)payload;
    if (strcmp(c->kind, "dielectric") != 0) return;
    for (int i = 0; i < 200; i++) {
        struct imp_dirs d = {kind_direction(i, 51), {0}, 0, false}, e;
        struct kind_draw s;
        imp_spec back;
        const double u[3] = {1 - 1e-15, 0.5, 0.5};
        const imp_spec in[3] = {imp__spec(0.7), imp__spec(0.4),
                                imp__spec(0.5 + 0.01 * i)};
        if (!kind_draw(b, in, u, &d, &s)) continue;
        const struct imp_dirs r = {d.wo, {0}, 0, false};
        if (d.lobe == 0) continue; /* total reflection */
        n++;
        sum = fmax(sum, fabs(b->ops->pdf(b, in, &d) + b->ops->pdf(b, in, &r) - 1));
        const double so = hypot(d.wo[0], d.wo[1]), si = hypot(d.wi[0], d.wi[1]);
        snell = fmax(snell, fabs(so - s.eta * si));
        e = (struct imp_dirs){d.wi, d.wo, d.lobe, false};
        b->ops->eval(b, in, &e, &back);
        reciprocal =
            fmax(reciprocal, fabs(s.f[0] * s.eta * s.eta - back[0] / (s.eta * s.eta)));
    }
    tap_ok(n > 50 && snell < 1e-14, "%s: Snell # %.1e", c->label, snell);
    tap_ok(sum < 1e-15, "%s: chances sum to 1 # %.1e", c->label, sum);
    tap_ok(reciprocal < 1e-13, "%s: radiance over n^2 is reciprocal # %.1e", c->label,
           reciprocal);
}

static bool is_long;
static void visit(const struct kind_case *c, void *payload)
{
    if (!is_long && kind_waits(c)) return;
    albedo_visit(c, payload);
    principled_visit(c, payload);
    reciprocity_visit(c, payload);
    dielectric_visit(c, payload);
}

int main(int argc, char **argv)
{
    struct kind_factory f;
    is_long = tap_is_long(argc, argv);
    if (!kinds_open(&f)) return 1;
    kinds_visit(&f, visit, NULL);
    kinds_visit(&f, find_m2, NULL);
    stam_numbers();
    fresnel_numbers();
    microfacets();
    kinds_close(&f);
    return tap_done();
}
