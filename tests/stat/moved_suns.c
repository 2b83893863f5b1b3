/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by the place and the width of a sun: irradiance of a plane below suns of both kinds, in
 * closed form, and below a CIE sky, by quadrature; pictures of skies, and fields under them, against
 * differences. What is refused. */
#include "egg.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include "sky_field.h"

#define METER                                                                            \
    "<shape type='rectangle'><sensor type='irradiancemeter'><film type='hdrfilm'>"       \
    "<integer name='width' value='2'/><integer name='height' value='2'/><rfilter "       \
    "type='box'/></film></sensor></shape>"
#define METER_BELOW(sky)                                                                 \
    "<scene version='3.0.0'><integrator type='direct'/>" sky METER "</scene>"

/* ---- Closed forms ------------------------------------------------------------------------------ */

#define WIDE_SUN                                                                         \
    "<emitter type='sun' id='sun'><vector name='direction' value='.5,-.6,-.9'/><float "  \
    "name='radius' value='.2'/><rgb name='radiance' value='7'/></emitter>"

/* A sun of the angular radius a, above a plane's horizon in whole, brings it pi L sin^2(a) n.w; where its
 * power stays, of which 4 pi sin^2(a/2) L is a measure, pi L' 4 cos^2(a/2) n.w. */
static void radius_test(void)
{
    struct tap_stat g = {0};
    const imp_v3 w = imp__normalize(imp__v3(-.5, .6, .9));
    imp_scene *scene = test_scene_text(ctx, METER_BELOW(WIDE_SUN), IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "sun.sun_radius"));
    mean_gradient(ctx, scene, "sun.sun_radius", 64, 24, &g);
    tap_z(&g, IMP_PI * 7 * sin(.4) * w[2], .02, "irradiance by the radius of a sun");
    imp_scene_destroy(scene);
}

static double mean_of(imp_scene *scene, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_render(scene, &run, &film));
    const float *y = imp_film_mean(film);
    const double mean = (y[0] + y[1] + y[2] + y[3]) / 4.;
    imp_film_destroy(film);
    return mean;
}

static void dimmer_test(void)
{
    struct tap_stat g = {0}, lit = {0};
    imp_scene *scene = test_scene_text(
        ctx,
        METER_BELOW("<emitter type='sunsky' id='sky'><vector name='sun_direction' "
                    "value='-.5,.6,.9'/><float name='sun_aperture' value='40'/><float "
                    "name='sky_scale' value='0'/></emitter>"),
        IMP_MONO);
    for (uint64_t k = 0; k < 24; k++) tap_add(&lit, mean_of(scene, 64, 300 + k));
    test_must(ctx, imp_scene_add_geometry(scene, "sky.sun_radius"));
    mean_gradient(ctx, scene, "sky.sun_radius", 64, 24, &g);
    const double expected = -tan(IMP_PI / 18) * lit.mean,
                 se = hypot(tap_se(&g), tap_se(&lit) * tan(IMP_PI / 18));
    tap_ok(fabs(g.mean - expected) < 3.5 * se && se < .02 * fabs(expected),
           "irradiance by the radius of a sun of one power # %.6f %.6f se %.1e z %.2f",
           g.mean, expected, se, (g.mean - expected) / se);
    imp_scene_destroy(scene);
}

/* ---- A CIE sky by quadrature ------------------------------------------------------------------- */

/* Irradiance of level ground under type 12, whose zenith has the luminance 1. */
static double cie_irradiance(imp_v3 sun)
{
    enum { UP = 400, AROUND = 800 };
    const double Zs = acos(sun[2]), a = -1, b = -.32, c = 10, d = -3, e = .45;
    double sum = 0;
    for (int i = 0; i < UP; i++)
        for (int j = 0; j < AROUND; j++) {
            const double square = (i + .5) / UP, phi = IMP_2PI * (j + .5) / AROUND,
                         r = sqrt(1 - square), z = sqrt(square),
                         x = acos(r * cos(phi) * sun[0] + r * sin(phi) * sun[1] +
                                  z * sun[2]);
            sum += (1 + c * (exp(d * x) - exp(d * IMP_PI / 2)) + e * cos(x) * cos(x)) *
                   (1 + a * exp(b / z));
        }
    return sum * IMP_PI / (UP * AROUND) /
           ((1 + c * (exp(d * Zs) - exp(d * IMP_PI / 2)) + e * cos(Zs) * cos(Zs)) *
            (1 + a * exp(b)));
}

static void cie_test(void)
{
    struct tap_stat g[3] = {{0}};
    imp_scene *scene = test_scene_text(
        ctx,
        METER_BELOW("<emitter type='ciesky' id='sky'><integer name='sky' value='12'/>"
                    "<vector name='sun_direction' value='.5,-.6,.7'/></emitter>"),
        IMP_MONO);
    const imp_v3 sun = imp__normalize(imp__v3(.5, -.6, .7));
    test_must(ctx, imp_scene_add_geometry(scene, "sky.sun_direction"));
    mean_gradient(ctx, scene, "sky.sun_direction", 256, 24, g);
    for (int k = 0; k < 3; k++) {
        double value[2];
        char what[80];
        for (int s = 0; s < 2; s++) {
            imp_v3 there = sun;
            there[k] += s ? 1e-4 : -1e-4;
            value[s] = cie_irradiance(imp__normalize(there));
        }
        snprintf(what, sizeof what, "irradiance by number %d of a sun's direction", k);
        tap_z(&g[k], (value[1] - value[0]) / 2e-4, .03, what);
    }
    imp_scene_destroy(scene);
}

/* ---- Values ----------------------------------------------------------------------------------- */

static size_t index_of(imp_scene *scene, const char *name)
{
    size_t index;
    test_must(ctx, imp_scene_find_param(scene, name, &index));
    return index;
}
static double value_of(imp_scene *scene, const char *name)
{
    double v;
    test_must(ctx, imp_scene_get_values(scene, index_of(scene, name), &v));
    return v;
}
static void value_set(imp_scene *scene, const char *name, double v)
{
    test_must(ctx, imp_scene_set_values(scene, index_of(scene, name), 1, &v));
}

/* A sun's radius has two names. */
static void names_test(void)
{
    static const char *const name[2] = {"sun.radius.value", "sun.sun_radius"};
    const double radius[2] = {.3, .1}, along[3] = {.5, -.6, -.8};
    const imp_v3 w = imp__normalize(imp__v3(-.5, .6, .8));
    imp_scene *scene = test_scene_text(ctx, METER_BELOW(WIDE_SUN), IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "sun.sun_radius"));
    test_must(ctx, imp_scene_add_geometry(scene, "sun.direction"));
    for (int k = 0; k < 2; k++) {
        struct tap_stat lit = {0};
        char what[80];
        value_set(scene, name[k], radius[k]);
        test_must(
            ctx, imp_scene_set_values(scene, index_of(scene, "sun.direction"), 3, along));
        tap_ok(value_of(scene, name[0]) == radius[k] &&
                   value_of(scene, name[1]) == radius[k],
               "a sun's radius by both names, set as %s # %g %g", name[k],
               value_of(scene, name[0]), value_of(scene, name[1]));
        for (uint64_t s = 0; s < 24; s++) tap_add(&lit, mean_of(scene, 64, 500 + s));
        snprintf(what, sizeof what, "irradiance, set as %s", name[k]);
        tap_z(&lit, IMP_PI * 7 * imp__sqr(sin(radius[k])) * w[2], .002, what);
    }
    imp_scene_destroy(scene);
}

/* Bright and even, which the model has under a high sun alone. */
static void no_sky_test(void)
{
    const double low[3] = {.8, .5, .35};
    double there[3];
    imp_scene *scene = test_scene_text(
        ctx,
        METER_BELOW("<emitter type='perezsky' id='sky'><float name='diffuse' "
                    "value='800'/><float name='direct' value='0'/><vector "
                    "name='sun_direction' value='.4,.2,.9'/></emitter>"),
        IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "sky.sun_direction"));
    const size_t index = index_of(scene, "sky.sun_direction");
    const double before = mean_of(scene, 64, 3);
    const enum imp_status st = imp_scene_set_values(scene, index, 3, low);
    tap_ok(st == IMP_E_NUMERIC && strstr(imp_last_error(ctx), "no sky"),
           "a sun for which the model has no sky # %s", imp_last_error(ctx));
    test_must(ctx, imp_scene_get_values(scene, index, there));
    tap_ok(there[2] > .8 && mean_of(scene, 64, 3) == before, "all is as before");
    imp_scene_destroy(scene);
}

/* ---- Differences ------------------------------------------------------------------------------- */

#define ALONE(sky)                                                                       \
    "<scene version='3.0.0'><integrator type='direct'/><sensor type='perspective' "      \
    "id='camera'><float name='fov' value='50'/><transform name='to_world'><rotate "      \
    "x='1' angle='-80'/></transform><film type='hdrfilm'><integer name='width' "         \
    "value='24'/><integer name='height' value='16'/><rfilter type='box'/></film>"        \
    "</sensor>" sky "</scene>"
#define SKY_PEREZ                                                                        \
    "<emitter type='perezsky' id='sky'><float name='diffuse' value='120'/><float "       \
    "name='direct' value='600'/><float name='illuminance' value='2'/><vector "           \
    "name='sun_direction' value='.5,.9,.7'/></emitter>"
/* Darker towards the limb and the horizon. */
#define SKY_LIMB                                                                         \
    "<emitter type='sunsky' id='sky'><vector name='sun_direction' value='-.2,1.2,.4'/>"  \
    "<float name='sun_aperture' value='16'/><float name='sun_scale' value='.004'/>"      \
    "<float name='sky_scale' value='20'/><boolean name='complex_sun' value='true'/>"     \
    "</emitter>"
/* Its upper half through a telescope, where what it sends depends on the height of a place in it. */
#define INSIDE                                                                           \
    "<scene version='3.0.0'><integrator type='direct'/><sensor type='perspective' "      \
    "id='camera'><float name='fov' value='5'/><transform name='to_world'><lookat "       \
    "origin='0,0,0' target='-.2,1.2,.49' up='0,0,1'/></transform><film "                 \
    "type='hdrfilm'><integer name='width' value='24'/><integer name='height' "           \
    "value='16'/><rfilter type='box'/></film></sensor>" SKY_LIMB "</scene>"
#define MIRROR                                                                           \
    "<shape type='rectangle'><transform name='to_world'><scale value='1.2'/><rotate "    \
    "x='1' angle='70'/><translate x='1.3' y='-1.4' z='1.1'/></transform><bsdf "          \
    "type='conductor'/></shape>"
#define MASK                                                                             \
    "<shape type='rectangle'><transform name='to_world'><scale value='1.2'/><rotate "    \
    "x='1' angle='70'/><translate x='1.3' y='-1.4' z='1.1'/></transform><bsdf "          \
    "type='mask'><float name='opacity' value='.4'/><bsdf type='twosided'><bsdf "         \
    "type='diffuse'/></bsdf></bsdf></shape>"

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    static const struct number place[] = {{"sky.sun_direction", 0, .002},
                                          {"sky.sun_direction", 1, .002},
                                          {"sky.sun_direction", 2, .002},
                                          {NULL, 0, 0}},
                               disc[] = {{"sky.sun_direction", 0, .002},
                                         {"sky.sun_direction", 2, .002},
                                         {"sky.sun_radius", 0, .004},
                                         {"block.pose", 0, .03},
                                         {NULL, 0, 0}},
                               inside[] = {{"sky.sun_radius", 0, .0002},
                                           {"sky.sun_direction", 0, .002},
                                           {"sky.sun_direction", 2, .002},
                                           {NULL, 0, 0}},
                               seen[] = {{"sky.sun_direction", 0, .002},
                                         {"sky.sun_direction", 2, .002},
                                         {"camera.pose", 4, .002},
                                         {NULL, 0, 0}},
                               sun[] = {{"sun.sun_radius", 0, .01},
                                        {"sun.direction", 1, .01},
                                        {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    radius_test();
    dimmer_test();
    cie_test();
    names_test();
    no_sky_test();
    numbers_compare("a Perez sky alone", test_scene_text(ctx, ALONE(SKY_PEREZ), IMP_MONO),
                    16, 16 * more, .01, place);
    numbers_compare("a clear sky alone", test_scene_text(ctx, ALONE(SKY_LIMB), IMP_MONO),
                    64 * more, 64 * more, .06, seen);
    numbers_compare("inside of a sun", test_scene_text(ctx, INSIDE, IMP_MONO), 16, 16,
                    .01, inside);
    numbers_compare("a CIE sky", sky_field(SKY_PATH SKY_CIE), 16 * more, 16 * more, .03,
                    place);
    numbers_compare("a CIE sky behind a mask", sky_field(SKY_PATH SKY_CIE MASK),
                    16 * more, 16 * more, .03, place);
    numbers_compare("a CIE sky in a mirror", sky_field(SKY_PATH SKY_CIE MIRROR),
                    16 * more, 16 * more, .03, place);
    numbers_compare("sky and sun", sky_field(SKY_DIRECT SKY_CLEAR), 16 * more, 32 * more,
                    .06, disc);
    numbers_compare("a sun", sky_field(SKY_PATH SKY_SUN), 16 * more, 32 * more, .06, sun);
    number_refused("an overcast sky", sky_field("<emitter type='ciesky' id='sky'/>"),
                   "sky.sun_direction", "depend on their sun");
    number_refused("a CIE sky has no disc", sky_field(SKY_CIE), "sky.sun_radius",
                   "neither sun nor sunsky");
    number_refused("a sun that the horizon cuts",
                   sky_field(SKY_DIRECT "<emitter type='sunsky' id='sky'><vector "
                                        "name='sun_direction' value='-.5,1.2,.1'/><float "
                                        "name='sun_aperture' value='12'/></emitter>"),
                   "sky.sun_direction", "touches the horizon");
    number_refused("a mask", sky_field(SKY_DIRECT SKY_CLEAR MASK), "sky.sun_radius",
                   "straight through");
    imp_scene *scene = sky_field(SKY_CLEAR);
    test_must(ctx, imp_scene_add_geometry(scene, "sky.turn"));
    number_refused("beside a turn", scene, "sky.sun_direction", "takes its sun along");
    imp_context_destroy(ctx);
    return tap_done();
}
