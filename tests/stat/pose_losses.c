/* SPDX-License-Identifier: Apache-2.0
 *
 * Losses by poses: the gradient of imp_problem_objective against central differences of the loss
 * with the same random numbers, and errors told over errors seen, of every loss, of independent
 * samples and of points, at the optimum and away from it, through filters of one pixel and wider. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "moves_kit.h"

enum { WIDTH = 24, HEIGHT = 16, N = 18, ALL = N + 3 };
static imp_context *ctx;
static const double truth[N] = {0};
static const double away[N] = {.1, -.1, .05, .2, -.1, .3,  -.1, .2,  .1,
                               .1, .05, 0,   .1, .2,  -.1, .02, .03, -.02};

static imp_scene *room(const char *filter)
{
    return room_posed(
        ctx, &(struct room_parts){.rest = "<integrator type='path'><integer "
                                          "name='max_depth' value='3'/></integrator>",
                                  .filter = filter});
}

/* A problem with a reflectance and, if asked for, all poses, and the picture at the scene file's
 * poses. */
static imp_problem *problem(imp_scene *scene, enum imp_loss loss, bool moves)
{
    imp_film *film;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target t = IMP_TARGET_INIT;
    imp_problem *p = test_problem(ctx, scene, "grey.reflectance.value");
    if (moves) test_must(ctx, imp_problem_activate(p, "*.pose"));
    room_poses_set(ctx, scene, truth);
    run.spp = 1024;
    run.seed = 77;
    test_must(ctx, imp_render(scene, &run, &film));
    t.width = WIDTH;
    t.height = HEIGHT;
    t.channels = 3;
    t.loss = loss;
    t.epsilon = 0.05;
    t.scale = 1. / (WIDTH * HEIGHT);
    t.pixels = imp_film_mean(film);
    test_must(ctx, imp_problem_add_target(p, &t));
    imp_film_destroy(film);
    return p;
}

static double loss_at(imp_problem *p, imp_scene *scene, const double numbers[N], int k,
                      double h, uint64_t seed, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate value;
    double there[N];
    memcpy(there, numbers, sizeof there);
    there[k] += h;
    room_poses_set(ctx, scene, there);
    run.spp = spp;
    run.seed = seed;
    test_must(ctx, imp_problem_objective(p, NULL, &run, &value, NULL, NULL));
    return value.value;
}

static const struct {
    int k;
    double step;
} checked[] = {{0, .02},  {1, .02},  {3, .02},  {5, .02},    {6, .04},   {8, .04},
               {10, .04}, {12, .02}, {13, .02}, {15, .0036}, {17, .0036}};

struct setting {
    const char *name, *filter;
    enum imp_loss loss;
    enum imp_points points;
    bool at_optimum;
    int spp, seeds, spp_ref,
        every; /* of the gradient; of differences, 0: none are taken */
};

static void loss_test(const struct setting *o)
{
    enum { GROUPS = 16 };
    imp_scene *scene = room(o->filter);
    imp_problem *p = problem(scene, o->loss, true);
    imp_problem *still = problem(scene, o->loss, false);
    const int SEEDS = o->seeds;
    const double *at = o->at_optimum ? truth : away;
    double sum[ALL] = {0}, square[ALL] = {0}, told[ALL] = {0}, most[3] = {0};
    room_poses_set(ctx, scene, at);
    for (int s = 0; s < SEEDS; s++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate value;
        double g[ALL], se[ALL];
        run.spp = o->spp;
        run.seed = 100 + (uint64_t)s;
        run.points = o->points;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &value, g, se));
        for (int k = 0; k < ALL; k++) {
            sum[k] += g[k] / SEEDS;
            square[k] += g[k] * g[k] / SEEDS;
            told[k] += se[k] * se[k] / SEEDS;
        }
    }
    double ratio = 0;
    for (int k = 0; k < ALL; k++) {
        const double seen = (square[k] - sum[k] * sum[k]) * SEEDS / (SEEDS - 1);
        ratio += log(sqrt(told[k] / seen)) / ALL;
        if (k >= 3) most[(k - 3) / 6] = fmax(most[(k - 3) / 6], fabs(sum[k]));
    }
    tap_ok(exp(ratio) > 0.85 && exp(ratio) < 1.2,
           "%s: errors told over errors seen, mean of %d numbers # %.3f", o->name, ALL,
           exp(ratio));
    for (size_t i = 0; i < sizeof checked / sizeof *checked && o->spp_ref > 0;
         i += (size_t)o->every) {
        const int k = checked[i].k;
        const double h = checked[i].step;
        struct tap_stat ref = {0, 0, 0};
        for (int g = 0; g < GROUPS; g++) {
            const double hi =
                loss_at(still, scene, at, k, h, 500 + (uint64_t)g, o->spp_ref);
            const double lo =
                loss_at(still, scene, at, k, -h, 500 + (uint64_t)g, o->spp_ref);
            tap_add(&ref, (hi - lo) / (2 * h));
        }
        const double se = sqrt(told[3 + k] / SEEDS);
        const double z = (sum[3 + k] - ref.mean) / hypot(se, tap_se(&ref));
        tap_ok(fabs(z) < 3.5 && se < 0.05 * most[k / 6],
               "%s, %s.pose[%d] # %.5f se %.5f ref %.5f se %.5f z %.2f", o->name,
               room_objects[k / 6], k % 6, sum[3 + k], se, ref.mean, tap_se(&ref), z);
    }
    imp_problem_destroy(still);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool all = argc > 1 && strcmp(argv[1], "long") == 0;
    static const struct setting settings[] = {
        {"l2, points", "type='box'", IMP_LOSS_L2, IMP_POINTS_SCENE, false, 32, 64, 128,
         1},
        {"l2, independent", "type='box'", IMP_LOSS_L2, IMP_POINTS_INDEPENDENT, false, 16,
         64, 0, 1},
        {"l2 at the optimum", "type='box'", IMP_LOSS_L2, IMP_POINTS_SCENE, true, 16, 64,
         0, 1},
        {"relative, a Gaussian filter", "type='gaussian'", IMP_LOSS_RELATIVE_L2,
         IMP_POINTS_SCENE, false, 16, 64, 64, 3},
        {"log", "type='box'", IMP_LOSS_LOG, IMP_POINTS_SCENE, false, 256, 16, 128, 3},
        {"l1", "type='box'", IMP_LOSS_L1, IMP_POINTS_SCENE, false, 32, 64, 0, 1}};
    ctx = test_context(2);
    for (size_t k = 0; k < sizeof settings / sizeof *settings; k++)
        if (all || k < 4) loss_test(&settings[k]); /* the others take as long as these */
    imp_context_destroy(ctx);
    return tap_done();
}
