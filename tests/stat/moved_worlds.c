/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by to_world: of black rectangles and disks before a sky, whose pictures have areas in
 * closed form; the same numbers as by pose and scale, of each kind that has them; differences of
 * pictures with the same random numbers, of maps that shear, and of lamps that grow. Places that no
 * object can have. */
#include "egg.h"
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define GREY   "<ref id='grey'/>"
#define BALL                                                                             \
    "<shape type='sphere' id='ball'><transform name='to_world'><scale value='.8'/>"      \
    "<rotate x='1' y='1' angle='50'/></transform><float name='radius' value='.5'/>"      \
    "<point name='center' value='1.3,-.5,1.2'/>" GREY "</shape>"
#define TUBE                                                                             \
    "<shape type='cylinder' id='tube'><float name='radius' value='.35'/><point "         \
    "name='p0' value='.8,-.9,.5'/><point name='p1' value='1.3,-.4,1.4'/>" THIN_PALE      \
    "</shape>"
#define DISK                                                                             \
    "<shape type='disk' id='disk'><transform name='to_world'><scale x='.6' y='.4'/>"     \
    "<rotate y='1' angle='-50'/><translate x='1.2' y='-.6' z='.9'/></transform>"         \
    "" THIN_GREEN "</shape>"
#define STAND                                                                            \
    "<shape type='shapegroup' id='stand'><shape type='cube'><transform "                 \
    "name='to_world'><scale x='.3' y='.2' z='.2'/></transform>" THIN_PALE                \
    "</shape><shape type='disk'><transform name='to_world'><scale value='.3'/>"          \
    "<rotate y='1' angle='70'/><translate z='.6'/></transform>" THIN_RED                 \
    "</shape></shape><shape type='instance' id='there'><ref id='stand'/><transform "     \
    "name='to_world'><scale x='1.2'/><rotate z='1' angle='30'/><translate x='1.3' "      \
    "y='-.9' z='.5'/></transform></shape>"
#define SPOT                                                                             \
    "<emitter type='spot' id='spot'><transform name='to_world'><lookat "                 \
    "origin='1.4,-1,2.6' target='.3,.1,.3' up='0,0,1'/></transform><rgb "                \
    "name='intensity' value='20,18,15'/><float name='cutoff_angle' value='35'/>"         \
    "<float name='beam_width' value='12'/></emitter>"
#define EGG_FILE "moved_worlds_egg.obj"

static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

/* Seen by parallel rays along z on a film of 4 x 4, before a sky of radiance 5. */
static imp_scene *before_sky(const char *kind)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>" DIRECT
             "<sensor type='orthographic' id='camera'><transform name='to_world'><scale "
             "value='2'/><lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
             "<film type='hdrfilm'><integer name='width' value='16'/><integer "
             "name='height' value='16'/><rfilter type='box'/></film></sensor><emitter "
             "type='constant'><rgb name='radiance' value='5'/></emitter><shape "
             "type='%s' id='it'><transform name='to_world'><matrix value='.9 .3 .2 .1 "
             "-.2 .7 .1 -.3 .4 -.3 .5 .2 0 0 0 1'/></transform><bsdf "
             "type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "
             "value='0'/></bsdf></bsdf></shape></scene>",
             kind);
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* What is black hides k (M_00 M_11 - M_01 M_10) of the 16 that are seen, and the more of the film, the
 * smaller the film's own map is. */
static void areas_test(const char *kind, double k)
{
    const double sky = 5. / 16, M[4] = {.9, .3, -.2, .7};
    const double by[12] = {M[3], -M[2], 0, 0, -M[1], M[0]};
    struct tap_stat r[12] = {{0}}, film[12] = {{0}};
    imp_scene *scene = before_sky(kind);
    test_must(ctx, imp_scene_add_geometry(scene, "it.to_world"));
    test_must(ctx, imp_scene_add_geometry(scene, "camera.to_world"));
    mean_gradient(ctx, scene, "it.to_world", 64, 16, r);
    mean_gradient(ctx, scene, "camera.to_world", 64, 16, film);
    for (int i = 0; i < 12; i++) {
        char what[64];
        snprintf(what, sizeof what, "area of a %s by number %d of its map", kind, i);
        if (i % 4 == 2 || i >= 8) tap_ok(r[i].mean == 0, "%s # %.1e", what, r[i].mean);
        else tap_z(&r[i], -sky * k * by[i], 3e-3 * sky * k, what);
    }
    /* lookat has -x along x and y along y; the part of the film that is hidden is k det/(4 s^2). */
    const double area = sky * k * (M[0] * M[3] - M[1] * M[2]);
    tap_z(&film[0], -area / 2, 3e-3 * area, "a film that grows along x");
    tap_z(&film[5], area / 2, 3e-3 * area, "a film that grows along y");
    tap_z(&film[1], 0, 3e-3 * area, "a film that is sheared");
    imp_scene_destroy(scene);
}

/* The gradient by all numbers of these names; ends the scene. */
static void gradient(imp_scene *scene, const char *const *names, int n, double *g)
{
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    for (int k = 0; k < n; k++) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < n; k++) test_must(ctx, imp_problem_activate(p, names[k]));
    run.spp = 16;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* d(to_world) of a pose about c, or of a scale (k = 6), in the direction of number k. */
static void world_dot(const double M[12], imp_v3 c, int k, double dot[12])
{
    for (int j = 0; j < 4; j++) {
        imp_v3 r = imp__v3(M[j], M[4 + j], M[8 + j]), by = {0};
        if (j == 3) r -= c;
        if (k < 3) by[k] = j == 3;
        else if (k < 6) by[k - 3] = 1;
        const imp_v3 d = k < 3 ? by : k < 6 ? imp__cross(by, r) : r;
        for (int i = 0; i < 3; i++) dot[4 * i + j] = d[i];
    }
}

static void same_test(const char *what, const char *rest, const char *object, int n)
{
    const char *names[2][2] = {{NULL}};
    char name[3][64];
    double own[12], pose[7], M[12];
    static const char *const tails[3] = {"to_world", "pose", "scale"};
    for (int k = 0; k < 3; k++)
        snprintf(name[k], sizeof name[k], "%s.%s", object, tails[k]);
    names[0][0] = name[0];
    names[1][0] = name[1];
    names[1][1] = name[2];
    imp_scene *scene = room(rest), *other = room(rest);
    size_t index, count;
    test_must(ctx, imp_scene_add_geometry(scene, name[0]));
    test_must(ctx, imp_scene_add_geometry(other, name[1]));
    values_get(scene, name[0], M, &count, &index);
    const imp_v3 c = other->poses->centre;
    gradient(scene, names[0], 1, own);
    gradient(other, names[1], n > 6 ? 2 : 1, pose);
    double worst = 0, most = 0;
    for (int k = 0; k < n; k++) {
        double dot[12], sum = 0;
        world_dot(M, c, k, dot);
        for (int j = 0; j < 12; j++) sum += own[j] * dot[j];
        most = fmax(most, fabs(pose[k]));
        worst = fmax(worst, fabs(sum - pose[k]));
    }
    tap_ok(worst < 1e-6 * most && most > 1e-3 && count == 12,
           "%s: to_world is pose and scale # off %.1e of %.3g", what, worst, most);
}

/* M after a pose's numbers, or with the scale that follows them. */
static void world_of(const double M[12], imp_v3 c, const double pose[7], double out[12])
{
    double R[9];
    imp__rotation_of(pose + 3, R);
    for (int j = 0; j < 4; j++) {
        imp_v3 r = imp__v3(M[j], M[4 + j], M[8 + j]);
        if (j == 3) r -= c;
        for (int i = 0; i < 3; i++)
            out[4 * i + j] =
                pose[6] * (R[3 * i] * r[0] + R[3 * i + 1] * r[1] + R[3 * i + 2] * r[2]) +
                (j == 3 ? c[i] + pose[i] : 0);
    }
}

/* The picture of what is put there by to_world, and by a pose and a scale. */
static void pictures_test(const char *what, const char *rest, const char *object, int n)
{
    static const double pose[7] = {.1, -.05, .08, .1, .2, -.3, .9},
                        rigid[7] = {.1, -.05, .08, .1, .2, -.3, 1};
    char name[3][64];
    double M[12], there[12], value[2];
    size_t index, count;
    static const char *const tails[3] = {"to_world", "pose", "scale"};
    for (int k = 0; k < 3; k++)
        snprintf(name[k], sizeof name[k], "%s.%s", object, tails[k]);
    imp_scene *scene = room(rest), *other = room(rest);
    test_must(ctx, imp_scene_add_geometry(scene, name[0]));
    for (int k = 1; k < (n > 6 ? 3 : 2); k++)
        test_must(ctx, imp_scene_add_geometry(other, name[k]));
    const double at_rest[2] = {functional(scene, 3, 16), functional(other, 3, 16)};
    values_get(scene, name[0], M, &count, &index);
    world_of(M, other->poses->centre, n > 6 ? pose : rigid, there);
    test_must(ctx, imp_scene_set_values(scene, index, 12, there));
    values_get(other, name[1], there, &count, &index);
    test_must(ctx, imp_scene_set_values(other, index, 6, pose));
    if (n > 6) {
        values_get(other, name[2], there, &count, &index);
        test_must(ctx, imp_scene_set_values(other, index, 1, pose + 6));
    }
    value[0] = functional(scene, 3, 16);
    value[1] = functional(other, 3, 16);
    const double moved = fabs(value[0] - at_rest[0]);
    tap_ok(at_rest[0] == at_rest[1] && fabs(value[0] - value[1]) < 1e-2 * moved &&
               moved > 1e-4,
           "%s: pictures by to_world and pose # %.8f %.8f, at rest %.8f", what, value[0],
           value[1], at_rest[0]);
    imp_scene_destroy(scene);
    imp_scene_destroy(other);
}

/* Position and direction of a spot, of which direction e turns the axis d by d x e. */
static void spot_test(void)
{
    static const char *const names[3] = {"spot.to_world", "spot.position",
                                         "spot.direction"};
    double own[12], other[6], M[12], worst = 0, most = 0;
    size_t index, n;
    imp_scene *scene = room(PATH SPOT);
    test_must(ctx, imp_scene_add_geometry(scene, names[0]));
    values_get(scene, names[0], M, &n, &index);
    gradient(scene, names, 1, own);
    gradient(room(PATH SPOT), names + 1, 2, other);
    const imp_v3 axis = imp__v3(M[2], M[6], M[10]);
    for (int k = 0; k < 6; k++) {
        double sum = 0;
        imp_v3 e = {0};
        e[k % 3] = 1;
        if (k < 3) sum = own[4 * k + 3];
        for (int j = 0; k >= 3 && j < 3; j++) {
            const imp_v3 d =
                imp__cross(imp__cross(axis, e), imp__v3(M[j], M[4 + j], M[8 + j]));
            for (int i = 0; i < 3; i++) sum += own[4 * i + j] * d[i];
        }
        most = fmax(most, fabs(other[k]));
        worst = fmax(worst, fabs(sum - other[k]));
    }
    tap_ok(worst < 1e-8 * most && most > 1e-3,
           "a spot: to_world is position and direction # off %.1e of %.3g", worst, most);
}

static void placed_test(const char *what, const char *rest, const char *name,
                        const double by[12], const char *word)
{
    imp_scene *scene = room(rest);
    double M[12], there[12], back[12];
    size_t index, n;
    test_must(ctx, imp_scene_add_geometry(scene, name));
    values_get(scene, name, M, &n, &index);
    const double before = functional(scene, 3, 4);
    for (int k = 0; k < 12; k++) there[k] = M[k] + by[k];
    const enum imp_status st = imp_scene_set_values(scene, index, 12, there);
    char why[256];
    snprintf(why, sizeof why, "%s", st == IMP_OK ? "" : imp_last_error(ctx));
    test_must(ctx, imp_scene_get_values(scene, index, back));
    const bool stays =
        functional(scene, 3, 4) == before && memcmp(back, M, sizeof M) == 0;
    tap_ok(st == IMP_E_NUMERIC && strstr(why, word) && strstr(why, name) && stays,
           "%s, and the scene stays # %s", what, why);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number block[] = {{"block.to_world", 0, .02},
                                          {"block.to_world", 2, .02},
                                          {"block.to_world", 5, .02},
                                          {"block.to_world", 11, .02},
                                          {NULL, 0, 0}},
                               lamp[] = {{"lamp.to_world", 0, .02},
                                         {"lamp.to_world", 5, .02},
                                         {"lamp.to_world", 9, .02},
                                         {"lamp.to_world", 11, .02},
                                         {NULL, 0, 0}},
                               disk[] = {{"disk.to_world", 0, .02},
                                         {"disk.to_world", 1, .02},
                                         {"disk.to_world", 8, .02},
                                         {"camera.to_world", 3, .02},
                                         {"camera.to_world", 11, .02},
                                         {NULL, 0, 0}},
                               egg[] = {{"egg.to_world", 0, .02},
                                        {"egg.to_world", 6, .02},
                                        {"egg.to_world", 7, .02},
                                        {NULL, 0, 0}},
                               there[] = {{"there.to_world", 0, .02},
                                          {"there.to_world", 1, .02},
                                          {"there.to_world", 10, .02},
                                          {"there.to_world", 3, .02},
                                          {NULL, 0, 0}};
    static const double flat[12] = {[10] = -.4}, over[12] = {[10] = -.9},
                        longer[12] = {[0] = .1}, beyond[12] = {[3] = 1e300};
    ctx = test_context(2);
    adjoint_make();
    egg_write(EGG_FILE, true);
    areas_test("rectangle", 4);
    areas_test("disk", IMP_PI);
    same_test("a block", PATH, "block", 7);
    same_test("a lamp", PATH, "lamp", 6);
    same_test("a camera", PATH, "camera", 6);
    same_test("a ball", PATH BALL, "ball", 7);
    same_test("a tube", PATH TUBE, "tube", 7);
    same_test("a disk", PATH DISK, "disk", 7);
    same_test("an egg", PATH EGG_OF(EGG_FILE), "egg", 7);
    same_test("an instance", PATH STAND, "there", 7);
    spot_test();
    pictures_test("a block", PATH, "block", 7);
    pictures_test("a lamp", PATH, "lamp", 6);
    pictures_test("a camera", PATH, "camera", 6);
    pictures_test("a ball", PATH BALL, "ball", 7);
    pictures_test("a tube", PATH TUBE, "tube", 7);
    pictures_test("a disk", PATH DISK, "disk", 7);
    pictures_test("an egg", PATH EGG_OF(EGG_FILE), "egg", 7);
    pictures_test("an instance", PATH STAND, "there", 7);
    numbers_compare("a block", room(PATH), 32 * more, 48 * more, .2, block);
    numbers_compare("a lamp", room(DIRECT), 32 * more, 48 * more, .2, lamp);
    numbers_compare("a disk", room(DIRECT DISK), 32 * more, 48 * more, .2, disk);
    numbers_compare("an egg", room(DIRECT EGG_OF(EGG_FILE)), 32 * more, 48 * more, .2,
                    egg);
    numbers_compare("an instance", room(DIRECT STAND), 32 * more, 48 * more, .2, there);
    placed_test("a block that is flattened", DIRECT, "block.to_world", flat, "singular");
    placed_test("a block that is turned over", DIRECT, "block.to_world", over,
                "inside out");
    placed_test("a ball that is stretched", DIRECT BALL, "ball.to_world", longer,
                "sphere");
    placed_test("a tube that is stretched", DIRECT TUBE, "tube.to_world", longer,
                "cylinder");
    placed_test("a camera that is stretched", DIRECT, "camera.to_world", longer,
                "turn and shift");
    placed_test("a spot that is stretched", DIRECT SPOT, "spot.to_world", longer,
                "turn and shift");
    placed_test("a place that is none", DIRECT, "block.to_world", beyond, "beyond");
    imp_scene *scene = room(DIRECT);
    test_must(ctx, imp_scene_add_geometry(scene, "block.pose"));
    number_refused("to_world beside a pose", scene, "block.to_world",
                   "to_world says where it is");
    remove(EGG_FILE);
    number_refused("an oval cylinder in an instance",
                   room(DIRECT
                        "<shape type='shapegroup' id='pipe'><shape type='cylinder'>"
                        "<transform name='to_world'><scale x='.2' y='.3'/></transform>"
                        "</shape></shape><shape type='instance' id='oval'><ref "
                        "id='pipe'/></shape>"),
                   "oval.to_world", "would be stretched");
    imp_context_destroy(ctx);
    return tap_done();
}
