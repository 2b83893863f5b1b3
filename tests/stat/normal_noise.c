/* SPDX-License-Identifier: Apache-2.0
 *
 * Covariance of the gradient that Gauss-Newton takes from pairs of units, or from
 * pictures through a wide filter, against the spread over seeds, in every eigenvector of
 * J^T W J: where the pictures tell little, most of the noise is of second order, of two at
 * once. Run with the name of a filter, or with "metal" or "stam", for whole fits: how often
 * their intervals hold the truth. */
#include "imp_cornell.h"
#include "imp_tap.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/problem/problem.h"
#include "math/linalg.h"

enum { N = 9, SIDE = 12, SPP = 16, SEEDS = 300, FITS = 200 };

static const char *const active[] = {"white.reflectance.value", "red.reflectance.value",
                                     "green.reflectance.value"};

static imp_scene *box(imp_context *ctx, const char *filter)
{
    char element[40];
    snprintf(element, sizeof element, "<rfilter type='%s'/>", filter);
    return test_cornell_through(ctx, element, SIDE);
}

static double along(const double *v, const double *matrix)
{
    double sum = 0;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) sum += v[i] * matrix[i * N + j] * v[j];
    return sum;
}

static void filter(imp_context *ctx, const char *name, enum imp_points points)
{
    double H[N * N], C[N * N], S[N * N], g[SEEDS][N], told[N * N] = {0},
                                                               mean[N * N] = {0};
    double values[N], vectors[N * N];
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *scene = box(ctx, name);
    imp_problem *p;
    imp_film *film;
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < 3; k++) test_must(ctx, imp_problem_activate(p, active[k]));
    run.spp = 4096;
    run.seed = 7;
    test_must(ctx, imp_render(scene, &run, &film));
    target.pixels = imp_film_mean(film);
    target.width = target.height = SIDE;
    target.channels = 3;
    test_must(ctx, imp_problem_add_target(p, &target));
    run.spp = SPP;
    run.points = points;
    for (int seed = 0; seed < SEEDS; seed++) {
        struct imp__gauss_newton normal = {
            .H = H, .g = g[seed], .cov_g = C, .cov_excess = S};
        run.seed = 100 + (uint64_t)seed;
        test_must(ctx, imp__gauss_newton(p, NULL, &run, &normal));
        for (int i = 0; i < N * N; i++) {
            mean[i] += H[i] / SEEDS;
            told[i] += (C[i] - S[i]) / SEEDS;
        }
    }
    if (!imp__eigen_symmetric(N, mean, values, vectors)) exit(99);
    double least = INFINITY, most = 0;
    for (int e = 0; e < N; e++) {
        struct tap_stat seen = {0};
        for (int seed = 0; seed < SEEDS; seed++) {
            double at = 0;
            for (int k = 0; k < N; k++) at += vectors[e * N + k] * g[seed][k];
            tap_add(&seen, at);
        }
        const double ratio =
            sqrt(along(vectors + (size_t)e * N, told) / (seen.m2 / (seen.n - 1)));
        least = fmin(least, ratio);
        most = fmax(most, ratio);
    }
    tap_ok(least > 0.85 && most < 1.18, "%s, %s # told/seen %.2f to %.2f", name,
           points == IMP_POINTS_SOBOL ? "sobol" : "independent", least, most);
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* Noisy pictures, each fitted with walks of its own; reflectances are at least `least`: a
 * fit that ends at a bound is nearer to the truth than its errors say. */
struct experiment {
    const char *name;
    imp_scene *scene;
    const char *const *active;
    int n_active;
    double least, start; /* of the truth */
    int width, height, target_spp, spp;
    enum imp_points points;
    bool mono;
};

static void one_fit(imp_context *ctx, const struct experiment *e, int seed, int *held,
                    struct tap_stat *z2)
{
    const struct imp_fit_result *r;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    struct imp_run run = IMP_RUN_INIT;
    double truth[2 * N], begin[2 * N], start[2 * N];
    imp_problem *p;
    imp_film *film;
    test_must(ctx, imp_problem_create(e->scene, &p));
    for (int k = 0; k < e->n_active; k++)
        test_must(ctx, imp_problem_activate(p, e->active[k]));
    const size_t n = imp_problem_n_variables(p);
    imp_problem_get_x(p, begin);
    for (size_t k = 0; k < n; k++) truth[k] = fmax(begin[k], e->least);
    test_must(ctx, imp_problem_set_x(p, truth));
    run.spp = e->target_spp;
    run.seed = 500 + (uint64_t)seed;
    run.points = IMP_POINTS_INDEPENDENT;
    test_must(ctx, imp_render(e->scene, &run, &film));
    target.pixels = imp_film_mean(film);
    target.noise_se = imp_film_se(film);
    target.width = e->width;
    target.height = e->height;
    target.channels = e->mono ? 1 : 3;
    test_must(ctx, imp_problem_add_target(p, &target));
    for (size_t k = 0; k < n; k++) start[k] = e->start * truth[k];
    test_must(ctx, imp_problem_set_x(p, start));
    o.optimizer = IMP_LM;
    o.intervals = 1;
    run.spp = e->spp;
    run.seed = 9000 + (uint64_t)seed;
    run.points = e->points;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    for (size_t k = 0; k < n; k++) {
        const double z = (r->variables[k].value - truth[k]) / r->variables[k].se;
        tap_add(z2, z * z);
        *held += fabs(z) < 1.959964;
    }
    test_must(ctx, imp_problem_set_x(p, begin));
    imp_problem_destroy(p);
    imp_film_destroy(film);
}

static void fits(imp_context *ctx, const struct experiment *e)
{
    struct tap_stat z2 = {0};
    int held = 0;
    for (int seed = 0; seed < FITS; seed++) one_fit(ctx, e, seed, &held, &z2);
    const double share = held / z2.n;
    tap_ok(share >= 0.93 && share <= 0.97 && z2.mean > 0.75 && z2.mean < 1.2,
           "fits, %s, %s, %d spp # %.1f %% of intervals hold the truth, mean z^2 %.2f",
           e->name, e->points == IMP_POINTS_SOBOL ? "sobol" : "independent", e->spp,
           100 * share, z2.mean);
}

static void cornell(imp_context *ctx, const char *filter)
{
    struct experiment e = {
        filter, box(ctx, filter),       active, 3, .4, .8, SIDE, SIDE, 64,
        SPP,    IMP_POINTS_INDEPENDENT, false};
    fits(ctx, &e);
    e.points = IMP_POINTS_SOBOL;
    fits(ctx, &e);
    e.points = IMP_POINTS_INDEPENDENT;
    e.spp = 4 * SPP;
    fits(ctx, &e);
    imp_scene_destroy(e.scene);
}

/* Where the model is far from linear in the roughness. */
static void metal(imp_context *ctx)
{
    static const char *const numbers[] = {"metal.alpha.value", "lamp.radiance.value",
                                          "wall.reflectance.color0.value",
                                          "wall.reflectance.color1.value"};
    static const char *const size[] = {"width=40", "height=30"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct experiment e = {
        "rough metal",          NULL, numbers, 4, 0, .8, 40, 30, 256, SPP,
        IMP_POINTS_INDEPENDENT, false};
    o.defines = size;
    o.n_defines = 2;
    test_must(ctx, imp_scene_load(ctx, IMP_SCENES "/textured.xml", &o, &e.scene));
    fits(ctx, &e);
    e.spp = 4 * SPP;
    fits(ctx, &e);
    imp_scene_destroy(e.scene);
}

/* Numbers that trade: of the lamp, and of what it lights. */
static void stam(imp_context *ctx)
{
    static const char *const numbers[] = {"*"};
    static const char *const told[] = {"res=24", "integrator=path"};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct experiment e = {
        "Stam's box",           NULL, numbers, 1, 0, .8, 24, 24, 512, 64,
        IMP_POINTS_INDEPENDENT, true};
    o.defines = told;
    o.n_defines = 2;
    o.mode = IMP_MONO;
    test_must(ctx, imp_scene_load(ctx, IMP_SCENES "/stam.xml", &o, &e.scene));
    fits(ctx, &e);
    imp_scene_destroy(e.scene);
}

int main(int argc, char **argv)
{
    static const char *const filters[] = {"box", "tent", "gaussian", "mitchell"};
    imp_context *ctx = test_context(2);
    if (argc == 1) {
        filter(ctx, "gaussian", IMP_POINTS_INDEPENDENT);
        filter(ctx, "tent", IMP_POINTS_SOBOL);
        filter(ctx, "box", IMP_POINTS_INDEPENDENT);
        filter(ctx, "box", IMP_POINTS_SOBOL);
    } else if (strcmp(argv[1], "metal") == 0) metal(ctx);
    else if (strcmp(argv[1], "stam") == 0) stam(ctx);
    else
        for (size_t f = 0; f < imp_count(filters); f++)
            if (strcmp(argv[1], filters[f]) == 0) cornell(ctx, filters[f]);
    imp_context_destroy(ctx);
    return tap_done();
}
