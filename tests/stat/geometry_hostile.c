/* SPDX-License-Identifier: Apache-2.0
 *
 * Bad numbers of geometry: errors with a name and a reason, and the scene as it was. Vertices that
 * are no numbers, triangles that vanish or turn over, singular transforms, shapes beyond what
 * floats hold, directions without length, a camera inside of a shape; fits step back. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdio.h>

enum { RES = 12 };
static imp_context *ctx;

#define SHEET "geometry_hostile.obj"

/* A square of 3 x 3 vertices in the plane z = 0; the middle is the third that faces name. */
static void sheet_write(void)
{
    FILE *f = fopen(SHEET, "w");
    if (!f) exit(99);
    for (int k = 0; k < 9; k++) fprintf(f, "v %d %d 0\n", k % 3 - 1, k / 3 - 1);
    for (int k = 0; k < 4; k++) {
        const int a = 1 + k % 2 + 3 * (k / 2);
        fprintf(f, "f %d %d %d\nf %d %d %d\n", a, a + 1, a + 4, a, a + 4, a + 3);
    }
    fclose(f);
}

static const char text[] =
    "<scene version='3.0.0'><integrator type='direct'/><sensor type='perspective' "
    "id='camera'><float name='fov' value='40'/><transform name='to_world'><lookat "
    "origin='.5,-4,3' target='0,0,0' up='0,0,1'/></transform><film type='hdrfilm'>"
    "<integer name='width' value='12'/><integer name='height' value='12'/><rfilter "
    "type='box'/></film></sensor><bsdf type='diffuse' id='grey'/>"
    "<shape type='obj' id='sheet'><string name='filename' value='" SHEET "'/><ref "
    "id='grey'/></shape>"
    "<shape type='cube' id='block'><transform name='to_world'><scale value='.3'/>"
    "<translate x='2.5' y='0' z='1'/></transform><ref id='grey'/></shape>"
    "<emitter type='directional' id='sun'><vector name='direction' value='.2,.1,-1'/>"
    "</emitter><emitter type='constant' id='sky'/></scene>";

static void values_get(imp_scene *scene, const char *name, double *out, size_t *n,
                       size_t *index)
{
    struct imp_param_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_find_param(scene, name, index));
    test_must(ctx, imp_scene_get_param(scene, *index, &info));
    test_must(ctx, imp_scene_get_values(scene, *index, out));
    *n = info.count;
}

static double brightness(imp_scene *scene)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    double sum = 0;
    run.spp = 4;
    test_must(ctx, imp_render(scene, &run, &film));
    for (int k = 0; k < RES * RES * 3; k++) sum += imp_film_mean(film)[k];
    imp_film_destroy(film);
    return sum;
}

/* Number k of a parameter becomes v; the message has both words, and nothing has changed. */
static void refused(imp_scene *scene, const char *name, int k, double v,
                    enum imp_status status, const char *word, const char *other)
{
    double old[32], now[32];
    size_t n, index;
    values_get(scene, name, old, &n, &index);
    const double before = brightness(scene);
    memcpy(now, old, sizeof now);
    now[k] = v;
    const enum imp_status st = imp_scene_set_values(scene, index, n, now);
    char why[512];
    snprintf(why, sizeof why, "%s", st == IMP_OK ? "accepted" : imp_last_error(ctx));
    values_get(scene, name, now, &n, &index);
    tap_ok(st == status && strstr(why, word) && strstr(why, other), "%s[%d] = %g # %s",
           name, k, v, why);
    tap_ok(memcmp(old, now, n * sizeof *now) == 0 && brightness(scene) == before,
           "%s[%d]: the scene is as it was", name, k);
}

static void numbers_test(imp_scene *scene)
{
    const char *sheet = "sheet.vertex_positions";
    refused(scene, sheet, 13, NAN, IMP_E_ARG, sheet, "nan");
    refused(scene, sheet, 13, INFINITY, IMP_E_ARG, sheet, "inf");
    refused(scene, sheet, 13, 1e300, IMP_E_NUMERIC, sheet, "beyond");
    /* The middle onto the middle of a side, and across it. */
    refused(scene, sheet, 6, 1, IMP_E_NUMERIC, sheet, "vanish");
    refused(scene, sheet, 6, 1.5, IMP_E_NUMERIC, sheet, "turn over");
    refused(scene, "block.scale", 0, 0, IMP_E_ARG, "block.scale", "outside");
    refused(scene, "block.scale", 0, -1, IMP_E_ARG, "block.scale", "outside");
    refused(scene, "block.scale", 0, 1e300, IMP_E_NUMERIC, "block.scale", "beyond");
    refused(scene, "block.pose", 1, NAN, IMP_E_ARG, "block.pose", "nan");
    refused(scene, "camera.x_fov", 0, 180, IMP_E_ARG, "camera.x_fov", "outside");
    refused(scene, "camera.opencv_k1", 0, -40, IMP_E_NUMERIC, "camera", "folds");
}

static void direction_test(imp_scene *scene)
{
    double old[3];
    size_t n, index;
    values_get(scene, "sun.direction", old, &n, &index);
    const enum imp_status st =
        imp_scene_set_values(scene, index, 3, (const double[]){0, 0, 0});
    tap_ok(st == IMP_E_NUMERIC && strstr(imp_last_error(ctx), "sun.direction"),
           "a direction without length # %s", imp_last_error(ctx));
}

static void singular_test(void)
{
    char bad[4096];
    snprintf(bad, sizeof bad, "%s", text);
    char *at = strstr(bad, "<scale value='.3'/>");
    memcpy(at, "<scale x='0'/>     ", 19);
    imp_scene *scene = NULL;
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    const enum imp_status st =
        imp_scene_load_string(ctx, bad, strlen(bad), "bad", &o, &scene);
    tap_ok(st != IMP_OK && strstr(imp_last_error(ctx), "block"),
           "a singular transform # %s", st == IMP_OK ? "" : imp_last_error(ctx));
    imp_scene_destroy(scene);
}

/* The camera moves into the block. */
static void camera_test(imp_scene *scene)
{
    double old[6], there[6];
    size_t n, index;
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p;
    double g[6];
    static float adjoint[RES * RES * 3];
    for (int k = 0; k < RES * RES * 3; k++) adjoint[k] = 1;
    run.spp = 4;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "block.pose"));
    values_get(scene, "camera.pose", old, &n, &index);
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
    memcpy(there, old, sizeof there);
    there[0] = 2.5 - .5;
    there[1] = 4;
    there[2] = 1 - 3;
    test_must(ctx, imp_scene_set_values(scene, index, n, there));
    const enum imp_status st = imp_problem_reverse(p, adjoint, &run, g, NULL);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "'camera'") &&
               strstr(imp_last_error(ctx), "'block'"),
           "a camera inside of a block # %s", imp_last_error(ctx));
    test_must(ctx, imp_scene_set_values(scene, index, n, old));
    test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, NULL));
    imp_problem_destroy(p);
}

/* Adam, whose steps are as wide as the triangles: it steps back, and ends at a mesh. */
static void fit_test(imp_scene *scene)
{
    struct imp_fit_options options = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *result;
    static float target[RES * RES * 3];
    for (int k = 0; k < RES * RES * 3; k++) target[k] = k % 5 == 0;
    run.spp = 4;
    options.max_iterations = 12;
    options.learning_rate = 1;
    imp_problem *p = test_problem(ctx, scene, "sheet.vertex_positions");
    test_target(ctx, p, 0, RES, RES, target);
    const enum imp_status st = imp_fit(p, &options, &run, &result);
    tap_ok(st == IMP_OK && brightness(scene) > 0, "a fit with wide steps ends # %s",
           st == IMP_OK ? "" : imp_last_error(ctx));
    double now[32], lift = 0;
    size_t n, index;
    values_get(scene, "sheet.vertex_positions", now, &n, &index);
    for (size_t k = 0; k < n; k++) lift = fmax(lift, fabs(now[k]));
    tap_ok(imp_scene_set_values(scene, index, n, now) == IMP_OK && lift < 10,
           "at a mesh whose triangles lie as they did # %.2f", lift);
    imp_problem_destroy(p);
}

int main(void)
{
    ctx = test_context(1);
    sheet_write();
    singular_test();
    imp_scene *scene = test_scene_text(ctx, text, IMP_RGB);
    static const char *const names[] = {
        "sheet.vertex_positions", "block.scale",   "block.pose",      "camera.pose",
        "camera.x_fov",           "sun.direction", "camera.opencv_k1"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    numbers_test(scene);
    direction_test(scene);
    imp_scene_destroy(scene);
    /* Without a sun, which facets of the sheet would not bear. */
    char still[4096];
    snprintf(still, sizeof still, "%s", text);
    memcpy(strstr(still, "<emitter type='directional'"), "<!--", 4);
    memcpy(strstr(still, "</emitter><emitter type='constant'"), "       -->", 10);
    scene = test_scene_text(ctx, still, IMP_RGB);
    for (size_t k = 0; k < 4; k++)
        if (k != 1) test_must(ctx, imp_scene_add_geometry(scene, names[k]));
    camera_test(scene);
    fit_test(scene);
    imp_scene_destroy(scene);
    remove(SHEET);
    imp_context_destroy(ctx);
    return tap_done();
}
