/* SPDX-License-Identifier: Apache-2.0
 *
 * Gradients by poses through the public calls: imp_problem_reverse against central differences of
 * functionals of pictures with poses set and the same random numbers, away from the scene file's
 * poses; with a filter of one pixel and a wider one, and a material's parameter beside them; errors
 * over seeds; what has no such gradient is refused. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "importon/walks.h"
#include "moves_functional.h"
#include "moves_kit.h"

enum { N = 18 };
static const double at[N] = {.1, -.1, .05, .2, -.1, .3,  -.1, .2,  .1,
                             .1, .05, 0,   .1, .2,  -.1, .02, .03, -.02};

static imp_scene *room(const char *rest, const char *filter)
{
    return room_posed(ctx, &(struct room_parts){.rest = rest, .filter = filter});
}

/* Numbers of which differences are taken, and steps. */
static const struct {
    int k;
    double step;
} checked[] = {{0, .03},  {1, .03},  {3, .03},  {5, .03},  {6, .05}, {8, .05},
               {10, .05}, {12, .03}, {13, .03}, {15, .01}, {17, .01}};

static void room_test(const char *name, const char *rest, const char *filter, int spp,
                      int spp_ref)
{
    enum { SEEDS = 36, GROUPS = 12 };
    imp_scene *scene = room(rest, filter);
    imp_problem *p;
    double sum[N + 3] = {0}, square[N + 3] = {0}, told[N + 3] = {0}, most[3] = {0};
    room_poses_set(ctx, scene, at);
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "grey.reflectance.value"));
    test_must(ctx, imp_problem_activate(p, "*.pose"));
    const size_t n = imp_problem_n_variables(p);
    for (int s = 0; s < SEEDS; s++) {
        struct imp_run run = IMP_RUN_INIT;
        double g[N + 3], se[N + 3];
        run.spp = spp;
        run.seed = 100 + (uint64_t)s;
        test_must(ctx, imp_problem_reverse(p, adjoint, &run, g, se));
        for (size_t k = 0; k < n; k++) {
            sum[k] += g[k] / SEEDS;
            square[k] += g[k] * g[k] / SEEDS;
            told[k] += se[k] * se[k] / SEEDS;
        }
    }
    imp_problem_destroy(p);
    tap_ok(n == N + 3, "%s: three poses, and a reflectance beside them", name);
    double ratio = 0;
    for (int k = 0; k < N; k++) {
        const double seen =
            (square[3 + k] - sum[3 + k] * sum[3 + k]) * SEEDS / (SEEDS - 1);
        ratio += log(sqrt(told[3 + k] / seen)) / N;
        most[k / 6] = fmax(most[k / 6], fabs(sum[3 + k]));
    }
    tap_ok(exp(ratio) > 0.85 && exp(ratio) < 1.2,
           "%s: errors told over errors seen, mean of %d numbers # %.3f", name, N,
           exp(ratio));
    for (size_t i = 0; i < sizeof checked / sizeof *checked; i++) {
        const int k = checked[i].k;
        struct tap_stat ref = {0, 0, 0};
        for (int g = 0; g < GROUPS; g++) {
            double value[2];
            for (int s = 0; s < 2; s++) {
                double there[N];
                memcpy(there, at, sizeof there);
                there[k] += (s ? 1 : -1) * checked[i].step;
                room_poses_set(ctx, scene, there);
                value[s] = functional(scene, 500 + g, spp_ref);
            }
            tap_add(&ref, (value[1] - value[0]) / (2 * checked[i].step));
        }
        const double se = sqrt(told[3 + k] / SEEDS);
        const double z = (sum[3 + k] - ref.mean) / hypot(se, tap_se(&ref));
        tap_ok(fabs(z) < 3.5 && se < 0.05 * most[k / 6],
               "%s, %s.pose[%d] # %.5f se %.5f ref %.5f se %.5f z %.2f", name,
               room_objects[k / 6], k % 6, sum[3 + k], se, ref.mean, tap_se(&ref), z);
    }
    imp_scene_destroy(scene);
}

/* Walks that have no such derivative, and objects that stand where it has none. */
static void refusals_test(void)
{
    imp_scene *scene = room("<integrator type='path'/>", "type='box'");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_walks_options options = IMP_WALKS_OPTIONS_INIT;
    struct imp_estimate value;
    const double pierced[6] = {0, 0, -0.5, 0, 0, 0}, far[6] = {1e300, 0, 0, 0, 0, 0},
                 unknown[6] = {NAN, 0, 0, 0, 0, 0}, rest[6] = {0};
    imp_walks *walks;
    imp_problem *p;
    size_t index;
    double g[6];
    run.spp = 4;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "block.pose"));
    test_target(ctx, p, 0, WIDTH, HEIGHT, adjoint);
    options.losses = true;
    test_must(ctx, imp_walks_keep(scene, &run, &options, &walks));
    run.walks = walks;
    enum imp_status st = imp_problem_objective(p, NULL, &run, &value, g, NULL);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "recorded walks") &&
               strstr(imp_last_error(ctx), "block.pose"),
           "recorded walks are refused # %s", imp_last_error(ctx));
    run.walks = NULL;
    imp_walks_destroy(walks);
    test_must(ctx, imp_scene_find_param(scene, "block.pose", &index));
    test_must(ctx, imp_scene_set_values(scene, index, 6, pierced));
    st = imp_problem_objective(p, NULL, &run, &value, g, NULL);
    tap_ok(st == IMP_OK, "a block in the floor # %s",
           st == IMP_OK ? "" : imp_last_error(ctx));
    st = imp_scene_set_values(scene, index, 6, far);
    tap_ok(st == IMP_E_NUMERIC && strstr(imp_last_error(ctx), "block.pose"),
           "beyond floats # %s", imp_last_error(ctx));
    test_must(ctx, imp_scene_set_values(scene, index, 6, rest));
    st = imp_scene_set_values(scene, index, 6, unknown);
    tap_ok(st == IMP_E_ARG, "not a number # %s", imp_last_error(ctx));
    test_must(ctx, imp_problem_objective(p, NULL, &run, &value, g, NULL));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void refused_test(void)
{
    imp_scene *scene = room("<integrator type='path'/>", "type='box'");
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    const size_t all = imp_problem_n_variables(p);
    test_must(ctx, imp_problem_activate(p, "block.pose"));
    tap_ok(imp_problem_n_variables(p) == all + 6, "'*' leaves poses alone");
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    refusals_test();
}

#define PATH   "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define DIRECT "<integrator type='direct'/>"

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    ctx = test_context(2);
    adjoint_make();
    if (is_long) room_test("direct", DIRECT, "type='box'", 64, 128);
    room_test("path, a Gaussian filter", PATH, "type='gaussian'", 64, 64);
    refused_test();
    imp_context_destroy(ctx);
    return tap_done();
}
