/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by how skies are turned, and by the direction of a sun: a sky that turns is a camera that
 * turns the other way; irradiance by the sun's elevation, in closed form; a map that turns about its axis
 * as by its own rotation; a field under skies, and a meter in the shadow of a block, against differences.
 * What is refused. */
#include "egg.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include "sky_field.h"
#include <unistd.h>

/* ---- Before a sky alone ------------------------------------------------------------------------ */

#define ALONE(sky)                                                                       \
    "<scene version='3.0.0'><integrator type='direct'/><sensor type='perspective' "      \
    "id='camera'><float name='fov' value='50'/><transform name='to_world'><rotate "      \
    "x='1' angle='-80'/></transform><film type='hdrfilm'><integer name='width' "         \
    "value='24'/><integer name='height' value='16'/><rfilter type='box'/></film>"        \
    "</sensor>" sky "</scene>"

static void opposite_test(const char *what, const char *xml, const char *number)
{
    struct tap_stat camera[6] = {{0}}, sky[3] = {{0}};
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    const bool sun = strstr(number, "direction") != NULL;
    test_must(ctx, imp_scene_add_geometry(scene, "camera.pose"));
    test_must(ctx, imp_scene_add_geometry(scene, number));
    mean_gradient(ctx, scene, "camera.pose", 16, 4, camera);
    mean_gradient(ctx, scene, number, 16, 4, sky);
    double worst = 0, most = 0;
    imp_v3 turn = imp__v3(-camera[3].mean, -camera[4].mean, -camera[5].mean);
    if (sun) { /* of the length 1: its number e turns it by d x e */
        const imp_v3 d = imp__normalize(imp__v3(-.1, -1, -.15));
        turn = imp__cross(turn, d);
    }
    for (int k = 0; k < 3; k++) {
        most = fmax(most, fabs(turn[k]));
        worst = fmax(worst, fabs(sky[k].mean - turn[k]));
    }
    tap_ok(most > 1e-2 && worst < 1e-9 * most,
           "%s turns as the camera does the other way # off %.1e of %.3g", what, worst,
           most);
    imp_scene_destroy(scene);
}

/* ---- Transposes ----------------------------------------------------------------------------------- */

/* theta_bar.theta is bar.V of the light, or of the camera, for any of them. */
static void transposed_test(const char *what, imp_scene *scene, const char *name)
{
    struct imp__moves moves = imp__moves_begin(scene, scene->sensors[0]);
    double theta[12], bar[12] = {0}, sum[2] = {0};
    test_must(ctx, imp_scene_add_geometry(scene, name));
    test_must(ctx, imp__moves_add_pose(&moves, scene->poses));
    const imp_v3 p = imp__normalize(imp__v3(.3, -.8, .5)), v = imp__v3(1.2, .7, -.4),
                 eye = imp__v3(.1, .2, .3);
    for (size_t k = 0; k < moves.n; k++) theta[k] = cos(1.7 * (double)k + .4);
    if (scene->poses->sensor) {
        sum[0] = imp__dot(v, imp__camera_velocity(&moves, eye, p, theta));
        imp__camera_velocity_bar(&moves, eye, p, v, bar);
    } else {
        int k = 0;
        while (scene->emitters[k] != scene->poses->emitter) k++;
        sum[0] = imp__dot(v, imp__light_velocity(&moves, k, p, theta));
        imp__light_velocity_bar(&moves, k, p, v, bar);
    }
    for (size_t k = 0; k < moves.n; k++) sum[1] += bar[k] * theta[k];
    tap_ok(fabs(sum[0] - sum[1]) < 1e-12 && fabs(sum[0]) > 1e-3,
           "%s and its transpose # %.6g off %.1e", what, sum[0], sum[0] - sum[1]);
    imp__moves_free(&moves);
    imp_scene_destroy(scene);
}

/* ---- Closed form -------------------------------------------------------------------------------- */

/* A sun of the angular radius a, above a plane's horizon in whole, brings it pi L sin^2(a) n.w. */
static void elevation_test(void)
{
    static const char *const xml =
        "<scene version='3.0.0'><integrator type='direct'/><emitter type='sun' "
        "id='sun'><vector name='direction' value='.5,-.6,-.9'/><float name='radius' "
        "value='.2'/><rgb name='radiance' value='7'/></emitter><shape type='rectangle'>"
        "<sensor type='irradiancemeter'><film type='hdrfilm'><integer name='width' "
        "value='2'/><integer name='height' value='2'/><rfilter type='box'/></film>"
        "</sensor></shape></scene>";
    const imp_v3 d = imp__normalize(imp__v3(.5, -.6, -.9)); /* as the number begins */
    const double lit = IMP_PI * 7 * imp__sqr(sin(.2));
    struct tap_stat g[3] = {{0}};
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "sun.direction"));
    mean_gradient(ctx, scene, "sun.direction", 64, 24, g);
    for (int k = 0; k < 3; k++) {
        imp_v3 e = {0};
        e[k] = 1;
        const imp_v3 turned = e - d * imp__dot(d, e);
        char what[80];
        snprintf(what, sizeof what, "irradiance of a plane by number %d of the sun", k);
        tap_z(&g[k], -lit * turned[2], 3e-3 * lit, what);
    }
    imp_scene_destroy(scene);
}

/* ---- The same by another number ----------------------------------------------------------------- */

static void rotation_test(void)
{
    enum { SEEDS = 20 };
    struct tap_stat by_turn = {0}, by_rotation = {0};
    imp_scene *scene = sky_field(SKY_PATH SKY_ENVMAP);
    imp_problem *p;
    test_must(ctx, imp_scene_add_geometry(scene, "sky.turn"));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "sky.rotation.value"));
    test_must(ctx, imp_problem_activate(p, "sky.turn"));
    for (int s = 0; s < SEEDS; s++) {
        struct imp_run run = IMP_RUN_INIT;
        double g[4];
        run.spp = 48;
        run.seed = 50 + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
        tap_add(&by_rotation, g[0] * 180 / IMP_PI);
        tap_add(&by_turn, g[3]);
    }
    const double se = hypot(tap_se(&by_turn), tap_se(&by_rotation)),
                 z = (by_turn.mean - by_rotation.mean) / se;
    tap_ok(fabs(z) < 3.5 && se < .05 * fabs(by_turn.mean),
           "a map turns about its axis as by its rotation # %.5f %.5f se %.1e z %.2f",
           by_turn.mean, by_rotation.mean, se, z);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

#define METAL                                                                            \
    "<shape type='rectangle'><transform name='to_world'><scale value='1.2'/><rotate "    \
    "x='1' angle='20'/><translate x='1.3' y='-1.4' z='.9'/></transform><bsdf "           \
    "type='roughconductor'><float name='alpha' value='.3'/></bsdf></shape>"

/* ---- A meter ------------------------------------------------------------------------------------- */

static imp_scene *meter_below(const char *sky, const char *film)
{
    char xml[4096];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
             "value='3'/></integrator>%s<shape type='cube' id='block'><transform "
             "name='to_world'><scale x='.3' y='.5' z='.4'/><rotate z='1' angle='25'/>"
             "<translate x='-.2' y='.9' z='.7'/></transform></shape><shape "
             "type='rectangle'><sensor type='irradiancemeter'>%s<film type='hdrfilm'>"
             "<integer name='width' value='24'/><integer name='height' value='16'/>"
             "<rfilter type='box'/></film></sensor></shape></scene>",
             sky, film);
    return test_scene_text(ctx, xml, IMP_RGB);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    static const struct number turn[] = {{"sky.turn", 0, .02},
                                         {"sky.turn", 1, .02},
                                         {"sky.turn", 2, .02},
                                         {NULL, 0, 0}},
                               clear[] = {{"sky.turn", 0,
                                           .007}, /* small beside the sun */
                                          {"sky.turn", 1, .007},
                                          {"sky.turn", 2, .007},
                                          {NULL, 0, 0}},
                               sun[] = {{"sun.direction", 0, .01},
                                        {"sun.direction", 1, .01},
                                        {"sun.direction", 2, .01},
                                        {NULL, 0, 0}},
                               alone[] = {{"sky.turn", 0, .007},
                                          {"sky.turn", 2, .007},
                                          {"camera.pose", 4, .007},
                                          {NULL, 0, 0}},
                               metal[] = {{"sky.turn", 0, .02},
                                          {"sky.turn", 1, .02},
                                          {"block.pose", 0, .03},
                                          {NULL, 0, 0}},
                               both[] = {{"sky.turn", 0, .02},
                                         {"sun.direction", 1, .01},
                                         {"block.pose", 0, .03},
                                         {NULL, 0, 0}};
    char folder[] = "moved_turns_XXXXXX";
    ctx = test_context(2);
    adjoint_make();
    if (!mkdtemp(folder) || chdir(folder) != 0) exit(99);
    sky_map_write();
    opposite_test("a map", ALONE(SKY_ENVMAP), "sky.turn");
    opposite_test("a CIE sky", ALONE(SKY_CIE), "sky.turn");
    opposite_test("a clear sky", ALONE(SKY_CLEAR), "sky.turn");
    opposite_test("a sun",
                  ALONE("<emitter type='sun' id='sun'><vector name='direction' "
                        "value='-.1,-1,-.15'/><float name='radius' value='.2'/><rgb "
                        "name='radiance' value='7'/></emitter>"),
                  "sun.direction");
    numbers_compare("a clear sky alone", test_scene_text(ctx, ALONE(SKY_CLEAR), IMP_MONO),
                    32 * more, 64 * more, .06, alone);
    transposed_test("the turn of a sky", sky_field(SKY_CIE), "sky.turn");
    transposed_test("the direction of a sun", sky_field(SKY_SUN), "sun.direction");
    transposed_test("the matrix of a camera", sky_field(SKY_SUN), "camera.to_world");
    transposed_test("the matrix of a spot", sky_field("<emitter type='spot' id='spot'/>"),
                    "spot.to_world");
    elevation_test();
    rotation_test();
    numbers_compare("a map", sky_field(SKY_PATH SKY_ENVMAP), 32 * more, 64 * more, .06,
                    turn);
    numbers_compare("a CIE sky", sky_field(SKY_PATH SKY_CIE), 16 * more, 32 * more, .06,
                    turn);
    numbers_compare("sky and sun", sky_field(SKY_DIRECT SKY_CLEAR), 16 * more, 32 * more,
                    .06, clear);
    numbers_compare("a sun", sky_field(SKY_PATH SKY_SUN), 16 * more, 32 * more, .06, sun);
    numbers_compare("a map and a sun", sky_field(SKY_DIRECT SKY_ENVMAP SKY_SUN),
                    16 * more, 32 * more, .2, both);
    numbers_compare("a map over metal", sky_field(SKY_DIRECT SKY_ENVMAP METAL), 16 * more,
                    32 * more, .1, metal);
    numbers_compare("a meter below a map", meter_below(SKY_ENVMAP, ""), 16 * more,
                    32 * more, .06, turn);
    number_refused("a mask",
                   sky_field(SKY_DIRECT SKY_ENVMAP
                             "<shape type='rectangle'><bsdf type='mask'><float "
                             "name='opacity' value='.5'/><bsdf type='diffuse'/></bsdf>"
                             "</shape>"),
                   "sky.turn", "straight through");
    egg_write("egg.obj", true);
    number_refused("vertex normals", sky_field(SKY_DIRECT SKY_ENVMAP EGG_OF("egg.obj")),
                   "sky.turn", "vertex normals");
    number_refused("a sky that is the same from everywhere",
                   sky_field("<emitter type='constant' id='sky'/>"), "sky.turn",
                   "it is none of");
    if (remove("egg.obj") != 0 || remove(SKY_MAP) != 0 || chdir("..") != 0 ||
        rmdir(folder) != 0)
        exit(99);
    imp_context_destroy(ctx);
    return tap_done();
}
