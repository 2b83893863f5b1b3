/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums of many numbers in fixed point: the same for any order and any number of threads,
 * within their unit of sums in doubles, and done again where the first unit was too small
 * for a term. */
#include "base/fixed_sum.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"

enum { SIDE = 64, TEXELS = 32, N = TEXELS * TEXELS * 3, TERMS = 20000, NUMBERS = 7 };

static void sums_of(const struct imp_fixed_sum *f, double *out)
{
    for (size_t k = 0; k < f->n; k++) out[k] = imp__fixed_value(f, k);
}

static double term(size_t i)
{
    const struct imp_key key = imp__key(3, i, 0);
    return (imp__u01(key, 0) - 0.5) * exp2(-30 * imp__u01(key, 1));
}

static void integers(void)
{
    double a[NUMBERS], b[NUMBERS];
    imp_fixed fine[2][NUMBERS];
    long double exact[NUMBERS] = {0};
    struct imp_fixed_sum fa = {.n = NUMBERS, .sum = (imp_fixed *)a, .fine = fine[0]};
    struct imp_fixed_sum fb = {.n = NUMBERS, .sum = (imp_fixed *)b, .fine = fine[1]};
    imp__fixed_begin(&fa, 0.5, 4, TERMS);
    imp__fixed_begin(&fb, 0.5, 4, TERMS);
    for (size_t i = 0; i < TERMS; i++) {
        exact[i % NUMBERS] += term(i);
        imp__fixed_add(&fa, i % NUMBERS, term(i));
        imp__fixed_add(&fb, (TERMS - 1 - i) % NUMBERS, term(TERMS - 1 - i));
    }
    sums_of(&fa, a);
    sums_of(&fb, b);
    double worst = 0;
    for (int k = 0; k < NUMBERS; k++) worst = fmax(worst, fabs(a[k] - (double)exact[k]));
    tap_ok(memcmp(a, b, sizeof a) == 0, "backwards: the same bits");
    tap_ok(worst < 1e-15, "exact but for the last double # %.2g", worst);

    imp__fixed_begin(&fa, 1, 4, 8);
    imp__fixed_add(&fa, 0, 3);
    imp__fixed_add(&fa, 0, 1e9);
    imp__fixed_add(&fa, 1, NAN);
    imp__fixed_add(&fa, 1, -INFINITY);
    tap_ok(fa.too_large == 3 && isnan(imp__fixed_largest(&fa)),
           "too large, infinite or no number: counted # %llu",
           (unsigned long long)fa.too_large);
    sums_of(&fa, a);
    tap_ok(a[0] == 3 && a[1] == 0, "and left out");
}

static imp_scene *wall(imp_context *ctx)
{
    static float pixels[N];
    imp_scene *s;
    for (int k = 0; k < N; k++) pixels[k] = 0.3f + 0.4f * (float)(k % 5) / 5;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 3, 30, SIDE, SIDE);
    test_picture_wall(s, TEXELS, TEXELS, pixels);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

/* Gradient and errors with weight `all` on the pixels and `one` on pixel (1, 1). */
static void gradient(int threads, float all, float one, double *g, double *se)
{
    static float target[SIDE * SIDE * 3], weights[SIDE * SIDE];
    imp_context *ctx = test_context(threads);
    imp_scene *s = wall(ctx);
    imp_problem *p;
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    for (int k = 0; k < SIDE * SIDE; k++) weights[k] = k == SIDE + 1 ? one : all;
    t.width = t.height = SIDE, t.channels = 3, t.pixels = target, t.weights = weights;
    run.spp = 4;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*data*"));
    test_must(ctx, imp_problem_add_target(p, &t));
    test_must(ctx, imp_problem_objective(p, NULL, &run, NULL, g, se));
    if (imp_problem_n_variables(p) != N) exit(99);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
}

/* A picture that a material reads as a colour and another as one number: the derivative
 * is the sum of those of two pictures with the same texels. */
static void read_twice(void)
{
    enum { TWICE = 2 * N };
    static float pixels[N];
    static double g[2][TWICE];
    double worst = 0, largest = 0;
    for (int k = 0; k < N; k++) pixels[k] = 0.3f + 0.4f * (float)(k % 5) / 5;
    for (int shared = 0; shared < 2; shared++) {
        imp_context *ctx = test_context(1);
        static float target[SIDE * SIDE * 3];
        struct imp_target t = IMP_TARGET_INIT;
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate e;
        imp_scene *s;
        test_must(ctx, imp_scene_create(ctx, NULL, &s));
        test_camera(s, 3, 30, SIDE, SIDE);
        for (int k = 0; k < 2 - shared; k++) {
            imp_scene_begin(s, "texture", "bitmap", k ? "other" : "one", NULL);
            imp_scene_image(s, TEXELS, TEXELS, 3, pixels);
            imp_scene_end(s);
        }
        imp_scene_begin(s, "emitter", "constant", NULL, NULL);
        imp_scene_end(s);
        imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
        imp_scene_begin(s, "bsdf", "blendbsdf", NULL, NULL);
        imp_scene_ref(s, shared ? "one" : "other", "weight");
        for (int k = 0; k < 2; k++) {
            imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
            if (k) imp_scene_ref(s, "one", "reflectance");
            imp_scene_end(s);
        }
        imp_scene_end(s);
        imp_scene_end(s);
        test_must(ctx, imp_scene_commit(s));
        imp_problem *p = test_problem(ctx, s, "*data*");
        if (imp_problem_n_variables(p) != (shared ? N : TWICE)) exit(99);
        t.width = t.height = SIDE, t.channels = 3, t.pixels = target;
        run.spp = 4;
        test_must(ctx, imp_problem_add_target(p, &t));
        test_must(ctx, imp_problem_objective(p, NULL, &run, &e, g[shared], NULL));
        imp_problem_destroy(p);
        imp_scene_destroy(s);
        imp_context_destroy(ctx);
    }
    for (int k = 0; k < N; k++) {
        worst = fmax(worst, fabs(g[1][k] - g[0][k] - g[0][k + N]));
        largest = fmax(largest, fabs(g[1][k]));
    }
    tap_ok(largest > 0 && worst < 1e-12 * largest,
           "a picture read as a colour and as a number # off by %.1e of the largest",
           worst / largest);
}

int main(void)
{
    static double g[3][N], se[3][N];
    integers();
    read_twice();

    gradient(1, 1, 1, g[0], se[0]);
    gradient(2, 1, 1, g[1], se[1]);
    gradient(5, 1, 1, g[2], se[2]);
    tap_ok(!memcmp(g[0], g[1], sizeof g[0]) && !memcmp(g[0], g[2], sizeof g[0]) &&
               !memcmp(se[0], se[1], sizeof se[0]) && !memcmp(se[0], se[2], sizeof se[0]),
           "gradient of %d texels: the same bits at 1, 2, 5 threads", N);
    /* The gradient is linear in the weights. A pixel that a look at some tiles does not
     * see has 2^30 times the weight of others. */
    const float large = 0x1p30f;
    double worst = 0, worst_se = 0, largest = 0;
    gradient(2, 0, 1, g[1], se[1]);
    gradient(2, 1, large, g[2], se[2]);
    for (int k = 0; k < N; k++) largest = fmax(largest, fabs(g[2][k]));
    for (int k = 0; k < N; k++) {
        const double want = g[0][k] + (large - 1.) * g[1][k];
        const double want_se = large * se[1][k];
        worst = fmax(worst, fabs(g[2][k] - want) / largest);
        if (want_se > 0) worst_se = fmax(worst_se, fabs(se[2][k] / want_se - 1));
    }
    tap_ok(largest > 0 && worst < 1e-9 && worst_se < 1e-6,
           "a term 2^30 times larger than expected # off by %.2g of the largest, %.2g",
           worst, worst_se);
    return tap_done();
}
