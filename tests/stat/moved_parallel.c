/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves of orthographic pictures: a black rectangle before a sky against the closed
 * form of what it covers, also of a film that is stretched; imp_problem_reverse against central
 * differences by poses of a block, a ball, a can, an egg with vertex normals and the camera, and below
 * a sky that varies. What is refused. */
#include "egg.h"
#include "mean_gradient.h"
#include "moves_numbers.h"

#define PATH "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define LAMP                                                                             \
    "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "        \
    "y='.3'/><rotate x='1' angle='160'/><translate x='.7' y='-.3' z='3'/></transform>"   \
    "<emitter type='area'><rgb name='radiance' value='9,8,7'/></emitter></shape>"
#define CIE                                                                              \
    "<emitter type='ciesky' id='sky'><integer name='sky' value='12'/><vector "           \
    "name='sun_direction' value='.5,-.6,.7'/></emitter>"
#define BALL                                                                             \
    "<shape type='sphere' id='ball'><float name='radius' value='.4'/><point "            \
    "name='center' x='1.1' y='-.8' z='.5'/><ref id='grey'/></shape>"
#define CAN                                                                              \
    "<shape type='cylinder' id='can'><point name='p0' x='-1.3' y='-.9' z='.3'/><point "  \
    "name='p1' x='-1.1' y='-.8' z='1.1'/><float name='radius' value='.3'/><bsdf "        \
    "type='twosided'><ref id='grey'/></bsdf></shape>"
#define EGG_FILE "moved_parallel_egg.obj"
#define EGG      EGG_OF(EGG_FILE)

static imp_scene *room(const char *rest)
{
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><bsdf type='diffuse' id='grey'><rgb "
             "name='reflectance' value='.6,.5,.4'/></bsdf>%s"
             "<sensor type='orthographic' id='camera'><transform name='to_world'><scale "
             "x='2.2' y='2.2'/><lookat origin='.4,-5.5,2.3' target='0,0,.6' "
             "up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' "
             "value='24'/><integer name='height' value='16'/><rfilter "
             "type='box'/></film></sensor>"
             "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
             "value='3'/></transform><ref id='grey'/></shape>"
             "<shape type='cube' id='block'><transform name='to_world'><scale x='.6' "
             "y='.5' z='.4'/><rotate z='1' angle='25'/><translate x='-.2' y='.3' "
             "z='.7'/></transform><ref id='grey'/></shape></scene>",
             rest);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* The film sees x from -a to a and y from -b to b; of the black rectangle half is within, x > e, |y| < h:
 * the mean is  1 - (a - e) 2h/(4ab). */
static void covered_test(void)
{
    const double a = 1.5, b = 1.2, h = .5, e = .3;
    struct tap_stat g[6] = {{0, 0, 0}}, camera[6] = {{0, 0, 0}};
    char xml[2048];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='direct'/><emitter type='constant'>"
        "<spectrum name='radiance' value='1'/></emitter>"
        "<sensor type='orthographic' id='camera'><transform name='to_world'><scale "
        "x='%g' y='%g'/><translate z='-4'/></transform><film type='hdrfilm'><integer "
        "name='width' value='8'/><integer name='height' value='8'/><rfilter "
        "type='box'/></film></sensor><shape type='rectangle' id='it'><transform "
        "name='to_world'><scale x='3' y='%g'/><translate x='%g' z='1'/></transform>"
        "<bsdf type='diffuse'><spectrum name='reflectance' "
        "value='0'/></bsdf></shape></scene>",
        a, b, h, e + 3);
    for (int k = 0; k < 2; k++) {
        imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
        const char *name = k ? "camera" : "it";
        char whole[32];
        snprintf(whole, sizeof whole, "%s.pose", name);
        test_must(ctx, imp_scene_add_pose(scene, name));
        mean_gradient(ctx, scene, whole, 64, 16, k ? camera : g);
        imp_scene_destroy(scene);
    }
    const double edge = 2 * h / (4 * a * b), far = 5 - .01; /* from the near plane */
    tap_z(&g[0], edge, 3e-3 * edge, "what a rectangle covers, by its x");
    tap_z(&camera[0], -edge, 3e-3 * edge, "by that of the camera");
    tap_z(&g[5], 0, 1e-3, "by its turn about the axis of view");
    tap_z(&g[2], 0, 1e-9, "by its distance");
    tap_z(&camera[4], -edge * far, 3e-3 * edge * far, "by the camera's turn before it");
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number block[] = {{"block.pose", 0, .02},
                                          {"block.pose", 5, .03},
                                          {"lamp.pose", 0, .03},
                                          {"camera.pose", 0, .02},
                                          {"camera.pose", 3, .01},
                                          {"camera.pose", 5, .01},
                                          {NULL, 0, 0}};
    static const struct number round[] = {{"ball.pose", 0, .02},   {"ball.scale", 0, .02},
                                          {"can.pose", 2, .02},    {"can.pose", 4, .02},
                                          {"camera.pose", 1, .02}, {NULL, 0, 0}};
    static const struct number egg[] = {{"egg.pose", 0, .02},
                                        {"egg.pose", 4, .01},
                                        {"camera.pose", 2, .02},
                                        {NULL, 0, 0}};
    static const struct number sky[] = {
        {"block.pose", 2, .02}, {"camera.pose", 4, .01}, {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    egg_write(EGG_FILE, true);
    covered_test();
    numbers_compare("block", room(PATH LAMP), 32 * more, 64 * more, .15, block);
    numbers_compare("ball and can", room(PATH LAMP BALL CAN), 64 * more, 64 * more, .2,
                    round);
    numbers_compare("egg", room(PATH LAMP EGG), 128 * more, 64 * more, .2, egg);
    numbers_compare("below a sky that varies", room(PATH CIE), 32 * more, 64 * more, .2,
                    sky);
    number_refused("a camera without a place",
                   room(PATH LAMP "<sensor type='distant' id='far'/>"), "far.pose",
                   "it has a turn");
    remove(EGG_FILE);
    imp_context_destroy(ctx);
    return tap_done();
}
