/* SPDX-License-Identifier: Apache-2.0
 *
 * Stam's box against published means: the picture's mean and its seven derivatives (two
 * independent implementations, 7e9 paths: docs/estimators.md 2.2), and the whole-picture
 * loss with its gradient at few samples per pixel, where estimators without leave-one-out
 * are wrong by factors (2.3 T5, 5). Deterministic walks with fixed seeds; z-tests. */
#include "imp_scene.h"
#include "imp_tap.h"

static const char *const names[] = {"light.emission.value",  "sphere.ambient.value",
                                    "sphere.diffuse.value",  "sphere.specular.value",
                                    "sphere.exponent.value", "walls.ambient.value",
                                    "walls.diffuse.value"};

struct row {
    double value, se;
};

static void agrees(double value, double se, struct row ref, double se_limit,
                   const char *what)
{
    const double z = (value - ref.value) / sqrt(se * se + ref.se * ref.se);
    tap_ok(fabs(z) <= 4 && se <= se_limit * fabs(ref.value),
           "%s # value %.6g se %.2g ref %.6g z %.2f", what, value, se, ref.value, z);
}

/* Mean of the picture and of its derivatives: an adjoint image of 1/pixels. */
static void means(imp_context *ctx, const char *variant, const char *sampling, int spp,
                  const struct row *ref, double se_limit)
{
    char defines[128], what[160];
    snprintf(defines, sizeof defines, "variant=%s sampling=%s", variant, sampling);
    imp_scene *scene = test_scene(ctx, "stam.xml", IMP_MONO, defines);
    imp_problem *p = test_problem(ctx, scene, "*");
    struct imp_run run = IMP_RUN_INIT;
    float seed[32 * 32];
    double g[7], se[7];
    imp_film *film;
    run.spp = spp;
    run.seed = 20;

    test_must(ctx, imp_render(scene, &run, &film));
    double sum = 0, variance = 0;
    for (int k = 0; k < 32 * 32; k++) {
        seed[k] = 1.f / (32 * 32);
        sum += imp_film_mean(film)[k];
        variance += pow(imp_film_se(film)[k], 2);
    }
    snprintf(what, sizeof what, "%s, %s: mean of the picture", variant, sampling);
    agrees(sum / 1024, sqrt(variance) / 1024, ref[0], se_limit, what);
    imp_film_destroy(film);

    test_must(ctx, imp_problem_reverse(p, seed, &run, g, se));
    for (int k = 0; k < 7; k++) {
        const size_t i = test_variable(p, scene, ctx, names[k]);
        snprintf(what, sizeof what, "%s, %s: d mean / d %s", variant, sampling, names[k]);
        agrees(g[i], se[i], ref[k + 1], k == 4 ? 20 * se_limit : se_limit, what);
    }
    /* Euler: the emission terms times their values are the picture, per walk. */
    const double theta[] = {5, .02, 0, 0, 0, .03, 0};
    double euler = 0;
    for (int k = 0; k < 7; k++)
        euler += theta[k] * g[test_variable(p, scene, ctx, names[k])];
    snprintf(what, sizeof what, "%s, %s: emission identity", variant, sampling);
    tap_near(euler, sum / 1024, 1e-6, 0, what); /* the film is in floats */
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* J = 1/2 sum (I - 0.12)^2 over 16 x 16 pixels, M2 microfacet. */
static void loss(imp_context *ctx, int spp, int repeats)
{
    static const struct row ref[] = {{3.818, .003}, {1.641, .001}, {9.022, .005},
                                     {4.324, .004}, {21.40, .02},  {.0950, .0001},
                                     {5.036, .005}, {1.716, .002}};
    imp_scene *scene = test_scene(ctx, "stam.xml", IMP_MONO, "res=16 variant=microfacet");
    imp_problem *p = test_problem(ctx, scene, "*");
    struct imp_target target = IMP_TARGET_INIT;
    float pixels[16 * 16];
    for (int k = 0; k < 256; k++) pixels[k] = .12f;
    target.width = target.height = 16;
    target.channels = 1;
    target.pixels = pixels;
    test_must(ctx, imp_problem_add_target(p, &target));

    struct tap_stat stat[8] = {{0}};
    double reported[8] = {0};
    for (int r = 0; r < repeats; r++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate J;
        double g[7], se[7];
        run.spp = spp;
        run.seed = 100 + (uint64_t)r;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &J, g, se));
        tap_add(&stat[0], J.value);
        reported[0] += J.se * J.se;
        for (int k = 0; k < 7; k++) {
            const size_t i = test_variable(p, scene, ctx, names[k]);
            tap_add(&stat[k + 1], g[i]);
            reported[k + 1] += se[i] * se[i];
        }
    }
    for (int k = 0; k < 8; k++) {
        char what[160];
        snprintf(what, sizeof what, "loss at %d spp: %s", spp, k ? names[k - 1] : "J");
        agrees(stat[k].mean, tap_se(&stat[k]), ref[k], 10 / sqrt(spp * (double)repeats),
               what);
        /* The reported variance against the spread of the repeats, whose logarithm has a
         * standard error of sqrt(2/(repeats - 1)) for normal numbers, which sums over a
         * thousand pixels nearly are: 4 of them. Paired pixels give a bound, here a tight
         * one: neighbours differ little beside the noise. */
        const double ratio = reported[k] / repeats / (stat[k].m2 / (stat[k].n - 1));
        tap_ok(fabs(log(ratio)) < 4 * sqrt(2 / (stat[k].n - 1)),
               "loss at %d spp: reported variance of %s # reported/observed %.3f", spp,
               k ? names[k - 1] : "J", ratio);
    }
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const int lengthy = argc > 1 && strcmp(argv[1], "long") == 0;
    static const struct row m2[] = {{.149190, .000007},  {.019663, .000002},
                                    {.869446, .000017},  {.129130, .000009},
                                    {.212496, .000016},  {.0003882, .0000003},
                                    {1.116213, .000018}, {.253808, .000015}};
    static const struct row m2p[] = {
        {.101409, .000013}, {.011562, .000003},  {.859354, .000054}, {.123374, .000025},
        {.049937, .000012}, {-.000189, .000001}, {.880400, .000051}, {.189464, .000043}};
    imp_context *ctx = test_context(0);
    if (lengthy) { /* "agrees" in full: SE within 0.2 % of what is compared */
        means(ctx, "microfacet", "mixture", 40000, m2, .002);
        means(ctx, "paper", "mixture", 80000, m2p, .002);
        loss(ctx, 8, 1600);
        imp_context_destroy(ctx);
        return tap_done();
    }
    means(ctx, "microfacet", "mixture", 1024, m2, .012);
    means(ctx, "microfacet", "cosine", 512, m2, .12);
    means(ctx, "paper", "mixture", 512, m2p, .02);
    means(ctx, "microfacet", "mixture integrator=path", 512, m2,
          .022); /* lights sampled */
    loss(ctx, 2, 1000);
    loss(ctx, 64, 60);
    imp_context_destroy(ctx);
    return tap_done();
}
