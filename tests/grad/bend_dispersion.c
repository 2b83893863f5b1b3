/* SPDX-License-Identifier: Apache-2.0
 *
 * Several wavelengths in one problem: Schott's N-BK7 from its published coefficients,
 * optical paths through a block in closed form, the gradient of a problem of three
 * colours against differences, and what is refused. */
#include "bend_kit.h"
#include <math.h>
#include <string.h>

/* Schott, optical glass data sheets, N-BK7 (2014): Sellmeier coefficients, n_d, n_F, n_C.
 */
static const struct imp_dispersion bk7 = {
    sizeof bk7,
    IMP_SELLMEIER,
    {1.03961212, 0.231792344, 1.01046945, 0.00600069867, 0.0200179144, 103.560653},
    0.5875618};
static const double um[3] = {0.4861327, 0.5875618, 0.6562725},
                    published[3] = {1.52238, 1.51680, 1.51432};

static const char head[] =
    "<scene version='3.0.0'><medium type='graded'>"
    "<volume type='grid'><integer name='cells' value='5'/>"
    "<volume name='start' type='plume'><float name='n0' value='1.4'/>"
    "<float name='b' value='0.1'/><float name='width' value='0.6'/></volume></volume>";
static const char rays[] =
    "<surface type='plane'><float name='offset' value='0.9'/></surface></medium>"
    "<rays type='beam'><integer name='count' value='60'/><float name='radius' "
    "value='0.6'/><float name='start' value='-0.9'/><string name='wavelengths' "
    "value='%s'/></rays><target type='focus'><float name='plane' value='3'/>"
    "<vector name='point' value='0 0 3'/></target></scene>";

static enum imp_status load(const char *medium, const char *wavelengths, imp_bend **b)
{
    char xml[4096];
    const int n = snprintf(xml, sizeof xml, "%s%s", head, medium);
    snprintf(xml + n, sizeof xml - (size_t)n, rays, wavelengths);
    return imp_bend_load_string(kit_ctx, xml, strlen(xml), "d.xml", NULL, b);
}

int main(void)
{
    kit_begin(2);
    double worst = 0;
    for (int k = 0; k < 3; k++)
        worst = fmax(worst, fabs(imp_dispersion_index(&bk7, um[k]) - published[k]));
    const double F = imp_dispersion_index(&bk7, um[0]),
                 d = imp_dispersion_index(&bk7, um[1]),
                 C = imp_dispersion_index(&bk7, um[2]);
    tap_ok(worst < 6e-6 && fabs((d - 1) / (F - C) - 64.17) < 0.01,
           "N-BK7: indices and Abbe number as published # %.1e, %.3f", worst,
           (d - 1) / (F - C));

    /* A block of that glass, 2 thick: optical path 2 n(l). */
    const double p[4] = {d, 0, 0, 0};
    const double x[1][3] = {{0, 0, -1}}, dir[1][3] = {{0, 0, 1}};
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    struct imp_bend_exit e[3];
    struct imp_bend_stats stats = IMP_BEND_STATS_INIT;
    imp_bend *b;
    s.offset = 1, o.surfaces = &s, o.n_surfaces = 1, o.step = 0.1;
    KIT_CHECK(imp_bend_create(kit_ctx, kit_profile("constant", p, NULL), &b));
    KIT_CHECK(imp_bend_set_options(b, &o));
    worst = 0;
    for (int k = 0; k < 3; k++) {
        int bundle;
        KIT_CHECK(imp_bend_add_rays(b, 1, x, dir, NULL, &bundle));
        KIT_CHECK(imp_bend_set_wavelength(b, bundle, &bk7, um[k]));
    }
    KIT_CHECK(imp_bend_run(b, e, NULL, &stats));
    for (int k = 0; k < 3; k++)
        worst = fmax(worst, fabs(e[k].path - 2 * imp_dispersion_index(&bk7, um[k])));
    tap_ok(worst < 1e-14 && stats.rays == 3 && stats.traced == 3,
           "optical path of a block in three colours # %.1e", worst);
    double(*points)[4];
    size_t n_points;
    KIT_CHECK(imp_bend_ray(b, 0, &points, &n_points));
    tap_near(points[n_points - 1][3], 2 * F, 0, 1e-14, "a ray drawn has its colour");
    imp_free(kit_ctx, points);
    struct imp_dispersion bad = bk7;
    bad.coefficient[0] = -3;
    tap_ok(imp_bend_set_wavelength(b, 0, &bad, 0.5) == IMP_E_ARG &&
               imp_bend_set_wavelength(b, 0, &bk7, 0.0774) == IMP_E_ARG &&
               imp_bend_set_wavelength(b, 3, &bk7, 0.5) == IMP_E_ARG,
           "no index there, no such bundle # %s", imp_last_error(kit_ctx));
    imp_bend_destroy(b);

    /* Three colours at once: gradient, and the checks that the command prints. */
    const char *cauchy = "<vector name='cauchy' value='1.5 0.02 0.0003'/>";
    KIT_CHECK(load(cauchy, "0.45 0.5875618 0.7", &b));
    const size_t n = imp_field_n_theta(imp_bend_field(b));
    double *theta = malloc(3 * n * sizeof *theta), *g = theta + n, *moved = g + n;
    double value, f[2], want = 0;
    const double eps = 1e-5;
    imp_field_get_theta(imp_bend_field(b), theta);
    KIT_CHECK(imp_bend_objective(b, &value, g, NULL, NULL));
    for (size_t k = 0; k < n; k++) want += g[k] * kit_pm(1, k);
    for (int side = 0; side < 2; side++) {
        for (size_t k = 0; k < n; k++)
            moved[k] = theta[k] + (side ? -eps : eps) * kit_pm(1, k);
        KIT_CHECK(imp_field_set_theta(imp_bend_field(b), moved));
        KIT_CHECK(imp_bend_objective(b, &f[side], NULL, NULL, NULL));
    }
    tap_ok(fabs((f[0] - f[1]) / (2 * eps) / want - 1) < 1e-6,
           "gradient of three colours is the difference # %.10g %.10g", want,
           (f[0] - f[1]) / (2 * eps));
    KIT_CHECK(imp_field_set_theta(imp_bend_field(b), theta));
    const struct imp_check_row *rows;
    size_t n_rows;
    bool ok = true;
    KIT_CHECK(imp_bend_check(b, &rows, &n_rows));
    for (size_t k = 0; k < n_rows; k++) {
        ok = ok && rows[k].ok;
        if (!strcmp(rows[k].method, "dot"))
            tap_ok(rows[k].error < 1e-12, "dot test over colours # %.1e", rows[k].error);
    }
    tap_ok(ok, "importon bend check: all rows");
    /* Each colour by itself gives a third of the sum. */
    double sum = 0;
    static const char *const alone[] = {"0.45", "0.5875618", "0.7"};
    for (int k = 0; k < 3; k++) {
        imp_bend *one;
        double v;
        KIT_CHECK(load(cauchy, alone[k], &one));
        KIT_CHECK(imp_bend_objective(one, &v, NULL, NULL, NULL));
        sum += v / 3;
        imp_bend_destroy(one);
    }
    tap_near(sum, value, 0, 1e-13 * value, "the mean of the colours one by one");
    struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r = {.size = sizeof r};
    fo.iterations[0] = 30;
    KIT_CHECK(imp_bend_fit(b, &fo, &r));
    tap_ok(r.value < 0.1 * r.start, "a fit of three colours # %.2e -> %.2e", r.start,
           r.value);
    free(theta);
    imp_bend_destroy(b);

    tap_ok(load("", "0.5", &b) == IMP_E_SCENE, "no dispersion # %s",
           imp_last_error(kit_ctx));
    tap_ok(load(cauchy, "0.5 red", &b) == IMP_E_SCENE, "no number # %s",
           imp_last_error(kit_ctx));
    tap_ok(load(cauchy, "", &b) == IMP_E_SCENE, "no wavelength # %s",
           imp_last_error(kit_ctx));
    tap_ok(load(cauchy, "-0.5", &b) == IMP_E_SCENE, "negative # %s",
           imp_last_error(kit_ctx));
    tap_ok(load("<vector name='cauchy' value='0.5 0 0'/>", "0.5", &b) == IMP_OK,
           "an index below 1 has its factor, too");
    imp_bend_destroy(b);
    tap_ok(load("<vector name='cauchy' value='1 0 0'/>", "0.5", &b) == IMP_E_SCENE,
           "vacuum has none # %s", imp_last_error(kit_ctx));
    imp_context_destroy(kit_ctx);
    return tap_done();
}
