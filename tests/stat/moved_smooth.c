/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves in scenes of meshes with vertex normals: imp_problem_reverse against
 * central differences of pictures with the same random numbers. An egg of 32 triangles, on which
 * shading and geometric normals are up to 25 degrees apart, is moved, turned, scaled, and bent at
 * single vertices, and its normals are turned alone; the camera and the lamp move past it. A tile
 * whose light is a formula of its normals. Standard errors are bounded. What would be biased is
 * refused by name. */
#include "egg.h"
#include "imp_tap.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include <stdio.h>

#define EGG "moved_smooth_egg.obj"

#define WHITE                                                                            \
    "<bsdf type='diffuse' id='white'><rgb name='reflectance' value='.8,.7,.6'/></bsdf>"
#define METAL                                                                            \
    "<bsdf type='roughconductor' id='white'><string name='material' value='Cu'/><float " \
    "name='alpha' value='.4'/></bsdf>"
#define SKY    "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"

static imp_scene *room(const char *rest, const char *white)
{
    char xml[16384], camera[4096];
    snprintf(camera, sizeof camera, ROOM_CAMERA, "", "type='box'");
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s%s%s"
             "<bsdf type='diffuse' id='floor_white'><rgb name='reflectance' "
             "value='.6,.5,.4'/></bsdf>"
             "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
             "value='3'/></transform><ref id='floor_white'/></shape>"
             "<shape type='obj' id='egg'><string name='filename' value='" EGG "'/>"
             "<transform name='to_world'><rotate x='1' y='.3' z='.2' angle='25'/>"
             "<translate x='-.2' y='-.3' z='1.1'/></transform><ref id='white'/></shape>"
             "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.9' "
             "y='.9'/><rotate x='1' y='.3' angle='160'/><translate x='1.2' y='-.9' "
             "z='3'/></transform><emitter type='area'><rgb name='radiance' "
             "value='9,8,7'/></emitter></shape></scene>",
             rest, camera, white);
    return test_scene_text(ctx, xml, IMP_RGB);
}

static void numbers_test(const char *what, const char *rest, const char *white, int spp,
                         int spp_ref, double largest, const struct number *numbers)
{
    numbers_compare(what, room(rest, white), spp, spp_ref, largest, numbers);
}

/* ---- Normals alone ---------------------------------------------------------------------------- */

#define TILE "moved_smooth_tile.obj"

/* The middle of a triangle, where each normal n_i counts a third, reflects  rho/pi E N.w/|N|. */
static void tile_test(void)
{
    static const double to_sun[3] = {.48, -.36, .8};
    double n[9], ref[9], N[3] = {0}, most = 0, worst = 0;
    struct tap_stat g[MEAN_NUMBERS_MAX] = {{0, 0, 0}};
    size_t count, index;
    FILE *f = fopen(TILE, "w");
    if (!f) exit(99);
    fprintf(f, "v -1 -1 0\nv 2 -1 0\nv -1 2 0\nvn .2 .1 1\nvn -.3 .2 .8\nvn .1 -.4 .9\n"
               "f 1//1 2//2 3//3\n");
    fclose(f);
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'>" DIRECT
        "<sensor type='perspective'><float name='fov' value='.01'/><transform "
        "name='to_world'><lookat origin='.6,-.4,3' target='0,0,0' up='0,1,0'/>"
        "</transform><film type='hdrfilm'><integer name='width' value='1'/><integer "
        "name='height' value='1'/><rfilter type='box'/></film></sensor><shape type='obj' "
        "id='tile'><string name='filename' value='" TILE "'/><bsdf type='diffuse'>"
        "<spectrum name='reflectance' value='.5'/></bsdf></shape><emitter "
        "type='directional'><vector name='direction' value='-.48,.36,-.8'/><spectrum "
        "name='irradiance' value='3'/></emitter></scene>",
        IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "tile.vertex_normals"));
    values_get(scene, "tile.vertex_normals", n, &count, &index);
    n[0] *= 1.5; /* of other lengths than 1 */
    n[4] += .3;
    test_must(ctx, imp_scene_set_values(scene, index, count, n));
    mean_gradient(ctx, scene, "tile.vertex_normals", 64, 1, g);
    for (int k = 0; k < 9; k++) N[k % 3] += n[k] / 3;
    const double length = sqrt(N[0] * N[0] + N[1] * N[1] + N[2] * N[2]);
    double cosine = 0;
    for (int i = 0; i < 3; i++) cosine += N[i] / length * to_sun[i];
    for (int k = 0; k < 9; k++) {
        ref[k] =
            .5 * 3 / IMP_PI / 3 * (to_sun[k % 3] - N[k % 3] / length * cosine) / length;
        most = fmax(most, fabs(ref[k]));
        worst = fmax(worst, fabs(ref[k] - g[k].mean));
    }
    tap_ok(count == 9 && worst < 1e-4 * most, "normals of a tile # off %.1e of %.3g",
           worst, most);
    memset(n, 0, 3 * sizeof *n);
    tap_ok(imp_scene_set_values(scene, index, count, n) == IMP_E_NUMERIC &&
               strstr(imp_last_error(ctx), "tile.vertex_normals"),
           "a normal without a direction is refused # %s", imp_last_error(ctx));
    imp_scene_destroy(scene);
    remove(TILE);
}

#define BULB                                                                             \
    DIRECT "<emitter type='point' id='bulb'><point name='position' value='1,-1,3'/>"     \
           "</emitter>"

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const struct number whole[] = {{"egg.pose", 0, .02},
                                          {"egg.pose", 5, .03},
                                          {"camera.pose", 0, .02},
                                          {"camera.pose", 5, .01},
                                          {"lamp.pose", 0, .04},
                                          {"lamp.pose", 4, .04},
                                          {NULL, 0, 0}};
    static const struct number sky[] = {
        {"camera.pose", 0, .02}, {"lamp.pose", 0, .04}, {NULL, 0, 0}};
    /* Larger steps see how the coarse silhouette bends. */
    static const struct number turns[] = {
        {"egg.pose", 3, .003}, {"egg.pose", 5, .003}, {NULL, 0, 0}};
    static const struct number metal[] = {
        {"camera.pose", 5, .01}, {"lamp.pose", 0, .04}, {NULL, 0, 0}};
    static const struct number sizes[] = {
        {"egg.scale", 0, .03}, {"camera.pose", 3, .01}, {NULL, 0, 0}};
    static const struct number vertices[] = {{"egg.vertex_positions", 1, .02},
                                             {"egg.vertex_positions", 14, .02},
                                             {"egg.vertex_positions", 20, .02},
                                             {"egg.vertex_positions", 27, .02},
                                             {"egg.vertex_positions", 31, .02},
                                             {"egg.vertex_positions", 38, .02},
                                             {NULL, 0, 0}};
    static const struct number normals[] = {
        {"egg.vertex_normals", 1, .05},  {"egg.vertex_normals", 14, .05},
        {"egg.vertex_normals", 31, .05}, {"egg.vertex_normals", 27, .05},
        {"egg.vertex_normals", 38, .05}, {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    egg_write(EGG, true);
    numbers_test("direct", DIRECT, WHITE, 64, 128, .06, whole);
    numbers_test("path and a sky", PATH SKY, WHITE, 48, 32, .06, sky);
    numbers_test("path, rough metal at grazing angles", PATH, METAL, 16, 16, .5, metal);
    numbers_test("an egg that turns under a sky", DIRECT SKY, WHITE, 64,
                 is_long ? 20000 : 96, .1, turns);
    if (is_long) {
        numbers_test("path, all", PATH, WHITE, 512, 1024, .1, whole);
        numbers_test("path, rough metal", PATH, METAL, 512, 1024, .1, whole);
        numbers_test("path, a scale", PATH, WHITE, 512, 1024, .1, sizes);
    }
    tile_test();
    numbers_test("normals", DIRECT, WHITE, 64, 192, .1, normals);
    if (is_long) {
        numbers_test("normals, path and a sky", PATH SKY, WHITE, 512, 1024, .1, normals);
        numbers_test("normals, rough metal", DIRECT, METAL, 512, 1024, .1, normals);
    }
    number_refused("normals of a rectangle", room(DIRECT, WHITE), "floor.vertex_normals",
                   "vertex normals");
    egg_write(EGG, false);
    numbers_test("vertices", DIRECT, WHITE, 64, 128, .1, vertices);
    number_refused("a bulb and an egg that moves", room(BULB, WHITE), "egg.pose",
                   "'bulb'");
    number_refused("a bulb that moves", room(BULB, WHITE), "bulb.position", "'egg'");
    number_refused("a bulb, an egg, and a camera that moves", room(BULB, WHITE),
                   "camera.pose", NULL);
    remove(EGG);
    imp_context_destroy(ctx);
    return tap_done();
}
