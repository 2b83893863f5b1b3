/* SPDX-License-Identifier: Apache-2.0
 *
 * Every field kind: gradient and Hessian against central differences, splat as the
 * transpose of the tangent (and of the value, for kinds that are linear), sums, samples,
 * levels. */
#include "bend_kit.h"
/* No name of bent rays clashes with one of these. */
#include "elements/elements.h"
#include "kind/shape/shape.h"

static void check_kind(int kind)
{
    const char *name;
    imp_field *f = kit_field(kind, &name);
    const size_t n = imp_field_n_theta(f);
    double *dot = calloc(n, sizeof *dot), *bar = calloc(n, sizeof *bar);
    double *theta = calloc(n, sizeof *theta), *moved = calloc(n, sizeof *moved);
    double worst_g = 0, worst_h = 0, worst_t = 0, worst_d = 0;
    imp_field_get_theta(f, theta);
    for (int p = 0; p < 40; p++) {
        double x[3], eta, g[3], h[6], b[3], eta_dot, g_dot[3];
        for (int k = 0; k < 3; k++)
            x[k] = 0.7 * kit_pm(10 + k, p), b[k] = kit_pm(20 + k, p);
        const double a = kit_pm(30, p);
        imp_field_eval(f, x, &eta, g, h);
        const double full[3][3] = {
            {h[0], h[3], h[4]}, {h[3], h[1], h[5]}, {h[4], h[5], h[2]}};
        for (int k = 0; k < 3; k++) {
            const double e = 1e-6;
            double xp[3] = {x[0], x[1], x[2]}, xm[3] = {x[0], x[1], x[2]}, ep, em, gp[3],
                   gm[3];
            xp[k] += e, xm[k] -= e;
            imp_field_eval(f, xp, &ep, gp, NULL);
            imp_field_eval(f, xm, &em, gm, NULL);
            worst_g = fmax(worst_g, fabs((ep - em) / (2 * e) - g[k]));
            for (int m = 0; m < 3; m++)
                worst_h = fmax(worst_h, fabs((gp[m] - gm[m]) / (2 * e) - full[m][k]));
        }
        for (size_t i = 0; i < n; i++) dot[i] = kit_pm(40 + p, i);
        memset(bar, 0, n * sizeof *bar);
        imp_field_splat(f, x, a, b, bar);
        imp_field_tangent(f, x, dot, &eta_dot, g_dot);
        double left = 0, right = a * eta_dot, scale = fabs(a * eta_dot);
        for (size_t i = 0; i < n; i++)
            left += bar[i] * dot[i], scale += fabs(bar[i] * dot[i]);
        for (int k = 0; k < 3; k++) right += b[k] * g_dot[k];
        worst_t = fmax(worst_t, fabs(left - right) / scale);

        const double e = 1e-6; /* the tangent itself, against a difference */
        double ep, em, gp[3], gm[3];
        for (size_t i = 0; i < n; i++) moved[i] = theta[i] + e * dot[i];
        KIT_CHECK(imp_field_set_theta(f, moved));
        imp_field_eval(f, x, &ep, gp, NULL);
        for (size_t i = 0; i < n; i++) moved[i] = theta[i] - e * dot[i];
        KIT_CHECK(imp_field_set_theta(f, moved));
        imp_field_eval(f, x, &em, gm, NULL);
        KIT_CHECK(imp_field_set_theta(f, theta));
        worst_d = fmax(worst_d, fabs((ep - em) / (2 * e) - eta_dot));
        for (int k = 0; k < 3; k++)
            worst_d = fmax(worst_d, fabs((gp[k] - gm[k]) / (2 * e) - g_dot[k]));
    }
    tap_ok(worst_g < 2e-9, "%s: gradient is the difference # worst %.1e", name, worst_g);
    tap_ok(worst_h < 2e-8, "%s: Hessian is the difference # worst %.1e", name, worst_h);
    tap_ok(worst_t < 1e-12, "%s: <splat, dot> = <bar, tangent> # worst %.1e", name,
           worst_t);
    tap_ok(worst_d < 1e-7, "%s: tangent is the difference # worst %.1e", name, worst_d);
    free(dot), free(bar), free(theta), free(moved);
    imp_field_destroy(f);
}

static void check_linear(enum imp_field_interp interp)
{
    imp_field *f = kit_grid(interp, IMP_FIELD_ETA, 5, 0.9, 0.2);
    const size_t n = imp_field_n_theta(f);
    double *theta = calloc(n, sizeof *theta), *bar = calloc(n, sizeof *bar), worst = 0;
    imp_field_get_theta(f, theta);
    for (int p = 0; p < 200; p++) {
        double x[3], b[3], eta, g[3], sum = 0, scale = 0;
        for (int k = 0; k < 3; k++)
            x[k] = 0.9 * kit_pm(50 + k, p), b[k] = kit_pm(60 + k, p);
        memset(bar, 0, n * sizeof *bar);
        imp_field_splat(f, x, 0.7, b, bar);
        imp_field_eval(f, x, &eta, g, NULL);
        for (size_t i = 0; i < n; i++)
            sum += bar[i] * theta[i], scale += fabs(bar[i] * theta[i]);
        worst = fmax(worst,
                     fabs(sum - (0.7 * eta + b[0] * g[0] + b[1] * g[1] + b[2] * g[2])) /
                         scale);
    }
    tap_ok(worst < 1e-14, "%s: <splat(a, b), theta> = a eta + b.g, h != 1 # worst %.1e",
           imp_field_kind(f), worst);
    free(theta), free(bar);
    imp_field_destroy(f);
}

static void check_samples(enum imp_field_interp interp)
{
    imp_field *f = kit_grid(interp, IMP_FIELD_ETA, 6, 1, 0), *fine = NULL;
    struct imp_field_grid d = {.size = sizeof d};
    KIT_CHECK(imp_field_get_grid(f, &d));
    const int m[3] = {d.cells[0] + 1, d.cells[1] + 1, d.cells[2] + 1};
    const size_t n_s = (size_t)m[0] * m[1] * m[2], n = imp_field_n_theta(f);
    double *s = calloc(n_s, sizeof *s), *s2 = calloc(n_s, sizeof *s2);
    double *sb = calloc(n_s, sizeof *sb), *tb = calloc(n, sizeof *tb),
           *th = calloc(n, sizeof *th);
    double worst = 0;
    for (size_t i = 0; i < n_s; i++)
        s[i] = 1.2 + 0.1 * kit_u(70, i), s2[i] = 1 + kit_u(71, i);
    KIT_CHECK(imp_field_set_samples(f, s));
    for (int k = 0; k < m[2]; k++)
        for (int j = 0; j < m[1]; j++)
            for (int i = 0; i < m[0]; i++) {
                const int at[3] = {i, j, k};
                double x[3], eta;
                for (int a = 0; a < 3; a++)
                    x[a] = d.lo[a] + (d.hi[a] - d.lo[a]) * at[a] / d.cells[a];
                imp_field_eval(f, x, &eta, NULL, NULL);
                worst = fmax(worst, fabs(eta - s[i + m[0] * (j + (size_t)m[1] * k)]));
            }
    tap_ok(worst < 1e-14, "%s: passes through the samples # worst %.1e",
           imp_field_kind(f), worst);

    for (size_t i = 0; i < n; i++) tb[i] = kit_pm(72, i);
    KIT_CHECK(imp_field_samples_vjp(f, tb, sb));
    KIT_CHECK(imp_field_set_samples(f, s2));
    imp_field_get_theta(f, th);
    double left = 0, right = 0;
    for (size_t i = 0; i < n; i++) left += tb[i] * th[i];
    for (size_t i = 0; i < n_s; i++) right += sb[i] * s2[i];
    tap_near(left, right, 0, 1e-11, "samples: transpose");

    KIT_CHECK(imp_field_refine(f, &fine));
    const size_t nf = imp_field_n_theta(fine);
    worst = 0;
    for (int p = 0; p < 300; p++) {
        double x[3], e1, e2, g1[3], g2[3], h1[6], h2[6];
        for (int k = 0; k < 3; k++)
            x[k] = d.lo[k] + (d.hi[k] - d.lo[k]) * kit_u(80 + k, p);
        imp_field_eval(f, x, &e1, g1, h1);
        imp_field_eval(fine, x, &e2, g2, h2);
        worst = fmax(worst, fabs(e1 - e2));
        for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(g1[k] - g2[k]));
    }
    tap_ok(worst < 1e-13, "%s: refined, the same function # worst %.1e",
           imp_field_kind(f), worst);
    double *fb = calloc(nf, sizeof *fb), *ft = calloc(nf, sizeof *ft);
    for (size_t i = 0; i < nf; i++) fb[i] = kit_pm(90, i);
    KIT_CHECK(imp_field_refine_vjp(f, fb, tb));
    imp_field_get_theta(fine, ft);
    left = right = 0;
    for (size_t i = 0; i < nf; i++) left += fb[i] * ft[i];
    for (size_t i = 0; i < n; i++) right += tb[i] * th[i];
    tap_near(left, right, 0, 1e-11, "refinement: transpose is restriction");
    free(s), free(s2), free(sb), free(tb), free(th), free(fb), free(ft);
    imp_field_destroy(f);
    imp_field_destroy(fine);
}

static void check_refusals(void)
{
    struct imp_field_grid d = IMP_FIELD_GRID_INIT;
    imp_field *f = NULL;
    const double bad[5] = {NAN, 1, 0, 0, 0};
    tap_ok(imp_field_grid_create(kit_ctx, &d, 1, &f) == IMP_E_ARG, "no cells # %s",
           imp_last_error(kit_ctx));
    d.cells[0] = d.cells[1] = d.cells[2] = 8000;
    d.hi[0] = d.hi[1] = d.hi[2] = 1;
    tap_ok(imp_field_grid_create(kit_ctx, &d, 1, &f) == IMP_E_ARG, "absurd size # %s",
           imp_last_error(kit_ctx));
    d.cells[0] = d.cells[1] = d.cells[2] = 2;
    tap_ok(imp_field_grid_create(kit_ctx, &d, NAN, &f) == IMP_E_ARG, "index NaN # %s",
           imp_last_error(kit_ctx));
    tap_ok(imp_field_profile_create(kit_ctx, "maxwell", bad, NULL, &f) == IMP_E_ARG,
           "profile NaN # %s", imp_last_error(kit_ctx));
    tap_ok(imp_field_profile_create(kit_ctx, "lens", bad, NULL, &f) == IMP_E_ARG,
           "no such profile # %s", imp_last_error(kit_ctx));
    f = kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 2, 1, 0);
    double *t = calloc(imp_field_n_theta(f), sizeof *t), e0, e1;
    const double x[3] = {0.1, 0.2, 0.3};
    t[7] = NAN;
    imp_field_eval(f, x, &e0, NULL, NULL);
    const enum imp_status st = imp_field_set_theta(f, t);
    imp_field_eval(f, x, &e1, NULL, NULL);
    tap_ok(st == IMP_E_ARG && e0 == e1, "NaN coefficient refused, field unchanged");
    free(t);
    imp_field_destroy(f);
}

int main(void)
{
    kit_begin(1);
    const char *name;
    imp_field *f;
    for (int i = 0; (f = kit_field(i, &name)); i++) {
        imp_field_destroy(f);
        check_kind(i);
    }
    check_linear(IMP_FIELD_SPLINE);
    check_linear(IMP_FIELD_TRILINEAR);
    check_samples(IMP_FIELD_SPLINE);
    check_samples(IMP_FIELD_TRILINEAR);
    check_refusals();
    imp_context_destroy(kit_ctx);
    return tap_done();
}
