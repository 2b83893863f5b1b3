/* SPDX-License-Identifier: Apache-2.0
 *
 * Fog without an end: what it scatters of a point light, by quadrature, with its derivative
 * from no extinction at all upwards; a derivative that is infinite is told. */
#include "media_kit.h"

static imp_context *ctx;

enum { H = 1, S0 = 2 }; /* distances of the light: from the ray, and along it */
static const double intensity = 5, albedo = .8, far_end = 4000;

static imp_scene *fog(double sigma, const char *more)
{
    char text[2048];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'><integer "
             "name='max_depth' value='2'/></integrator><medium type='homogeneous' "
             "id='fog'><float name='sigma_t' value='%g'/><float name='albedo' "
             "value='0.8'/></medium><emitter type='point'><point name='position' "
             "value='1,0,2'/><float name='intensity' value='5'/></emitter>%s"
             "<sensor type='orthographic'><transform name='to_world'><scale "
             "value='0.001'/></transform><float name='near_clip' value='1e-6'/><float "
             "name='far_clip' value='4e6'/>"
             "<ref id='fog'/><film type='hdrfilm'><integer name='width' value='8'/>"
             "<integer name='height' value='8'/><rfilter type='box'/></film></sensor>"
             "</scene>",
             sigma, more);
    return test_scene_text(ctx, text, IMP_MONO);
}

/* Scattered once: d/d sigma of sigma albedo/(4 pi) I exp(-sigma (s + r))/r^2 at distance s,
 * with s = S0 + H tan x. */
static double integrand(double x, const void *with)
{
    const double sigma = *(const double *)with, s = S0 + H * tan(x),
                 r = sqrt(H * H + (s - S0) * (s - S0)), way = s + r;
    return albedo * intensity / (4 * M_PI * H) * exp(-sigma * way) * (1 - sigma * way);
}
static double truth(double sigma)
{
    return media_integral(integrand, &sigma, atan(-(double)S0 / H),
                          atan((far_end - S0) / H), 20000);
}

static void derivatives(void)
{
    static const double sigma[] = {0, 1e-6, .01, .09, .11, .5, 2};
    for (size_t k = 0; k < sizeof sigma / sizeof *sigma; k++) {
        imp_scene *s = fog(sigma[k], "");
        imp_problem *p = test_problem(ctx, s, "fog.sigma_t.value");
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate v;
        double g, g_se;
        char what[80];
        run.spp = 4096;
        run.seed = 3;
        test_must(ctx, imp_problem_functional(p, NULL, &run, &v, &g, &g_se));
        snprintf(what, sizeof what, "endless fog of extinction %g: derivative", sigma[k]);
        media_near(g, g_se, truth(sigma[k]), .01 * fabs(truth(0)), what);
        imp_problem_destroy(p);
        imp_scene_destroy(s);
    }
}

/* A wall under a sky that endless fog hides. */
static void infinite(void)
{
    static const char *const sky =
        "<emitter type='constant'><float name='radiance' value='1'/></emitter><shape "
        "type='rectangle'><bsdf type='diffuse'/><transform name='to_world'><rotate x='1' "
        "angle='180'/><translate z='1'/></transform></shape>";
    imp_scene *s = fog(0, sky);
    imp_problem *p = test_problem(ctx, s, "fog.sigma_t.value");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate v;
    double g, g_se;
    run.spp = 64;
    enum imp_status st = imp_problem_functional(p, NULL, &run, &v, &g, &g_se);
    tap_ok(st == IMP_E_PATHS, "an infinite derivative ends the run # %s",
           imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);

    /* Inside a ball that hides the sky it is finite: what arrives is 1, scattered or not. */
    s = fog(0,
            "<shape type='sphere'><float name='radius' value='10'/><boolean "
            "name='flip_normals' value='true'/><ref id='fog' name='exterior'/><emitter "
            "type='area'><float name='radiance' value='1'/></emitter></shape>");
    p = test_problem(ctx, s, "fog.sigma_t.value");
    run.spp = 4096;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, &g, &g_se));
    /* Light of the ball: lost 10, scattered back 10 albedo; of the point along 10. */
    const double none = 0, point = media_integral(integrand, &none, atan(-(double)S0 / H),
                                                  atan((10. - S0) / H), 1000);
    media_near(g, g_se, 10 * (albedo - 1) + point, .05, "in a ball it is finite");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    derivatives();
    infinite();
    imp_context_destroy(ctx);
    return tap_done();
}
