/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves of fine meshes: a ball of 1,280 triangles, made an ellipsoid, flat and with
 * vertex normals, under a lamp, against central differences of pictures with the same random
 * numbers. Near its silhouettes facets are seen at such flat angles that a look beside an edge may pass
 * them. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include <stdio.h>

#define EGG "moved_fine_egg.obj"
enum { LEVELS = 3, FACES = 20 << 2 * LEVELS };

static double at[3 * FACES][3];
static int face[FACES][3], n_at = 0;

/* A vertex at this place of the ball; the one that is there. */
static int vertex(const double p[3])
{
    double q[3];
    const double r = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (int i = 0; i < 3; i++) q[i] = p[i] / r;
    for (int k = 0; k < n_at; k++)
        if (fabs(q[0] - at[k][0]) + fabs(q[1] - at[k][1]) + fabs(q[2] - at[k][2]) < 1e-9)
            return k;
    memcpy(at[n_at], q, sizeof q);
    return n_at++;
}

/* An icosahedron, each of whose triangles becomes four, LEVELS times. */
static void egg_write(void)
{
    const double t = (1 + sqrt(5)) / 2,
                 corner[12][3] = {{-1, t, 0}, {1, t, 0}, {-1, -t, 0}, {1, -t, 0},
                                  {0, -1, t}, {0, 1, t}, {0, -1, -t}, {0, 1, -t},
                                  {t, 0, -1}, {t, 0, 1}, {-t, 0, -1}, {-t, 0, 1}};
    static const int first[20][3] = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10},
                                     {0, 10, 11}, {1, 5, 9},  {5, 11, 4}, {11, 10, 2},
                                     {10, 7, 6},  {7, 1, 8},  {3, 9, 4},  {3, 4, 2},
                                     {3, 2, 6},   {3, 6, 8},  {3, 8, 9},  {4, 9, 5},
                                     {2, 4, 11},  {6, 2, 10}, {8, 6, 7},  {9, 8, 1}};
    for (int k = 0; k < 12; k++) vertex(corner[k]);
    memcpy(face, first, sizeof first);
    for (int n = 20; n < FACES; n *= 4)
        for (int k = n - 1; k >= 0; k--) {
            const int v[3] = {face[k][0], face[k][1], face[k][2]};
            int m[3];
            for (int c = 0; c < 3; c++) {
                double p[3];
                for (int i = 0; i < 3; i++) p[i] = at[v[c]][i] + at[v[(c + 1) % 3]][i];
                m[c] = vertex(p);
            }
            for (int c = 0; c < 4; c++) {
                face[4 * k + c][0] = c == 3 ? m[0] : v[c];
                face[4 * k + c][1] = c == 3 ? m[1] : m[c];
                face[4 * k + c][2] = c == 3 ? m[2] : m[(c + 2) % 3];
            }
        }
    FILE *f = fopen(EGG, "w");
    if (!f) exit(99);
    for (int k = 0; k < n_at; k++)
        fprintf(f, "v %.9g %.9g %.9g\n", .6 * at[k][0], .5 * at[k][1], .35 * at[k][2]);
    for (int k = 0; k < FACES; k++)
        fprintf(f, "f %d %d %d\n", face[k][0] + 1, face[k][1] + 1, face[k][2] + 1);
    fclose(f);
}

#define LIT                                                                              \
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "        \
    "y='.7'/><rotate x='1' angle='205'/><translate x='.9' y='-2' z='3.2'/></transform>"  \
    "<emitter type='area'><rgb name='radiance' value='9,8,7'/></emitter></shape>"
#define GLOWS "<emitter type='area'><rgb name='radiance' value='1,1,1'/></emitter>"

static imp_scene *room(bool flat, const char *paint, const char *wall, const char *lamp)
{
    char xml[16384];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='2'/></integrator><sensor type='perspective' id='camera'><float "
        "name='fov' value='30'/><transform name='to_world'><lookat origin='.4,-5.5,2.6' "
        "target='-.2,.3,1.1' up='0,0,1'/></transform><film type='hdrfilm'><integer "
        "name='width' value='%d'/><integer name='height' value='%d'/><rfilter "
        "type='box'/></film><sampler type='independent'/></sensor>"
        "<bsdf type='diffuse' id='black'><rgb name='reflectance' value='0,0,0'/></bsdf>"
        "<bsdf type='diffuse' id='paint'><rgb name='reflectance' value='%s'/></bsdf>"
        "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
        "value='9'/></transform><ref id='black'/>%s</shape>"
        "<shape type='obj' id='egg'><string name='filename' value='" EGG "'/><boolean "
        "name='face_normals' value='%s'/><transform name='to_world'><rotate z='1' "
        "angle='25'/><translate x='-.2' y='.3' z='1.1'/></transform><ref "
        "id='paint'/></shape>%s</scene>",
        WIDTH, HEIGHT, paint, wall, flat ? "true" : "false", lamp);
    return test_scene_text(ctx, xml, IMP_RGB);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    static const struct number shifts[] = {
        {"egg.pose", 0, .02}, {"egg.pose", 1, .02}, {"egg.pose", 2, .02}, {NULL, 0, 0}};
    const int spp = is_long ? 256 : 32, spp_ref = is_long ? 4096 : 256;
    ctx = test_context(2);
    adjoint_make();
    egg_write();
    numbers_compare("a black egg before a floor that glows",
                    room(true, "0,0,0", GLOWS, ""), spp, spp_ref, .05, shifts);
    numbers_compare("an egg of facets", room(true, ".2,.5,.7", "", LIT), spp, spp_ref, .1,
                    shifts);
    numbers_compare("an egg with vertex normals", room(false, ".2,.5,.7", "", LIT), spp,
                    spp_ref, .15, shifts);
    remove(EGG);
    imp_context_destroy(ctx);
    return tap_done();
}
