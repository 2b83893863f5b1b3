/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves where meshes pass through each other: a block that sinks into a floor, two
 * blades, balls, a lamp through a board, an egg with vertex normals through a block, instances, and what meters
 * read of them, against central differences; the visible height of a block, against its closed form. What
 * is refused. */
#include "egg.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define DIRECT "<integrator type='direct'/>"
#define SUN                                                                              \
    "<emitter type='directional' id='sun'><vector name='direction' x='-.8' y='.3' "      \
    "z='-1.6'/><rgb name='irradiance' value='3,2.5,2'/></emitter>"
#define SUNK "<translate z='-.45'/>"
#define SUNK_AND_TURNED                                                                  \
    "<translate x='.2' y='-.3' z='-.7'/><rotate x='1' y='.5' angle='20'/>"               \
    "<translate x='-.2' y='.3' z='.3'/>"
#define BLADES                                                                           \
    "<shape type='rectangle' id='blade'><transform name='to_world'><scale x='.6' "       \
    "y='.5'/><rotate y='1' angle='60'/><rotate z='1' angle='20'/><translate x='1.3' "    \
    "y='-.9' z='.8'/></transform>" THIN_GREEN "</shape>"                                 \
    "<shape type='rectangle' id='other'><transform name='to_world'><scale x='.5' "       \
    "y='.7'/><rotate y='1' angle='-20'/><rotate z='1' angle='50'/><translate x='1.2' "   \
    "y='-1' z='.9'/></transform>" THIN_RED "</shape>"
#define BLACK                                                                            \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='0'/>"     \
    "</bsdf></bsdf>"
#define BOARD(MATERIAL)                                                                  \
    "<shape type='rectangle' id='board'><transform name='to_world'><scale x='1.6' "      \
    "y='.6'/><rotate x='1' angle='90'/><rotate z='1' angle='40'/><rotate x='1' "         \
    "angle='15'/><translate x='1' y='-.3' z='3'/></transform>" MATERIAL "</shape>"
#define BALL(MORE)                                                                       \
    "<shape type='sphere' id='ball'><float name='radius' value='.6'/><point "            \
    "name='center' x='1.1' y='-.7' z='.25'/>" MORE "</shape>"
#define OTHER                                                                            \
    "<shape type='sphere' id='other'><float name='radius' value='.45'/><point "          \
    "name='center' x='.5' y='-.9' z='.6'/>" THIN_GREEN "</shape>"
#define EGG_FILE "moved_seams_egg.obj"
#define EGG                                                                              \
    "<shape type='obj' id='egg'><string name='filename' value='" EGG_FILE                \
    "'/><transform name='to_world'><scale value='.5'/><translate x='.5' y='-.1' "        \
    "z='.9'/></transform><ref id='grey'/></shape>"
#define PLACED                                                                           \
    "<shape type='shapegroup' id='g'><shape type='cube'><transform name='to_world'>"     \
    "<scale x='.4' y='.3' z='.3'/></transform>" THIN_GREEN "</shape></shape>"            \
    "<shape type='instance' id='left'><ref id='g'/><transform name='to_world'><rotate "  \
    "x='1' y='1' angle='30'/><translate x='1.2' y='-1' z='.2'/></transform></shape>"     \
    "<shape type='instance' id='right'><ref id='g'/><transform name='to_world'><rotate " \
    "z='1' y='.3' angle='40'/><translate x='1.7' y='-.9' z='.5'/></transform></shape>"

static imp_scene *room(const char *rest, const char *block)
{
    return room_build(ctx, &(struct room_parts){.rest = rest, .block = block});
}

/* A meter under a lamp that a black board divides, beside a block that is sunk into the floor. */
static imp_scene *meter(const char *kind)
{
    char xml[8192];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'>" PATH
        "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
        "value='3'/></transform>" THIN_GREEN "</shape>"
        "<shape type='cube' id='block'><transform name='to_world'><scale x='.4' "
        "y='.5' z='.6'/><rotate x='1' z='1' angle='25'/><translate x='1.1' y='.3' "
        "z='.2'/></transform>" THIN_RED "</shape>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "
        "y='.7'/><rotate x='1' angle='170'/><translate x='.9' y='-.2' z='2.2'/>"
        "</transform><emitter type='area'><rgb name='radiance' value='9,8,7'/>"
        "</emitter></shape>"
        "<shape type='rectangle' id='board'><transform name='to_world'><scale "
        "x='1.6' y='.6'/><rotate x='1' angle='90'/><rotate z='1' angle='40'/>"
        "<rotate x='1' angle='15'/><translate x='1' y='-.3' z='2'/></transform>" BLACK
        "</shape>"
        "<shape type='rectangle' id='table'><transform name='to_world'><scale "
        "x='.8' y='.7'/><translate x='-.3' z='.3'/></transform><bsdf type='diffuse'>"
        "<rgb name='reflectance' value='.5'/></bsdf><sensor type='irradiancemeter' "
        "id='meter'>%s<film type='hdrfilm'><integer name='width' value='4'/>"
        "<integer name='height' value='3'/><rfilter type='box'/></film></sensor>"
        "</shape></scene>",
        kind);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* A black block that stands in a floor of radiance L, seen by parallel rays from an elevation of 30 degrees:
 * of its width w it hides  w cos(30) dz  more as it rises by dz, however deep it is sunk, and as the
 * floor falls. */
static void height_test(void)
{
    struct tap_stat g[2][6] = {{{0, 0, 0}}};
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'>" DIRECT
        "<sensor type='orthographic'><transform name='to_world'><scale value='2'/>"
        "<lookat origin='0,-4.33012701892,2.5' target='0,0,0' up='0,0,1'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' "
        "value='16'/><rfilter type='box'/></film></sensor>"
        "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
        "value='9'/></transform><emitter type='area'><spectrum name='radiance' "
        "value='2'/></emitter></shape>"
        "<shape type='cube' id='block'><transform name='to_world'><scale x='.6' y='.5' "
        "z='.4'/><translate x='.1' y='.2' z='.15'/></transform><bsdf type='diffuse'>"
        "<spectrum name='reflectance' value='0'/></bsdf></shape></scene>",
        IMP_MONO);
    const double ref = 2 * 1.2 * sqrt(0.75) / 16;
    static const char *const names[] = {"block.pose", "floor.pose"};
    for (int k = 0; k < 2; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    for (int k = 0; k < 2; k++) mean_gradient(ctx, scene, names[k], 64, 16, g[k]);
    tap_z(&g[0][2], -ref, 3e-3 * ref, "what a block hides of a floor, by its height");
    tap_z(&g[1][2], ref, 3e-3 * ref, "by the floor's");
    imp_scene_destroy(scene);
}

/* A black ball of radius r, whose centre is h below a floor in parallel light from above, seen from there:
 * it hides  pi (r^2 - h^2)  of the floor, whose radiance is  rho E/pi. */
static void ball_test(void)
{
    struct tap_stat g[6] = {{0, 0, 0}}, grows[1] = {{0, 0, 0}}, falls[6] = {{0, 0, 0}};
    const double r = .9, h = .5, rho = .6, E = 4, ref = 2 * rho * E / 16;
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'>" DIRECT
        "<sensor type='orthographic'><transform name='to_world'><scale value='2'/>"
        "<lookat origin='.1,.2,5' target='.1,.2,0' up='0,1,0'/></transform><film "
        "type='hdrfilm'><integer name='width' value='16'/><integer name='height' "
        "value='16'/><rfilter type='box'/></film></sensor><emitter type='directional'>"
        "<vector name='direction' value='0,0,-1'/><spectrum name='irradiance' value='4'/>"
        "</emitter><shape type='rectangle' id='floor'><transform name='to_world'><scale "
        "value='9'/></transform><bsdf type='diffuse'><spectrum name='reflectance' "
        "value='.6'/></bsdf></shape><shape type='sphere' id='ball'><point name='center' "
        "value='0,0,-.5'/><float name='radius' value='.9'/><bsdf type='diffuse'>"
        "<spectrum name='reflectance' value='0'/></bsdf></shape></scene>",
        IMP_MONO);
    static const char *const names[] = {"ball.pose", "ball.scale", "floor.pose"};
    for (int k = 0; k < 3; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    mean_gradient(ctx, scene, names[0], 64, 16, g);
    mean_gradient(ctx, scene, names[1], 64, 16, grows);
    mean_gradient(ctx, scene, names[2], 64, 16, falls);
    tap_z(&g[0], 0, 3e-3 * ref * r, "a ball in a floor, shifted along it");
    tap_z(&g[2], -ref * h, 3e-3 * ref * r, "a ball in a floor, by its height");
    tap_z(&grows[0], -ref * r * r, 3e-3 * ref * r, "by its size");
    tap_z(&falls[2], ref * h, 3e-3 * ref * r, "by the floor's height");
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    static const struct number block[] = {
        {"block.pose", 0, .02},  {"block.pose", 1, .02},
        {"block.pose", 2, .02},  {"block.pose", 3, .02},
        {"block.pose", 5, .02},  {"block.scale", 0, .02},
        {"camera.pose", 0, .02}, {NULL, 0, 0}};
    static const struct number blades[] = {{"blade.pose", 0, .02},
                                           {"blade.pose", 2, .02},
                                           {"blade.pose", 4, .02},
                                           {"other.pose", 1, .02},
                                           {"other.pose", 3, .02},
                                           {"blade.scale", 0, .02},
                                           {NULL, 0, 0}};
    static const struct number lamp[] = {{"lamp.pose", 1, .02},   {"lamp.pose", 2, .02},
                                         {"lamp.pose", 3, .02},   {"board.pose", 0, .02},
                                         {"board.pose", 1, .02},  {"board.pose", 5, .02},
                                         {"camera.pose", 5, .01}, {NULL, 0, 0}};
    static const struct number balls[] = {{"ball.pose", 0, .02},   {"ball.pose", 2, .02},
                                          {"ball.scale", 0, .02},  {"other.pose", 1, .02},
                                          {"camera.pose", 0, .02}, {NULL, 0, 0}};
    static const struct number egg[] = {{"egg.pose", 0, .02},
                                        {"egg.pose", 2, .02},
                                        {"egg.pose", 4, .02},
                                        {"block.pose", 2, .02},
                                        {NULL, 0, 0}};
    static const struct number placed[] = {{"left.pose", 0, .02},
                                           {"right.pose", 2, .02},
                                           {"left.scale", 0, .02},
                                           {NULL, 0, 0}};
    static const struct number meters[] = {{"lamp.pose", 0, .02},  {"board.pose", 1, .02},
                                           {"board.pose", 3, .02}, {"block.pose", 2, .02},
                                           {"table.pose", 0, .02}, {NULL, 0, 0}};
    /* From a point in its plane a board is a line. */
    static const struct number points[] = {{"lamp.pose", 0, .02},
                                           {"board.pose", 1, .004},
                                           {"board.pose", 3, .004},
                                           {"block.pose", 2, .02},
                                           {NULL, 0, 0}};
    const bool is_long = tap_is_long(argc, argv);
    const int more = is_long ? 16 : 1;
    ctx = test_context(2);
    adjoint_make();
    egg_write(EGG_FILE, true);
    height_test();
    ball_test();
    numbers_compare("a block in a floor", room(DIRECT, SUNK), 24 * more, 32 * more, .1,
                    block);
    numbers_compare("two blades", room(PATH BLADES, ""), 24 * more, 32 * more, .15,
                    blades);
    numbers_compare("a lamp through a board", room(PATH BOARD(BLACK), ""), 64 * more,
                    32 * more, .15, lamp);
    numbers_compare("balls in a floor and in each other",
                    room(PATH BALL("<ref id='grey'/>") OTHER, ""), 24 * more, 32 * more,
                    .2, balls);
    numbers_compare("a meter", meter(""), 512 * more, 1024 * more, .2, meters);
    if (is_long) {
        numbers_compare("a block aslant, over bounces", room(PATH SUN, SUNK_AND_TURNED),
                        32 * more, 48 * more, .15, block);
        numbers_compare("an egg in a block", room(PATH EGG, ""), 24 * more, 32 * more, .2,
                        egg);
        numbers_compare("instances in each other", room(PATH PLACED, ""), 24 * more,
                        32 * more, .15, placed);
        numbers_compare("a grid of points",
                        meter("<boolean name='virtual' value='true'/><string name='at' "
                              "value='points'/>"),
                        64 * more, 2048 * more, .3, points);
    }
    number_refused("a lamp through a board that reflects",
                   room(DIRECT BOARD(THIN_GREEN), ""), "camera.pose", "which reflects");
    number_refused("a ball that shines in the floor",
                   room(DIRECT BALL("<emitter type='area'/>"), ""), "block.pose",
                   "one of them is a sphere");
    number_refused("a disk in the floor",
                   room(DIRECT "<shape type='disk' id='disk'><transform name='to_world'>"
                               "<scale value='.3'/><rotate x='1' angle='60'/>"
                               "</transform></shape>",
                        ""),
                   "block.pose", "disk or cylinder");
    number_refused("a mesh whose vertices lie in a surface, on both sides of it",
                   room(DIRECT "<shape type='obj' id='egg'><string name='filename' "
                               "value='" EGG_FILE "'/></shape>",
                        ""),
                   "egg.pose", "lies on shape 'floor'");
    remove(EGG_FILE);
    imp_context_destroy(ctx);
    return tap_done();
}
