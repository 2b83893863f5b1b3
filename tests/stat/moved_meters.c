/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of the readings of meters by what moves: illuminance of a point under a lamp that moves,
 * against its closed form; imp_problem_reverse against central differences for meters with an area, on
 * a shape of the scene or on one that is not there, and for grids of points: planar, turned,
 * cylindrical and semicylindrical; below area lamps, point lamps and skies, behind a block. What is
 * refused. */
#include "egg.h"
#include "mean_gradient.h"
#include "moves_numbers.h"

#define DIRECT                                                                           \
    "<integrator type='path'><integer name='max_depth' value='1'/></integrator>"
#define PATH "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define LAMP                                                                             \
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "        \
    "y='.3'/><rotate x='1' angle='160'/><translate x='.7' y='-.3' z='2.4'/></transform>" \
    "<emitter type='area'><rgb name='radiance' value='9,8,7'/></emitter></shape>"
#define BULB                                                                             \
    "<emitter type='point' id='bulb'><point name='position' x='.8' y='-.6' z='2.2'/>"    \
    "<rgb name='intensity' value='6,5,4'/></emitter>"
#define SUN                                                                              \
    "<emitter type='directional' id='sun'><vector name='direction' x='-.8' y='.3' "      \
    "z='-1.6'/><rgb name='irradiance' value='3,2.5,2'/></emitter>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define CIE                                                                              \
    "<emitter type='ciesky' id='sky'><integer name='sky' value='12'/><vector "           \
    "name='sun_direction' value='.5,-.6,.7'/></emitter>"
#define FILM(W, H)                                                                       \
    "<film type='hdrfilm'><integer name='width' value='" W "'/><integer name='height' "  \
    "value='" H "'/><rfilter type='box'/></film>"
#define GREY "<bsdf type='diffuse'><rgb name='reflectance' value='.6,.5,.4'/></bsdf>"
#define PLACE                                                                            \
    "<transform name='to_world'><scale x='1.4' y='1.1'/><translate "                     \
    "z='.05'/></transform>"
#define ON(SENSOR) "<shape type='rectangle' id='table'>" PLACE GREY SENSOR "</shape>"
#define AREA       ON("<sensor type='irradiancemeter' id='meter'>" FILM("4", "3") "</sensor>")
#define VIRTUAL(MORE)                                                                    \
    ON("<sensor type='irradiancemeter' id='meter'><boolean name='virtual' "              \
       "value='true'/>" MORE FILM("4", "3") "</sensor>")
#define POINTS  "<string name='at' value='points'/>"
#define LEANS   "<vector name='facing' x='.3' y='-.5' z='1'/>"
#define UPRIGHT "<string name='receiver' value='cylindrical'/>"
#define HALF                                                                             \
    "<string name='receiver' value='semicylindrical'/><vector name='facing' x='.3' "     \
    "y='-1' z='0'/>"

#define BALL                                                                             \
    "<shape type='sphere'><point name='center' x='0' y='0' z='.5'/><float "              \
    "name='radius' value='.2'/>" GREY                                                    \
    "<sensor type='irradiancemeter'>" FILM("1", "1") "</sensor></shape>"
#define EGG_FILE "moved_meters_egg.obj"
#define EGG                                                                              \
    "<shape type='obj' id='egg'><string name='filename' value='" EGG_FILE                \
    "'/><transform name='to_world'><scale value='.5'/><translate x='-.6' y='-.4' "       \
    "z='.7'/></transform>" GREY "</shape>"

/* A floor, a wall, a block above the meter; REST: the meter, lights, integrator. */
static imp_scene *room(const char *rest)
{
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s"
             "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
             "value='3'/></transform>" GREY "</shape>"
             "<shape type='rectangle' id='wall'><transform name='to_world'><scale x='3' "
             "y='1.5'/><rotate x='1' angle='90'/><translate y='1.6' z='1.6'/></transform>"
             "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
             "value='.7,.5,.3'/></bsdf></bsdf></shape>"
             "<shape type='cube' id='block'><transform name='to_world'><scale x='.4' "
             "y='.3' z='.1'/><rotate z='1' angle='25'/><rotate x='1' angle='15'/>"
             "<translate x='.3' y='.1' z='1.1'/></transform>" GREY "</shape></scene>",
             rest);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* Illuminance of the point (0, 0, 0) by a rectangle of half sides a, b at (x, y, h) that looks down,
 * by the sum over its edges (Lambert): L/2 sum_i angle_i (n_i.z). */
static double lambert(double x, double y, double h, double L)
{
    const double a = .5, b = .3;
    const imp_v3 corner[4] = {imp__v3(x - a, y - b, h), imp__v3(x + a, y - b, h),
                              imp__v3(x + a, y + b, h), imp__v3(x - a, y + b, h)};
    double sum = 0;
    for (int k = 0; k < 4; k++) {
        const imp_v3 p = imp__normalize(corner[k]),
                     q = imp__normalize(corner[(k + 1) % 4]);
        const imp_v3 n = imp__normalize(imp__cross(p, q));
        sum += acos(imp__dot(p, q)) * n[2];
    }
    return fabs(sum) * L / 2;
}

static void point_test(void)
{
    const double h = 1e-4, at[3] = {.7, -.2, 1.5};
    struct tap_stat g[6] = {{0, 0, 0}};
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'>" DIRECT
        "<shape type='rectangle' id='table'><sensor type='irradiancemeter'><boolean "
        "name='virtual' value='true'/>" POINTS FILM(
            "1",
            "1") "</sensor></shape>"
                 "<shape type='rectangle' id='lamp'><transform name='to_world'><scale "
                 "x='.5' "
                 "y='.3'/><rotate x='1' angle='180'/><translate x='.7' y='-.2' z='1.5'/>"
                 "</transform><emitter type='area'><spectrum name='radiance' "
                 "value='7'/></emitter>"
                 "</shape></scene>",
        IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "lamp.pose"));
    mean_gradient(ctx, scene, "lamp.pose", 512, 16, g);
    for (int k = 0; k < 3; k++) {
        double to[2][3];
        for (int s = 0; s < 2; s++)
            for (int i = 0; i < 3; i++) to[s][i] = at[i] + (s ? h : -h) * (i == k);
        const double ref = (lambert(to[1][0], to[1][1], to[1][2], 7) -
                            lambert(to[0][0], to[0][1], to[0][2], 7)) /
                           (2 * h);
        char what[64];
        snprintf(what, sizeof what, "a point under a lamp that moves along %c", "xyz"[k]);
        tap_z(&g[k], ref, 5e-3 * fabs(ref), what);
    }
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number lamp[] = {{"lamp.pose", 0, .03},  {"lamp.pose", 2, .03},
                                         {"lamp.pose", 3, .03},  {"block.pose", 0, .03},
                                         {"block.pose", 5, .03}, {NULL, 0, 0}};
    static const struct number table[] = {{"table.pose", 0, .03},
                                          {"table.pose", 2, .03},
                                          {"table.pose", 3, .03},
                                          {NULL, 0, 0}};
    static const struct number upright[] = {{"table.pose", 2, .03},
                                            {"table.pose", 4, .03},
                                            {"table.pose", 5, .03},
                                            {NULL, 0, 0}};
    static const struct number bulb[] = {{"bulb.position", 0, .03},
                                         {"bulb.position", 2, .03},
                                         {"block.pose", 0, .03},
                                         {NULL, 0, 0}};
    static const struct number sun[] = {
        {"sun.direction", 0, .02}, {"block.pose", 3, .03}, {NULL, 0, 0}};
    static const struct number egg[] = {{"egg.pose", 0, .02},
                                        {"egg.pose", 2, .02},
                                        {"egg.pose", 3, .01},
                                        {"lamp.pose", 0, .03},
                                        {NULL, 0, 0}};
    static const struct number alone[] = {
        {"egg.pose", 0, .02}, {"egg.pose", 2, .02}, {"egg.pose", 3, .01}, {NULL, 0, 0}};
    static const struct number block[] = {{"block.pose", 0, .03},
                                          {"block.pose", 2, .03},
                                          {"block.pose", 3, .03},
                                          {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    egg_write(EGG_FILE, true);
    point_test();
    numbers_compare("lamp", room(AREA DIRECT LAMP), 256 * more, 256 * more, .1, lamp);
    numbers_compare("over bounces", room(AREA PATH LAMP), 256 * more, 512 * more, .1,
                    lamp);
    numbers_compare("a table that moves", room(AREA PATH LAMP), 256 * more, 512 * more,
                    .1, table);
    numbers_compare("bulb", room(AREA PATH BULB), 256 * more, 512 * more, .1, bulb);
    numbers_compare("sun", room(AREA PATH SUN), 256 * more, 512 * more, .2, sun);
    numbers_compare("sky", room(AREA PATH SKY), 256 * more, 512 * more, .2, block);
    numbers_compare("a sky that varies", room(AREA PATH CIE), 256 * more, 512 * more, .2,
                    block);
    numbers_compare("cells that are not there", room(VIRTUAL("") PATH LAMP), 256 * more,
                    512 * more, .1, lamp);
    numbers_compare("points", room(VIRTUAL(POINTS) PATH LAMP), 256 * more, 512 * more, .4,
                    lamp);
    numbers_compare("points below a sky", room(VIRTUAL(POINTS) PATH CIE), 256 * more,
                    512 * more, .2, block);
    numbers_compare("cylinders", room(VIRTUAL(POINTS UPRIGHT) PATH LAMP), 256 * more,
                    512 * more, .5, lamp);
    numbers_compare("halves of cylinders", room(VIRTUAL(HALF) PATH LAMP), 256 * more,
                    512 * more, .3, lamp);
    numbers_compare("an egg with vertex normals", room(AREA EGG PATH LAMP), 256 * more,
                    512 * more, .2, egg);
    numbers_compare("points and an egg", room(VIRTUAL(POINTS) EGG PATH SKY), 1024 * more,
                    512 * more, .5, alone);
    number_refused("a ball", room(BALL PATH LAMP), "lamp.pose", "flat");
    numbers_compare("cells that move", room(VIRTUAL("") PATH LAMP), 256 * more,
                    512 * more, .1, table);
    numbers_compare("points that move below a sky", room(VIRTUAL(POINTS LEANS) PATH CIE),
                    256 * more, 512 * more, .2, table);
    numbers_compare("halves of cylinders that move", room(VIRTUAL(HALF) PATH CIE),
                    256 * more, 512 * more, .2, upright);
    remove(EGG_FILE);
    return tap_done();
}
