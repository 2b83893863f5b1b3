/* SPDX-License-Identifier: Apache-2.0
 *
 * What control variates bring: the variance of the gradient of a texture along the path of a
 * search by Adam, without them over with them. Chains follow one path, and differ in their
 * walks alone.
 *
 *     variate_gain long     # 80 x 60 pixels, 20 iterations */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/replicates.h"
#include "inverse/gradient/objective_gradient.h"
#include "inverse/gradient/variate.h"
#include "math/rng.h"

enum { SPP = 8, CHAINS_MOST = 12, STEPS_MOST = 21 };

static imp_context *ctx;
static imp_problem *problem;
static size_t n;

static double *room(size_t count)
{
    double *p = calloc(count, sizeof *p);
    if (!p) exit(99);
    return p;
}

static void gradient(const double *x, int chain, int step, struct imp__variate *v,
                     double *g)
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = SPP;
    run.seed = imp__mix64(((uint64_t)chain << 32) + (uint64_t)step);
    problem->variate = v;
    test_must(ctx, imp__problem_objective(problem, x, &run, true, NULL, g, NULL));
    problem->variate = NULL;
}

static struct imp__variate *variate(void)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp__variate *v;
    run.spp = SPP;
    test_must(ctx, imp__variate_create(problem, &run, &v));
    return v;
}

/* path [steps][n]: Adam, from grey. */
static void path_make(int steps, double *path)
{
    double *state = room(IMP_OPTIMIZER_STATE(n)), *g = room(n), *x = room(n);
    double *lo = room(n), *hi = room(n);
    struct imp__variate *v = variate();
    for (size_t k = 0; k < n; k++) x[k] = 0.5, hi[k] = 1;
    for (int t = 0; t < steps; t++) {
        memcpy(path + (size_t)t * n, x, n * sizeof *x);
        gradient(x, 0, t, v, g);
        test_must(ctx, imp_optimizer_step(NULL, n, g, lo, hi, state, x));
    }
    imp__variate_destroy(v);
    free(state);
    free(g);
    free(x);
    free(lo);
    free(hi);
}

int main(int argc, char **argv)
{
    const bool more = argc > 1 && strcmp(argv[1], "long") == 0;
    const int steps = more ? STEPS_MOST : 11, chains = more ? CHAINS_MOST : 5;
    ctx = test_context(0);
    imp_scene *scene = test_scene(ctx, "textured.xml", IMP_RGB,
                                  more ? "width=80 height=60" : "width=40 height=30");
    imp_film *film;
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 512;
    run.seed = 1;
    test_must(ctx, imp_render(scene, &run, &film));
    target.width = more ? 80 : 40;
    target.height = more ? 60 : 30;
    target.channels = 3;
    target.pixels = imp_film_mean(film);
    test_must(ctx, imp_problem_create(scene, &problem));
    test_must(ctx, imp_problem_activate(problem, "floor.*"));
    test_must(ctx, imp_problem_add_target(problem, &target));
    n = imp_problem_n_variables(problem);

    double *path = room((size_t)steps * n), *g = room(n);
    double *sum[2][2]; /* without, with; of g and of its squares: [steps][n] */
    path_make(steps, path);
    for (int k = 0; k < 4; k++) sum[k / 2][k % 2] = room((size_t)steps * n);
    for (int chain = 1; chain <= chains; chain++) {
        struct imp__variate *v = variate();
        for (int t = 0; t < steps; t++)
            for (int with = 0; with < 2; with++) {
                const size_t at = (size_t)t * n;
                gradient(path + at, chain, t, with ? v : NULL, g);
                for (size_t k = 0; k < n; k++) {
                    sum[with][0][at + k] += g[k];
                    sum[with][1][at + k] += g[k] * g[k];
                }
            }
        imp__variate_destroy(v);
    }
    for (int t = 0; t < steps; t++) {
        double variance[2] = {0, 0}, off = 0;
        for (size_t k = (size_t)t * n; k < (size_t)(t + 1) * n; k++) {
            for (int with = 0; with < 2; with++)
                variance[with] +=
                    (sum[with][1][k] - sum[with][0][k] * sum[with][0][k] / chains) /
                    (chains - 1);
            off += imp__sqr((sum[1][0][k] - sum[0][0][k]) / chains);
        }
        const double gain = variance[0] / variance[1];
        /* The squared distance of the means, over what chance makes it. */
        const double chance = (variance[0] + variance[1]) / chains;
        const double least = t == 20 ? 12 : t == 10 ? 5 : t == 5 ? 3 : t == 0 ? 0.8 : 1.3;
        tap_ok(gain >= least && off < 1.1 * chance,
               "iteration %d: variance without/with >= %g # %.3g; means apart by %.3f of "
               "chance",
               t, least, gain, off / chance);
    }
    for (int k = 0; k < 4; k++) free(sum[k / 2][k % 2]);
    free(path);
    free(g);
    imp_problem_destroy(problem);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}
