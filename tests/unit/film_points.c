/* SPDX-License-Identifier: Apache-2.0
 *
 * Where cameras see points (imp_scene_film_point), against the formulas of a pinhole; that a camera's
 * own rays come back to their pixels, through lenses, windows and distortions; and where things are
 * that move (imp_scene_place). */
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include <math.h>
#include <string.h>

static imp_context *ctx;

#define THINGS                                                                           \
    "<integrator type='path'/>"                                                          \
    "<shape type='cube' id='block'><transform name='to_world'><scale x='1' y='2' "       \
    "z='3'/>"                                                                            \
    "<translate x='1' y='2' z='3'/></transform></shape>"                                 \
    "<shape type='sphere' id='ball'><point name='center' x='-2' y='0' z='1'/>"           \
    "<float name='radius' value='.5'/></shape>"                                          \
    "<shape type='shapegroup' id='pair'><shape type='sphere'/></shape>"                  \
    "<shape type='instance'><ref id='pair'/><transform name='to_world'><translate "      \
    "x='5' z='3'/></transform></shape>"                                                  \
    "<shape type='instance'><ref id='pair'/><transform name='to_world'><translate "      \
    "x='5' z='-3'/></transform></shape>"                                                 \
    "<emitter type='point' id='lamp'><point name='position' x='0' y='4' z='0'/>"         \
    "<rgb name='intensity' value='1'/></emitter>"                                        \
    "<emitter type='constant' id='sky'><rgb name='radiance' value='1'/></emitter>"

static imp_scene *scene_with(const char *sensor)
{
    char xml[4096];
    snprintf(xml, sizeof xml, "<scene version='3.0.0'>" THINGS "%s</scene>", sensor);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* From z = -10 along z: x to the left of the picture, y up. */
static void pinhole_test(void)
{
    imp_scene *s = scene_with(
        "<sensor type='perspective'><float name='fov' value='40'/><transform "
        "name='to_world'><lookat origin='0,0,-10' target='0,0,0' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='60'/><integer name='height' "
        "value='40'/><integer name='crop_offset_x' value='10'/><integer "
        "name='crop_offset_y' value='5'/><integer name='crop_width' value='45'/><integer "
        "name='crop_height' value='30'/></film></sensor>");
    const double focal = 30 / tan(20 * M_PI / 180);
    double worst = 0, film[2];
    for (int i = 0; i < 27; i++) {
        const double p[3] = {(i % 3 - 1) * 1.1, (i / 3 % 3 - 1) * 0.7, i / 9 * 2 - 3.};
        const double x = 30 - focal * p[0] / (p[2] + 10) - 10,
                     y = 20 - focal * p[1] / (p[2] + 10) - 5;
        test_must(ctx, imp_scene_film_point(s, 0, p, film));
        worst = fmax(worst, fmax(fabs(film[0] - x), fabs(film[1] - y)));
    }
    tap_ok(worst < 1e-9, "points in a window of a film # %.2g pixels", worst);
    static const double outside[][3] = {{0, 0, -11}, {0, 0, -10}, {9, 0, 0},
                                        {0, -9, 0},  {NAN, 0, 0}, {0, INFINITY, 0}};
    bool none = true;
    for (int i = 0; i < 4; i++) {
        film[0] = film[1] = 1;
        test_must(ctx, imp_scene_film_point(s, 0, outside[i], film));
        none &= isnan(film[0]) && isnan(film[1]);
    }
    tap_ok(none, "points behind the camera and beside the film");
    const double p[3] = {0, 0, 0}, no[3] = {0, NAN, 0};
    const bool nowhere = imp_scene_film_point(s, 0, no, film) == IMP_E_ARG;
    tap_ok(nowhere, "a point that is nowhere # %s", imp_last_error(ctx));
    bool refused = imp_scene_film_point(s, 1, p, film) == IMP_E_ARG;
    refused &= imp_scene_film_point(s, -1, p, film) == IMP_E_ARG;
    tap_ok(refused, "no such sensor # %s", imp_last_error(ctx));
    imp_scene_destroy(s);
}

/* Points of the rays through the middle of the lens. */
static void returns_test(const char *what, const char *sensor)
{
    static const double lens[2] = {0.5, 0.5};
    imp_scene *s = scene_with(sensor);
    const struct imp_sensor *camera = s->sensors[0];
    double worst = 0;
    for (int i = 0; i < 48; i++) {
        const double px = 1 + i % 8 * 7.3, py = 1 + i / 8 * 7.1;
        struct imp_sensor_ray ray;
        double film[2], p[3];
        camera->ops->ray(camera, px, py, lens, &ray);
        for (int k = 0; k < 3; k++) p[k] = ray.o[k] + (3 + i) * ray.d[k];
        test_must(ctx, imp_scene_film_point(s, 0, p, film));
        const double off = hypot(film[0] - px, film[1] - py);
        if (!(off < worst)) worst = off;
    }
    tap_ok(worst < 1e-6, "%s: points of its rays # %.2g pixels", what, worst);
    imp_scene_destroy(s);
}

#define PLACED                                                                           \
    "<transform name='to_world'><lookat origin='3,-8,2' target='0,0,1' up='0,0,1'/>"     \
    "</transform><film type='hdrfilm'><integer name='width' value='60'/><integer "       \
    "name='height' value='40'/></film></sensor>"

static bool is_at(imp_scene *s, const char *name, const double want[3], double radius)
{
    size_t param;
    double at[3], r = 0;
    test_must(ctx, imp_scene_add_geometry(s, name));
    test_must(ctx, imp_scene_find_param(s, name, &param));
    test_must(ctx, imp_scene_place(s, param, at, &r));
    bool good = fabs(r - radius) < 1e-6 * radius;
    for (int k = 0; k < 3; k++) good &= fabs(at[k] - want[k]) < 1e-6;
    printf("# %s: %g %g %g, radius %g\n", name, at[0], at[1], at[2], r);
    return good;
}

static void places_test(void)
{
    imp_scene *s = scene_with("<sensor type='perspective' id='camera'>" PLACED);
    static const double block[3] = {1, 2, 3}, moved[3] = {1.5, 2, 2},
                        ball[3] = {-2, 0, 1}, lamp[3] = {0, 4, 0}, camera[3] = {3, -8, 2},
                        pose[6] = {.5, 0, -1, .2, 0, 0};
    const double small = 0.05 * s->ball.radius;
    tap_ok(is_at(s, "block.pose", block, sqrt(14)), "a block");
    tap_ok(is_at(s, "ball.center", ball, sqrt(.75)), "a ball");
    tap_ok(is_at(s, "lamp.position", lamp, small), "a lamp");
    tap_ok(is_at(s, "camera.pose", camera, small), "the camera");
    size_t param;
    double at[3], r;
    test_must(ctx, imp_scene_find_param(s, "block.pose", &param));
    test_must(ctx, imp_scene_set_values(s, param, 6, pose));
    test_must(ctx, imp_scene_place(s, param, at, &r));
    tap_ok(fabs(at[0] - moved[0]) + fabs(at[1] - moved[1]) + fabs(at[2] - moved[2]) <
               1e-9,
           "the block, moved and turned # %g %g %g", at[0], at[1], at[2]);
    test_must(ctx, imp_scene_find_param(s, "sky.radiance.value", &param));
    tap_ok(imp_scene_place(s, param, at, &r) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "sky.radiance.value"),
           "what has no place # %s", imp_last_error(ctx));
    test_must(ctx, imp_scene_add_geometry(s, "pair.pose"));
    test_must(ctx, imp_scene_add_geometry(s, "pair.scale"));
    for (int k = 0; k < 2; k++) {
        static const char *const names[] = {"pair.pose", "pair.scale"};
        test_must(ctx, imp_scene_find_param(s, names[k], &param));
        tap_ok(imp_scene_place(s, param, at, &r) == IMP_E_ARG &&
                   strstr(imp_last_error(ctx), names[k]),
               "a group, which is in two places # %s", imp_last_error(ctx));
    }
    tap_ok(imp_scene_place(s, 1000000, at, &r) == IMP_E_ARG, "no such parameter # %s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(1);
    pinhole_test();
    returns_test("a camera", "<sensor type='perspective'>" PLACED);
    returns_test("a lens that distorts",
                 "<sensor type='perspective'><float name='opencv_k1' value='-.1'/><float "
                 "name='opencv_p2' value='.01'/>" PLACED);
    returns_test(
        "a thin lens",
        "<sensor type='thinlens'><float name='aperture_radius' value='.3'/><float "
        "name='focus_distance' value='7'/>" PLACED);
    returns_test("parallel rays", "<sensor type='orthographic'>" PLACED);
    imp_scene *s =
        scene_with("<sensor type='distant' id='far'><film type='hdrfilm'><integer "
                   "name='width' value='1'/><integer name='height' value='1'/>"
                   "</film></sensor>");
    double film[2];
    const enum imp_status st =
        imp_scene_film_point(s, 0, (const double[]){0, 0, 0}, film);
    tap_ok(st == IMP_E_UNSUPPORTED, "a sensor without a picture # %s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
    places_test();
    imp_context_destroy(ctx);
    return tap_done();
}
