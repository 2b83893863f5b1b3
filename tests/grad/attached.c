/* SPDX-License-Identifier: Apache-2.0
 *
 * The table of docs/estimators.md 4: the derivative of
 *   I(alpha) = int f cos(theta_i) L(wi) dwi,  wo = (1/2, 0, sqrt(3)/2),
 *   L(w) = max(0, w_z) exp(2 w.a),  a = (-.6, 0, .8),  specular 1, diffuse 0
 * with respect to Stam's exponent. Exact numbers by quadrature of eval and eval_d; then
 * the estimators: detached (two samplers), fully attached, and Stam's own term, which
 * keeps only the first part of the attached form and is wrong (E9). */
#include "imp_kinds.h"
#include "imp_tap.h"
#include "math/sphere_cells.h"

enum { AMBIENT, DIFFUSE, SPECULAR, EXPONENT };
static const imp_v3 a = {-0.6, 0, 0.8, 0};
static const imp_v3 wo = {0.5, 0, 0.86602540378443864676, 0};

static double L(imp_v3 w) { return fmax(0, w[2]) * exp(2 * imp__dot(w, a)); }
static imp_v3 L_gradient(imp_v3 w)
{
    if (!(w[2] > 0)) return imp__v3(0, 0, 0);
    return (imp__v3(0, 0, 1) + a * (2 * w[2])) * exp(2 * imp__dot(w, a));
}

struct setting {
    const struct imp_bsdf *b;
    imp_spec in[4];
};
static double primal(imp_v3 wi, void *payload)
{
    const struct setting *s = payload;
    const struct imp_dirs d = {wo, wi, IMP_SMOOTH, 0};
    imp_spec f;
    s->b->ops->eval(s->b, s->in, &d, &f);
    return f[0] * L(wi);
}
static double derivative(imp_v3 wi, void *payload)
{
    const struct setting *s = payload;
    const struct imp_dirs d = {wo, wi, IMP_SMOOTH, 0};
    imp_spec df[4];
    s->b->ops->eval_d(s->b, s->in, &d, df);
    return df[EXPONENT][0] * L(wi);
}

/* The table: rows of both normal distributions. */
static const struct row {
    double alpha, I, dI, stam, sd_detached, sd_cosine, sd_attached;
} correct[3] = {{1, 1.3463040, 0.3515689, 0, 1.570, 0.939, 0.908},
                {10, 3.2738922, 0.1309128, 0, 1.465, 2.151, 0.494},
                {40, 4.9865830, 0.0248455, 0, 3.534, 7.360, 0.680}},
  with_sine[3] = {{1, 0.4294239, 0.0978342, -0.0644643, 1.303, 0.740, 1.348},
                  {10, 0.8272367, 0.0161351, -0.0323467, 2.623, 3.084, 2.204},
                  {40, 0.8456737, -0.0035256, -0.0097902, 5.910, 6.205, 1.584}};

struct estimates {
    struct tap_stat detached, attached, stam;
};

static struct estimates estimate(const struct setting *s, uint32_t n, uint64_t seed)
{
    struct estimates e = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    for (uint32_t i = 0; i < n; i++) {
        const struct imp_key key = imp__key(seed, 0, i);
        const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
        struct imp_dirs d = {wo, {0}, IMP_SMOOTH, 0};
        struct kind_draw q;
        double detached = 0, attached = 0, stam = 0;
        if (kind_draw(s->b, s->in, u, &d, &q)) {
            imp_spec df[4], dw;
            imp_v3 dwi;
            s->b->ops->eval_d(s->b, s->in, &d, df);
            detached = df[EXPONENT][0] / q.pdf * L(d.wi);
            if (s->b->ops->sample_d(s->b, s->in, u, &d, EXPONENT, &dw, &dwi)) {
                stam = dw[0] * L(d.wi);
                attached = stam + q.f[0] / q.pdf * imp__dot(L_gradient(d.wi), dwi);
            }
        }
        tap_add(&e.detached, detached);
        tap_add(&e.attached, attached);
        tap_add(&e.stam, stam);
    }
    return e;
}

static void sd_check(const struct tap_stat *s, double truth, double relative,
                     const char *what)
{
    const double sd = sqrt(s->m2 / (s->n - 1)) / fabs(truth);
    tap_ok(fabs(sd / relative - 1) < 0.03, "%s: relative sd of a draw # %.3f, table %.3f",
           what, sd, relative);
}

static void table(const struct imp_bsdf *phong, const struct imp_bsdf *cosine,
                  const struct row *rows, const char *name)
{
    for (int i = 0; i < 3; i++) {
        const struct row *r = &rows[i];
        char what[128];
        struct setting s = {
            phong, {imp__spec(0), imp__spec(0), imp__spec(1), imp__spec(r->alpha)}};
        struct setting c = s;
        c.b = cosine;
#define WHAT(text)                                                                       \
    (snprintf(what, sizeof what, "%s D, alpha %g: %s", name, r->alpha, text), what)
        const double I = imp__sphere_integral(primal, &s, 0, 1, 1e-8, IMP_SPHERE_SMOOTH);
        const double dI =
            imp__sphere_integral(derivative, &s, 0, 1, 1e-8, IMP_SPHERE_SMOOTH);
        tap_near(I, r->I, 1e-7, 6e-8, WHAT("I by quadrature"));
        tap_near(dI, r->dI, 1e-6, 1e-7, WHAT("dI/dalpha by quadrature"));

        const struct estimates e = estimate(&s, 100000, 4 + (uint64_t)i);
        const struct estimates o = estimate(&c, 100000, 14 + (uint64_t)i);
        tap_z(&e.detached, dI, 0.02 * fabs(dI) + 1e-3, WHAT("detached"));
        tap_z(&o.detached, dI, 0.02 * fabs(dI) + 1e-3, WHAT("detached, cosine"));
        tap_z(&e.attached, dI, 0.01 * fabs(dI), WHAT("attached"));
        if (r->stam == 0)
            tap_ok(fabs(e.stam.mean) < 1e-13, "%s # %.1e", WHAT("Stam's term is 0"),
                   e.stam.mean);
        else tap_z(&e.stam, r->stam, 0.01 * fabs(r->stam), WHAT("Stam's term"));
        tap_ok(fabs(e.stam.mean - dI) > 10 * tap_se(&e.stam), "%s",
               WHAT("Stam's term is not the derivative (E9)"));
        sd_check(&e.detached, dI, r->sd_detached, WHAT("detached"));
        sd_check(&o.detached, dI, r->sd_cosine, WHAT("cosine"));
        sd_check(&e.attached, dI, r->sd_attached, WHAT("attached"));
#undef WHAT
    }
}

/* The mixture with everything on: the attached form of all samplers has the same mean. */
static void mixtures(const struct imp_bsdf *b, const char *name)
{
    struct setting s = {b, {imp__spec(0), imp__spec(0.4), imp__spec(0.6), imp__spec(12)}};
    const double dI = imp__sphere_integral(derivative, &s, 0, 1, 1e-8, IMP_SPHERE_SMOOTH);
    const struct estimates e = estimate(&s, 200000, 99);
    tap_z(&e.detached, dI, 0.02 * fabs(dI), name);
    tap_z(&e.attached, dI, 0.02 * fabs(dI), name);
}

static struct imp_bsdf *make(struct kind_factory *f, const char *variant,
                             const char *sampling)
{
    struct imp_bsdf *b = imp__arena_array(&f->arena, 1, sizeof *b);
    const char *props[2] = {variant, sampling};
    for (int k = 0; imp__bsdf_kinds[k]; k++)
        if (strcmp(imp__bsdf_kinds[k]->name, "stam_m2") == 0 &&
            kind_make(f, imp__bsdf_kinds[k], props, 2, NULL, 0, b))
            return b;
    return NULL;
}

int main(void)
{
    struct kind_factory f;
    if (!kinds_open(&f)) return 1;
    table(make(&f, "variant=microfacet", "sampling=phong"),
          make(&f, "variant=microfacet", "sampling=cosine"), correct, "correct");
    table(make(&f, "variant=paper", "sampling=phong"),
          make(&f, "variant=paper", "sampling=cosine"), with_sine, "sine");
    mixtures(make(&f, "variant=microfacet", "sampling=mixture"), "microfacet, mixture");
    mixtures(make(&f, "variant=reciprocal", "sampling=mixture"), "reciprocal, mixture");
    mixtures(make(&f, "variant=reciprocal", "sampling=phong"), "reciprocal, phong");
    mixtures(make(&f, "variant=paper", "sampling=mixture"), "paper, mixture");
    kinds_close(&f);
    return tap_done();
}
