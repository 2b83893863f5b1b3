/* SPDX-License-Identifier: Apache-2.0
 *
 * Camera and time: the circle of confusion of a thin lens, a bar that moves while the
 * shutter is open, lights and sensors that vary in time, from both ends; and random
 * numbers of their own for each (Morley et al. 2006; F13 of the checklist in
 * docs/adjoint-photons.md). */
#include "end_reading.h"
#include "imp_light_room.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/course.h"
#include "math/rng.h"
#include "scene/scene.h"

static imp_context *ctx;

#define HEAD                                                                             \
    "<scene version='3.0.0'><integrator type='ptracer'><integer name='max_depth' "       \
    "value='3'/></integrator>"
#define FILM(w, h)                                                                       \
    "<film type='hdrfilm'><integer name='width' value='" #w                              \
    "'/><integer name='height' value='" #h "'/><rfilter type='box'/></film>"

/* ---- Thin lens ---------------------------------------------------------------------- */

/* A lens of 50 mm, f/2, focused at 2 m: a point at 3 m is a disc of diameter
 * A (s - s0)/s f/(s0 - f) = .21367 mm on the film, f s0/(s0 - f) behind it. */
static void confusion(void)
{
    enum { RINGS = 8, N = 400000 };
    const double v = 50 * 2000 / 1950., side = 2.0; /* mm */
    char xml[2048];
    snprintf(xml, sizeof xml,
             HEAD "<sensor type='thinlens'><float name='fov' value='%.17g'/><float "
                  "name='aperture_radius' value='12.5'/><float name='focus_distance' "
                  "value='2000'/><float name='far_clip' value='1e5'/>" FILM(
                      1000, 1000) "</sensor></scene>",
             2 * atan(side / 2 / v) * 180 / acos(-1));
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    const struct imp_sensor *s = scene->sensors[0];
    const imp_v3 point = {0, 0, 3000, 0};
    int ring[RINGS] = {0};
    double most = 0, off = 0;
    for (unsigned i = 0; i < N; i++) {
        struct imp_sensor_sample to;
        const struct imp_key key = imp__key(9, i, 0);
        const double u[4] = {imp__u01(key, 0), imp__u01(key, 1), 0, 0};
        if (!s->ops->connect(s, &point, false, u, &to)) continue;
        const double r = hypot(to.px - 500, to.py - 500) * side / 1000;
        most = fmax(most, r);
        const double share = (r / (0.21367 / 2)) * (r / (0.21367 / 2));
        ring[imp_min((int)(share * RINGS), RINGS - 1)]++;
    }
    for (int k = 0; k < RINGS; k++)
        off = fmax(off, fabs(ring[k] * (double)RINGS / N - 1));
    tap_near(2 * most, 0.21367, 1e-4, 0, "circle of confusion, mm");
    tap_ok(off < 1e-2, "and it is flat within %.1e", off);
    imp_scene_destroy(scene);
}

/* ---- A bar that moves ---------------------------------------------------------------- */

static void bar(void)
{
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='path'/><emitter type='constant'/>"
        "<shape type='shapegroup' id='bar'><shape type='rectangle'><transform "
        "name='to_world'><scale x='.1' y='2'/></transform><bsdf type='diffuse'><rgb "
        "name='reflectance' value='0'/></bsdf></shape></shape>"
        "<shape type='instance'><ref id='bar'/><transform name='to_world'><translate "
        "x='-.2'/></transform><transform name='to_world_end'><translate "
        "x='.2'/></transform><float name='time_start' value='2'/><float name='time_end' "
        "value='6'/></shape>"
        "<sensor type='orthographic'><float name='shutter_open' value='2'/><float "
        "name='shutter_close' value='6'/><sampler type='stratified'/><transform "
        "name='to_world'><scale x='.5' "
        "y='.5'/><lookat origin='0,0,-1' target='0,0,0' up='0,1,0'/></transform>" FILM(
            50, 1) "</sensor></scene>",
        IMP_MONO);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 10000;
    test_must(ctx, imp_render(scene, &run, &film));
    const float *L = imp_film_mean(film);
    double wrong = 0, whole = 0, plateau = 0;
    for (int k = 0; k < 50; k++) {
        double truth = 0; /* over the pixel: |x| < .1: .5, then linear to 0 at .3 */
        for (int i = 0; i < 100; i++) {
            const double x = fabs((k + (i + 0.5) / 100) / 50 - 0.5);
            truth += imp_clamp((0.3 - x) / 0.2, 0.0, 1.0) * 0.5 / 100;
        }
        wrong += fabs(1 - L[k] - truth);
        whole += truth;
        if (k >= 21 && k < 29) plateau += (1 - L[k]) / 8;
    }
    tap_ok(wrong < 1e-2 * whole, "a bar of width .2 that moves by .4: L1 error %.2g %%",
           100 * wrong / whole);
    tap_near(plateau, 0.5, 0, 5e-3, "its plateau");
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

/* ---- Lights and sensors that vary ----------------------------------------------------- */

/* Both ends against the truth; NAN: against each other. */
static void ends(const char *what, const char *xml, int spp, double truth, double limit)
{
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    const struct imp_estimate a = end_reading(ctx, scene, IMP_FROM_SENSOR, spp, 5),
                              b = end_reading(ctx, scene, IMP_FROM_LIGHTS, spp, 6);
    const double se = hypot(a.se, b.se), z = (a.value - b.value) / se;
    tap_ok(fabs(z) < 4 && se < limit * a.value,
           "%s: sensor %.5g +- %.1g, lights %.5g +- %.1g # z %.2f", what, a.value, a.se,
           b.value, b.se, z);
    if (!isnan(truth))
        tap_ok(fabs(a.value - truth) < 4 * a.se && fabs(b.value - truth) < 4 * b.se,
               "%s: truth %.5g # z %.2f, %.2f", what, truth, (a.value - truth) / a.se,
               (b.value - truth) / b.se);
    imp_scene_destroy(scene);
}

/* Discs of radius .5 and 1 at distance 1: irradiance F12 pi of a steady lamp of radiance 1,
 * on the smaller one .4688711 pi. */
#define DISCS(lamp, meter)                                                               \
    HEAD "<shape type='disk'>" AT(                                                       \
        "<scale value='.5'/>") "<bsdf type='diffuse'><rgb "                              \
                               "name='reflectance' "                                     \
                               "value='0'/></bsdf><sensor "                              \
                               "type='irradiancemeter'>" meter                           \
                               "<float name='shutter_open' "                             \
                               "value='1'/><float "                                      \
                               "name='shutter_close' "                                   \
                               "value='3'/>" FILM(                                       \
                                   1,                                                    \
                                   1) "</sensor></shape>"                                \
                                      "<shape "                                          \
                                      "type='disk'>" AT(                                 \
                                          "<rotate y='1' "                               \
                                          "angle='180'/>"                                \
                                          "<translate "                                  \
                                          "z='1'/>") "<bsdf type='diffuse'><rgb "        \
                                                     "name='reflectance' "               \
                                                     "value='0'/></bsdf><emitter "       \
                                                     "type='area'><rgb name='radiance' " \
                                                     "value='1'/>" lamp                  \
                                                     "</emitter></shape></scene>"

static void courses(void)
{
    const double E = 0.4688711 * acos(-1);
    ends("steady", DISCS("", ""), 100000, E, 5e-3);
    ends("a lamp that rises from 0 to 1",
         DISCS("<string name='times' value='1:0, 3:1'/>", ""), 100000, E / 2, 1e-2);
    ends("seen by a sensor whose response does, too",
         DISCS("<string name='times' value='1:0, 3:1'/>",
               "<string name='times' value='1:0, 3:1'/>"),
         100000, 2 * E / 3, 1e-2);
    ends("a flash",
         DISCS("<string name='times' value='1.5:0, 1.6:2, 1.7:2, 1.8:0'/>", ""), 200000,
         E * 0.2, 2e-2);

    /* Integral, value and inverse of a course. */
    const double t[] = {0, 1, 1.5, 4}, f[] = {1, 3, 0, 2};
    const struct imp_course c = {4, t, f};
    double worst = 0;
    tap_near(imp__course_integral(&c, -1, 5), 1 + 2 + 0.75 + 2.5 + 2, 1e-14, 0,
             "integral of a course");
    for (int k = 1; k < 1000; k++) {
        const double at = imp__course_draw(&c, -1, 5, k / 1000.);
        worst = fmax(worst, fabs(imp__course_integral(&c, -1, at) / 8.25 - k / 1000.));
    }
    tap_ok(worst < 1e-14, "times are drawn at its shares, within %.1e", worst);
}

/* A ball that falls before a lamp. */
static void falling(void)
{
    ends("a ball falls",
         HEAD "<shape type='shapegroup' id='ball'><shape type='sphere'><float "
              "name='radius' value='.3'/></shape></shape>"
              "<shape type='instance'><ref id='ball'/><transform "
              "name='to_world'><translate y='1' z='1'/></transform><transform "
              "name='to_world_end'><translate y='-1' z='1'/></transform></shape>"
              "<shape type='rectangle'><bsdf type='diffuse'/></shape>"
              "<shape type='rectangle'>" AT(
                  "<scale value='.5'/><rotate y='1' "
                  "angle='180'/><translate z='2'/>") "<emitter "
                                                     "type='area'/></"
                                                     "shape>"
                                                     "<sensor "
                                                     "type='"
                                                     "perspective'><"
                                                     "float "
                                                     "name='shutter_"
                                                     "close' "
                                                     "value='1'/"
                                                     "><float "
                                                     "name='fov' "
                                                     "value='60'/"
                                                     ">" AT("<lookat "
                                                            "origin='"
                                                            "2,0,2' "
                                                            "target='"
                                                            "0,0,.5' "
                                                            "up='0,0,"
                                                            "1'/>") FILM(6, 4) "</"
                                                                               "sens"
                                                                               "or><"
                                                                               "/sce"
                                                                               "ne>",
         8000, NAN, 1.5e-2);
}

/* ---- Numbers of their own -------------------------------------------------------------- */

static void streams(const char *sampler)
{
    float mean[2];
    imp_film *film[2];
    for (int open = 0; open < 2; open++) {
        char xml[2048];
        snprintf(
            xml, sizeof xml,
            "<scene version='3.0.0'><integrator type='path'/><emitter "
            "type='constant'/><shape type='sphere'/><sensor type='thinlens'><float "
            "name='aperture_radius' value='.1'/><float name='focus_distance' "
            "value='3'/><float name='shutter_close' value='%d'/>" AT(
                "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/>") "<sampler "
                                                                      "type='%s'/>" FILM(
                                                                          12,
                                                                          8) "</sensor></"
                                                                             "scene>",
            open, sampler);
        imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
        struct imp_run run = IMP_RUN_INIT;
        run.spp = 16;
        test_must(ctx, imp_render(scene, &run, &film[open]));
        mean[open] = imp_film_mean(film[open])[100];
        imp_scene_destroy(scene);
    }
    tap_ok(mean[0] > 0 && memcmp(imp_film_mean(film[0]), imp_film_mean(film[1]),
                                 12 * 8 * 3 * sizeof(float)) == 0,
           "%s: an open shutter before a scene at rest leaves all bits", sampler);
    for (int k = 0; k < 2; k++) imp_film_destroy(film[k]);
}

int main(void)
{
    ctx = test_context(1);
    confusion();
    bar();
    courses();
    falling();
    streams("independent");
    streams("stratified");
    imp_context_destroy(ctx);
    return tap_done();
}
