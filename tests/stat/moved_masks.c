/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves where light passes masks and null materials: a screen that moves before
 * a glowing wall, or under parallel light, in closed form; imp_problem_reverse against central
 * differences in a room with a pane before the camera and a leaf under the lamp. For path, where
 * light samples stop at masks and a pass is a bounce, and for volpath, where they do not and it is
 * none. What is refused. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH "<integrator type='path'><integer name='max_depth' value='5'/></integrator>"
#define VOLPATH                                                                          \
    "<integrator type='volpath'><integer name='max_depth' value='3'/></integrator>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define GREEN                                                                            \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "                \
    "value='.2,.6,.3'/></bsdf></bsdf>"
#define MASK(OPACITY, BSDF) "<bsdf type='mask'>" OPACITY BSDF "</bsdf>"
#define EVEN(O)             "<float name='opacity' value='" O "'/>"
#define WAVES                                                                            \
    "<texture type='bitmap' name='opacity'><string name='filename' value='" IMP_SCENES   \
    "/textured/waves.png'/><boolean name='raw' value='true'/></texture>"
#define NOTHING "<bsdf type='null'/>"
/* Before the camera, smaller than its picture; under the lamp, beside the block. */
#define PANE(BSDF)                                                                       \
    "<shape type='rectangle' id='pane'><transform name='to_world'><scale x='.5' "        \
    "y='.4'/><rotate x='1' angle='80'/><translate x='.2' y='-2.5' "                      \
    "z='1.4'/></transform>" BSDF "</shape>"
#define LEAF(BSDF)                                                                       \
    "<shape type='rectangle' id='leaf'><transform name='to_world'><scale x='.5' "        \
    "y='.4'/><rotate y='1' angle='15'/><translate x='.8' y='-.4' "                       \
    "z='1.6'/></transform>" BSDF "</shape>"
/* A lamp that walks of path find behind a leaf. */
#define WIDE                                                                             \
    "<translate x='-.9' y='.2' z='-3.2'/><scale x='4' y='3'/><translate x='.3' y='-.2' " \
    "z='3.4'/>"

/* An orthographic camera that looks down on 2 x 2 of the plane z = 0 from the height EYE. */
#define DOWN(EYE)                                                                        \
    "<sensor type='orthographic'><transform name='to_world'><lookat origin='0,0," EYE    \
    "' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><integer "            \
    "name='width' value='8'/><integer name='height' value='8'/><rfilter type='box'/>"    \
    "</film></sensor>"
/* At the height 2, from x = .1 on. */
#define SCREEN(BSDF)                                                                     \
    "<shape type='rectangle' id='screen'><transform name='to_world'><scale x='2' "       \
    "y='2'/><translate x='2.1' z='2'/></transform>" BSDF "</shape>"
#define BLACK "<bsdf type='diffuse'><spectrum name='reflectance' value='0'/></bsdf>"
#define GLOWS                                                                            \
    "<shape type='rectangle'><transform name='to_world'><scale value='2'/></transform>"  \
    "<emitter type='area'><spectrum name='radiance' value='3'/></emitter></shape>"
#define FLOOR                                                                            \
    "<shape type='rectangle'><transform name='to_world'><scale value='2'/></transform>"  \
    "<bsdf type='diffuse'><spectrum name='reflectance' value='.5'/></bsdf></shape>"
#define SUN                                                                              \
    "<emitter type='directional'><vector name='direction' value='0,0,-1'/><spectrum "    \
    "name='irradiance' value='4'/></emitter>"

/* The picture's mean changes by `ref` where the screen moves by 1 along x. */
static void screen_test(const char *what, const char *rest, double ref)
{
    char xml[4096];
    struct tap_stat g[6] = {{0, 0, 0}};
    snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", rest);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "screen.pose"));
    mean_gradient(ctx, scene, "screen.pose", 512, 16, g);
    tap_z(&g[0], ref, 3e-3 * fabs(ref), what);
    imp_scene_destroy(scene);
}

static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

static void refused_test(void)
{
    number_refused("a texture that light samples pass",
                   room(VOLPATH LEAF(MASK(WAVES, GREEN))), "block.pose", "texture");
    number_refused(
        "its values jump",
        room(PATH LEAF(MASK("<texture type='checkerboard' name='opacity'/>", GREEN))),
        "block.pose", "values jump");
    number_refused("a mask that shines",
                   room(PATH LEAF(MASK(EVEN(".5"), GREEN) "<emitter type='area'/>")),
                   "block.pose", "is a light");
    number_refused("a mask of plastic",
                   room(PATH LEAF(MASK(EVEN(".5"), "<bsdf type='plastic'/>"))),
                   "block.pose", "single directions");
    number_refused(
        "masks that meet",
        room(VOLPATH LEAF(MASK(
            EVEN(".5"),
            GREEN)) "<shape type='rectangle'><transform "
                    "name='to_world'><translate x='-2'/><scale x='.5' y='.4'/><rotate "
                    "y='1' "
                    "angle='15'/><translate x='.8' y='-.4' z='1.6'/></transform>" GREEN
                    "</shape>"),
        "block.pose", "materials meet");
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    static const struct number pane[] = {{"pane.pose", 0, .02},
                                         {"camera.pose", 4, .01},
                                         {NULL, 0, 0}},
                               leaf[] = {{"leaf.pose", 3, .02},
                                         {"lamp.pose", 1, .02},
                                         {NULL, 0, 0}},
                               both[] = {{"pane.pose", 0, .02},
                                         {"leaf.pose", 2, .015},
                                         {"lamp.pose", 1, .03},
                                         {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    /* Behind it there is less by the opacity, over 1/2 of the picture's width. */
    screen_test("a screen before a wall, path",
                PATH DOWN("3") SCREEN(MASK(EVEN(".3"), BLACK)) GLOWS, .3 * 3 / 2);
    screen_test("a screen before a wall, volpath",
                VOLPATH DOWN("3") SCREEN(MASK(EVEN(".3"), BLACK)) GLOWS, .3 * 3 / 2);
    screen_test("a screen under the sun, path",
                PATH DOWN("1") SCREEN(MASK(EVEN(".3"), BLACK)) FLOOR SUN,
                .5 * 4 / IMP_PI / 2);
    screen_test("a screen under the sun, volpath",
                VOLPATH DOWN("1") SCREEN(MASK(EVEN(".3"), BLACK)) FLOOR SUN,
                .3 * .5 * 4 / IMP_PI / 2);
    numbers_compare("path, a textured pane", room(PATH PANE(MASK(WAVES, GREEN))),
                    128 * more, 64 * more, .03, pane);
    if (more > 1)
        numbers_compare("path, a textured pane and a sky",
                        room(PATH SKY PANE(MASK(WAVES, GREEN))), 256 * more, 64 * more,
                        .03, pane);
    numbers_compare(
        "path, a leaf and nothing",
        room_build(ctx, &(struct room_parts){.rest = PATH LEAF(MASK(EVEN(".7"), GREEN))
                                                 PANE(NOTHING),
                                             .lamp = WIDE}),
        128 * more, 64 * more, .06, leaf);
    numbers_compare(
        "volpath",
        room(VOLPATH PANE(MASK(EVEN(".6"), GREEN)) LEAF(MASK(EVEN(".7"), GREEN))),
        64 * more, 64 * more, .03, both);
    refused_test();
    imp_context_destroy(ctx);
    return tap_done();
}
