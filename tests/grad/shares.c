/* SPDX-License-Identifier: Apache-2.0
 *
 * Shares of a pixel: those of the lights add up to 1, each is value times the reverse
 * derivative over the value from the same walks, and their standard errors are what other
 * seeds show. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/report.h>
#include <stdlib.h>
#include <string.h>

enum { X = 3, Y = 5, SPP = 256, SEEDS = 200 };

static size_t find(imp_scene *s, const char *name)
{
    size_t k = 0;
    return imp_scene_find_param(s, name, &k) == IMP_OK ? k : 0;
}

/* Through a box filter the pixel's walks are those of the reverse derivative. */
static void against_reverse(imp_context *ctx)
{
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate radiance, again;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    const size_t n = imp_scene_n_params(s), n_x = imp_problem_n_variables(p);
    double *share = calloc(n, sizeof *share), *se = calloc(n, sizeof *se),
           *walks = calloc(4 * n, sizeof *walks), *all = calloc(SPP * n, sizeof *all);
    double *x = calloc(n_x, sizeof *x), *g = calloc(n_x, sizeof *g);
    float *seed = calloc(8 * 8 * 3, sizeof *seed);
    run.spp = SPP, run.seed = 7;
    test_must(ctx, imp_problem_shares(p, &run, X, Y, share, se, &radiance, walks, 4));
    for (int c = 0; c < 3; c++) seed[3 * (Y * 8 + X) + c] = 1.f / 3;
    test_must(ctx, imp_problem_reverse(p, seed, &run, g, NULL));
    imp_problem_get_x(p, x);
    double worst = 0, lights = 0, *sum = calloc(n, sizeof *sum);
    for (size_t i = 0; i < n_x; i++) {
        const size_t param = test_param_of(ctx, p, i);
        sum[param] += x[i] * g[i] / radiance.value;
    }
    for (size_t k = 0; k < n; k++) {
        struct imp_param_info info = {.size = sizeof info};
        test_must(ctx, imp_scene_get_param(s, k, &info));
        if (!isfinite(share[k])) continue;
        worst = fmax(worst, fabs(sum[k] - share[k]));
        if (!strcmp(info.unit, "W m^-2 sr^-1")) lights += share[k];
    }
    tap_near(worst, 0, 1e-6, 1e-6, "shares are value x derivative / radiance");
    tap_near(lights, 1, 1e-12, 0, "those of the lights add up to 1");
    /* And walk by walk. */
    test_must(ctx, imp_problem_shares(p, &run, X, Y, share, se, &again, all, SPP));
    const size_t white = find(s, "white.reflectance.value");
    double mean = 0;
    for (size_t i = 0; i < SPP; i++) mean += all[i * n + white] / SPP;
    tap_near(mean / radiance.value, share[white], 1e-12, 0, "walks add up to the pixel");
    tap_ok(!memcmp(all, walks, 4 * n * sizeof *all), "the first walks are the first");
    tap_ok(imp_problem_shares(p, &run, 8, 0, share, se, &again, NULL, 0) == IMP_E_ARG &&
               imp_problem_shares(p, &run, X, Y, share, se, &again, all, SPP + 1) ==
                   IMP_E_ARG &&
               imp_problem_shares(p, &run, X, Y, share, se, &again, NULL, 1) == IMP_E_ARG,
           "what is not there is refused");
    free(share), free(se), free(walks), free(all), free(x), free(g), free(seed),
        free(sum);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Spread over seeds beside what is told: its root mean square, 5 % known from 200 seeds. */
static void errors(imp_context *ctx, enum imp_points points, const char *name)
{
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate r;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    const size_t n = imp_scene_n_params(s), white = find(s, "white.reflectance.value");
    double *share = calloc(n, sizeof *share), *se = calloc(n, sizeof *se);
    double sum[2] = {0}, square[2] = {0}, told[2] = {0};
    run.spp = SPP, run.points = points;
    for (int k = 0; k < SEEDS; k++) {
        run.seed = 100 + (uint64_t)k;
        test_must(ctx, imp_problem_shares(p, &run, X, Y, share, se, &r, NULL, 0));
        const double v[2] = {share[white], r.value}, e[2] = {se[white], r.se};
        for (int i = 0; i < 2; i++) {
            sum[i] += v[i] / SEEDS;
            square[i] += v[i] * v[i] / SEEDS;
            told[i] += e[i] * e[i] / SEEDS;
        }
    }
    for (int i = 0; i < 2; i++) {
        const double seen = sqrt((square[i] - sum[i] * sum[i]) * SEEDS / (SEEDS - 1));
        const double ratio = sqrt(told[i]) / seen;
        tap_ok(ratio > 0.8 && ratio < 1.3, "%s: error of %s, told over seen # %.3f", name,
               i ? "the radiance" : "a share", ratio);
    }
    free(share), free(se);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Sets of unequal size: a pixel of one radiance has no error. And what is refused. */
static void edges(imp_context *ctx)
{
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    const size_t n = imp_scene_n_params(s);
    double *share = calloc(n, sizeof *share), *se = calloc(n, sizeof *se);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate r;
    imp_problem *p;
    double even;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "*"));
    run.points = IMP_POINTS_SOBOL;
    run.spp = 96;
    test_must(ctx, imp_problem_shares(p, &run, X, Y, share, se, &r, NULL, 0));
    even = r.se / r.value;
    run.spp = 100; /* six sets, four of which have one walk more */
    test_must(ctx, imp_problem_shares(p, &run, X, Y, share, se, &r, NULL, 0));
    tap_ok(r.se / r.value < 1.5 * even, "sets of 16 and 17 walks # %.3f beside %.3f",
           r.se / r.value, even);
    run.time_limit_s = 1;
    tap_ok(imp_problem_shares(p, &run, X, Y, share, se, &r, NULL, 0) == IMP_E_UNSUPPORTED,
           "a time limit # %s", imp_last_error(ctx));
    free(share), free(se);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(1);
    against_reverse(ctx);
    errors(ctx, IMP_POINTS_INDEPENDENT, "independent samples");
    errors(ctx, IMP_POINTS_SOBOL, "points in sets");
    edges(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
