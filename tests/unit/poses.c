/* SPDX-License-Identifier: Apache-2.0
 *
 * Poses as parameters: a shape or camera that is moved makes the picture, to the bit or to the
 * rounding of its positions, that a scene file makes with the motion written in it; moved back,
 * the one it made before. Rotations and their derivative; what is refused. */
#include "base/film.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "moves_kit.h"
#include "scene/pose.h"

static imp_context *ctx;

static imp_scene *room(const char *rest, const char *camera, const char *block,
                       const char *lamp)
{
    char first[1024];
    snprintf(
        first, sizeof first,
        "<integrator type='path'><integer name='max_depth' value='3'/></integrator>%s",
        rest);
    return room_build(ctx,
                      &(struct room_parts){
                          .rest = first, .camera = camera, .block = block, .lamp = lamp});
}

static imp_film *picture(imp_scene *scene)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 16;
    run.seed = 4;
    test_must(ctx, imp_render(scene, &run, &film));
    return film;
}

/* Part of the pixels that differ by more than 1e-4 of the largest, which is bright. */
static double differs(const imp_film *a, const imp_film *b, bool *same)
{
    const float *x = a->mean, *y = b->mean;
    const int n = a->width * a->height * a->channels;
    int apart = 0;
    *same = true;
    for (int k = 0; k < n; k++) {
        apart += fabs((double)x[k] - y[k]) > 1e-4 * (1 + fabs((double)y[k]));
        *same &= x[k] == y[k];
    }
    return (double)apart / n;
}

static void pose_set(imp_scene *scene, const char *object, const double numbers[6])
{
    char name[64];
    size_t index;
    test_must(ctx, imp_scene_add_pose(scene, object));
    snprintf(name, sizeof name, "%s.pose", object);
    test_must(ctx, imp_scene_find_param(scene, name, &index));
    test_must(ctx, imp_scene_set_values(scene, index, 6, numbers));
}

/* The motion about a centre as a file writes it. */
static void motion_text(const double pose[6], imp_v3 c, char *out, size_t n)
{
    const double angle = sqrt(pose[3] * pose[3] + pose[4] * pose[4] + pose[5] * pose[5]);
    snprintf(out, n,
             "<translate x='%.17g' y='%.17g' z='%.17g'/><rotate x='%.17g' y='%.17g' "
             "z='%.17g' angle='%.17g'/><translate x='%.17g' y='%.17g' z='%.17g'/>",
             -c[0], -c[1], -c[2], pose[3], pose[4], pose[5], angle * 180 / IMP_PI,
             c[0] + pose[0], c[1] + pose[1], c[2] + pose[2]);
}

static void object_test(const char *rest, const char *object, imp_v3 centre, int which)
{
    const double pose[6] = {.3, -.2, .1, .2, -.4, .5}, none[6] = {0};
    char text[1024];
    bool same;
    motion_text(pose, centre, text, sizeof text);
    imp_scene *scene = room(rest, "", "", "");
    imp_scene *written = room(rest, which == 0 ? text : "", which == 1 ? text : "",
                              which == 2 ? text : "");
    imp_film *before = picture(scene), *there = picture(written);
    const double far = differs(before, there, &same);
    pose_set(scene, object, pose);
    imp_film *moved = picture(scene);
    const double near = differs(moved, there, &same);
    tap_ok(far > 0.1 && near < 0.01,
           "%s: the picture of a file with the motion in it # %.3f of the values differ, "
           "%.3f unmoved",
           object, near, far);
    pose_set(scene, object, none);
    imp_film *back = picture(scene);
    differs(back, before, &same);
    tap_ok(same, "%s: moved back, the bits of before", object);
    imp_film_destroy(before);
    imp_film_destroy(there);
    imp_film_destroy(moved);
    imp_film_destroy(back);
    imp_scene_destroy(scene);
    imp_scene_destroy(written);
}

#define GROUPS                                                                           \
    "<shape type='shapegroup' id='cubes'><shape type='cube'><transform name='to_world'>" \
    "<scale value='.25'/></transform></shape></shape><shape type='shapegroup' "          \
    "id='pair'><shape type='instance'><ref id='cubes'/></shape><shape type='sphere'>"    \
    "<point name='center' x='.5' y='0' z='0'/><float name='radius' value='.25'/>"        \
    "</shape></shape><shape type='instance' id='it'><ref id='pair'/><transform "         \
    "name='to_world'><scale x='.8' y='1.1' z='1'/><translate x='.9' y='-.8' z='1'/>%s"   \
    "</transform></shape>"

/* The middle of the group's box (-.25, .75) x (-.25, .25)^2, where the instance has it. */
static void instance_test(void)
{
    const double pose[6] = {-.3, .2, .1, .2, -.4, .5}, none[6] = {0}, half = .5, one = 1;
    const imp_v3 centre = imp__v3(.25 * .8 + .9, -.8, 1);
    char text[1024], rest[4096];
    size_t size;
    bool same;
    motion_text(pose, centre, text, sizeof text);
    snprintf(rest, sizeof rest, GROUPS, "");
    imp_scene *scene = room(rest, "", "", "");
    char small[2048];
    snprintf(small, sizeof small,
             "<translate x='%.17g' y='%.17g' z='%.17g'/><scale value='.5'/><translate "
             "x='%.17g' y='%.17g' z='%.17g'/>%s",
             -centre[0], -centre[1], -centre[2], centre[0], centre[1], centre[2], text);
    snprintf(rest, sizeof rest, GROUPS, small);
    imp_scene *written = room(rest, "", "", "");
    imp_film *before = picture(scene), *there = picture(written);
    const double far = differs(before, there, &same);
    pose_set(scene, "it", pose);
    test_must(ctx, imp_scene_add_geometry(scene, "it.scale"));
    test_must(ctx, imp_scene_find_param(scene, "it.scale", &size));
    test_must(ctx, imp_scene_set_values(scene, size, 1, &half));
    imp_film *moved = picture(scene);
    const double near = differs(moved, there, &same);
    tap_ok(
        far > 0.1 && near < 0.01,
        "an instance, smaller: the picture of a file that says so # %.3f of the values "
        "differ, %.3f unmoved",
        near, far);
    pose_set(scene, "it", none);
    test_must(ctx, imp_scene_set_values(scene, size, 1, &one));
    imp_film *back = picture(scene);
    differs(back, before, &same);
    tap_ok(same, "an instance: moved back, the bits of before");
    const enum imp_status st = imp_scene_add_geometry(scene, "it.vertex_positions");
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "instance"),
           "an instance has no vertices # %s", imp_last_error(ctx));
    imp_film_destroy(before);
    imp_film_destroy(there);
    imp_film_destroy(moved);
    imp_film_destroy(back);
    imp_scene_destroy(scene);
    imp_scene_destroy(written);
}

static void rotations_test(void)
{
    double worst = 0, transposed = 0;
    static const double angles[][3] = {
        {0, 0, 0}, {1e-4, 2e-4, -1e-4}, {.3, -.7, .2}, {2, 1, -1.5}, {.004, .009, 0}};
    for (int k = 0; k < 5; k++) {
        const double *a = angles[k];
        double R[9], bar[3] = {0};
        imp__rotation_of(a, R);
        const double pose[6] = {0, 0, 0, a[0], a[1], a[2]};
        for (int j = 0; j < 3; j++) {
            real p[3] = {j == 0, j == 1, j == 2};
            pose_apply(pose, (imp_v3){0}, 1, p);
            for (int i = 0; i < 3; i++)
                worst = fmax(worst, fabs(R[3 * i + j] - (double)p[i]));
        }
        /* turn_bar . (turning that R(a + h d) R(a)^T is) by differences. */
        const imp_v3 turn = imp__v3(.3, -.5, .8);
        imp__rotation_bar(a, turn, bar);
        for (int d = 0; d < 3; d++) {
            double M[2][9], W[9] = {0};
            const double h = 1e-5;
            for (int s = 0; s < 2; s++) {
                double b[3] = {a[0], a[1], a[2]};
                b[d] += (s ? 1 : -1) * h;
                imp__rotation_of(b, M[s]);
            }
            for (int i = 0; i < 9; i++)
                for (int j = 0; j < 3; j++)
                    W[i] += (M[1][i / 3 * 3 + j] - M[0][i / 3 * 3 + j]) / (2 * h) *
                            R[i % 3 * 3 + j];
            const double slope = turn[0] * W[7] + turn[1] * W[2] + turn[2] * W[3];
            transposed = fmax(transposed, fabs(slope - bar[d]));
        }
    }
    tap_ok(worst < 1e-15, "rotation vectors, small and large # %.1e", worst);
    tap_ok(transposed < 1e-9, "and their derivative, transposed # %.1e", transposed);
}

/* What a tie makes equal moves at once. */
static void tied_test(void)
{
    const double there[6] = {.3, -.2, .1, .2, -.4, .5}, none[6] = {0};
    bool same;
    imp_problem *p;
    imp_scene *scene = room("", "", "", ""), *set = room("", "", "", "");
    pose_set(scene, "block", there);
    pose_set(scene, "lamp", none);
    pose_set(set, "block", there);
    pose_set(set, "lamp", there);
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "block.pose"));
    test_must(ctx, imp_problem_activate(p, "lamp.pose"));
    test_must(ctx, imp_problem_tie(p, "*.pose", IMP_TIE_SAME));
    imp_film *tied = picture(scene), *both = picture(set);
    differs(tied, both, &same);
    tap_ok(same, "poses that are tied: the picture of both");
    imp_film_destroy(tied);
    imp_film_destroy(both);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_scene_destroy(set);
}

static void refused(imp_scene *scene, const char *object, enum imp_status status,
                    const char *word)
{
    const enum imp_status st = imp_scene_add_pose(scene, object);
    const char *why = imp_last_error(ctx);
    tap_ok(st == status && strstr(why, word), "refused # %s", why);
}

int main(void)
{
    char far[4096] = "";
    for (int k = 0; k < 8; k++) /* so many facets that Embree has them */
        snprintf(far + strlen(far), sizeof far - strlen(far),
                 "<shape type='cube'><transform name='to_world'><scale value='.1'/>"
                 "<translate x='%d' y='-20'/></transform></shape>",
                 k);
    ctx = test_context(1);
    instance_test();
    rotations_test();
    object_test("", "block", imp__v3(-.2, .3, .7), 1);
    object_test(far, "block", imp__v3(-.2, .3, .7), 1);
    object_test("", "lamp", imp__v3(.9, -.2, 3.2), 2);
    object_test("", "camera", imp__v3(.4, -5.5, 2.3), 0);

    FILE *f = fopen("poses_thread.txt", "w");
    if (!f) return 99;
    fprintf(f, "0 0 2 .1\n1 0 2 .1\n");
    fclose(f);
    tied_test();
    imp_scene *scene = room("<shape type='linearcurve' id='thread'><string "
                            "name='filename' value='poses_thread.txt'/></shape>",
                            "", "", "");
    remove("poses_thread.txt");
    refused(scene, "thread", IMP_E_UNSUPPORTED, "triangles");
    refused(scene, "nobody", IMP_E_ARG, "nobody");
    const size_t n = imp_scene_n_theta(scene);
    test_must(ctx, imp_scene_add_pose(scene, "block"));
    test_must(ctx, imp_scene_add_pose(scene, "block"));
    tap_ok(imp_scene_n_theta(scene) == n + 6, "a pose is added once, six numbers");
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    refused(scene, "lamp", IMP_E_ARG, "problem");
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}
