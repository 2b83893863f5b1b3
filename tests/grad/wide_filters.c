/* SPDX-License-Identifier: Apache-2.0
 *
 * Gauss-Newton and Levenberg-Marquardt through filters wider than a pixel: J^T J, J^T r
 * and their noise against many seeds and against derivative pictures with many samples,
 * and fits of a scene whose film has the format's default filter. */
#include "imp_tap.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/problem/problem.h"
#include "inverse_scenes.h"
#include <math.h>

enum { K = 4, SEEDS = 60 };

static const char room_xml[] =
    "<scene version='3.0.0'>"
    "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
    "<sensor type='perspective' id='camera'><float name='fov' value='50'/>"
    "  <transform name='to_world'><lookat origin='0,1,4' target='0,.4,0' up='0,1,0'/>"
    "  </transform>"
    "  <film type='hdrfilm'><integer name='width' value='24'/>"
    "    <integer name='height' value='16'/>%s</film></sensor>"
    "<bsdf type='diffuse' id='white'><rgb name='reflectance' value='.7'/></bsdf>"
    "<bsdf type='diffuse' id='red'><rgb name='reflectance' value='.6,.2,.1'/></bsdf>"
    "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/>"
    "  </transform><ref id='white'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><rotate y='1' angle='90'/>"
    "  <translate x='-1' y='1'/></transform><ref id='red'/></shape>"
    "<shape type='rectangle'><transform name='to_world'><scale value='.2'/>"
    "  <rotate x='1' angle='90'/><translate x='.2' y='2.2'/></transform>"
    "  <emitter type='area' id='lamp'><rgb name='radiance' value='9,7,5'/></emitter>"
    "</shape>"
    "<emitter type='constant' id='sky'><rgb name='radiance' value='.2'/></emitter>"
    "</scene>";
static const char *const filters[][2] = {
    {"gaussian (the default)", ""},
    {"tent", "<rfilter type='tent'><float name='radius' value='1.5'/></rfilter>"}};

static imp_context *ctx;

static imp_scene *room(int filter, enum imp_color_mode mode)
{
    char xml[4096];
    snprintf(xml, sizeof xml, room_xml, filters[filter][1]);
    return scene_open(ctx, xml, mode);
}

static imp_problem *problem(imp_scene *s, const struct imp_target *t)
{
    imp_problem *p = NULL;
    if (imp_problem_create(s, &p) != IMP_OK || imp_problem_activate(p, "*") != IMP_OK ||
        imp_problem_add_target(p, t) != IMP_OK)
        printf("Bail out! %s\n", imp_last_error(ctx));
    return p;
}

/* One number against the mean of many seeds. */
static void judge(const struct tap_stat *s, double reference, const char *what, int k,
                  int l)
{
    const double se = tap_se(s);
    const double z = (s->mean - reference) / se;
    tap_ok(fabs(z) < 4.5 && se < 0.1 * fabs(reference),
           "%s %d %d # mean %.5g se %.2g ref %.5g z %.2f", what, k, l, s->mean, se,
           reference, z);
}

/* Means over seeds of H and g against sums over pixels of derivative pictures; the
 * variance of g that is reported against the one that is seen. */
static void moments(int filter)
{
    imp_scene *s = room(filter, IMP_MONO);
    imp_film *film = NULL, *primal = NULL, *J[K] = {NULL};
    struct imp_target t = target_of(ctx, s, 0, 64, 3, &film);
    float *pixels = imp_film_mean(film);
    for (int i = 0; i < t.width * t.height; i++) pixels[i] *= 1.1f; /* a residual */
    imp_problem *p = problem(s, &t);
    struct imp_run run = IMP_RUN_INIT;
    double H[K * K], same[K * K], meas[K * K], g[K], se[K], C[K * K];
    struct imp__gauss_newton gn = {
        .H = H, .H_same = same, .H_meas = meas, .g = g, .g_se = se, .cov_g = C};
    struct tap_stat h_stat[K * K] = {{0}}, g_stat[K] = {{0}}, c_stat[K] = {{0}},
                               m_stat[K] = {{0}};
    bool fine = imp_problem_n_variables(p) == K;
    for (int seed = 0; fine && seed < SEEDS; seed++) {
        run.spp = 32;
        run.seed = 100 + (uint64_t)seed;
        fine = imp__gauss_newton(p, NULL, &run, &gn) == IMP_OK;
        for (int k = 0; k < K; k++) {
            tap_add(&g_stat[k], g[k]);
            tap_add(&c_stat[k], C[k * K + k]);
            tap_add(&m_stat[k], meas[k * K + k]);
            for (int l = 0; l <= k; l++) tap_add(&h_stat[k * K + l], H[k * K + l]);
        }
    }
    tap_ok(fine, "%s: normal equations # %s", filters[filter][0],
           fine ? "" : imp_last_error(ctx));
    run.spp = 1024;
    run.seed = 7;
    if (!fine || imp_problem_jacobian(p, &run, &primal, J) != IMP_OK) return;
    const float *I = imp_film_mean(primal);
    for (int k = 0; k < K; k++) {
        const float *a = imp_film_mean(J[k]);
        double gk = 0;
        for (int i = 0; i < t.width * t.height; i++)
            gk += ((double)I[i] - t.pixels[i]) * a[i];
        judge(&g_stat[k], gk, "J^T r", k, 0);
        for (int l = 0; l <= k; l++) {
            const float *b = imp_film_mean(J[l]);
            double h = 0;
            for (int i = 0; i < t.width * t.height; i++) h += (double)a[i] * b[i];
            judge(&h_stat[k * K + l], h, "J^T J", k, l);
        }
        /* a variance from 60 numbers is known to 18 % */
        const double ratio = c_stat[k].mean / (g_stat[k].m2 / (SEEDS - 1));
        tap_ok(ratio > 0.5 && ratio < 2.2, "variance of J^T r %d # reported/seen %.2f", k,
               ratio);
    }
    for (int k = 0; k < K; k++) imp_film_destroy(J[k]);
    imp_film_destroy(primal);
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* LM finds the way back; over several targets the errors are those promised, with the
 * noise of the targets given and without. */
static void fits(int filter, enum imp_color_mode mode, int noise_given)
{
    imp_scene *s = room(filter, mode);
    struct tap_stat z2 = {0};
    int iterations = 0;
    for (int seed = 0; seed < 6; seed++) {
        imp_film *film = NULL;
        struct imp_target t = target_of(ctx, s, 0, 16, 50 + (uint64_t)seed, &film);
        if (!noise_given) t.noise_se = NULL;
        imp_problem *p = problem(s, &t);
        const size_t n = imp_problem_n_variables(p);
        double truth[3 * K], x[3 * K];
        imp_problem_get_x(p, truth);
        for (size_t k = 0; k < n; k++) x[k] = truth[k] * (k % 2 ? 1.25 : 0.8);
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        const struct imp_fit_result *r = NULL;
        o.optimizer = IMP_LM;
        o.intervals = 1;
        run.spp = 64;
        run.seed = (uint64_t)seed;
        enum imp_status st = imp_problem_set_x(p, x);
        if (st == IMP_OK) st = imp_fit(p, &o, &run, &r);
        if (st != IMP_OK) {
            tap_ok(0, "%s: LM # %s", filters[filter][0], imp_last_error(ctx));
            return;
        }
        iterations += r->iterations;
        for (size_t k = 0; k < n; k++) {
            const struct imp_fit_variable *v = &r->variables[k];
            tap_add(&z2, pow((v->value - truth[k]) / v->se, 2));
        }
        if (imp_problem_set_x(p, truth) != IMP_OK) tap_ok(0, "set");
        imp_problem_destroy(p);
        imp_film_destroy(film);
    }
    tap_ok(z2.mean > 0.3 && z2.mean < 2,
           "%s, %s, noise %s: LM # mean z^2 %.2f over %.0f numbers, %.1f iterations",
           filters[filter][0], mode == IMP_MONO ? "mono" : "rgb",
           noise_given ? "given" : "from residuals", z2.mean, (double)z2.n,
           iterations / 6.0);
    imp_scene_destroy(s);
}

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    moments(0);
    fits(0, IMP_RGB, 1);
    fits(0, IMP_RGB, 0);
    fits(1, IMP_MONO, 0);
    imp_context_destroy(ctx);
    return tap_done();
}
