/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves among instances that stand still: the same numbers as with the groups'
 * shapes written out where they are placed, also of nested groups, stretched ones, and one with a
 * material of its own; and the same pictures of a block that was moved. What is refused. */
#include "moves_kit.h"
#include "moves_numbers.h"

#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define DIRECT "<integrator type='direct'/>"

#define CHAIR                                                                            \
    "<shape type='cube'><transform name='to_world'><scale x='.3' y='.2' z='.2'/>%s"      \
    "</transform>%s</shape><shape type='rectangle'><transform name='to_world'><scale "   \
    "value='.25'/><rotate y='1' angle='70'/><translate z='.6'/>%s</transform>%s</shape>"
#define BOTH                                                                             \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "                \
    "value='.4,.7,.5'/></bsdf></bsdf>"
#define RED                                                                              \
    "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' "                \
    "value='.8,.2,.1'/></bsdf></bsdf>"
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
    chair(own, sizeof own, "", BOTH);
    chair(left, sizeof left, LEFT, BOTH);
    chair(right, sizeof right, RIGHT, RED);
    chair(above, sizeof above, SHIFT LEFT, BOTH);
    if (placed)
        snprintf(rest, sizeof rest,
                 PATH "<shape type='shapegroup' id='chair'>%s</shape><shape "
                      "type='shapegroup' id='pair'>" PLACED("chair", "", "")
                          PLACED("chair", SHIFT, "") "</shape>" PLACED("pair", LEFT, "")
                              PLACED("chair", RIGHT, RED),
                 own);
    else snprintf(rest, sizeof rest, PATH "%s%s%s", left, above, right);
    room_write(&(struct room_parts){.rest = rest}, xml, sizeof xml);
    return test_scene_text(ctx, xml, IMP_RGB);
}

static void gradients(bool placed, double out[ROOM_NUMBERS])
{
    imp_scene *scene = room(placed);
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    for (int k = 0; k < 3; k++)
        test_must(ctx, imp_scene_add_pose(scene, room_objects[k]));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "*.pose"));
    run.spp = 16;
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, out, NULL));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void same_test(void)
{
    double g[2][ROOM_NUMBERS], worst = 0, most = 0;
    for (int k = 0; k < 2; k++) gradients(k, g[k]);
    for (int k = 0; k < ROOM_NUMBERS; k++) {
        most = fmax(most, fabs(g[0][k]));
        worst = fmax(worst, fabs(g[0][k] - g[1][k]));
    }
    tap_ok(worst < 1e-5 * most && most > 0,
           "the same derivatives as written out # off %.1e of %.3g", worst, most);
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

static void refused(const char *what, const char *rest, const char *word)
{
    imp_scene *scene = room_build(ctx, &(struct room_parts){.rest = rest});
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double g[6];
    run.spp = 2;
    test_must(ctx, imp_scene_add_pose(scene, "camera"));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "camera.pose"));
    const enum imp_status st = imp_problem_reverse(p, adjoint, &run, g, NULL);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), word), "%s # %s", what,
           st == IMP_OK ? "" : imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(2);
    adjoint_make();
    same_test();
    moved_test();
    refused("a ball in an instance",
            DIRECT
            "<shape type='shapegroup' id='g'><shape type='sphere' id='ball'><float "
            "name='radius' value='.2'/></shape></shape>" PLACED(
                "g", "<translate x='1.5' y='-1' z='1'/>", ""),
            "'ball'");
    refused("an instance that moves",
            DIRECT
            "<shape type='shapegroup' id='g'><shape type='cube'><transform "
            "name='to_world'><scale value='.2'/></transform></shape></shape>" PLACED(
                "g", "<translate x='1.5' y='-1' z='1'/>",
                "<transform name='to_world_end'><translate x='1.6' y='-1' "
                "z='1'/></transform>"),
            "motion of its own");
    refused("instances that pass through each other",
            DIRECT
            "<shape type='shapegroup' id='g'><shape type='cube' id='box'><transform "
            "name='to_world'><scale value='.2'/></transform></shape></shape>" PLACED(
                "g", "<translate x='1.5' y='-1' z='1'/>", "")
                PLACED("g",
                       "<rotate z='1' angle='30'/><translate x='1.7' y='-1' z='1.1'/>",
                       ""),
            "passes through");
    imp_scene *scene = room(true);
    tap_ok(imp_scene_add_pose(scene, "chair") != IMP_OK, "a group has no pose # %s",
           imp_last_error(ctx));
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}
