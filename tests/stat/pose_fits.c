/* SPDX-License-Identifier: Apache-2.0
 *
 * Where an object stands, from one picture: fits of a block's pose by lm, each with its own noise in
 * the picture and in the fit, from 20 degrees and a tenth of the room away, and how often their 95 %
 * intervals hold the truth. The bound is that of 95 % and a binomial number. Adam; a pose together
 * with a material, the lamp's radiance and an exposure; steps that would lead into the floor. With
 * the argument `long`: 200 fits, or so many as a second one says, of 64 x 64 pixels and 64 samples, or
 * as many on a side, samples and levels as a third, a fourth and a fifth one say. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/vec.h"
#include <stdlib.h>

static imp_context *ctx;

static imp_scene *room(int res, const char *film)
{
    char xml[8192];
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='3'/>"
        "</integrator><sensor type='perspective' id='camera'><float name='fov' "
        "value='42'/>"
        "<transform name='to_world'><lookat origin='.4,-5.5,2.6' target='0,.4,.7' "
        "up='0,0,1'/></transform><film type='hdrfilm' id='film'>"
        "<integer name='width' value='%d'/><integer name='height' value='%d'/>%s"
        "<rfilter type='box'/></film></sensor>"
        "<bsdf type='diffuse' id='table'><rgb name='reflectance' "
        "value='.6,.5,.4'/></bsdf>"
        "<bsdf type='diffuse' id='paint'><rgb name='reflectance' "
        "value='.2,.5,.7'/></bsdf>"
        "<shape type='rectangle' id='floor'><transform name='to_world'><scale value='3'/>"
        "</transform><ref id='table'/></shape>"
        "<shape type='rectangle' id='wall'><transform name='to_world'><scale x='3' "
        "y='1.5'/>"
        "<rotate x='1' angle='90'/><translate y='3' z='1.5'/></transform>"
        "<bsdf type='twosided'><ref id='table'/></bsdf></shape>"
        "<shape type='cube' id='block'><transform name='to_world'><scale x='.6' y='.5' "
        "z='.35'/><rotate z='1' angle='25'/><translate x='-.2' y='.3' z='1.1'/>"
        "</transform><ref id='paint'/></shape>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'><scale x='.5' "
        "y='.7'/>"
        "<rotate x='1' angle='205'/><translate x='.9' y='-2' z='3.2'/></transform>"
        "<emitter type='area' id='light'><rgb name='radiance' value='9,8,7'/></emitter>"
        "</shape></scene>",
        res, res, film);
    return test_scene_text(ctx, xml, IMP_RGB);
}

static void set(imp_scene *scene, const char *name, size_t n, const double *values)
{
    size_t index;
    test_must(ctx, imp_scene_find_param(scene, name, &index));
    test_must(ctx, imp_scene_set_values(scene, index, n, values));
}

static void target_add(imp_problem *p, imp_scene *scene, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    imp_film *film;
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_render(scene, &run, &film));
    imp_film_get_info(film, &info);
    test_target(ctx, p, 0, info.width, info.height, imp_film_mean(film));
    imp_film_destroy(film);
}

/* A start 20 degrees (about a random axis) and up to a tenth of the room away, in the air. */
static void start_at(uint64_t seed, double pose[6])
{
    const struct imp_key key = imp__key(seed, 1, 2);
    double axis[3], length = 0;
    for (int i = 0; i < 3; i++) {
        axis[i] = 2 * imp__u01(key, (uint32_t)i) - 1;
        pose[i] = (2 * imp__u01(key, (uint32_t)i + 3) - 1) * 0.35;
        length += axis[i] * axis[i];
    }
    for (int i = 0; i < 3; i++)
        pose[3 + i] = axis[i] / sqrt(length) * 20 * 3.14159265 / 180;
}

/* Fits, and how many of their intervals miss 0, in all and of those that converged. */
static void coverage_test(int fits, int res, int spp, int levels)
{
    int missed = 0, arrived = 0, intervals = 0;
    double chi2 = 0;
    for (int k = 0; k < fits; k++) {
        static const double rest[6] = {0};
        imp_scene *scene = room(res, "");
        double pose[6];
        struct imp_fit_options options = IMP_FIT_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        const struct imp_fit_result *result;
        test_must(ctx, imp_scene_add_pose(scene, "block"));
        imp_problem *p = test_problem(ctx, scene, "block.pose");
        set(scene, "block.pose", 6, rest);
        target_add(p, scene, 4 * spp, 9000 + (uint64_t)k);
        start_at((uint64_t)k, pose);
        set(scene, "block.pose", 6, pose);
        options.optimizer = IMP_LM;
        options.intervals = true;
        options.levels = levels;
        run.spp = spp;
        run.seed = 100 + (uint64_t)k;
        test_must(ctx, imp_fit(p, &options, &run, &result));
        bool near = true;
        int own = 0;
        for (size_t i = 0; i < result->n; i++) {
            const struct imp_fit_variable *v = &result->variables[i];
            near &= fabs(v->value) < 0.1 && v->se < 0.05;
            own += !(v->lo95 <= 0 && v->hi95 >= 0);
            chi2 += near ? v->value * v->value / (v->se * v->se) : 0;
        }
        if (near) {
            arrived++;
            intervals += 6;
            missed += own;
        }
        printf("# fit %d: %s, %d missed, %d iterations, %s\n", k,
               near ? "there" : "elsewhere", own, result->iterations, result->reason);
        imp_problem_destroy(p);
        imp_scene_destroy(scene);
    }
    /* Three standard errors of a binomial number, of which three of the six are independent. */
    const double p = (double)missed / imp_max(intervals, 1);
    const double allowed = 3 * sqrt(0.05 * 0.95 / (0.5 * imp_max(intervals, 1)));
    tap_ok(arrived >= 0.65 * fits, "fits that find the block # %d of %d", arrived, fits);
    tap_ok(p < 0.05 + allowed && p > 0.05 - allowed,
           "95 %% intervals that miss the truth # %d of %d: %.1f %%, mean square %.2f",
           missed, intervals, 100 * p, chi2 / imp_max(intervals, 1));
}

/* With a material, a light and an exposure that are not known either. */
static void together_test(void)
{
    static const double pose[6] = {.1, -.1, .05, .1, 0, .1};
    imp_scene *scene = room(32, "<float name='exposure' value='1'/>");
    struct imp_fit_options options = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *result;
    test_must(ctx, imp_scene_add_pose(scene, "block"));
    imp_problem *p = test_problem(ctx, scene, "block.pose");
    test_must(ctx, imp_problem_activate(p, "paint.reflectance.value"));
    test_must(ctx, imp_problem_activate(p, "camera.exposure.value"));
    target_add(p, scene, 64, 77);
    set(scene, "block.pose", 6, pose);
    set(scene, "paint.reflectance.value", 3, (const double[]){.4, .4, .4});
    options.optimizer = IMP_LM;
    options.intervals = true;
    run.spp = 32;
    test_must(ctx, imp_fit(p, &options, &run, &result));
    double worst = 0;
    for (size_t i = 0; i < result->n; i++) {
        static const double truth[10] = {1, .2, .5, .7, 0, 0, 0, 0, 0, 0};
        const struct imp_fit_variable *v = &result->variables[i];
        const double z = fabs(v->value - truth[i]) / v->se;
        printf("# %g +- %g, z %.2f\n", v->value, v->se, z);
        if (!(z <= worst)) worst = z;
    }
    tap_ok(result->n == 10 && worst < 4,
           "a pose, a reflectance and an exposure: worst |z| of 10 # %.2f", worst);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Adam, towards a block just above the floor, into which some steps would push it. */
static void adam_test(void)
{
    static const double truth[6] = {0, 0, -.745, 0, 0, 0},
                        pose[6] = {.05, .05, -.6, 0, 0, .05};
    imp_scene *scene = room(24, "");
    struct imp_fit_options options = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *result;
    test_must(ctx, imp_scene_add_pose(scene, "block"));
    imp_problem *p = test_problem(ctx, scene, "block.pose");
    set(scene, "block.pose", 6, truth);
    target_add(p, scene, 64, 5);
    set(scene, "block.pose", 6, pose);
    options.max_iterations = 120;
    run.spp = 8;
    test_must(ctx, imp_fit(p, &options, &run, &result));
    /* Never into it; and the block is nearer to where it was seen. */
    const double height = result->variables[2].value;
    tap_ok(height > -.75 && fabs(height - truth[2]) < 0.4 * fabs(pose[2] - truth[2]),
           "Adam, to a hair above the floor # height %.4f for %.3f after %d", height,
           truth[2], result->iterations);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool all = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(2);
    if (all) {
        coverage_test(argc > 2 ? atoi(argv[2]) : 200, argc > 3 ? atoi(argv[3]) : 64,
                      argc > 4 ? atoi(argv[4]) : 64, argc > 5 ? atoi(argv[5]) : 5);
    } else {
        coverage_test(3, 32, 8, 3);
        together_test();
        adam_test();
    }
    imp_context_destroy(ctx);
    return tap_done();
}
