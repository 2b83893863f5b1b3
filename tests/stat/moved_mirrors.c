/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves, seen in flat mirrors, panes and coats of plastic: a disk before a glowing
 * wall, in a mirror at 45 degrees; a wall that a mirror turns past the camera; recorded walks over mirrors (check's frozen rows);
 * imp_problem_reverse against central differences in a room with mirrors. What is refused. */
#include "egg.h"
#include "imp_check_rows.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define DEEP "<integrator type='path'><integer name='max_depth' value='5'/></integrator>"
#define SKY  "<emitter type='constant'><rgb name='radiance' value='.4,.5,.6'/></emitter>"
#define MIRROR                                                                           \
    "<bsdf type='twosided'><bsdf type='conductor'><string name='material' value='Cu'/>"  \
    "</bsdf></bsdf>"
#define PERFECT "<bsdf type='conductor'><string name='material' value='none'/></bsdf>"
#define PANE    "<bsdf type='thindielectric'/>"
#define PLASTIC                                                                          \
    "<bsdf type='plastic' id='grey'><rgb name='diffuse_reflectance' value='.6,.5,.4'/>"  \
    "</bsdf>"
#define MATT                                                                             \
    "<bsdf type='roughplastic' id='grey'><float name='alpha' value='.4'/><rgb "          \
    "name='diffuse_reflectance' value='.6,.5,.4'/></bsdf>"
#define DARK "<bsdf type='diffuse' id='grey'><rgb name='reflectance' value='0'/></bsdf>"
#define ROUGH                                                                            \
    "<bsdf type='roughconductor' id='grey'><float name='alpha' value='.3'/></bsdf>"
#define BLACK "<bsdf type='diffuse'><spectrum name='reflectance' value='0'/></bsdf>"

/* Beside the block, seen by the camera. */
#define BATHROOM(BSDF)                                                                   \
    "<shape type='rectangle' id='mirror'><transform name='to_world'><scale x='1.1' "     \
    "y='.9'/><rotate x='1' angle='90'/><rotate z='1' angle='-20'/><translate x='.9' "    \
    "y='1.6' z='1.2'/></transform>" BSDF "</shape>"
/* A second one, which faces the first. */
#define OTHER(BSDF)                                                                      \
    "<shape type='rectangle' id='other'><transform name='to_world'><scale x='.7' "       \
    "y='.8'/><rotate x='1' angle='-90'/><rotate z='1' angle='35'/><translate x='1.9' "   \
    "y='-1.2' z='1'/></transform>" BSDF "</shape>"
#define WINDOW                                                                           \
    "<shape type='rectangle' id='pane'><transform name='to_world'><scale x='.7' "        \
    "y='.6'/><rotate x='1' angle='70'/><rotate z='1' angle='20'/><translate x='.3' "     \
    "y='-2.2' z='1.3'/></transform>" PANE "</shape>"

#define EGG "moved_mirrors_egg.obj"
#define BALL                                                                             \
    "<shape type='sphere' id='ball'><float name='radius' value='.35'/><point "           \
    "name='center' x='.9' y='.7' z='.6'/><ref id='grey'/></shape>"
/* A cube whose sides are mirrors, in an instance. */
#define PLACED                                                                           \
    "<shape type='shapegroup' id='g'><shape type='cube'><transform name='to_world'>"     \
    "<scale x='.5' y='.3' z='.4'/></transform>" MIRROR "</shape></shape>"                \
    "<shape type='instance' id='placed'><ref id='g'/><transform "                        \
    "name='to_world'><rotate "                                                           \
    "x='1' y='1' angle='20'/><translate x='1.2' y='-.6' z='.8'/></transform></shape>"

static imp_scene *room_of(const char *rest, const char *grey)
{
    return room_build(ctx, &(struct room_parts){.rest = rest, .grey = grey});
}
static imp_scene *room(const char *rest) { return room_of(rest, NULL); }

/* An orthographic camera that looks along +y on 2 x 2, at a mirror that turns its rays to +x, where a
 * wall of radiance 3 glows; a black disk of radius r, or a square, is before it. Images
 * are behind far_clip, and the mirror is not. `place`: where all of that is;
 * `mirror`: from -1 to 1 in x and y. */
static imp_scene *disk_scene(const char *place, const char *mirror, const char *disk)
{
    char xml[8192];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'>" PATH
        "<sensor type='orthographic' id='camera'><float name='far_clip' value='3.5'/>"
        "<transform name='to_world'><lookat origin='0,-2,0' target='0,0,0' "
        "up='0,0,1'/>%s</transform><film type='hdrfilm'>"
        "<integer name='width' value='8'/><integer name='height' value='8'/><rfilter "
        "type='box'/></film></sensor>"
        "<shape id='mirror' %s<transform name='to_world'><scale x='1.8' y='1.5'/>"
        "<rotate x='1' angle='90'/><rotate z='1' angle='-45'/>%s</transform>"
        "<bsdf type='twosided'>" PERFECT "</bsdf></shape>"
        "<shape type='%s' id='disk'><transform name='to_world'><scale value='.4'/>"
        "<rotate y='1' angle='-90'/><translate x='-2' y='-.3' z='.2'/>%s</transform>"
        "<bsdf type='twosided'>" BLACK "</bsdf></shape>"
        "<shape type='rectangle' id='wall'><transform name='to_world'><scale x='3' "
        "y='2'/><rotate y='1' angle='90'/><translate x='-4' y='-1.3'/>%s</transform>"
        "<emitter type='area'><spectrum name='radiance' value='3'/></emitter></shape>"
        "</scene>",
        place, mirror, place, disk, place, place);
    return test_scene_text(ctx, xml, IMP_MONO);
}

#define GRID "moved_mirrors_grid.obj"
/* A square of 20 x 20 squares. */
static void grid_write(void)
{
    enum { N = 20 };
    FILE *f = fopen(GRID, "w");
    if (!f) exit(99);
    for (int k = 0; k < (N + 1) * (N + 1); k++)
        fprintf(f, "v %.9g %.9g 0\n", k % (N + 1) * 2. / N - 1, k / (N + 1) * 2. / N - 1);
    for (int k = 0; k < N * N; k++) {
        const int a = k / N * (N + 1) + k % N + 1;
        fprintf(f, "f %d %d %d %d\n", a, a + 1, a + N + 2, a + N + 1);
    }
    fclose(f);
}

/* Two facets of a flat mirror whose corners are rounded are one plane, and so are 800. */
static void facets_test(void)
{
    static const char *const mirror[] =
        {"type='rectangle'>", "type='obj'><string name='filename' value='" GRID
                              "'/><boolean name='face_normals' value='true'/>"},
                             *const what[] = {"a square in a small mirror",
                                              "a square in a small mirror of 800 facets"};
    const double r = .4;
    grid_write();
    for (int k = 0; k < 2; k++) {
        struct tap_stat size[1] = {{0, 0, 0}};
        imp_scene *scene = disk_scene("<scale value='.012'/><rotate x='1' y='.3' z='.7' "
                                      "angle='41'/><translate x='1.3' y='-.7' z='2.1'/>",
                                      mirror[k], "rectangle");
        test_must(ctx, imp_scene_add_geometry(scene, "disk.scale"));
        mean_gradient(ctx, scene, "disk.scale", 128, 16, size);
        tap_z(&size[0], -3 * 2 * 4 * r * r / 4, k ? .03 : .006, what[k]);
        imp_scene_destroy(scene);
    }
    remove(GRID);
}

static void disk_test(void)
{
    struct tap_stat size[1] = {{0, 0, 0}}, wall[6] = {{0, 0, 0}}, turn[6] = {{0, 0, 0}};
    imp_scene *scene = disk_scene("", "type='rectangle'>", "disk");
    static const char *const names[] = {"disk.scale", "wall.pose", "mirror.pose"};
    for (int k = 0; k < 3; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    mean_gradient(ctx, scene, names[0], 64, 16, size);
    mean_gradient(ctx, scene, names[1], 64, 16, wall);
    mean_gradient(ctx, scene, names[2], 64, 16, turn);
    const double r = .4, width = 2. / 4;
    tap_z(&size[0], -3 * 2 * IMP_PI * r * r / 4, 2e-3, "a disk in a mirror, by its size");
    tap_z(&wall[1], 3 * width, 4e-3, "a wall in a mirror, shifted along it");
    tap_z(&turn[0], -3 * width, 4e-3, "by the mirror's place");
    tap_z(&turn[5], 3 * 8 * width, 3e-2, "turned, by twice the angle");
    imp_scene_destroy(scene);
}

static void refused_test(void)
{
    number_refused("a mirror under a mask",
                   room(PATH BATHROOM("<bsdf type='mask'>" MIRROR "</bsdf>")),
                   "block.pose", "under a mask");
    number_refused("a pane that light samples pass",
                   room("<integrator type='volpath'/>" WINDOW), "block.pose", "volpath");
    number_refused("a horizon in a mirror",
                   room(PATH "<emitter type='ciesky'/>" BATHROOM(MIRROR)), "mirror.pose",
                   "horizon");
}

/* The horizon of a sky, beside a tilted mirror and in it; a black block hides a part. */
static imp_scene *horizon(void)
{
    char xml[8192], camera[4096];
    snprintf(camera, sizeof camera, ROOM_CAMERA, "<rotate x='1' angle='7'/>",
             "type='box'");
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='direct'/><emitter type='ciesky'/>"
             "%s" DARK "<shape type='cube' id='block'><transform name='to_world'><scale "
             "x='.6' y='.5' z='.4'/><rotate z='1' angle='25'/><translate x='-.2' y='.3' "
             "z='.7'/></transform><ref id='grey'/></shape>"
             "<shape type='rectangle' id='mirror'><transform name='to_world'><scale "
             "x='1.1' y='.9'/><rotate x='1' angle='87'/><rotate y='1' angle='8'/><rotate "
             "z='1' angle='-20'/><translate x='.9' y='1.6' z='1.8'/></transform>" MIRROR
             "</shape></scene>",
             camera);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* A meter on the floor beside a block and a mirror, under a lamp. */
static imp_scene *meter(void)
{
    return test_scene_text(
        ctx,
        "<scene version='3.0.0'>" PATH
        "<shape type='cube' id='block'><transform name='to_world'><scale x='.3' y='.4' "
        "z='.4'/><rotate x='1' z='1' angle='25'/><translate x='.2' y='.3' z='.9'/>"
        "</transform>" THIN_RED "</shape>"
        "<shape type='rectangle' id='mirror'><transform name='to_world'><scale x='1.3' "
        "y='1.5'/><rotate x='1' angle='90'/><rotate z='1' angle='20'/><translate y='1.4' "
        "z='1.2'/></transform>" MIRROR "</shape>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.8' "
        "y='.7'/><rotate x='1' angle='150'/><translate x='-.4' y='-.9' z='2.2'/>"
        "</transform><emitter type='area'><rgb name='radiance' value='9,8,7'/>"
        "</emitter></shape>"
        "<shape type='rectangle' id='table'><transform name='to_world'><scale "
        "x='.8' y='.7'/><translate x='-.1' z='.1'/></transform><bsdf type='diffuse'>"
        "<rgb name='reflectance' value='.5'/></bsdf><sensor type='irradiancemeter' "
        "id='meter'><film type='hdrfilm'><integer name='width' value='24'/><integer "
        "name='height' value='16'/><rfilter type='box'/></film></sensor></shape></scene>",
        IMP_RGB);
}

/* The inside of walks whose vertices move, and directions with mirrors. */
static void frozen_test(const char *what, imp_scene *scene, const char *const *names)
{
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    imp_problem *p;
    o.paths = 250;
    o.only = "frozen";
    for (int k = 0; names[k]; k++)
        test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; names[k]; k++) test_must(ctx, imp_problem_activate(p, names[k]));
    test_check(ctx, p, &o, what);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void walks_test(void)
{
    static const char *const mirrors[] = {"block.pose",  "mirror.pose", "other.pose",
                                          "camera.pose", "lamp.pose",   NULL};
    static const char *const pane[] = {"block.pose", "pane.pose", "camera.pose",
                                       "lamp.pose", NULL};
    static const char *const plastic[] = {"block.pose", "camera.pose", "lamp.pose", NULL};
    frozen_test("walks over two mirrors", room(DEEP BATHROOM(MIRROR) OTHER(MIRROR)),
                mirrors);
    frozen_test("and rough metal, under a sky",
                room_of(SKY DEEP BATHROOM(MIRROR) OTHER(MIRROR), ROUGH), mirrors);
    frozen_test("walks through a pane", room(PATH WINDOW), pane);
    frozen_test("walks over plastic", room_of(PATH, PLASTIC), plastic);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    const int more = is_long ? 8 : 1;
    const double most = is_long ? .1 : .3;
    static const struct number one[] = {{"block.pose", 0, .03},
                                        {"block.pose", 5, .03},
                                        {"mirror.pose", 1, .03},
                                        {"mirror.pose", 5, .02},
                                        {"camera.pose", 4, .01},
                                        {"lamp.pose", 1, .04},
                                        {NULL, 0, 0}},
                               two[] = {{"block.pose", 0, .03},
                                        {"other.pose", 1, .03},
                                        {"other.pose", 5, .02},
                                        {"lamp.pose", 1, .04},
                                        {NULL, 0, 0}},
                               pane[] = {{"block.pose", 0, .03},
                                         {"pane.pose", 1, .03},
                                         {"camera.pose", 4, .01},
                                         {NULL, 0, 0}},
                               plastic[] = {{"block.pose", 0, .03},
                                            {"block.pose", 5, .03},
                                            {"camera.pose", 4, .01},
                                            {NULL, 0, 0}},
                               placed[] = {{"placed.pose", 0, .03},
                                           {"placed.pose", 4, .02},
                                           {"block.pose", 1, .03},
                                           {NULL, 0, 0}},
                               images[] = {{"block.pose", 0, .02},
                                           {"block.pose", 5, .02},
                                           {"ball.pose", 1, .02},
                                           {"mirror.pose", 0, .02},
                                           {"mirror.pose", 5, .01},
                                           {"camera.pose", 5, .01},
                                           {NULL, 0, 0}},
                               turns[] = {{"camera.pose", 3, .01},
                                          {"camera.pose", 4, .01},
                                          {"camera.pose", 5, .01},
                                          {"block.pose", 0, .02},
                                          {NULL, 0, 0}},
                               eggs[] = {{"egg.pose", 0, .01},
                                         {"egg.pose", 2, .01},
                                         {"mirror.pose", 1, .03},
                                         {"camera.pose", 4, .01},
                                         {NULL, 0, 0}},
                               meters[] = {
                                   {"block.pose", 0, .03},  {"mirror.pose", 1, .03},
                                   {"mirror.pose", 3, .02}, {"table.pose", 0, .03},
                                   {"lamp.pose", 0, .03},   {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    disk_test();
    facets_test();
    walks_test();
    numbers_compare(
        "images before a sky",
        room_of("<integrator type='direct'/>" SKY BATHROOM(MIRROR) BALL, DARK),
        128 * more, 192 * more, .1, images);
    numbers_compare("a horizon", horizon(), 64 * more, 128 * more, .05, turns);
    numbers_compare("a mirror", room(PATH BATHROOM(MIRROR)), 32 * more, 32 * more, most,
                    one);
    numbers_compare("plastic", room_of(PATH, PLASTIC), 32 * more, 32 * more, most,
                    plastic);
    numbers_compare("a meter", meter(), 16 * more, 16 * more, most, meters);
    if (is_long) {
        numbers_compare("a pane", room(PATH WINDOW), 512, 512, .15, pane);
        numbers_compare("two mirrors", room(DEEP BATHROOM(MIRROR) OTHER(MIRROR)), 512,
                        512, .15, two);
        numbers_compare("a sky", room(SKY PATH BATHROOM(MIRROR)), 512, 512, .15, one);
        numbers_compare("rough plastic", room_of(PATH BATHROOM(MIRROR), MATT), 512, 512,
                        .2, one);
        numbers_compare("a cube of mirrors", room(PATH PLACED), 512, 512, .15, placed);
        egg_write(EGG, true);
        numbers_compare("an egg", room(PATH BATHROOM(MIRROR) EGG_OF(EGG)), 512, 512, .15,
                        eggs);
        remove(EGG);
    }
    refused_test();
    imp_context_destroy(ctx);
    return tap_done();
}
