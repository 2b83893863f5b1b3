/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves in scenes of meshes with vertex normals: imp_problem_reverse against
 * central differences of pictures with the same random numbers. An egg of 32 triangles, on which
 * shading and geometric normals are up to 25 degrees apart, is moved, turned, scaled, and bent at
 * single vertices; the camera and the lamp move past it. Standard errors are bounded. What would
 * be biased is refused by name. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include <stdio.h>

/* ---- The egg ---------------------------------------------------------------------------- */

#define EGG "moved_smooth_egg.obj"

/* An octahedron with every triangle cut into four, on an ellipsoid: 18 vertices. normals: of the
 * ellipsoid, in the file; else importon computes them. */
static void egg_write(bool normals)
{
    static const int face[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                   {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    double p[18][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                       {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    int n = 6, middle[6][6] = {{0}};
    FILE *f = fopen(EGG, "w");
    if (!f) exit(99);
    for (int a = 0; a < 6; a++)
        for (int b = 0; b < a; b++) {
            if (a / 2 == b / 2) continue;
            for (int i = 0; i < 3; i++) p[n][i] = (p[a][i] + p[b][i]) / sqrt(2);
            middle[a][b] = middle[b][a] = n++;
        }
    for (int k = 0; k < n; k++)
        fprintf(f, "v %.9g %.9g %.9g\n", .8 * p[k][0], .6 * p[k][1], .7 * p[k][2]);
    for (int k = 0; k < n && normals; k++)
        fprintf(f, "vn %.9g %.9g %.9g\n", p[k][0] / .8, p[k][1] / .6, p[k][2] / .7);
    for (int k = 0; k < 8; k++)
        for (int j = 0; j < 4; j++) {
            const int *v = face[k];
            const int m[3] = {middle[v[0]][v[1]], middle[v[1]][v[2]], middle[v[2]][v[0]]};
            const int c[3] = {j == 3 ? m[0] : v[j], j == 3 ? m[1] : m[j],
                              j == 3 ? m[2] : m[(j + 2) % 3]};
            for (int i = 0; i < 3; i++) {
                fprintf(f, i == 0 ? "f %d" : " %d", c[i] + 1);
                if (normals) fprintf(f, "//%d", c[i] + 1);
            }
            fprintf(f, "\n");
        }
    fclose(f);
}

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

static void refused(const char *what, const char *rest, const char *white,
                    const char *name, const char *word)
{
    imp_scene *scene = room(rest, white);
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double g[6];
    run.spp = 2;
    test_must(ctx, imp_scene_add_geometry(scene, name));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, name));
    const enum imp_status st = imp_problem_reverse(p, adjoint, &run, g, NULL);
    tap_ok(word ? st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), word)
                : st == IMP_OK,
           "%s # %s", what, word ? imp_last_error(ctx) : "");
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
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
    ctx = test_context(2);
    adjoint_make();
    egg_write(true);
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
    egg_write(false);
    numbers_test("vertices", DIRECT, WHITE, 64, 128, .1, vertices);
    refused("a bulb and an egg that moves", BULB, WHITE, "egg.pose", "'bulb'");
    refused("a bulb that moves", BULB, WHITE, "bulb.position", "'egg'");
    refused("a bulb, an egg, and a camera that moves", BULB, WHITE, "camera.pose", NULL);
    remove(EGG);
    imp_context_destroy(ctx);
    return tap_done();
}
