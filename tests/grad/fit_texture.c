/* SPDX-License-Identifier: Apache-2.0
 *
 * A texture back from a picture: 24 x 24 texels of three colours, by Adam, with bounds;
 * how soon by default, with control variates, and with more momentum, and to the same answer; and what smoothness does where the
 * picture says nothing. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <unistd.h>

enum { SIDE = 24, N = SIDE * SIDE * 3 };

/* A textured square under a constant sky, seen from above, two pixels a texel. */
static imp_scene *square(imp_context *ctx, const float *pixels)
{
    /* A camera at z = 5 that looks along -z: turned about y by 180 degrees. */
    static const double look[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 5, 0, 0, 0, 1};
    imp_scene *s = NULL;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "integrator", "path", NULL, NULL);
    imp_scene_integer(s, "max_depth", 2);
    imp_scene_end(s);
    imp_scene_begin(s, "sensor", "orthographic", "camera", NULL);
    imp_scene_transform(s, "to_world", look);
    imp_scene_begin(s, "film", "hdrfilm", NULL, NULL);
    imp_scene_integer(s, "width", 2 * SIDE);
    imp_scene_integer(s, "height", 2 * SIDE);
    imp_scene_begin(s, "rfilter", "box", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "emitter", "constant", "sky", NULL);
    imp_scene_float(s, "radiance", 1);
    imp_scene_end(s);
    imp_scene_begin(s, "bsdf", "diffuse", "paint", NULL);
    imp_scene_begin(s, "texture", "bitmap", "picture", "reflectance");
    imp_scene_bool(s, "raw", 1);
    imp_scene_image(s, SIDE, SIDE, 3, pixels);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", NULL, NULL);
    imp_scene_ref(s, "paint", NULL);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static double rmse(const double *x, const float *ref)
{
    double sum = 0, n = 0;
    for (int i = 0; i < N; i++) sum += (x[i] - ref[i]) * (x[i] - ref[i]), n++;
    return sqrt(sum / n);
}

/* A smooth texture from grey by `iterations` of 8 samples, its target and its walks those of
 * `seed`; stopped on the way and resumed if there is a checkpoint. x: [N] */
static void fit(imp_context *ctx, double momentum, int iterations, uint64_t seed,
                const char *checkpoint, const float *truth, double *x)
{
    static float grey[N];
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_target t = IMP_TARGET_INIT;
    imp_film *film;
    imp_problem *p;
    imp_scene *s = square(ctx, truth);
    for (int i = 0; i < N; i++) grey[i] = 0.5f;
    run.spp = 256;
    run.seed = 1000 + seed;
    test_must(ctx, imp_render(s, &run, &film));
    imp_scene_destroy(s);
    s = square(ctx, grey);
    t.width = t.height = 2 * SIDE;
    t.channels = 3;
    t.pixels = imp_film_mean(film);
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "picture.*"));
    test_must(ctx, imp_problem_add_target(p, &t));
    run.spp = 8;
    run.seed = seed;
    o.momentum = momentum;
    o.checkpoint = checkpoint;
    o.resume = checkpoint != NULL;
    for (int part = checkpoint ? 0 : 1; part < 2; part++) {
        o.max_iterations = part ? iterations : iterations / 3;
        test_must(ctx, imp_fit(p, &o, &run, &r));
    }
    imp_problem_get_x(p, x);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_film_destroy(film);
}

static void momenta(imp_context *ctx)
{
    enum { SEEDS = 6, SOON = 20, LATE = 90 };
    static float truth[N];
    static double x[N], other[N];
    double gain = 0, gain2 = 0, error[2] = {0, 0};
    for (int i = 0; i < N; i++)
        truth[i] = (float)(0.5 + 0.3 * sin(0.8 * (i / 3 % SIDE) + i % 3) *
                                     cos(0.6 * (i / 3. / SIDE)));
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        double e[2];
        for (int k = 0; k < 2; k++) {
            fit(ctx, k ? 0 : 0.9, SOON, seed, NULL, truth, x);
            e[k] = rmse(x, truth);
            error[k] += e[k] / SEEDS;
        }
        gain += (e[0] - e[1]) / SEEDS;
        gain2 += (e[0] - e[1]) * (e[0] - e[1]) / SEEDS;
    }
    const double gain_se = sqrt(fmax(gain2 - gain * gain, 0) / (SEEDS - 1));
    tap_ok(
        gain > 4.5 * gain_se && error[1] < 0.5 * error[0],
        "sooner by default # rms error %.4f after %d iterations, %.4f with momentum .9; "
        "z %.1f",
        error[1], SOON, error[0], gain / gain_se);

    /* The mean over the texels, whose errors have either sign. */
    for (int k = 0; k < 2; k++) {
        double mean = 0, square_mean = 0;
        for (uint64_t seed = 1; seed <= SEEDS; seed++) {
            double off = 0;
            fit(ctx, k ? 0 : 0.9, LATE, seed, NULL, truth, x);
            for (int i = 0; i < N; i++) off += (x[i] - truth[i]) / N;
            mean += off / SEEDS;
            square_mean += off * off / SEEDS;
        }
        const double se = sqrt(fmax(square_mean - mean * mean, 0) / (SEEDS - 1));
        tap_ok(
            fabs(mean) < 4.5 * se && se < 2e-4,
            "momentum %s ends at the truth # mean over the texels %.2g +- %.2g, z %.2f",
            k ? "by default" : ".9", mean, se, mean / se);
    }

    char path[64];
    imp_context *one = test_context(1), *three = test_context(3);
    int differ[2] = {0, 0};
    snprintf(path, sizeof path, "/tmp/imp_fit_texture_%ld.ck", (long)getpid());
    fit(three, 0, 30, 1, NULL, truth, x);
    fit(one, 0, 30, 1, NULL, truth, other);
    for (int i = 0; i < N; i++) differ[0] += x[i] != other[i];
    fit(one, 0, 30, 1, path, truth, other);
    for (int i = 0; i < N; i++) differ[1] += x[i] != other[i];
    remove(path);
    imp_context_destroy(one);
    imp_context_destroy(three);
    tap_ok(differ[0] == 0 && differ[1] == 0,
           "the same bits by one thread, and stopped and resumed # %d, %d differ",
           differ[0], differ[1]);
}

int main(void)
{
    imp_context *ctx = test_context(0);
    static float truth[N], grey[N];
    for (int i = 0; i < N; i++) {
        const int x = i / 3 % SIDE, y = i / 3 / SIDE, c = i % 3;
        truth[i] = (float)(0.5 + 0.35 * sin(0.5 * x + c) * cos(0.4 * y - c));
        if (x < 4 && y < 4) truth[i] = c == 0; /* pure red: at both bounds */
        grey[i] = 0.5f;
    }
    imp_scene *s = square(ctx, truth);
    imp_film *film = NULL;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 256;
    run.seed = 1;
    test_must(ctx, imp_render(s, &run, &film));
    imp_scene_destroy(s);

    s = square(ctx, grey);
    struct imp_target t = IMP_TARGET_INIT;
    t.width = t.height = 2 * SIDE;
    t.channels = 3;
    t.pixels = imp_film_mean(film);
    imp_problem *p = NULL;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "picture.*"));
    test_must(ctx, imp_problem_add_target(p, &t));
    tap_ok(imp_problem_n_variables(p) == N, "%zu numbers are active",
           imp_problem_n_variables(p));
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r = NULL;
    static double x[N];
    run.spp = 4;
    run.seed = 2;
    o.max_iterations = 150;
    o.intervals = 1;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    imp_problem_get_x(p, x);
    struct imp_fit_variable variable = IMP_FIT_VARIABLE_INIT;
    double outside = 0;
    int other = 0;
    for (size_t i = 0; i < N; i++) {
        outside += x[i] < 0 || x[i] > 1;
        test_must(ctx, imp_problem_get_fit_variable(p, i, &variable));
        other += variable.value != x[i] || variable.start != 0.5 ||
                 variable.at_bound != (x[i] <= 0 ? -1 : x[i] >= 1) ||
                 !variable.determined || !isnan(variable.se) || !isnan(variable.hi95);
    }
    tap_ok(other == 0 && !r->variables &&
               imp_problem_get_fit_variable(p, N, &variable) == IMP_E_ARG,
           "each of them is asked for by its number # %d differ", other);
    tap_ok(rmse(x, truth) < 0.02 && outside == 0,
           "a texture of %d numbers # rms error %.4f, from %.4f: %s", N, rmse(x, truth),
           0.25, r->reason);
    tap_ok(r->warning && strstr(r->warning, "256"), "no intervals for so many # %s",
           r->warning);
    tap_ok(r->history[0] > 50 * fabs(r->objective.value),
           "loss # from %.3g to %.3g +- %.1g", r->history[0], r->objective.value,
           r->objective.se);

    /* A third of the picture is masked: texels there stay where they were, unless a
     * smoothness term joins them to the others. */
    static float weights[4 * SIDE * SIDE];
    for (int i = 0; i < 4 * SIDE * SIDE; i++) {
        const int px = i % (2 * SIDE), py = i / (2 * SIDE);
        weights[i] = px < 30 || py < 10;
    }
    t.weights = weights;
    for (int smooth = 0; smooth < 2; smooth++) {
        imp_problem_destroy(p);
        imp_scene_destroy(s);
        s = square(ctx, grey);
        test_must(ctx, imp_problem_create(s, &p));
        test_must(ctx, imp_problem_activate(p, "picture.*"));
        test_must(ctx, imp_problem_add_target(p, &t));
        if (smooth) test_must(ctx, imp_problem_add_smoothness(p, "picture.*", 0.05));
        struct imp_estimate J;
        static double g[N],
            g_se[N];  /* of the data: the smoothness term is flat at first */
        run.spp = 64; /* enough that every texel in sight is met */
        test_must(ctx, imp_problem_objective(p, NULL, &run, &J, g, g_se));
        run.spp = 4;
        o.intervals = 0;
        o.max_iterations = 100;
        test_must(ctx, imp_fit(p, &o, &run, &r));
        size_t param;
        test_must(ctx, imp_scene_find_param(s, "picture.data", &param));
        test_must(ctx, imp_scene_get_values(s, param, x));
        int still = 0, all = 0;
        for (int i = 0; i < N; i++) {
            if (g[i] != 0 || g_se[i] != 0) continue;
            all++;
            still += x[i] == 0.5;
        }
        tap_ok(all > N / 6 && (smooth ? still == 0 : still == all),
               "behind the mask, %s # %d of %d where they were",
               smooth ? "with smoothness all move" : "nothing moves", still, all);
    }
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(s);
    momenta(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
