/* SPDX-License-Identifier: Apache-2.0
 *
 * Every material followed from the lights (kind/bsdf/transport.h): the transposed kernel
 * integrated over wo by quadrature, which takes f from eval alone, against its own
 * sampling; power through a dielectric; and value and cosine apart. */
#include "imp_kinds.h"
#include "imp_tap.h"
#include "kind/bsdf/transport.h"
#include "math/sphere_cells.h"

#define SAMPLES 20000

struct point {
    const struct imp_bsdf *b;
    const imp_spec *in;
    imp_v3 wi;
};
/* f |cos_o| from eval = f |cos_i|. */
static double kernel(imp_v3 w, void *payload)
{
    const struct point *p = payload;
    const struct imp_dirs d = {w, p->wi, IMP_SMOOTH, 0};
    imp_spec f;
    p->b->ops->eval(p->b, p->in, &d, &f);
    return f[0] * fabs(w[2] / p->wi[2]);
}

static void smooth_visit(const struct kind_case *c, void *payload)
{
    const struct imp_bsdf *b = &c->bsdf;
    double apart = 0;
    struct tap_stat z2 = {0};
    (void)payload;
    if (!(b->flags & IMP_BSDF_SMOOTH) || (b->flags & IMP_BSDF_DELTA)) return;
    if (b->flags & IMP_BSDF_TURNED) return; /* refused */
    /* Lambert drawn from a narrow lobe: the tails are too heavy for a z-test. */
    if (kind_has_config(c, "sampling=phong")) return;
    /* Two-sided glass: seen from behind another material, which does not draw what comes
     * through the one in front. */
    if (strcmp(c->kind, "twosided") == 0 && b->flags & IMP_BSDF_TRANSMIT) return;
    for (int i = 0; i < 6; i++) {
        imp_spec in[IMP_INPUTS_MAX];
        kind_inputs(b, KIND_RANDOM, 300 + (uint64_t)i, in);
        struct point p = {b, in, kind_direction(i, 77)};
        const double whole =
            imp__sphere_integral(kernel, &p, -1, 1, 1e-5,
                                 kind_steps(c) ? IMP_SPHERE_STEPS : IMP_SPHERE_SMOOTH);
        struct tap_stat mc = {0};
        for (uint32_t n = 0; n < SAMPLES; n++) {
            const struct imp_key key = imp__key(78, (uint64_t)i, n);
            const double u[3] = {imp__u01(key, 0), imp__u01(key, 1), imp__u01(key, 2)};
            struct imp_dirs d = {.wi = p.wi, .lobe = IMP_SMOOTH};
            imp_spec f = {0}, bare;
            double pdf = 1;
            if (imp__bsdf_transposed_sample(b, in, u, &d)) {
                pdf = imp__bsdf_transposed_pdf(b, in, &d);
                imp__bsdf_transposed(b, in, &d, &f);
                imp__bsdf_value(b, in, &d, &bare);
                apart = fmax(apart, fabs(bare[0] * fabs(d.wo[2]) - f[0]));
            }
            tap_add(&mc, pdf > 0 ? f[0] / pdf : 0);
        }
        /* f cos_o/p is the same number for every draw of Lambert's. */
        if (tap_se(&mc) > 1e-9) tap_add(&z2, pow((mc.mean - whole) / tap_se(&mc), 2));
        else
            tap_ok(fabs(mc.mean - whole) < 1e-4, "%s: no noise # %g %g", c->label,
                   mc.mean, whole);
    }
    /* The mean of up to six squared z: above 3.8 once in 1e4. */
    tap_ok(z2.n == 0 || z2.mean < 3.8, "%s: from the lights # mean z^2 %.2f of %d",
           c->label, z2.mean, (int)z2.n);
    tap_ok(apart < 1e-12, "%s: value and cosine apart # %.1e", c->label, apart);
}

/* With white tints all power goes on; radiance is divided by the squared index ratio. */
static void dielectrics(const struct kind_case *c, void *payload)
{
    const struct imp_bsdf *b = &c->bsdf;
    double lost = 0, radiance = 0;
    int refracted = 0;
    (void)payload;
    if (strcmp(c->kind, "dielectric") != 0) return;
    for (int i = 0; i < 400; i++) {
        const double eta = 0.6 + 0.003 * i;
        const imp_spec in[3] = {imp__spec(1), imp__spec(1), imp__spec(eta)};
        double power = 0;
        for (int lobe = 0; lobe < 2; lobe++) {
            const double u[3] = {lobe ? 1 - 1e-15 : 0, 0.5, 0.5};
            struct imp_dirs d = {.wi = kind_direction(i, 79), .lobe = IMP_SMOOTH};
            imp_spec f, r;
            if (!imp__bsdf_transposed_sample(b, in, u, &d) || d.lobe != lobe) continue;
            imp__bsdf_transposed(b, in, &d, &f);
            b->ops->eval(b, in, &d, &r);
            power += f[0];
            if (lobe == 0) continue;
            /* Index on the side of wi over that on the side of wo. */
            const double ratio = d.wi[2] > 0 ? 1 / eta : eta;
            radiance = fmax(radiance, fabs(r[0] * ratio * ratio - f[0]));
            refracted++;
        }
        lost = fmax(lost, fabs(power - 1));
    }
    tap_ok(refracted > 200 && lost < 1e-12, "%s: all power goes on # %.1e, %d", c->label,
           lost, refracted);
    tap_ok(radiance < 1e-12, "%s: radiance over n^2 # %.1e", c->label, radiance);
}

int main(void)
{
    struct kind_factory f;
    if (imp_context_create(NULL, &f.ctx) != IMP_OK) return 99;
    imp__arena_init(&f.arena, f.ctx);
    kinds_visit(&f, smooth_visit, NULL);
    kinds_visit(&f, dielectrics, NULL);
    imp__arena_free(&f.arena);
    imp_context_destroy(f.ctx);
    return tap_done();
}
