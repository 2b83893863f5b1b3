/* SPDX-License-Identifier: Apache-2.0
 *
 * Least squares by products with J and its transpose (sparse_rows.h) beside the matrices of
 * few numbers, of the same walks: gradient, loss, H v, diagonals, Newton steps, and vectors
 * that are drawn with the gradient's covariance; for plain, tied and regularised numbers,
 * masks, luminance, a loss that is not quadratic, and samples in several parts. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/fit/fit.h"
#include "inverse/gauss/sparse_rows.h"
#include "search/conjugate.h"
#include "search/excess.h"
#include "search/lm_system.h"

enum { WIDTH = 24, HEIGHT = 16, TEXELS = 4, MOST = 3 * TEXELS * TEXELS + 3 };

struct trial {
    const char *name;
    int spp, channels;
    bool tied, smooth, mask, noise, sobol;
    bool singular; /* numbers trade: without damping rounding decides */
    enum imp_loss loss;
};

static uint64_t state = 1;
static double draw(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 0x1p53;
}

static imp_problem *problem_make(imp_context *ctx, const struct trial *t, imp_scene **s)
{
    static float target[WIDTH * HEIGHT * 3], pixels[MOST], mask[WIDTH * HEIGHT],
        se[WIDTH * HEIGHT * 3];
    struct imp_target desc = IMP_TARGET_INIT;
    imp_problem *p;
    state = 1;
    for (int k = 0; k < MOST; k++) pixels[k] = (float)(.2 + .6 * draw());
    for (int k = 0; k < WIDTH * HEIGHT * 3; k++) target[k] = (float)(.3 + .2 * draw());
    for (int k = 0; k < WIDTH * HEIGHT; k++) mask[k] = k % 7 ? (float)draw() : 0;
    for (int k = 0; k < WIDTH * HEIGHT * 3; k++) se[k] = (float)(.02 + .01 * draw());
    test_must(ctx, imp_scene_create(ctx, NULL, s));
    test_camera(*s, 3, 30, WIDTH, HEIGHT);
    test_picture_wall(*s, TEXELS, TEXELS, pixels);
    test_must(ctx, imp_scene_commit(*s));
    p = test_problem(ctx, *s, t->tied ? "*" : "*data*");
    if (t->tied) {
        test_must(ctx, imp_problem_tie(p, "*radiance*", IMP_TIE_LOG));
    }
    desc.width = WIDTH, desc.height = HEIGHT, desc.channels = t->channels;
    desc.pixels = target, desc.loss = t->loss;
    if (t->mask) desc.weights = mask;
    if (t->noise) desc.noise_se = se;
    test_must(ctx, imp_problem_add_target(p, &desc));
    if (t->smooth) {
        test_must(ctx, imp_problem_add_smoothness(p, "*data*", 3));
        test_must(ctx, imp_problem_add_tikhonov(p, "*data*", .5, 1));
    }
    return p;
}

static double norm(size_t n, const double *a)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++) sum += a[k] * a[k];
    return sqrt(sum);
}
static double distance(size_t n, const double *a, const double *b)
{
    double d[MOST];
    for (size_t k = 0; k < n; k++) d[k] = a[k] - b[k];
    return norm(n, d) / norm(n, b);
}

/* z^T M^-1 z of vectors with covariance C, whose mean is tr(M^-1 C), M = diag C. */
static void draws_check(const struct imp__sparse_normal *eq, enum imp__draw what,
                        const double *C, const char *name, const char *of)
{
    const size_t n = eq->n;
    static double z[MOST * IMP_SPARSE_WIDTH];
    struct tap_stat diagonal = {0}, mixed = {0};
    double one[MOST], expected = 0;
    for (size_t k = 0; k < n; k++) one[k] = draw() - .5;
    for (size_t k = 0; k < n; k++)
        for (size_t l = 0; l < n; l++) expected += one[k] * C[k * n + l] * one[l];
    for (uint64_t seed = 0; seed < 100; seed++) {
        if (eq->draw(eq, what, seed, z) != IMP_OK) break;
        for (size_t v = 0; v < IMP_SPARSE_WIDTH; v++) {
            double sum = 0, along = 0;
            for (size_t k = 0; k < n; k++) {
                const double value = z[k * IMP_SPARSE_WIDTH + v], c = C[k * n + k];
                sum += c > 0 ? value * value / c / (double)n : 0;
                along += one[k] * value;
            }
            tap_add(&diagonal, sum);
            tap_add(&mixed, along * along / expected);
        }
    }
    char text[160];
    snprintf(text, sizeof text, "%s: vectors drawn for %s, over its variances", name, of);
    tap_z(&diagonal, 1, .05, text);
    snprintf(text, sizeof text, "%s: and along a direction", name);
    tap_z(&mixed, 1, .1, text);
}

static void compare(imp_context *ctx, const struct trial *t)
{
    imp_scene *scene;
    imp_problem *p = problem_make(ctx, t, &scene);
    const size_t n = imp_problem_n_variables(p);
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp__fit f = {0};
    struct imp__normal dense;
    struct imp__sparse_normal eq;
    double x[MOST], v[MOST], y[MOST], ref[MOST], d[MOST];
    o.optimizer = IMP_LM;
    run.spp = t->spp;
    if (t->sobol) run.points = IMP_POINTS_SOBOL;
    test_must(ctx, imp__fit_begin(p, &o, &run, &f));
    imp_problem_get_x(p, x);
    for (size_t k = 0; k < n; k++) f.scale[k] = 1;
    test_must(ctx, imp__normal_create(ctx, n, false, &dense));
    test_must(ctx, f.goal.normal(x, 5, 1, &dense, &f));
    test_must(ctx, imp__fit_sparse(x, 5, 1, &eq, &f));

    tap_ok(eq.f.value == dense.f.value && eq.f.se == dense.f.se &&
               eq.n_residuals == dense.n_residuals,
           "%s: %zu numbers, the same loss # %.17g", t->name, n, eq.f.value);
    tap_ok(distance(n, eq.g, dense.g) < 1e-6, "%s: the same gradient # %.1e", t->name,
           distance(n, eq.g, dense.g));
    for (size_t k = 0; k < n; k++) ref[k] = dense.H_same[k * n + k];
    tap_ok(distance(n, eq.same, ref) < 1e-6, "%s: the same damping # %.1e", t->name,
           distance(n, eq.same, ref));
    for (size_t k = 0; k < n; k++) ref[k] = dense.H[k * n + k] - dense.H_prior[k * n + k];
    tap_ok(distance(n, eq.diagonal, ref) < 1e-6, "%s: the same diagonal # %.1e", t->name,
           distance(n, eq.diagonal, ref));
    static double wide[MOST * IMP_SPARSE_WIDTH], many[MOST * IMP_SPARSE_WIDTH];
    double worst = 0;
    for (size_t k = 0; k < n * IMP_SPARSE_WIDTH; k++) many[k] = draw() - .5;
    test_must(ctx, eq.product(&eq, IMP_SPARSE_WIDTH, many, wide));
    for (size_t c = 0; c < IMP_SPARSE_WIDTH; c++) {
        for (size_t k = 0; k < n; k++) v[k] = many[k * IMP_SPARSE_WIDTH + c];
        for (size_t k = 0; k < n; k++) {
            ref[k] = 0;
            for (size_t l = 0; l < n; l++) ref[k] += dense.H[k * n + l] * v[l];
        }
        test_must(ctx, eq.product(&eq, 1, v, y));
        worst = fmax(worst, distance(n, y, ref));
        for (size_t k = 0; k < n; k++) d[k] = wide[k * IMP_SPARSE_WIDTH + c];
        worst = fmax(worst, distance(n, d, ref));
    }
    tap_ok(worst < 1e-6, "%s: the same products # %.1e", t->name, worst);
    draws_check(&eq, IMP_DRAW_GRADIENT, dense.cov_g, t->name, "the gradient's noise");
    draws_check(&eq, IMP_DRAW_EXCESS, dense.cov_excess, t->name,
                "what that has too much");

    /* Steps, of systems that make their own equations. */
    struct imp__goal goal = f.goal;
    struct imp__lm_system *few, *many_of;
    goal.normal = NULL;
    goal.sparse = imp__fit_sparse;
    test_must(ctx, imp__lm_system_create(&f.goal, &imp__lm_dense, &few));
    test_must(ctx, imp__lm_system_create(&goal, &imp__lm_sparse, &many_of));
    test_must(ctx, few->kind->take(few, x, 5));
    test_must(ctx, many_of->kind->take(many_of, x, 5));
    for (int k = t->singular; k < 3; k++) {
        double mu = k == 0 ? IMP_LM_MU_MIN : k == 1 ? 1e-2 : 1, own = mu;
        bool found, found_own;
        bool fixed[MOST] = {false};
        test_must(ctx, few->kind->newton(few, &mu, ref, &found));
        test_must(ctx, many_of->kind->newton(many_of, &own, y, &found_own));
        struct imp__conjugate c = {
            .eq = &eq, .fixed = fixed, .tolerance = 1e-13, .most = 10000};
        test_must(ctx, imp__conjugate_solve(ctx, &c, mu, 1, eq.g, d));
        tap_ok(found && found_own && mu == own && c.converged &&
                   distance(n, d, ref) < 1e-5 && distance(n, y, ref) < 2e-2,
               "%s: the same step, mu %.0e # %.1e to the end, %.1e as a search does; %d "
               "iterations",
               t->name, mu, distance(n, d, ref), distance(n, y, ref), c.iterations);
    }
    tap_ok(few->n_free == many_of->n_free, "%s: %zu numbers are free", t->name,
           few->n_free);
    imp__lm_system_destroy(few);
    imp__lm_system_destroy(many_of);
    imp__sparse_normal_destroy(&eq);
    imp__normal_destroy(ctx, &dense);
    imp__fit_end(&f);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(void)
{
    static const struct trial trials[] = {
        {.name = "plain", .spp = 16, .channels = 3},
        {.name = "few samples", .spp = 4, .channels = 3},
        {.name = "in parts", .spp = 1500, .channels = 3, .mask = true},
        {.name = "Sobol's points", .spp = 64, .channels = 3, .sobol = true},
        {.name = "luminance", .spp = 48, .channels = 1, .singular = true},
        {.name = "regularised", .spp = 16, .channels = 3, .smooth = true},
        {.name = "with a lamp's logarithms",
         .spp = 32,
         .channels = 3,
         .tied = true,
         .singular = true},
        {.name = "log loss",
         .spp = 32,
         .channels = 3,
         .loss = IMP_LOSS_LOG,
         .noise = true},
    };
    imp_context *ctx = test_context(2);
    for (size_t k = 0; k < sizeof trials / sizeof *trials; k++) compare(ctx, &trials[k]);
    imp_context_destroy(ctx);
    return tap_done();
}
