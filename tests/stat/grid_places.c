/* SPDX-License-Identifier: Apache-2.0
 *
 * Where grid volumes may move: the border of a box in a small ball is refused, recorded walks are of
 * one place, and fits step back from what is refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "vol_write.h"
#include <importon/walks.h>
#include <math.h>
#include <stdio.h>
#include <unistd.h>

enum { CELLS = 4, N = CELLS * CELLS * CELLS };
static imp_context *ctx;
static char full_file[64], ramp_file[64], cloud_file[64];

static bool is_inner(int k)
{
    bool inner = true;
    for (int a = 0; a < 3; a++, k /= CELLS)
        inner &= k % CELLS > 0 && k % CELLS < CELLS - 1;
    return inner;
}

static void files_make(void)
{
    float full[8], ramp[8], cloud[N];
    for (int k = 0; k < 8; k++) {
        full[k] = 1;
        ramp[k] = k % 2 ? 3 : .5f;
    }
    for (int k = 0; k < N; k++) cloud[k] = is_inner(k) ? 1 + .3f * (float)(k % 3) : 0;
    vol_write(full_file, 2, 2, 2, 1, full);
    vol_write(ramp_file, 2, 2, 2, 1, ramp);
    vol_write(cloud_file, CELLS, CELLS, CELLS, 1, cloud);
}

/* A box of ones, or of 0, as wide as two, about a ball of the medium before a wall that glows. */
static imp_scene *ball_in_box(const char *file, const char *centre, const char *radius)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='volpath'><integer "
             "name='max_depth' value='4'/></integrator><sensor type='perspective' "
             "id='camera'><float name='fov' value='40'/><transform name='to_world'>"
             "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film "
             "type='hdrfilm'><integer name='width' value='8'/><integer name='height' "
             "value='8'/><rfilter type='box'/></film></sensor><shape type='rectangle' "
             "id='wall'><transform name='to_world'><scale value='3'/><translate z='-2'/>"
             "</transform><emitter type='area'><rgb name='radiance' value='3'/></emitter>"
             "</shape><shape type='sphere' id='ball'><point name='center' value='%s'/>"
             "<float name='radius' value='%s'/><bsdf type='null'/><medium "
             "type='heterogeneous' name='interior'><volume type='gridvolume' "
             "name='sigma_t' id='cloud'><string name='filename' value='%s'/><transform "
             "name='to_world'><translate x='-.5' y='-.5' z='-.5'/><scale value='2'/>"
             "</transform></volume><float name='albedo' value='.5'/></medium></shape>"
             "</scene>",
             centre, radius, file);
    return test_scene_text(ctx, xml, IMP_RGB);
}

/* A ball that is smaller than a cell, at a border. */
static void small_border(void)
{
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    double g[6];
    float colour[3 * 8 * 8];
    run.spp = 2;
    for (int k = 0; k < 3 * 8 * 8; k++) colour[k] = 1;
    imp_scene *scene = ball_in_box(full_file, "1,0,0", ".3");
    test_must(ctx, imp_scene_add_geometry(scene, "cloud.pose"));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "cloud.pose"));
    const enum imp_status st = imp_problem_reverse(p, colour, &run, g, NULL);
    tap_ok(st == IMP_E_BIAS && strstr(imp_last_error(ctx), "the border of a box"),
           "a border between the middles of its cells # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Collisions were drawn where the volume was. */
static void kept_test(void)
{
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_walks_options headroom = {.size = sizeof headroom, .headroom = 4};
    const double there[6] = {.1};
    imp_walks *walks;
    imp_film *film;
    size_t index;
    imp_scene *scene = ball_in_box(full_file, "0,0,0", ".2");
    test_must(ctx, imp_scene_add_geometry(scene, "cloud.pose"));
    test_must(ctx, imp_scene_find_param(scene, "cloud.pose", &index));
    run.spp = 4;
    test_must(ctx, imp_walks_keep(scene, &run, &headroom, &walks));
    test_must(ctx, imp_scene_set_values(scene, index, 6, there));
    run.walks = walks;
    const enum imp_status st = imp_render(scene, &run, &film);
    tap_ok(st == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "cloud.pose has another value"),
           "recorded walks of a volume that has moved # %s", imp_last_error(ctx));
    if (st == IMP_OK) imp_film_destroy(film);
    imp_walks_destroy(walks);
    imp_scene_destroy(scene);
}

/* A fit by its place, and cells, to a picture that is dark, with steps that lead to where the border of the
 * box is in a small ball. */
static enum imp_status fit_to_dark(imp_scene *scene, bool cells, const char *held,
                                   double end[6])
{
    static const float dark[3 * 8 * 8];
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_options o = {
        .size = sizeof o, .max_iterations = 10, .learning_rate = 1};
    const struct imp_target target = {
        .size = sizeof target, .width = 8, .height = 8, .channels = 3, .pixels = dark};
    const struct imp_fit_result *result;
    imp_problem *p;
    size_t index;
    test_must(ctx, imp_scene_add_geometry(scene, "cloud.pose"));
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "cloud.pose"));
    if (cells) test_must(ctx, imp_problem_activate(p, "cloud.data"));
    if (held) test_must(ctx, imp_problem_hold(p, held));
    test_must(ctx, imp_problem_add_target(p, &target));
    run.spp = 8;
    const enum imp_status st = imp_fit(p, &o, &run, &result);
    test_must(ctx, imp_scene_find_param(scene, "cloud.pose", &index));
    test_must(ctx, imp_scene_get_values(scene, index, end));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    return st;
}

static void fits_test(void)
{
    char held[16384] = "", one[32];
    double end[6];
    enum imp_status st =
        fit_to_dark(ball_in_box(ramp_file, "0,0,0", ".2"), false, NULL, end);
    tap_ok(st == IMP_OK && end[0] != 0 && fabs(end[0]) < .8,
           "a fit steps back from where a volume jumps # at %.3f%s%s", end[0],
           st == IMP_OK ? "" : ": ", st == IMP_OK ? "" : imp_last_error(ctx));
    st = fit_to_dark(ball_in_box(ramp_file, "0,0,0", ".2"), true, NULL, end);
    tap_ok(st == IMP_OK, "cells beyond the ball # %s",
           st == IMP_OK ? "" : imp_last_error(ctx));
    st = fit_to_dark(ball_in_box(cloud_file, "0,0,0", "1.4"), true, NULL, end);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "hold these at 0"),
           "a place beside cells at the border # %s", imp_last_error(ctx));
    for (int k = 0; k < N; k++) {
        if (is_inner(k)) continue;
        snprintf(one, sizeof one, "%scloud.data[%d]", *held ? "," : "", k);
        strncat(held, one, sizeof held - strlen(held) - 1);
    }
    st = fit_to_dark(ball_in_box(cloud_file, "0,0,0", "1.4"), true, held, end);
    tap_ok(st == IMP_OK, "where these are held # %s",
           st == IMP_OK ? "" : imp_last_error(ctx));
}

int main(void)
{
    ctx = test_context(2);
    files_make();
    small_border();
    kept_test();
    fits_test();
    unlink(full_file);
    unlink(ramp_file);
    unlink(cloud_file);
    imp_context_destroy(ctx);
    return tap_done();
}
