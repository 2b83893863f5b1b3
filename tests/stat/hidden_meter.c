/* SPDX-License-Identifier: Apache-2.0
 *
 * hide_emitters before a sensor that is a surface: the inside of a sphere of radius 1, which
 * reflects rho and is the meter itself, around a black lamp of radius r and radiance 1. Of what
 * leaves the wall the lamp takes the part f = r^2, and the wall sends back
 *
 *     B = rho (pi f + (1 - f) B) = rho pi f/(1 - rho (1 - f))                              (1)
 *
 * A meter reads pi f + (1 - f) B; with the lamp hidden it looks past it at the wall, and
 * reads B. A point light of intensity 1 gives E = 1 at once and B = rho/(1 - rho). */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/vec.h"

#define R   0.4
#define F   (R * R)
#define RHO 0.6

static imp_context *ctx;

static const char *const lamp =
    "<shape type='sphere'><float name='radius' value='.4'/><bsdf type='diffuse'><float "
    "name='reflectance' value='0'/></bsdf><emitter type='area'><float name='radiance' "
    "value='1'/></emitter></shape>";
static const char *const point =
    "<emitter type='point'><float name='intensity' value='1'/></emitter>";
static const char *const sky =
    "<emitter type='constant'><float name='radiance' value='1'/></emitter>";

#define DEPTH(n) "<integer name='max_depth' value='" #n "'/>"

/* depth: DEPTH, or nothing. open: the wall is a square. */
static imp_scene *ball(const char *integrator, const char *depth, bool hidden,
                       const char *light, bool open)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='%s'>%s<boolean "
             "name='hide_emitters' value='%s'/></integrator>%s<shape type='%s'>%s<bsdf "
             "type='diffuse' id='wall'><float name='reflectance' value='%g'/></bsdf>"
             "<sensor type='irradiancemeter'><film type='hdrfilm'><integer name='width' "
             "value='1'/><integer name='height' value='1'/><rfilter type='box'/></film>"
             "</sensor></shape></scene>",
             integrator, depth, hidden ? "true" : "false", light,
             open ? "rectangle" : "sphere",
             open ? "" : "<boolean name='flip_normals' value='true'/>", RHO);
    return test_scene_text(ctx, xml, IMP_MONO);
}

static void reads(const char *what, imp_scene *scene, enum imp_from from, int spp,
                  double truth)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate e;
    imp_problem *p;
    run.from = from;
    run.spp = spp;
    run.seed = 5;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_functional(p, NULL, &run, &e, NULL, NULL));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    if (truth == 0) {
        tap_ok(e.value == 0 && e.se == 0, "%s: %g", what, e.value);
        return;
    }
    const double z = (e.value - truth) / e.se;
    const bool exact = fabs(e.value - truth) < 1e-9 * truth;
    tap_ok(exact || (fabs(z) < 4.5 && e.se < 0.01 * truth),
           "%s: %.6g +- %.1g, truth %.6g # z %.2f", what, e.value, e.se, truth,
           exact ? 0 : z);
}

/* Of (1) by rho. */
static void derivative(void)
{
    imp_scene *scene = ball("path", "", true, lamp, false);
    imp_problem *p = test_problem(ctx, scene, "wall.reflectance");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate e;
    double g, se;
    run.spp = 60000;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &e, &g, &se));
    const double below = 1 - RHO * (1 - F), truth = IMP_PI * F / (below * below);
    tap_ok(fabs(g - truth) < 4.5 * se && se < 0.01 * truth,
           "derivative by the wall: %.6g +- %.1g, truth %.6g # z %.2f", g, se, truth,
           (g - truth) / se);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(void)
{
    const double at_once = IMP_PI * F, B = RHO * at_once / (1 - RHO * (1 - F));
    ctx = test_context(2);
    reads("a lamp in sight", ball("path", "", false, lamp, false), IMP_FROM_SCENE, 40000,
          at_once + (1 - F) * B);
    reads("hidden, path", ball("path", "", true, lamp, false), IMP_FROM_SCENE, 40000, B);
    reads("hidden, volpath", ball("volpath", "", true, lamp, false), IMP_FROM_SCENE,
          40000, B);
    reads("hidden, photons", ball("photons", "", true, lamp, false), IMP_FROM_SCENE,
          200000, B);
    reads("hidden, one reflection", ball("path", DEPTH(2), true, lamp, false),
          IMP_FROM_SCENE, 40000, RHO * at_once);
    reads("hidden, direct", ball("direct", "", true, lamp, false), IMP_FROM_SCENE, 40000,
          RHO * at_once);
    reads("hidden, nothing reflects", ball("path", DEPTH(1), true, lamp, false),
          IMP_FROM_SCENE, 1000, 0);
    reads("a point light hidden", ball("path", "", true, point, false), IMP_FROM_SCENE,
          40000, RHO / (1 - RHO));
    reads("... from the light", ball("path", "", true, point, false), IMP_FROM_LIGHTS,
          40000, RHO / (1 - RHO));
    reads("a sky in sight", ball("path", "", false, sky, true), IMP_FROM_SCENE, 1000,
          IMP_PI);
    reads("a sky hidden", ball("path", "", true, sky, true), IMP_FROM_SCENE, 1000, 0);
    reads("... from the sky", ball("path", "", true, sky, true), IMP_FROM_LIGHTS, 1000,
          0);
    derivative();
    imp_context_destroy(ctx);
    return tap_done();
}
