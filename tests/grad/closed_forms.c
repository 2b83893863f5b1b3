/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes whose radiance and derivatives have closed forms: furnaces with depth caps and
 * roulette, parameters at exactly zero, mirrors, glass, a point light over a floor. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

static imp_context *ctx;

/* Mean of the picture over pixels, its SE, and the derivatives of that mean. */
struct result {
    double mean, se, g[16], g_se[16];
};

static struct result measure(imp_scene *scene, imp_problem *p, int spp, uint64_t seed)
{
    struct result r = {0};
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    imp_film *film;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_render(scene, &run, &film));
    imp_film_get_info(film, &info);
    const int pixels = info.width * info.height;
    float *ones = malloc((size_t)pixels * sizeof *ones);
    for (int k = 0; k < pixels; k++) {
        ones[k] = 1.f / (float)pixels;
        r.mean += imp_film_mean(film)[k] / pixels;
        r.se += pow(imp_film_se(film)[k] / pixels, 2);
    }
    r.se = sqrt(r.se);
    test_must(ctx, imp_problem_reverse(p, ones, &run, r.g, r.g_se));
    free(ones);
    imp_film_destroy(film);
    return r;
}

static void near_z(double value, double se, double ref, double relative_se,
                   const char *what)
{
    /* What is left where an estimator has no spread: ray origins are moved off the
     * surface, which a glowing sphere sees at grazing angles as a relative 1e-5 to 3e-5.
     */
    const double slack = 4e-5 * fabs(ref) + 1e-15,
                 z = (value - ref) / hypot(se, slack / 4);
    tap_ok(fabs(z) <= 4 && se <= relative_se * fabs(ref) + 1e-15,
           "%s # value %.9g se %.2g ref %.9g z %.2f", what, value, se, ref, z);
}

#define SENSOR                                                                           \
    "<sensor type='perspective'><float name='fov' value='60'/>"                          \
    "<transform name='to_world'><lookat origin='%s' target='0,0,0' "                     \
    "up='0,1,0'/></transform>"                                                           \
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "      \
    "value='8'/>"                                                                        \
    "<rfilter type='box'/></film></sensor>"

/* Inside a glowing sphere: I_d = e (1 - rho^d)/(1 - rho) (docs/estimators.md 9.1). `stam`
 * is the absorption of Stam's walk, which no mean depends on; 0: the path tracer. */
static void furnace(double rho, int depth, int rr_depth, double stam)
{
    char xml[2048], what[200];
    const double e = 0.2;
    if (stam > 0)
        snprintf(
            xml, sizeof xml,
            "<scene version='3.0.0'><integrator type='stam'><integer name='max_depth' "
            "value='%d'/></integrator>" SENSOR "<bsdf type='stam_m3' id='wall'>"
            "<float name='ambient' value='%g'/><float name='diffuse' value='%g'/>"
            "<float name='absorb' value='%g'/></bsdf><shape type='sphere'>"
            "<boolean name='flip_normals' value='true'/><ref id='wall'/></shape></scene>",
            depth, "0,0,.3", e, rho, stam);
    else
        snprintf(
            xml, sizeof xml,
            "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
            "value='%d'/><integer name='rr_depth' value='%d'/></integrator>" SENSOR
            "<bsdf type='diffuse' id='wall'><float name='reflectance' value='%g'/></bsdf>"
            "<shape type='sphere'><boolean name='flip_normals' value='true'/>"
            "<ref id='wall'/><emitter type='area' id='glow'>"
            "<float name='radiance' value='%g'/></emitter></shape></scene>",
            depth, rr_depth, "0,0,.3", rho, e);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    imp_problem *p = test_problem(ctx, scene, "*");
    const struct result r = measure(scene, p, 2000, 5);
    const size_t i_rho =
        test_variable(p, scene, ctx, stam > 0 ? "wall.diffuse" : "wall.reflectance");
    const size_t i_e =
        test_variable(p, scene, ctx, stam > 0 ? "wall.ambient" : "glow.radiance");
    const double d = depth, n = depth < 0 ? 0 : pow(rho, d);
    const double I = e * (1 - n) / (1 - rho);
    const double dn = depth < 0 || depth == 0 ? 0 : d * pow(rho, d - 1);
    const double dI = e * (1 - n - dn * (1 - rho)) / ((1 - rho) * (1 - rho));
    char name[64] = "path";
    if (stam > 0) snprintf(name, sizeof name, "Stam's walk, absorb %g", stam);
    snprintf(what, sizeof what, "furnace, %s, rho %g, depth %d, rr %d: I", name, rho,
             depth, rr_depth);
    near_z(r.mean, r.se, I, .01, what);
    snprintf(what, sizeof what, "furnace, %s, rho %g, depth %d, rr %d: dI/drho", name,
             rho, depth, rr_depth);
    near_z(r.g[i_rho], r.g_se[i_rho], dI, .02, what);
    snprintf(what, sizeof what, "furnace, %s, rho %g, depth %d, rr %d: dI/de", name, rho,
             depth, rr_depth);
    near_z(r.g[i_e], r.g_se[i_e], I / e, .01, what);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* One number of one parameter in a scene of the given objects, seen from +z. */
static void one(const char *what, const char *objects, const char *param, int spp,
                double I, double dI, double relative_se)
{
    char xml[4096], line[256];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/>" SENSOR "%s</scene>",
             "0,0,4", objects);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    imp_problem *p = test_problem(ctx, scene, "*");
    const struct result r = measure(scene, p, spp, 6);
    const size_t i = test_variable(p, scene, ctx, param);
    snprintf(line, sizeof line, "%s: I", what);
    near_z(r.mean, r.se, I, relative_se, line);
    snprintf(line, sizeof line, "%s: dI/d %s", what, param);
    near_z(r.g[i], r.g_se[i], dI, relative_se, line);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

#define WALL                                                                             \
    "<shape type='rectangle'><transform name='to_world'><scale value='9'/></transform>"
#define SKY                                                                              \
    "<emitter type='constant' id='sky'><float name='radiance' value='2'/></emitter>"

/* Point light of intensity 1 at (0,0,5) over a floor of 0.6 at z = 0, seen from (0,0,4)
 * with 60 degrees: radiance 0.6/pi h/(h^2 + x^2 + y^2)^(3/2), averaged over the pixels by
 * midpoints. Straight below it is 0.0076394 (docs/scene-format.md 16). */
static void point_light(void)
{
    double mean = 0;
    const int n = 400;
    const double t = tan(M_PI / 6) * 4;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const double x = t * (2 * (i + .5) / n - 1), y = t * (2 * (j + .5) / n - 1);
            mean += .6 / M_PI * 5 / pow(25 + x * x + y * y, 1.5) / n / n;
        }
    tap_near(.6 / M_PI * 5 / pow(25, 1.5), .0076394, 1e-5, 0, "straight below the lamp");
    one("point light over a floor",
        "<emitter type='point' id='lamp'><point name='position' "
        "x='0' y='0' z='5'/></emitter><bsdf type='diffuse' id='floor'><float "
        "name='reflectance' "
        "value='.6'/></bsdf>" WALL "<ref id='floor'/></shape>",
        "lamp.intensity", 4000, mean, mean, .001);
}

int main(void)
{
    ctx = test_context(0);
    for (int depth = 1; depth <= 4; depth *= 2) {
        furnace(.5, depth, 5, 0);
        furnace(.5, depth, 5, .4);
    }
    furnace(.8, -1, 5, 0);
    furnace(.8, -1, 1, 0);
    furnace(.8, 64, 1000, 0);
    furnace(.5, 40, 1, .4);
    furnace(.5, 40, 1, .15);
    furnace(.5, 40, 1, .65);

    /* Exactly zero, in the furnace and behind another zero. */
    furnace(0, 2, 5, 0);
    furnace(0, 6, 1, 0);
    one("black wall under the sky",
        SKY "<bsdf type='diffuse' id='wall'><float name='reflectance' "
            "value='0'/></bsdf>" WALL "<ref id='wall'/></shape>",
        "wall.reflectance", 4000, 0, 2, .01);
    one("dark sky over a grey wall",
        "<emitter type='constant' id='sky'><float name='radiance' "
        "value='0'/></emitter><bsdf type='diffuse' id='wall'><float name='reflectance' "
        "value='.5'/></bsdf>" WALL "<ref id='wall'/></shape>",
        "sky.radiance", 4000, 0, .5, .01);
    one("black mirror",
        SKY "<bsdf type='conductor' id='wall'><float name="
            "'specular_reflectance' value='0'/></bsdf>" WALL "<ref id='wall'/></shape>",
        "wall.specular_reflectance", 16, 0, 2, .01);

    one("mirror under the sky",
        SKY "<bsdf type='conductor' id='wall'><float name="
            "'specular_reflectance' value='.8'/></bsdf>" WALL "<ref id='wall'/></shape>",
        "wall.specular_reflectance", 16, 1.6, 2, .01);
    one("glass plate under the sky (white furnace)",
        SKY "<bsdf type='dielectric' id='glass'>"
            "<float name='specular_transmittance' value='1'/></bsdf>"
            "<shape type='cube'><transform name='to_world'><scale x='9' y='9' "
            "z='.1'/></transform>"
            "<ref id='glass'/></shape>",
        "sky.radiance", 2000, 2, 1, .01);
    point_light();
    imp_context_destroy(ctx);
    return tap_done();
}
