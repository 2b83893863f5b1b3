/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses with many numbers (more than 1,024, summed in fixed point), some of which are of geometry:
 * gradients by vertices are those of a problem without the others, to rounding; standard errors agree
 * with them on average, by fewer contrasts, and with the spread over seeds. */
#include "imp_scene.h"
#include "imp_tap.h"

enum { WIDTH = 16, HEIGHT = 12, NUMBERS = 27 };
static imp_context *ctx;

#define TENT "moved_many.obj"

/* 3 x 3 vertices, the middle lifted. */
static void tent_write(void)
{
    FILE *f = fopen(TENT, "w");
    if (!f) exit(99);
    for (int k = 0; k < 9; k++)
        fprintf(f, "v %g %g %g\n", .7 * (k % 3 - 1), .7 * (k / 3 - 1), k == 4 ? .6 : 0.);
    for (int k = 0; k < 4; k++) {
        const int a = 1 + k % 2 + 3 * (k / 2);
        fprintf(f, "f %d %d %d\nf %d %d %d\n", a, a + 1, a + 4, a, a + 4, a + 3);
    }
    fclose(f);
}

static imp_scene *room(void)
{
    return test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='3'/></integrator><sensor type='perspective' id='camera'><float "
        "name='fov' "
        "value='45'/><transform name='to_world'><lookat origin='.4,-4,2.6' "
        "target='0,0,.3' up='0,0,1'/></transform><film type='hdrfilm'><integer "
        "name='width' value='16'/><integer name='height' value='12'/><rfilter "
        "type='box'/></film></sensor><shape type='rectangle' id='floor'><transform "
        "name='to_world'><scale value='3'/></transform><bsdf type='diffuse'><texture "
        "type='bitmap' name='reflectance' id='map'><string name='filename' "
        "value='" IMP_SCENES "/textured/waves.png'/></texture></bsdf></shape>"
        "<shape type='obj' id='tent'><string name='filename' value='" TENT "'/>"
        "<transform name='to_world'><translate z='.8'/></transform><bsdf type='twosided'>"
        "<bsdf type='diffuse'/></bsdf></shape><shape type='rectangle' id='lamp'>"
        "<transform name='to_world'><scale value='.7'/><rotate x='1' angle='170'/>"
        "<translate x='1' y='-.4' z='3'/></transform><emitter type='area'><rgb "
        "name='radiance' value='9,8,7'/></emitter></shape></scene>",
        IMP_RGB);
}

static imp_problem *problem(imp_scene *scene, bool many, const float *target)
{
    imp_problem *p = test_problem(ctx, scene, "tent.vertex_positions");
    if (many) test_must(ctx, imp_problem_activate(p, "map.data"));
    test_target(ctx, p, 0, WIDTH, HEIGHT, target);
    return p;
}

int main(void)
{
    enum { SEEDS = 24 };
    static float target[WIDTH * HEIGHT * 3];
    ctx = test_context(2);
    tent_write();
    imp_scene *scene = room();
    test_must(ctx, imp_scene_add_geometry(scene, "tent.vertex_positions"));
    for (int k = 0; k < WIDTH * HEIGHT * 3; k++) target[k] = .2f + .1f * (float)(k % 7);
    imp_problem *few = problem(scene, false, target),
                *many = problem(scene, true, target);
    const size_t n = imp_problem_n_variables(many), first = n - NUMBERS;
    double *g = calloc(2 * n, sizeof *g), own[2 * NUMBERS], apart = 0, size = 0;
    double told[NUMBERS] = {0}, fewer = 0, seen = 0;
    struct tap_stat stat[NUMBERS] = {{0, 0, 0}};
    tap_ok(imp_problem_n_variables(few) == NUMBERS && n > 1024, "numbers # %d of %zu",
           NUMBERS, n);
    for (int s = 0; s < SEEDS; s++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate value;
        run.spp = 16;
        run.seed = 40 + (uint64_t)s;
        test_must(ctx,
                  imp_problem_objective(few, NULL, &run, &value, own, own + NUMBERS));
        test_must(ctx, imp_problem_objective(many, NULL, &run, &value, g, g + n));
        for (int k = 0; k < NUMBERS; k++) {
            const double here = g[first + (size_t)k], se = g[n + first + (size_t)k];
            apart = fmax(apart, fabs(here - own[k]));
            size = fmax(size, fabs(own[k]));
            told[k] += se * se / SEEDS;
            fewer += log(se / own[NUMBERS + k]) / (NUMBERS * SEEDS);
            tap_add(&stat[k], here);
        }
    }
    tap_ok(apart < 1e-9 * size,
           "gradients by vertices do not depend on the others # %.1e", apart / size);
    tap_ok(fabs(fewer) < 0.05, "nor do their errors, on average # %.3f", exp(fewer));
    for (int k = 0; k < NUMBERS; k++)
        seen += log(sqrt(told[k] / SEEDS) / tap_se(&stat[k])) / NUMBERS;
    tap_ok(exp(seen) > 0.85 && exp(seen) < 1.2, "errors told over errors seen # %.3f",
           exp(seen));
    free(g);
    imp_problem_destroy(few);
    imp_problem_destroy(many);
    imp_scene_destroy(scene);
    remove(TENT);
    imp_context_destroy(ctx);
    return tap_done();
}
