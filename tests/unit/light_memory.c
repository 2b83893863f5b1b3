/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures of light walks are held whole, for each number and
 * replicate: where they do not fit into the machine's memory, the fit says so before
 * anything is traced. And a picture, whose walks go in lanes, with every allocation
 * failing in turn. */
#include "base/context.h"
#include "imp_fail_alloc.h"
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

static const char room[] =
    "<scene version='3.0.0'><integrator type='ptracer'><integer name='max_depth' "
    "value='24'/><integer name='rr_depth' value='24'/></integrator>"
    "<sensor type='perspective'><transform name='to_world'><lookat "
    "origin='.3,.2,.9' target='0,0,-1' up='0,1,0'/></transform><float name='fov' "
    "value='80'/><film type='hdrfilm'><integer name='width' value='16'/><integer "
    "name='height' value='16'/></film></sensor><shape type='cube'><boolean "
    "name='flip_normals' value='true'/><bsdf type='diffuse'><rgb name='reflectance' "
    "value='.9,.8,.9'/></bsdf></shape><shape type='rectangle'><transform "
    "name='to_world'><scale value='.4'/><rotate x='1' angle='90'/><translate y='.9'/>"
    "</transform><emitter type='area'/></shape></scene>";

/* From allocation n on all fail: the picture is the same, since a walk alone takes less memory, or the
 * render says that there is none. */
static void picture_in_turn(void)
{
    enum { VALUES = 16 * 16 * 3 };
    struct fail_alloc heap = {0};
    imp_context *ctx = fail_alloc_context(&heap);
    imp_scene *scene = test_scene_text(ctx, room, IMP_RGB);
    struct imp_run run = IMP_RUN_INIT;
    static float whole[VALUES];
    int told = 0, same = 0, other = 0;
    run.spp = 16;
    for (long n = 0, calls = 0; n <= calls; n++) { /* the first time none fails */
        imp_film *film = NULL;
        heap.calls = 0;
        heap.fail_at = n;
        const enum imp_status st = imp_render(scene, &run, &film);
        calls = heap.calls;
        heap.fail_at = 0;
        if (n == 0 && st == IMP_OK) memcpy(whole, imp_film_mean(film), sizeof whole);
        else if (st == IMP_E_NOMEM) told++;
        else if (st == IMP_OK && !memcmp(whole, imp_film_mean(film), sizeof whole))
            same++;
        else other++;
        imp_film_destroy(film);
    }
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    tap_ok(told > 3 && same > 0 && other == 0 && heap.live == 0,
           "a picture in lanes without memory # %d times refused, %d times the same, %d "
           "times something else, %ld blocks left",
           told, same, other, heap.live);
}

int main(void)
{
    picture_in_turn();
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
