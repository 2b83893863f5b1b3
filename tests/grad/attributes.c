/* SPDX-License-Identifier: Apache-2.0
 *
 * Numbers of the vertices and faces of meshes: their derivatives in all roles and modes by
 * the checks of the library, and a plane under a white sky in closed form: light is
 * reflectance there, which is linear between vertices, and its derivative the barycentric
 * weight. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdbool.h>

static imp_context *ctx;

static void all_rows(enum imp_color_mode mode, const char *name, const char *defines,
                     uint64_t seed)
{
    imp_scene *scene =
        test_scene(ctx, "../tests/render/attributes_lamp.xml", mode, defines);
    imp_problem *p;
    const struct imp_check_row *rows;
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    size_t n, failed = 0, seen = 0;
    char worst[128] = "none";
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    o.draws_s = 0.02;
    o.paths = 400;
    o.fresh_spp = 24;
    run.seed = seed;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        seen += rows[i].param && strstr(rows[i].param, "vertex_") && rows[i].value != 0;
        if (rows[i].ok != 0) continue;
        failed++;
        snprintf(worst, sizeof worst, "%s %s", rows[i].method,
                 rows[i].param ? rows[i].param : "");
    }
    tap_ok(failed == 0 && seen > 8, "%s: %zu checks, %zu of vertices # failed: %s", name,
           n, seen, worst);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Corners (0,0), (4,0), (0,4) of a plane seen from above, one pixel on the middle of a
 * cell; the sky is white and the integrator stops after one reflection. */
static void plane(bool grouped)
{
    FILE *f = fopen("plane_attributes.ply", "w");
    fprintf(f,
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float "
            "y\nproperty float z\nproperty float paint_r\nproperty float "
            "paint_g\nproperty float paint_b\nelement face 1\nproperty list uchar int "
            "vertex_indices\nend_header\n-2 -2 0 .1 .2 .3\n6 -2 0 .9 .4 .5\n-2 6 0 .6 "
            ".8 .1\n3 0 1 2\n");
    fclose(f);
    static const char head[] =
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='2'/></integrator><sensor type='orthographic'><transform "
        "name='to_world'><scale x='1' y='1'/><lookat origin='0,0,3' target='0,0,0' "
        "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' "
        "value='4'/><integer name='height' value='4'/><rfilter "
        "type='box'/></film></sensor>"
        "<emitter type='constant'><float name='radiance' value='1'/></emitter>";
    static const char shape[] =
        "<shape type='ply' id='plane'><string name='filename' "
        "value='plane_attributes.ply'/>%s<bsdf type='diffuse'><texture "
        "type='mesh_attribute' name='reflectance'><string name='name' "
        "value='vertex_paint_color'/></texture></bsdf></shape>";
    char own[2048], xml[4096];
    /* In a group it is smaller and elsewhere; the instance undoes that. */
    snprintf(own, sizeof own, shape,
             grouped ? "<transform name='to_world'><scale value='.25'/><translate x='1' "
                       "y='2' z='3'/></transform>"
                     : "");
    snprintf(xml, sizeof xml,
             grouped ? "%s<shape type='shapegroup' id='g'>%s</shape><shape "
                       "type='instance'><ref id='g'/><transform name='to_world'>"
                       "<translate x='-1' y='-2' z='-3'/><scale value='4'/></transform>"
                       "</shape></scene>"
                     : "%s%s</scene>",
             head, own);
    const char *which = grouped ? "a plane in a group" : "a plane";
    static const double corner[3][3] = {{.1, .2, .3}, {.9, .4, .5}, {.6, .8, .1}};
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 2000;
    run.seed = 5;
    test_must(ctx, imp_render(scene, &run, &film));
    double worst = 0, largest = 0;
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 4; x++) {
            /* Of the pixel's middle: on the film x runs left to right, y down. */
            const double wx = (x + .5) / 2 - 1, wy = 1 - (y + .5) / 2;
            const double b1 = (wx + 2) / 8, b2 = (wy + 2) / 8;
            for (int c = 0; c < 3; c++) {
                const size_t k = (size_t)(3 * (4 * y + x) + c);
                const double truth =
                    corner[0][c] * (1 - b1 - b2) + corner[1][c] * b1 + corner[2][c] * b2;
                const double se = imp_film_se(film)[k];
                worst = fmax(worst, fabs(imp_film_mean(film)[k] - truth) / se);
                largest = fmax(largest, se / truth);
            }
        }
    tap_ok(worst < 4.5 && largest < .01,
           "light of %s: reflectance between vertices # largest z %.2f, se %.1e", which,
           worst, largest);
    imp_film_destroy(film);

    /* Mean of the picture by each number: the weight at its middle, over three channels. */
    imp_problem *p;
    double grad[9], se[9], z = 0, sum = 0;
    const double weight[3] = {.5, .25, .25};
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "plane.vertex_paint_color"));
    run.spp = 512;
    test_must(ctx, imp_problem_functional(p, NULL, &run, NULL, grad, se));
    for (int v = 0; v < 3; v++)
        for (int c = 0; c < 3; c++) {
            const double truth = weight[v] / 3;
            z = fmax(z, fabs(grad[3 * v + c] - truth) / se[3 * v + c]);
            sum += grad[3 * v + c];
        }
    tap_ok(z < 4.5 && fabs(sum - 1) < .01,
           "its derivatives: barycentric weights # largest z %.2f, sum %.4f", z, sum);
    /* Vertices stand in a list: the next of it is no neighbour. */
    enum imp_status st = imp_problem_add_smoothness(p, "plane.*", 1);
    tap_ok(st == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "'plane.vertex_paint_color' is a list"),
           "smoothness of them is refused # %s", imp_last_error(ctx));
    const struct imp_fit_result *r;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    static const float black[48];
    target.width = target.height = 4, target.channels = 3, target.pixels = black;
    test_must(ctx, imp_problem_add_target(p, &target));
    o.optimizer = IMP_ADAM;
    o.levels = 2;
    st = imp_fit(p, &o, &run, &r);
    tap_ok(st == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "'plane.vertex_paint_color' is"),
           "and so are levels # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    remove("plane_attributes.ply");
}

int main(void)
{
    ctx = test_context(0);
    all_rows(IMP_RGB, "rgb", NULL, 3);
    all_rows(IMP_MONO, "mono", NULL, 4);
    all_rows(IMP_SPECTRAL, "spectral", NULL, 5);
    all_rows(IMP_RGB, "rgb, volpath", "integrator=volpath", 6);
    plane(false);
    plane(true);
    imp_context_destroy(ctx);
    return tap_done();
}
