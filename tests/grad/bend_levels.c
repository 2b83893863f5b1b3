/* SPDX-License-Identifier: Apache-2.0
 *
 * What an optimiser learnt goes along when the grid is refined: prolonged changes keep
 * the curvature seen, Adam's step is the refined step, and a fit by L-BFGS gets further
 * in the same number of iterations than one that begins anew. */
#include "bend/lbfgs.h"
#include "bend_kit.h"
#include <math.h>

enum { DEFAULT = -1 }; /* the optimiser of IMP_BEND_FIT_OPTIONS_INIT */

/* Two levels of the lens of scenes/bend/focus.xml, `second` iterations on the second. */
static double fit(int kind, int carry, int first, int second)
{
    struct imp_bend_fit_options o = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r = {.size = sizeof r};
    imp_bend *b;
    KIT_CHECK(imp_bend_load(kit_ctx, IMP_SCENES "/bend/focus.xml", NULL, &b));
    if (kind != DEFAULT) o.optimizer = (enum imp_optimizer)kind;
    o.carry = carry;
    o.levels = 2;
    o.iterations[0] = first, o.iterations[1] = second;
    KIT_CHECK(imp_bend_fit(b, &o, &r));
    imp_bend_destroy(b);
    return r.value;
}

/* Variables are cells + 3 coefficients of a grid, all active. */
static enum imp_status prolong(const double *in, double *out, void *payload)
{
    return imp__grid_prolong(payload, in, out);
}
static enum imp_status half_norm(const double *x, uint64_t seed, struct imp_estimate *e,
                                 double *g, double *g_se, void *payload)
{
    const struct imp__goal *goal = payload;
    double f = 0;
    (void)seed, (void)g_se;
    for (size_t k = 0; k < goal->n; k++) {
        const double w = 1 + (double)(k % 7);
        f += w * x[k] * x[k] / 2;
        if (g) g[k] = w * x[k];
    }
    *e = (struct imp_estimate){.value = f, .se = 0};
    return IMP_OK;
}
static double dot(size_t n, const double *a, const double *b)
{
    double s = 0;
    for (size_t k = 0; k < n; k++) s += a[k] * b[k];
    return s;
}

static void curvature(void)
{
    imp_field *f = kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 4, 1, 0.1), *fine;
    KIT_CHECK(imp_field_refine(f, &fine));
    double *lo[2], *hi[2], *scale[2], *x[2];
    struct imp__goal goal[2];
    struct imp__search *s[2];
    const struct imp__opt_options options = {5, 0.05, 1e-9, 0, false};
    for (int k = 0; k < 2; k++) {
        const size_t n = (k ? fine : f)->n_theta;
        lo[k] = malloc(n * sizeof(double)), hi[k] = malloc(n * sizeof(double));
        scale[k] = malloc(n * sizeof(double)), x[k] = malloc(n * sizeof(double));
        for (size_t i = 0; i < n; i++)
            lo[k][i] = -10, hi[k][i] = 10, scale[k][i] = 1, x[k][i] = kit_pm(5, i);
        goal[k] = (struct imp__goal){.ctx = kit_ctx,
                                     .n = n,
                                     .lo = lo[k],
                                     .hi = hi[k],
                                     .scale = scale[k],
                                     .eval = half_norm,
                                     .payload = &goal[k]};
        KIT_CHECK(imp__search_create(&goal[k], IMP_LBFGS, &options, x[k], &s[k]));
    }
    KIT_CHECK(imp__lbfgs(&goal[0], &options, NULL, s[0]));
    const struct imp__carry carry = {prolong, f, 1.0 / 8};
    KIT_CHECK(imp__lbfgs_carry(s[0], &carry, s[1]));
    /* Arrays 0 and 1: s and y; scalar 0: pairs. */
    const int pairs = (int)s[0]->scalar[0];
    double worst = 0, step = 0;
    double *fine_s = malloc(goal[1].n * sizeof(double));
    for (int i = 0; i < pairs; i++) {
        const size_t a = (size_t)i * goal[0].n, b = (size_t)i * goal[1].n;
        const double was = dot(goal[0].n, s[0]->array[0] + a, s[0]->array[1] + a);
        const double is = dot(goal[1].n, s[1]->array[0] + b, s[1]->array[1] + b);
        worst = fmax(worst, fabs(is / was - 1));
        KIT_CHECK(imp__grid_prolong(f, s[0]->array[0] + a, fine_s));
        for (size_t k = 0; k < goal[1].n; k++)
            step = fmax(step, fabs(fine_s[k] - s[1]->array[0][b + k]));
    }
    tap_ok(pairs >= 4 && (int)s[1]->scalar[0] == pairs, "all %d pairs are carried",
           pairs);
    tap_ok(worst < 1e-13 && step == 0, "curvature s.y is kept, s is refined # %.1e %.1e",
           worst, step);
    for (int k = 0; k < 2; k++) {
        imp__search_destroy(s[k]);
        free(lo[k]), free(hi[k]), free(scale[k]), free(x[k]);
    }
    free(fine_s);
    imp_field_destroy(f), imp_field_destroy(fine);
}

/* Moments of a constant gradient: a step of the same length on the fine grid. */
static void moments(void)
{
    imp_field *f = kit_grid(IMP_FIELD_TRILINEAR, IMP_FIELD_ETA, 3, 1, 0.1), *fine;
    KIT_CHECK(imp_field_refine(f, &fine));
    const size_t n[2] = {f->n_theta, fine->n_theta};
    double *a = calloc(6 * n[1], sizeof *a), *lo = a, *hi = a + n[1],
           *scale = a + 2 * n[1];
    struct imp__search *s[2];
    for (size_t i = 0; i < n[1]; i++) lo[i] = -10, hi[i] = 10, scale[i] = 1;
    const struct imp__opt_options options = {1, 0.05, 1e-9, 0, false};
    for (int k = 0; k < 2; k++) {
        const struct imp__goal goal = {
            .ctx = kit_ctx, .n = n[k], .lo = lo, .hi = hi, .scale = scale};
        KIT_CHECK(imp__search_create(&goal, IMP_ADAM, &options, a + 3 * n[1], &s[k]));
    }
    for (size_t i = 0; i < n[0]; i++) s[0]->array[0][i] = 0.8, s[0]->array[1][i] = 4;
    KIT_CHECK(imp__search_carry(s[0], &(struct imp__carry){prolong, f, 1.0 / 8}, s[1]));
    double worst = 0;
    for (size_t i = 0; i < n[1]; i++)
        worst = fmax(worst, fmax(fabs(s[1]->array[0][i] - 0.1),
                                 fabs(s[1]->array[1][i] - 4.0 / 64)));
    tap_ok(worst < 1e-15, "moments of a fine number are 1/8, 1/64 # %.1e", worst);
    imp__search_destroy(s[0]), imp__search_destroy(s[1]);
    imp_field_destroy(f), imp_field_destroy(fine);
    free(a);
}

int main(void)
{
    kit_begin(2);
    curvature();
    moments();
    const double l0 = fit(IMP_LBFGS, 0, 20, 10), l1 = fit(IMP_LBFGS, -1, 20, 10);
    tap_ok(l0 < 0.8 * l1, "L-BFGS carries its pairs # %.2e, anew %.2e", l0, l1);
    tap_ok(l0 == fit(IMP_LBFGS, 1, 20, 10), "as when asked to");
    tap_ok(l0 == fit(DEFAULT, 0, 20, 10), "and L-BFGS is what nobody has to choose");
    const double a0 = fit(IMP_ADAM, 0, 20, 10), a1 = fit(IMP_ADAM, 1, 20, 10);
    tap_ok(a0 == fit(IMP_ADAM, -1, 20, 10), "Adam begins anew # %.2e", a0);
    tap_ok(a1 != a0 && a1 < 0.01, "Adam with its moments, if asked # %.2e", a1);
    const double m1 = fit(IMP_MMA, 1, 5, 3), m0 = fit(IMP_MMA, -1, 5, 3);
    tap_ok(m1 == m0, "MMA keeps nothing: the same # %.3e", m1);
    imp_context_destroy(kit_ctx);
    return tap_done();
}
