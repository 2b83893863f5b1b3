/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivative pictures by poses: sums over them against central differences of sums over pictures
 * with the same random numbers; their errors, of pixels and of sums, over seeds; forward mode.
 * Normal equations: the matrix against products of independent derivative pictures, the gradient
 * against that of the loss, its errors over seeds. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/gauss/gauss_newton.h"
#include "moves_kit.h"

enum { WIDTH = 24, HEIGHT = 16, VALUES = WIDTH * HEIGHT * 3, N = 18 };
static imp_context *ctx;
static const double at[N] = {.1, -.1, .05, .2, -.1, .3,  -.1, .2,  .1,
                             .1, .05, 0,   .1, .2,  -.1, .02, .03, -.02};
static float adjoint[VALUES];

static imp_scene *room(const char *filter)
{
    return room_posed(
        ctx, &(struct room_parts){.rest = "<integrator type='path'><integer "
                                          "name='max_depth' value='3'/></integrator>",
                                  .filter = filter});
}

static double sum_of(imp_film *film)
{
    double sum = 0;
    for (int k = 0; k < VALUES; k++) sum += (double)adjoint[k] * imp_film_mean(film)[k];
    return sum;
}

static double functional(imp_scene *scene, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 128;
    run.seed = seed;
    test_must(ctx, imp_render(scene, &run, &film));
    const double sum = sum_of(film);
    imp_film_destroy(film);
    return sum;
}

static const struct {
    int k;
    double step;
} checked[] = {{0, .03}, {1, .03}, {5, .03}, {6, .05}, {10, .05}, {13, .02}, {15, .0036}};

static void pictures_test(const char *name, const char *filter)
{
    enum { SEEDS = 24, GROUPS = 12 };
    imp_scene *scene = room(filter);
    imp_problem *p = test_problem(ctx, scene, "*.pose");
    static double mean[N][VALUES], square[N][VALUES], told[N][VALUES];
    double sum[N] = {0}, sum2[N] = {0}, sum_told[N] = {0}, tangent = 0, expected = 0;
    memset(mean, 0, sizeof mean);
    memset(square, 0, sizeof square);
    memset(told, 0, sizeof told);
    room_poses_set(ctx, scene, at);
    for (int s = 0; s < SEEDS; s++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate sums[N];
        imp_film *primal, *films[N], *forward;
        double x_dot[N];
        run.spp = 16;
        run.seed = 300 + (uint64_t)s;
        test_must(ctx, imp_problem_jacobian(p, &run, &primal, films));
        test_must(ctx, imp_problem_jacobian_sums(p, adjoint, &run, primal, films, NULL, 0,
                                                 NULL, sums));
        for (int k = 0; k < N; k++) x_dot[k] = 0.1 * k - 0.5;
        for (int k = 0; k < N; k++) {
            const float *v = imp_film_mean(films[k]), *se = imp_film_se(films[k]);
            const double a = sum_of(films[k]);
            for (int i = 0; i < VALUES; i++) {
                mean[k][i] += (double)v[i] / SEEDS;
                square[k][i] += (double)v[i] * v[i] / SEEDS;
                told[k][i] += (double)se[i] * se[i] / SEEDS;
            }
            sum[k] += a / SEEDS;
            sum2[k] += a * a / SEEDS;
            sum_told[k] += sums[k].se * sums[k].se / SEEDS;
            if (s == 0) expected += x_dot[k] * a;
        }
        if (s == 0) {
            test_must(ctx, imp_problem_forward(p, x_dot, &run, &forward));
            tangent = sum_of(forward);
            imp_film_destroy(forward);
        }
        imp_film_destroy(primal);
        for (int k = 0; k < N; k++) imp_film_destroy(films[k]);
    }
    imp_problem_destroy(p);
    tap_ok(fabs(tangent - expected) < 1e-5 * fabs(expected),
           "%s: forward mode is the pictures' combination # %g %g", name, tangent,
           expected);
    double pixels = 0, sums = 0, most[3] = {0};
    for (int k = 0; k < N; k++) {
        double seen = 0, all = 0;
        for (int i = 0; i < VALUES; i++) {
            seen += (square[k][i] - mean[k][i] * mean[k][i]) * SEEDS / (SEEDS - 1);
            all += told[k][i];
        }
        pixels += log(sqrt(all / seen)) / N;
        seen = (sum2[k] - sum[k] * sum[k]) * SEEDS / (SEEDS - 1);
        sums += log(sqrt(sum_told[k] / seen)) / N;
        most[k / 6] = fmax(most[k / 6], fabs(sum[k]));
    }
    tap_ok(exp(pixels) > 0.9 && exp(pixels) < 1.1,
           "%s: errors of pixels told over seen # %.3f", name, exp(pixels));
    tap_ok(exp(sums) > 0.8 && exp(sums) < 1.25,
           "%s: errors of sums told over seen # %.3f", name, exp(sums));
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
                value[s] = functional(scene, 700 + (uint64_t)g);
            }
            tap_add(&ref, (value[1] - value[0]) / (2 * checked[i].step));
        }
        const double se = sqrt(sum_told[k] / SEEDS);
        const double z = (sum[k] - ref.mean) / hypot(se, tap_se(&ref));
        tap_ok(fabs(z) < 3.5 && se < 0.06 * most[k / 6],
               "%s, %s.pose[%d] # %.5f se %.5f ref %.5f se %.5f z %.2f", name,
               room_objects[k / 6], k % 6, sum[k], se, ref.mean, tap_se(&ref), z);
    }
    imp_scene_destroy(scene);
}

/* ---- Normal equations ---------------------------------------------------------------- */

static void films_make(imp_problem *p, uint64_t seed, size_t n, imp_film **films)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *primal;
    run.spp = 256;
    run.seed = seed;
    test_must(ctx, imp_problem_jacobian(p, &run, &primal, films));
    imp_film_destroy(primal);
    (void)n;
}

static void normal_test(void)
{
    enum { SEEDS = 32, K = 9, PAIRS = 4 }; /* block and the reflectance */
    imp_scene *scene = room("type='box'");
    imp_problem *p = test_problem(ctx, scene, "block.pose");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *target;
    struct tap_stat H[K][K] = {{{0, 0, 0}}}, ref[K][K] = {{{0, 0, 0}}};
    struct tap_stat g[K] = {{0, 0, 0}}, loss[K] = {{0, 0, 0}};
    double told[K] = {0}, matrix[K * K], same[K * K], gradient[K], se[K];
    test_must(ctx, imp_problem_activate(p, "grey.reflectance.value"));
    run.spp = 512;
    run.seed = 9;
    test_must(ctx, imp_render(scene, &run, &target));
    test_target(ctx, p, 0, WIDTH, HEIGHT, imp_film_mean(target));
    imp_film_destroy(target);
    room_poses_set(ctx, scene, at);
    for (int s = 0; s < SEEDS; s++) {
        double cov[K * K], excess[K * K], own[K], own_se[K];
        struct imp_estimate value;
        struct imp__gauss_newton gn = {.H = matrix,
                                       .H_same = same,
                                       .g = gradient,
                                       .g_se = se,
                                       .cov_g = cov,
                                       .cov_excess = excess};
        run.spp = 32;
        run.seed = 40 + (uint64_t)s;
        test_must(ctx, imp__gauss_newton(p, NULL, &run, &gn));
        run.seed = 1040 + (uint64_t)s;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &value, own, own_se));
        for (int k = 0; k < K; k++) {
            tap_add(&g[k], gradient[k]);
            tap_add(&loss[k], own[k]);
            told[k] += se[k] * se[k] / SEEDS;
            for (int l = 0; l <= k; l++) tap_add(&H[k][l], matrix[k * K + l]);
        }
    }
    for (int pair = 0; pair < PAIRS; pair++) {
        imp_film *one[K], *other[K];
        films_make(p, 5000 + 2 * (uint64_t)pair, K, one);
        films_make(p, 5001 + 2 * (uint64_t)pair, K, other);
        for (int k = 0; k < K; k++)
            for (int l = 0; l <= k; l++) {
                double sum = 0;
                for (int i = 0; i < VALUES; i++)
                    sum +=
                        0.5 *
                        ((double)imp_film_mean(one[k])[i] * imp_film_mean(other[l])[i] +
                         (double)imp_film_mean(one[l])[i] * imp_film_mean(other[k])[i]);
                tap_add(&ref[k][l], sum);
            }
        for (int k = 0; k < K; k++) {
            imp_film_destroy(one[k]);
            imp_film_destroy(other[k]);
        }
    }
    double worst = 0, least = 0, ratio = 0, z_most = 0;
    for (int k = 0; k < K; k++)
        for (int l = 0; l <= k; l++) {
            const double error = hypot(tap_se(&H[k][l]), tap_se(&ref[k][l]));
            const double scale = sqrt(ref[k][k].mean * ref[l][l].mean);
            worst = fmax(worst, fabs(H[k][l].mean - ref[k][l].mean) / error);
            least = fmax(least, error / scale);
        }
    tap_ok(
        worst < 4.5 && least < 0.1,
        "J^T J against products of pictures: worst |z| of %d # %.2f, errors up to %.3f",
        K * (K + 1) / 2, worst, least);
    for (int k = 0; k < K; k++) {
        z_most = fmax(z_most, fabs(g[k].mean - loss[k].mean) /
                                  hypot(tap_se(&g[k]), tap_se(&loss[k])));
        ratio += log(sqrt(told[k] / SEEDS) / tap_se(&g[k])) / K;
    }
    tap_ok(z_most < 3.5, "J^T r is the gradient of the loss: worst |z| # %.2f", z_most);
    tap_ok(exp(ratio) > 0.8 && exp(ratio) < 1.25, "errors of J^T r told over seen # %.3f",
           exp(ratio));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    ctx = test_context(2);
    for (int p = 0; p < WIDTH * HEIGHT; p++)
        for (int c = 0; c < 3; c++) {
            const double x = (p % WIDTH + .5) / WIDTH, y = (p / WIDTH + .5) / HEIGHT;
            adjoint[3 * p + c] =
                (float)((1 + 0.3 * sin(3 * x + 2 * y + c)) / (WIDTH * HEIGHT));
        }
    if (is_long) pictures_test("box", "type='box'");
    pictures_test("a Gaussian filter", "type='gaussian'");
    normal_test();
    imp_context_destroy(ctx);
    return tap_done();
}
