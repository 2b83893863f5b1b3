/* SPDX-License-Identifier: Apache-2.0
 *
 * Stam's Figure 6, walk by walk (docs/estimators.md 2.3, T1 and T2): on 1000 recorded
 * walks the adjoint of all seven controls against central differences and against dual
 * numbers of this test's own evaluation, and the identities that need no difference at
 * all. */
#include "stam_walks.h"

struct worst {
    double value, density, difference, dual, emission, m2, m3;
    int walks, scatterings;
};

static void keep(double *worst, double error)
{
    if (!(error <= *worst)) *worst = error; /* NaN stays */
}

/* |a - b| in units of b, and of size where b is smaller: the exponent's score is a
 * difference of two terms of about 1/theta, which may cancel. */
static double off(double a, double b, double size)
{
    return a == b ? 0 : fabs(a - b) / fmax(fabs(b), size);
}

static void one(struct stam *s, const struct imp_walk *w, enum stam_variant variant,
                enum stam_sampling sampling, struct worst *worst)
{
    int n2, n3;
    double g[N_CONTROLS];
    const double *t = s->theta, L = w->L[0];
    const struct dual own = stam_value(w, variant, s->absorb, t, &n2, &n3);
    stam_gradient(s, w, 1, g);
    keep(&worst->value, off(L, own.v, 0));

    for (const struct imp_vertex *v = w->first; v && v->next; v = v->next) {
        const struct imp_dirs dirs = imp__vertex_dirs(v);
        const double p = stam_is(v, "sphere") ? stam_m2_pdf(&dirs, sampling, t[EXPONENT])
                                              : v->d.wi[2] / M_PI;
        keep(&worst->density, off(1 / v->scale[0], p * (1 - s->absorb), 0));
    }
    for (int k = 0; k < N_CONTROLS; k++) {
        const double h = 1e-5 * t[k], size = k == EXPONENT ? .1 * n2 * L / t[k] : 0;
        double up[N_CONTROLS], down[N_CONTROLS];
        int n;
        memcpy(up, t, sizeof up);
        memcpy(down, t, sizeof down);
        up[k] += h;
        down[k] -= h;
        const double fd = (stam_value(w, variant, s->absorb, up, &n, &n).v -
                           stam_value(w, variant, s->absorb, down, &n, &n).v) /
                          (up[k] - down[k]);
        /* Differences know nothing below rounding of L: 1e-16 L/h is 1e-11 L/theta. */
        keep(&worst->difference, off(g[k], fd, 1e-3 * L / t[k]));
        keep(&worst->dual, off(g[k], own.d[k], size));
    }
    keep(&worst->emission, off(t[EMISSION] * g[EMISSION] + t[AMBIENT2] * g[AMBIENT2] +
                                   t[AMBIENT3] * g[AMBIENT3],
                               L, 0));
    keep(&worst->m2,
         off(t[DIFFUSE2] * g[DIFFUSE2] + t[SPECULAR] * g[SPECULAR], n2 * L, L));
    keep(&worst->m3, off(t[DIFFUSE3] * g[DIFFUSE3], n3 * L, L));
    worst->walks++;
    worst->scatterings = n2 + n3 > worst->scatterings ? n2 + n3 : worst->scatterings;
}

static void paths(imp_context *ctx, const char *variant, const char *sampling, int which,
                  int how)
{
    char defines[128], what[96];
    struct worst worst = {0};
    snprintf(defines, sizeof defines, "variant=%s sampling=%s", variant, sampling);
    snprintf(what, sizeof what, "%s, %s", variant, sampling);
    struct stam s = stam_walks(ctx, test_scene(ctx, "stam.xml", IMP_MONO, defines), 6);
    for (int64_t k = 0; worst.walks < 1000; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&s.arena);
        const struct imp_walk w = stam_trace(&s, (int)(k % 32), (int)(k / 32 % 32), k);
        if (w.L[0] > 0)
            one(&s, &w, (enum stam_variant)which, (enum stam_sampling)how, &worst);
        imp__arena_rewind(&s.arena, mark);
    }
    tap_ok(worst.value <= 1e-13, "%s: L is the product written out # worst %.1e", what,
           worst.value);
    /* p and s are stored as floats: half a unit of 2^-24 each. */
    tap_ok(worst.density <= 0x1.1p-23, "%s: densities # worst %.1e", what, worst.density);
    tap_ok(worst.difference <= 1e-6,
           "%s: adjoint and central differences, h = 1e-5 theta # worst of %d walks %.1e",
           what, worst.walks, worst.difference);
    tap_ok(worst.dual <= 1e-12, "%s: adjoint and dual numbers # worst %.1e", what,
           worst.dual);
    tap_ok(worst.emission <= 2e-15, "%s: th1 d1 + th2 d2 + th6 d6 = L # worst %.1e", what,
           worst.emission);
    tap_ok(worst.m2 <= 2e-15, "%s: th3 d3 + th4 d4 = n_M2 L # worst %.1e", what,
           worst.m2);
    tap_ok(worst.m3 <= 2e-15, "%s: th7 d7 = n_M3 L # worst %.1e, up to %d scatterings",
           what, worst.m3, worst.scatterings);
    stam_close(&s);
}

/* With Stam's derivative of the exponent the same comparison must fail, and only there.
 */
static void paper(imp_context *ctx)
{
    struct stam s = stam_walks(
        ctx, test_scene(ctx, "stam.xml", IMP_MONO, "variant=paper alpha_gradient=paper"),
        6);
    double worst[N_CONTROLS] = {0};
    int wrong_sign = 0, walks = 0;
    for (int64_t k = 0; walks < 1000; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&s.arena);
        const struct imp_walk w = stam_trace(&s, (int)(k % 32), (int)(k / 32 % 32), k);
        double g[N_CONTROLS];
        int n2, n3;
        if (w.L[0] > 0) {
            const struct dual own =
                stam_value(&w, STAM_PAPER, s.absorb, s.theta, &n2, &n3);
            stam_gradient(&s, &w, 1, g);
            for (int c = 0; c < N_CONTROLS; c++)
                keep(&worst[c], off(g[c], own.d[c],
                                    c == EXPONENT ? .1 * n2 * w.L[0] / s.theta[c] : 0));
            wrong_sign += g[EXPONENT] * own.d[EXPONENT] < 0;
            walks++;
        }
        imp__arena_rewind(&s.arena, mark);
    }
    for (int c = 0; c < N_CONTROLS; c++)
        tap_ok(c == EXPONENT ? worst[c] > 1 : worst[c] <= 1e-12,
               "Stam's App. C (E9): %s %s # worst %.1e", control_name[c],
               c == EXPONENT ? "is caught" : "is not concerned", worst[c]);
    tap_ok(wrong_sign > 100, "Stam's App. C (E9): sign # wrong on %d of %d walks",
           wrong_sign, walks);
    stam_close(&s);
}

int main(void)
{
    static const char *const variants[] = {"reciprocal", "microfacet", "paper"};
    static const char *const samplings[] = {"mixture", "cosine", "phong"};
    imp_context *ctx = test_context(1);
    for (int v = 0; v < 3; v++)
        for (int q = 0; q < 3; q++) paths(ctx, variants[v], samplings[q], v, q);
    paper(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
