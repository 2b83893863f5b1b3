/* SPDX-License-Identifier: Apache-2.0
 *
 * Targets with levels weigh their values by how well the walks of a loss know them. A lamp before a bright
 * wall covers the part p of a column of pixels: n walks know these values with the variance
 * (lamp - wall)^2 p (1 - p)/n, and the target with s^2. The weight that the loss has there is measured by
 * moving the column's targets up and down, as L = w (M - T)^2/2 has the second difference w d^2,
 * and is s^2/(s^2 + that variance). */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/clip.h>
#include <math.h>

enum { WIDTH = 16, HEIGHT = 12, PIXELS = WIDTH * HEIGHT, EDGE = 6, SPP = 64 };
#define WALL 0.5
#define LAMP 8.0
#define PART 0.25 /* of the pixels of column EDGE, which the lamp covers */
#define STEP 0.5

static imp_context *ctx;

/* A camera at the origin whose pixels are 1/8 wide at z = -1. */
static imp_scene *scene_make(void)
{
    static char xml[2048];
    const double right = -1 + (EDGE + PART) / 8;
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'>"
             "<float name='fov' value='90'/><transform name='to_world'><lookat "
             "origin='0,0,0' target='0,0,-1' up='0,1,0'/></transform><film "
             "type='hdrfilm'><integer name='width' value='%d'/><integer name='height' "
             "value='%d'/><rfilter type='box'/></film></sensor>"
             "<shape type='rectangle'><transform name='to_world'><scale value='9'/>"
             "<translate z='-2'/></transform><emitter type='area' id='wall'><spectrum "
             "name='radiance' value='%g'/></emitter></shape><shape type='rectangle'>"
             "<transform name='to_world'><scale x='1' y='2'/><translate x='%g' z='-1'/>"
             "</transform><emitter type='area' id='lamp'><spectrum name='radiance' "
             "value='%g'/></emitter></shape></scene>",
             WIDTH, HEIGHT, WALL, right - 1, LAMP);
    return test_scene_text(ctx, xml, IMP_MONO);
}

static double light_at(int x)
{
    return x < EDGE ? LAMP : x > EDGE ? WALL : PART * LAMP + (1 - PART) * WALL;
}

/* The loss where targets differ from the light by s, up and down, those of a column by `moved` more. */
static struct imp_estimate loss(imp_scene *s, double noise, bool levels, int column,
                                double moved)
{
    float pixels[PIXELS];
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate out;
    imp_problem *p;
    double x[1];
    for (int i = 0; i < PIXELS; i++) {
        const int at = i % WIDTH, sign = (at + i / WIDTH) % 2 ? 1 : -1;
        pixels[i] =
            (float)(light_at(at) + sign * 0.6745 * noise + (at == column ? moved : 0));
    }
    t.width = WIDTH;
    t.height = HEIGHT;
    t.channels = 1;
    t.pixels = pixels;
    run.spp = SPP;
    run.seed = 5;
    run.points =
        IMP_POINTS_INDEPENDENT; /* as fits with Gauss-Newton matrices have them */
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "wall.radiance.value"));
    test_must(ctx, imp_problem_add_target(p, &t));
    if (levels) {
        test_must(ctx, imp_problem_clip(p, 0, -100, 100));
        test_must(ctx, imp_problem_censor(p, &run));
    }
    imp_problem_get_x(p, x);
    test_must(ctx, imp_problem_objective(p, x, &run, &out, NULL, NULL));
    imp_problem_destroy(p);
    return out;
}

/* Second difference of the loss by a column's targets. */
static double curvature(imp_scene *s, double noise, int column)
{
    return loss(s, noise, true, column, STEP).value +
           loss(s, noise, true, column, -STEP).value -
           2 * loss(s, noise, true, column, 0).value;
}

int main(void)
{
    static const double noises[] = {0.02, 0.1, 0.2};
    const double variance = (LAMP - WALL) * (LAMP - WALL) * PART * (1 - PART) / SPP;
    ctx = test_context(2);
    imp_scene *s = scene_make();
    for (size_t k = 0; k < sizeof noises / sizeof *noises; k++) {
        const double n2 = noises[k] * noises[k], whole = curvature(s, noises[k], 2);
        const double part = curvature(s, noises[k], EDGE) / whole;
        /* 256 samples of each of 12 pixels know the variance to 3 % */
        tap_ok(fabs(part / (n2 / (n2 + variance)) - 1) < 0.12,
               "noise %g: weight beside what is known # %.4g, expected %.4g", noises[k],
               part, n2 / (n2 + variance));
    }
    const struct imp_estimate with = loss(s, 0.1, true, -1, 0),
                              without = loss(s, 0.1, false, -1, 0);
    tap_ok(with.se < 0.1 * without.se,
           "and the loss is known better # %.3g +- %.2g, %.3g +- %.2g", with.value,
           with.se, without.value, without.se);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}
