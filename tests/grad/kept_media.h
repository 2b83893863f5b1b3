/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks through media: a cloud of a grid, and pictures side by side. */
#ifndef KEPT_MEDIA_H
#define KEPT_MEDIA_H

#include "imp_scene.h"
#include "imp_tap.h"
#include "vol_write.h"
#include <importon/walks.h>
#include <math.h>
#include <stdbool.h>

#define FAIL_Z 4.5
#define CELLS  64

static imp_context *ctx;

#define CAMERA(medium)                                                                   \
    "<sensor type='perspective'><float name='fov' value='45'/><transform "               \
    "name='to_world'><lookat origin='0,0,2.6' target='0,0,0' "                           \
    "up='0,1,0'/></transform>" medium                                                    \
    "<film type='hdrfilm'><integer name='width' value='16'/><integer "                   \
    "name='height' value='16'/><string name='pixel_format' value='rgb'/><rfilter "       \
    "type='box'/></film></sensor>"

/* A cloud in a box under a sky and a lamp. */
static imp_scene *cloud(const char *vol, const char *filter, const char *how,
                        enum imp_color_mode mode)
{
    char xml[4096];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='volpath'><integer name='rr_depth' "
        "value='6'/>%s</integrator>" CAMERA(
            "") "<emitter type='constant'><rgb name='radiance' "
                "value='.3,.4,.5'/></emitter>"
                "<shape type='sphere'><point name='center' x='.8' y='2' z='1'/><float "
                "name='radius' value='.4'/><emitter type='area'><float name='radiance' "
                "value='8'/></emitter></shape><shape type='cube'><transform "
                "name='to_world'>"
                "<scale value='.8'/></transform><bsdf type='null'/><medium "
                "name='interior' "
                "id='cloud' type='heterogeneous'><volume name='sigma_t' "
                "type='gridvolume'><string "
                "name='filename' value='%s'/><string name='filter_type' "
                "value='%s'/><transform "
                "name='to_world'><scale value='1.6'/><translate x='-.8' y='-.8' z='-.8'/>"
                "</transform></volume><rgb name='albedo' value='.9,.7,.5'/><phase "
                "type='hg'><float "
                "name='g' value='.4'/></phase></medium></shape></scene>",
        how, vol, filter);
    return test_scene_text(ctx, xml, mode);
}

/* Grids of 4^3 numbers drawn evenly from [.2, .2 + spread), and of three times as many;
 * value [3 CELLS] gets them. */
static void clouds_write(float spread, char *grey, char *coloured, float *value)
{
    uint32_t state = 1;
    for (int k = 0; k < 3 * CELLS; k++) {
        state = state * 1664525u + 1013904223u;
        value[k] = 0.2f + spread * (float)(state >> 8) / 16777216.0f;
    }
    vol_write(grey, 4, 4, 4, 1, value);
    vol_write(coloured, 4, 4, 4, 3, value);
}

/* headroom 0: none. */
static imp_walks *keep(imp_scene *scene, int spp, bool losses, double headroom)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    imp_walks *walks;
    run.spp = spp;
    run.seed = 21;
    run.points = IMP_POINTS_INDEPENDENT;
    o.survival = -1;
    o.losses = losses;
    o.ess = 0.1;
    o.headroom = headroom;
    test_must(ctx, imp_walks_keep(scene, &run, &o, &walks));
    return walks;
}
static imp_film *render(imp_scene *scene, const imp_walks *walks, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = spp;
    run.seed = seed;
    run.points = IMP_POINTS_INDEPENDENT;
    run.walks = walks;
    test_must(ctx, imp_render(scene, &run, &film));
    return film;
}
static struct imp_walks_weight weigh(const imp_walks *walks)
{
    struct imp_walks_weight w = IMP_WALKS_WEIGHT_INIT;
    test_must(ctx, imp_walks_weigh(walks, 0, NULL, &w));
    return w;
}
static size_t param(imp_scene *scene, const char *name, double *x, size_t *n)
{
    struct imp_param_info info = {.size = sizeof info};
    size_t k;
    test_must(ctx, imp_scene_find_param(scene, name, &k));
    test_must(ctx, imp_scene_get_param(scene, k, &info));
    test_must(ctx, imp_scene_get_values(scene, k, x));
    *n = info.count;
    return k;
}
/* Largest difference of the means over blocks of 4 x 4 pixels, channel by channel, in
 * standard errors: pixels are independent of each other. Its square's mean: about 1. */
static double worst_of(imp_film *a, imp_film *b, double *square)
{
    struct imp_film_info i = {.size = sizeof i};
    imp_film_get_info(a, &i);
    double worst = 0, sum = 0;
    int n = 0;
    for (int block = 0; block < 16; block++)
        for (int c = 0; c < i.channels; c++) {
            double d = 0, var = 0;
            for (int k = 0; k < 16; k++) {
                const int x = block % 4 * 4 + k % 4, y = block / 4 * 4 + k / 4;
                const size_t at = (size_t)((y * i.width + x) * i.channels + c);
                d += (double)imp_film_mean(a)[at] - (double)imp_film_mean(b)[at];
                var += pow((double)imp_film_se(a)[at], 2) +
                       pow((double)imp_film_se(b)[at], 2);
            }
            if (!(var > 0)) continue;
            worst = fmax(worst, fabs(d) / sqrt(var));
            sum += d * d / var;
            n++;
        }
    *square = sum / n;
    return worst;
}

#endif
