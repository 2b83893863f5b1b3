/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures of light walks are held whole, for each number and
 * replicate: where they do not fit into the machine's memory, the fit says so before
 * anything is traced. */
#include "base/context.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>
#include <string.h>

enum { SHAPES = 80, SIDE = 1600 }; /* 240 numbers */

static imp_scene *scene_of(imp_context *ctx, int side)
{
    static char xml[SHAPES * 400 + 2000];
    size_t n = (size_t)snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='ptracer'/><sensor type='perspective'>"
        "<transform name='to_world'><lookat origin='0,0,9' target='0,0,0' up='0,1,0'/>"
        "</transform><film type='hdrfilm'><integer name='width' value='%d'/><integer "
        "name='height' value='%d'/><rfilter type='box'/></film></sensor>"
        "<emitter type='point'><point name='position' x='0' y='0' z='5'/></emitter>",
        side, side);
    for (int k = 0; k < SHAPES; k++)
        n += (size_t)snprintf(
            xml + n, sizeof xml - n,
            "<shape type='rectangle'><transform name='to_world'><scale value='.2'/>"
            "<translate x='%d' y='%d'/></transform><bsdf type='diffuse' id='paint%d'>"
            "<rgb name='reflectance' value='.2,.3,.4'/></bsdf></shape>",
            k % 9 - 4, k / 9 - 4, k);
    snprintf(xml + n, sizeof xml - n, "</scene>");
    return test_scene_text(ctx, xml, IMP_RGB);
}

static enum imp_status fit(imp_context *ctx, int side)
{
    imp_scene *scene = scene_of(ctx, side);
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    const size_t pixels = (size_t)side * (size_t)side;
    float *zeros = calloc(3 * pixels, sizeof *zeros);
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "paint*"));
    t.width = t.height = side;
    t.channels = 3;
    t.pixels = zeros;
    test_must(ctx, imp_problem_add_target(p, &t));
    free(zeros);
    o.optimizer = IMP_LM;
    o.max_iterations = 1;
    o.intervals = false;
    run.spp = 8;
    const enum imp_status st = imp_fit(p, &o, &run, &r);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    return st;
}

int main(void)
{
    imp_context *ctx = test_context(1);
    /* 8 replicates of 241 pictures of three doubles a pixel, and 481 doubles: 128 GB. */
    if (imp__memory_check(ctx, 1.3e11, "them") == IMP_OK) {
        tap_skip("derivative pictures that do not fit", "128 GB are free");
    } else {
        const enum imp_status st = fit(ctx, SIDE);
        const char *message = st == IMP_OK ? "" : imp_last_error(ctx);
        tap_ok(st == IMP_E_NOMEM && strstr(message, "derivative pictures") &&
                   strstr(message, "128 GB of memory"),
               "derivative pictures that do not fit # %s", message);
    }
    tap_ok(fit(ctx, 4) == IMP_OK, "derivative pictures that do");
    imp_context_destroy(ctx);
    return tap_done();
}
