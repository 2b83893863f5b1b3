/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves among instances: the same numbers as with the groups' shapes written out
 * where they are placed, also of nested groups, stretched ones, and one with a material of its own; and
 * the same pictures of a block that was moved. By the pose and scale of an instance of one shape, flat,
 * curved or with vertex normals, as by those of the shape; of instances of several against central
 * differences. By those of a group as by those of its instances. What is refused. */
#include "egg.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define DIRECT "<integrator type='direct'/>"

#define CHAIR                                                                            \
    "<shape type='cube'><transform name='to_world'><scale x='.3' y='.2' z='.2'/>%s"      \
    "</transform>%s</shape><shape type='rectangle'><transform name='to_world'><scale "   \
    "value='.25'/><rotate y='1' angle='70'/><translate z='.6'/>%s</transform>%s</shape>"
#define LEFT "<rotate z='1' angle='30'/><translate x='1.3' y='-.9' z='.3'/>"
#define RIGHT                                                                            \
    "<scale x='1.4' y='1' z='.8'/><rotate x='1' angle='40'/><translate x='-1.5' "        \
    "y='-.7' z='.9'/>"
#define SHIFT "<translate x='.2' z='1.4'/>"
#define PLACED(group, place, more)                                                       \
    "<shape type='instance'><ref id='" group "'/><transform name='to_world'>" place      \
    "</transform>" more "</shape>"

static void chair(char *out, size_t n, const char *place, const char *material)
{
    snprintf(out, n, CHAIR, place, material, place, material);
}

static imp_scene *room(bool placed)
{
    char own[2048], left[2048], right[2048], above[2048], rest[16384], xml[32768];
    chair(own, sizeof own, "", THIN_GREEN);
    chair(left, sizeof left, LEFT, THIN_GREEN);
    chair(right, sizeof right, RIGHT, THIN_RED);
    chair(above, sizeof above, SHIFT LEFT, THIN_GREEN);
    if (placed)
        snprintf(rest, sizeof rest,
                 PATH "<shape type='shapegroup' id='chair'>%s</shape><shape "
                      "type='shapegroup' id='pair'>" PLACED("chair", "", "")
                          PLACED("chair", SHIFT, "") "</shape>" PLACED("pair", LEFT, "")
                              PLACED("chair", RIGHT, THIN_RED),
                 own);
    else snprintf(rest, sizeof rest, PATH "%s%s%s", left, above, right);
    room_write(&(struct room_parts){.rest = rest}, xml, sizeof xml);
    return test_scene_text(ctx, xml, IMP_RGB);
}

static void gradients(bool placed, uint64_t seed, double *out, double *se)
{
    imp_scene *scene = room(placed);
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    for (int k = 0; k < 3; k++)
        test_must(ctx, imp_scene_add_pose(scene, room_objects[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "*.pose"));
    run.spp = 16;
    run.seed = seed;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, out, se));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Corners are rounded to floats where they are written out. Of some seeds a look past an edge meets
 * something else by that, a small part of a standard error; the others agree as floats do. */
static void same_test(void)
{
    enum { SEEDS = 5 };
    double g[2][ROOM_NUMBERS], se[ROOM_NUMBERS], off[SEEDS], most = 0, looks = 0;
    for (int s = 0; s < SEEDS; s++) {
        double worst = 0;
        for (int k = 0; k < 2; k++) gradients(k, (uint64_t)s, g[k], se);
        for (int k = 0; k < ROOM_NUMBERS; k++) {
            const double d = fabs(g[0][k] - g[1][k]);
            most = fmax(most, fabs(g[0][k]));
            worst = fmax(worst, d);
            looks = fmax(looks, d / se[k]);
        }
        int at = s; /* sorted */
        for (; at > 0 && off[at - 1] > worst; at--) off[at] = off[at - 1];
        off[at] = worst;
    }
    tap_ok(off[SEEDS / 2] < 1e-5 * most && looks < 0.1,
           "the same derivatives as written out # off %.1e of %.3g, at most %.1e, by "
           "%.1e errors",
           off[SEEDS / 2], most, off[SEEDS - 1], looks);
}

static void picture(bool placed, float *out)
{
    imp_scene *scene = room(placed);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    /* Out of the box that the scene had. */
    const double there[ROOM_NUMBERS] = {-4, 1, .5, 0, 0, .4};
    for (int k = 0; k < 3; k++)
        test_must(ctx, imp_scene_add_pose(scene, room_objects[k]));
    room_poses_set(ctx, scene, there);
    run.spp = 4;
    test_must(ctx, imp_render(scene, &run, &film));
    memcpy(out, imp_film_mean(film), WIDTH * HEIGHT * 3 * sizeof *out);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

static void moved_test(void)
{
    static float x[2][WIDTH * HEIGHT * 3];
    double worst = 0;
    for (int k = 0; k < 2; k++) picture(k, x[k]);
    for (int k = 0; k < WIDTH * HEIGHT * 3; k++)
        worst = fmax(worst, fabs((double)x[0][k] - (double)x[1][k]));
    tap_ok(worst < 1e-4, "the same picture of a block that has moved # off %.1e", worst);
}

/* ---- What an instance carries --------------------------------------------------------- */

#define EGG_FILE "moved_instances_egg.obj"
#define GREY     "<bsdf type='diffuse'><rgb name='reflectance' value='.6,.5,.4'/></bsdf>"
#define EGG                                                                              \
    "<shape type='obj' %s><string name='filename' value='" EGG_FILE "'/>%s" GREY         \
    "</shape>"
#define BALL                                                                             \
    "<shape type='sphere' %s>%s<bsdf type='roughconductor'><float name='alpha' "         \
    "value='.4'/></bsdf></shape>"
#define CUBE "<shape type='cube' %s>%s" GREY "</shape>"
#define TUBE "<shape type='cylinder' %s>%s" THIN_GREEN "</shape>"
#define DISK "<shape type='disk' %s>%s" THIN_GREEN "</shape>"
#define TURNED                                                                           \
    "<transform name='to_world'><scale value='.4'/><rotate x='1' y='.4' angle='50'/>"    \
    "<translate x='1.3' y='-.8' z='.8'/></transform>"

/* One shape, as it is or in an instance; both have their centre at one point. */
static imp_scene *lone(const char *shape, bool placed)
{
    char own[1024], rest[2048];
    snprintf(own, sizeof own, shape, placed ? "" : "id='it'", placed ? "" : TURNED);
    if (placed)
        snprintf(rest, sizeof rest,
                 PATH "<shape type='shapegroup' id='g'>%s</shape><shape type='instance' "
                      "id='it'><ref id='g'/>" TURNED "</shape>",
                 own);
    else snprintf(rest, sizeof rest, PATH "%s", own);
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

/* The derivatives by the instance are those by the shape; but for `part` of standard errors: corners of
 * a mesh are rounded to floats where it is in no instance, and a look past its edges may go otherwise. */
static void lone_test(const char *what, const char *shape, double part)
{
    double g[2][7], se[7], worst = 0, most = 0;
    for (int k = 0; k < 2; k++) {
        imp_scene *scene = lone(shape, k);
        imp_problem *p;
        struct imp_run run = IMP_RUN_INIT;
        test_must(ctx, imp_scene_add_geometry(scene, "it.pose"));
        test_must(ctx, imp_scene_add_geometry(scene, "it.scale"));
        test_must(ctx, imp_problem_create(scene, &p));
        test_must(ctx, imp_problem_activate(p, "it.pose"));
        test_must(ctx, imp_problem_activate(p, "it.scale"));
        run.spp = 8;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g[k], se));
        imp_problem_destroy(p);
        imp_scene_destroy(scene);
    }
    for (int k = 0; k < 7; k++) {
        most = fmax(most, fabs(g[0][k]));
        worst = fmax(worst, fabs(g[0][k] - g[1][k]) - part * se[k]);
    }
    tap_ok(worst < 1e-5 * most && most > 1e-4,
           "%s: by its instance as by itself # off %.1e of %.3g", what, worst, most);
}

/* A block, an egg and a ball in a group, and that in another one; one of two instances is stretched. */
#define HEAP                                                                             \
    "<shape type='shapegroup' id='heap'><shape type='cube'><transform name='to_world'>"  \
    "<scale x='.3' y='.3' z='.1'/></transform>" GREY                                     \
    "</shape><shape type='obj'><string "                                                 \
    "name='filename' value='" EGG_FILE "'/><transform name='to_world'><scale "           \
    "value='.4'/><translate z='.5'/></transform>" GREY "</shape></shape>"
#define BALLS                                                                            \
    "<shape type='shapegroup' id='balls'>" PLACED(                                       \
        "heap", "<scale value='.9'/>",                                                   \
        "") "<shape type='sphere'><point name='center' x='.6' y='0' z='.3'/><float "     \
            "name='radius' value='.25'/>" GREY "</shape></shape>"
#define NAMED(id, group, place)                                                          \
    "<shape type='instance' id='" id "'><ref id='" group "'/><transform "                \
    "name='to_world'>" place "</transform></shape>"
#define CROWD                                                                            \
    HEAP BALLS NAMED("nest", "balls",                                                    \
                     "<rotate z='1' angle='20'/><translate x='1.2' "                     \
                     "y='-1' z='.4'/>")                                                  \
        NAMED("flat", "heap",                                                            \
              "<scale x='1.6' y='1' z='.7'/><rotate y='1' angle='25'/>"                  \
              "<translate x='-1.5' y='-.9' z='.5'/>")

static void crowd_test(int more)
{
    static const struct number numbers[] = {
        {"nest.pose", 0, .02},  {"nest.pose", 2, .02},   {"nest.pose", 4, .01},
        {"nest.pose", 5, .02},  {"flat.pose", 0, .02},   {"flat.pose", 3, .01},
        {"flat.scale", 0, .02}, {"camera.pose", 5, .01}, {NULL, 0, 0}};
    numbers_compare("instances that move",
                    room_build(ctx, &(struct room_parts){.rest = PATH CROWD}), 24 * more,
                    32 * more, .2, numbers);
}

/* ---- Groups ------------------------------------------------------------------------------ */

/* Two instances, one of which is smaller and mirrored: columns of their placements' linear parts. */
#define TWO                                                                              \
    HEAP NAMED("one", "heap",                                                            \
               "<rotate z='1' angle='20'/><translate x='1.2' y='-1' z='.4'/>")           \
        NAMED("other", "heap",                                                           \
              "<scale x='-.7' y='.7' z='.7'/><rotate y='1' angle='35'/>"                 \
              "<translate x='-1.5' y='-.9' z='.6'/>")
static const double angle[2] = {20, 35};

static void gradient_of(imp_scene *scene, const char *const *name, int n, double *g)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p;
    for (int k = 0; k < n; k++) test_must(ctx, imp_scene_add_geometry(scene, name[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < n; k++) test_must(ctx, imp_problem_activate(p, name[k]));
    run.spp = 8;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* By a group's numbers as by those of its instances, taken to its space. */
static void group_test(void)
{
    static const char *const whole[] = {"heap.pose", "heap.scale"}, *const each[] = {
                                                                        "one.pose",
                                                                        "other.pose",
                                                                        "one.scale",
                                                                        "other.scale"};
    double g[7], own[14], sum[7] = {0}, most = 0, worst = 0;
    const struct room_parts parts = {.rest = PATH TWO};
    gradient_of(room_build(ctx, &parts), whole, 2, g);
    gradient_of(room_build(ctx, &parts), each, 4, own);
    for (int k = 0; k < 2; k++) {
        const double c = cos(angle[k] * IMP_PI / 180), s = sin(angle[k] * IMP_PI / 180);
        const double size = k ? .7 : 1, x = k ? -1 : 1; /* of the turned x axis */
        const double L[3][3] = {{x * c, k ? 0 : -s, k ? s : 0},
                                {k ? 0 : s, k ? 1 : c, 0},
                                {k ? -x * s : 0, 0, k ? c : 1}};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                sum[i] += size * L[j][i] * own[6 * k + j];
                sum[3 + i] += x * L[j][i] * own[6 * k + 3 + j];
            }
        sum[6] += own[12 + k];
    }
    for (int i = 0; i < 7; i++) {
        most = fmax(most, fabs(g[i]));
        worst = fmax(worst, fabs(g[i] - sum[i]));
    }
    tap_ok(most > 1e-3 && worst < 1e-9 * most,
           "a group moves as its instances do # off %.1e of %.3g", worst, most);
}

static void groups_test(int more)
{
    static const struct number numbers[] = {{"heap.pose", 0, .02},  {"heap.pose", 2, .02},
                                            {"heap.pose", 4, .01},  {"heap.pose", 5, .02},
                                            {"heap.scale", 0, .02}, {NULL, 0, 0}};
    group_test();
    numbers_compare("a group that moves",
                    room_build(ctx, &(struct room_parts){.rest = DIRECT TWO}), 48 * more,
                    64 * more, .2, numbers);
    number_refused("a group of which an instance stretches",
                   room_build(ctx, &(struct room_parts){.rest = PATH CROWD}), "heap.pose",
                   "stretches it");
    imp_scene *scene = room_build(ctx, &(struct room_parts){.rest = PATH TWO});
    test_must(ctx, imp_scene_add_pose(scene, "heap"));
    tap_ok(imp_scene_add_pose(scene, "one") == IMP_E_UNSUPPORTED,
           "a group and one of its instances # %s", imp_last_error(ctx));
    imp_scene_destroy(scene);
}

static void refused(const char *what, const char *rest, const char *word)
{
    number_refused(what, room_build(ctx, &(struct room_parts){.rest = rest}),
                   "camera.pose", word);
}

int main(int argc, char **argv)
{
    ctx = test_context(2);
    adjoint_make();
    same_test();
    moved_test();
    egg_write(EGG_FILE, true);
    lone_test("a cube", CUBE, 0);
    lone_test("an egg with vertex normals", EGG, 0.2);
    lone_test("a ball of rough metal", BALL, 0);
    lone_test("a cylinder", TUBE, 0);
    lone_test("a disk", DISK, 0);
    lone_test("a disk of glass",
              "<shape type='disk' %s>%s<bsdf type='dielectric'/></shape>", 0);
    crowd_test(tap_is_long(argc, argv) ? 32 : 1);
    refused("a ball that its instance stretches",
            DIRECT
            "<shape type='shapegroup' id='g'><shape type='sphere' id='ball'><float "
            "name='radius' value='.2'/></shape></shape>" PLACED(
                "g", "<scale x='1.2'/><translate x='1.5' y='-1' z='1'/>", ""),
            "'ball'");
    refused("a tube through an instance",
            DIRECT
            "<shape type='shapegroup' id='g'><shape type='cube' id='box'><transform "
            "name='to_world'><scale value='.2'/></transform></shape></shape>"
            "<shape type='cylinder'><point name='p0' x='1.6' y='-1' z='1.1'/><point "
            "name='p1' x='1.6' y='-1' z='1.5'/><float name='radius' value='.1'/>"
            "</shape>" PLACED("g", "<translate x='1.5' y='-1' z='1'/>", ""),
            "passes through");
    groups_test(tap_is_long(argc, argv) ? 32 : 1);
    imp_scene *scene = room(true);
    tap_ok(imp_scene_add_pose(scene, "chair") == IMP_E_UNSUPPORTED,
           "a group that is stretched, and in another one, has no pose # %s",
           imp_last_error(ctx));
    imp_scene_destroy(scene);
    remove(EGG_FILE);
    imp_context_destroy(ctx);
    return tap_done();
}
