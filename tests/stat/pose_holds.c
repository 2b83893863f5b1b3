/* SPDX-License-Identifier: Apache-2.0
 *
 * A block of which x, y and the rotation about the vertical are unknown: numbers that are held
 * (imp_problem_hold). Derivatives of the others have the bits that they have when nothing is held;
 * lm, lbfgs and Adam leave the held ones in all their bits; the errors of the others are not
 * larger than those of a fit of all six, and hold the truth; checks still have a row for each. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/vec.h"

static imp_context *ctx;
static const double truth[6] = {0}, start[6] = {.06, -.05, 0, 0, 0, .08};

static void pose_set(imp_scene *scene, const double pose[6])
{
    size_t index;
    test_must(ctx, imp_scene_find_param(scene, "block.pose", &index));
    test_must(ctx, imp_scene_set_values(scene, index, 6, pose));
}

/* The block at `start`, and a target of where it is; `hold` NULL: nothing. */
static imp_problem *problem_of(imp_scene **scene, const char *hold)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_film_info info = {.size = sizeof info};
    imp_film *film;
    *scene = test_scene(ctx, "poses.xml", IMP_RGB, "res=24");
    test_must(ctx, imp_scene_add_pose(*scene, "block"));
    imp_problem *p = test_problem(ctx, *scene, "block.pose");
    run.spp = 64;
    run.seed = 31;
    pose_set(*scene, truth);
    test_must(ctx, imp_render(*scene, &run, &film));
    imp_film_get_info(film, &info);
    test_target(ctx, p, 0, info.width, info.height, imp_film_mean(film));
    imp_film_destroy(film);
    pose_set(*scene, start);
    if (hold) test_must(ctx, imp_problem_hold(p, hold));
    return p;
}

static void end(imp_problem *p, imp_scene *scene)
{
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void gradient_test(void)
{
    struct imp_run run = IMP_RUN_INIT;
    double g[2][6], se[2][6];
    int other = 0, held = 0;
    run.spp = 8;
    for (int k = 0; k < 2; k++) {
        imp_scene *scene;
        imp_problem *p = problem_of(&scene, k ? "block.pose[2-4]" : NULL);
        test_must(ctx, imp_problem_objective(p, NULL, &run, NULL, g[k], se[k]));
        for (size_t i = 0; k && i < 6; i++) {
            struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
            test_must(ctx, imp_problem_get_variable(p, i, &v));
            held += v.held && v.lo == start[i] && v.hi == start[i];
        }
        end(p, scene);
    }
    for (int i = 0; i < 6; i++) {
        const bool is_held = i >= 2 && i <= 4;
        other += is_held ? g[1][i] != 0 || se[1][i] != 0 || g[0][i] == 0
                         : g[1][i] != g[0][i] || se[1][i] != se[0][i];
    }
    tap_ok(other == 0 && held == 3, "a loss's gradient without three numbers");
}

static void fit_test(const char *hold, enum imp_optimizer optimizer, double se[6])
{
    imp_scene *scene;
    imp_problem *p = problem_of(&scene, hold);
    struct imp_fit_options options = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *result;
    double worst = 0, way = 0;
    int moved = 0;
    if (hold) test_must(ctx, imp_problem_add_tikhonov(p, "block.pose", 1e-4, false));
    options.optimizer = optimizer;
    options.intervals = optimizer == IMP_LM;
    options.no_recording = true;
    options.max_iterations = optimizer == IMP_ADAM ? 40 : 0;
    run.spp = 16;
    run.seed = 7;
    test_must(ctx, imp_fit(p, &options, &run, &result));
    for (size_t i = 0; i < 6; i++) {
        const struct imp_fit_variable *v = &result->variables[i];
        const bool held = hold && i >= 2 && i <= 4;
        se[i] = v->se;
        printf("# %g +- %g [%g, %g]\n", v->value, v->se, v->lo95, v->hi95);
        if (held) {
            moved += v->value != start[i] || v->at_bound != 0 || !v->determined;
            if (options.intervals)
                moved += v->se != 0 || v->lo95 != start[i] || v->hi95 != start[i];
        } else if (hold) {
            worst = fmax(worst, fabs(v->value - truth[i]) / v->se);
            way = fmax(way, fabs(v->value - truth[i]) / fabs(start[i]));
        }
    }
    if (hold && options.intervals)
        tap_ok(moved == 0 && worst < 4,
               "lm: three numbers stay # worst |z| of the others %.2f", worst);
    else if (hold)
        tap_ok(moved == 0 && way < (optimizer == IMP_ADAM ? 0.3 : 1),
               "%s: three numbers stay # the others are within %.2f of their way",
               optimizer == IMP_ADAM ? "Adam" : "lbfgs", way);
    end(p, scene);
}

static void whole_test(void)
{
    imp_scene *scene;
    imp_problem *p = problem_of(&scene, "block.pose");
    size_t held = 0;
    for (size_t i = 0; i < 6; i++) {
        struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
        test_must(ctx, imp_problem_get_variable(p, i, &v));
        held += v.held;
    }
    tap_ok(held == 6, "a name without indices holds all of its numbers");
    end(p, scene);
}

static void refused_test(void)
{
    static const char *const bad[] = {
        "block.pose[6]", "block.pose[3-2]", "block.pose[]",   "none[0]",
        "none",          "block.pose[1],x", "block.pose[-1]", ""};
    imp_scene *scene;
    imp_problem *p = problem_of(&scene, "*.pose[4],block.pose[2-3]");
    size_t wrong = 0;
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        wrong += imp_problem_hold(p, bad[k]) != IMP_E_ARG;
        printf("# %s\n", imp_last_error(ctx));
    }
    wrong += imp_problem_tie(p, "block.pose", IMP_TIE_FACTOR) != IMP_E_ARG;
    for (size_t i = 0; i < 6; i++) {
        struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
        test_must(ctx, imp_problem_get_variable(p, i, &v));
        wrong += v.held != (i >= 2 && i <= 4);
    }
    double x[6];
    test_must(ctx, imp_problem_get_x(p, x));
    wrong += imp_problem_set_x(p, x) != IMP_OK;
    x[2] = .1;
    wrong += imp_problem_set_x(p, x) != IMP_E_ARG;
    tap_ok(wrong == 0, "names that hold nothing, and ties, are refused # %zu wrong",
           wrong);
    end(p, scene);
}

/* Rows of a check, and what is held behind it. */
static void check_test(void)
{
    imp_scene *scene;
    imp_problem *p = problem_of(&scene, "block.pose[2-4]");
    struct imp_check_options options = IMP_CHECK_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_check_row *rows;
    struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
    size_t n = 0;
    options.only = "frozen";
    options.paths = 200;
    test_must(ctx, imp_check(p, &options, &run, &rows, &n));
    test_must(ctx, imp_problem_get_variable(p, 3, &v));
    tap_ok(n == 1 && rows[0].ok == IMP_VERDICT_RIGHT && v.held,
           "a check of all six numbers");
    end(p, scene);
}

int main(void)
{
    double all[6], held[6], other[6];
    int shorter = 0;
    ctx = test_context(2);
    gradient_test();
    fit_test(NULL, IMP_LM, all);
    fit_test("block.pose[2-4]", IMP_LM, held);
    for (int i = 0; i < 6; i++) shorter += held[i] < 1.15 * all[i];
    tap_ok(shorter == 6,
           "errors are not larger than those of six, within their own noise # %d",
           shorter);
    fit_test("block.pose[2-4]", IMP_ADAM, other);
    fit_test("block.pose[2-4]", IMP_LBFGS, other);
    whole_test();
    refused_test();
    check_test();
    imp_context_destroy(ctx);
    return tap_done();
}
