/* SPDX-License-Identifier: Apache-2.0
 *
 * A sky of 16 x 32 texels back from a picture, at 4 samples a pixel and 1000 iterations:
 * the loss goes down and stays down. Sampling densities that are those of older texels
 * let it rise again (mitsuba3, issue 420); here they follow every step. Then one number,
 * the rotation, with its interval.
 *
 *     fit_sky [long]    long: four times the pixels */
#include "imp_scene.h"
#include "imp_tap.h"
#include <stdbool.h>

enum { W = 32, H = 16, N = W * H * 3, WINDOW = 50 };

static imp_scene *make(imp_context *ctx, const float *pixels, double rotation, int side)
{
    static const double ground[16] = {3, 0, 0, 0, 0, 0, 3, -1, 0, -3, 0, 0, 0, 0, 0, 1};
    static const double rho[3] = {0.5, 0.6, 0.7};
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 5, 50, side, side);
    imp_scene_begin(s, "emitter", "envmap", "sky", NULL);
    imp_scene_image(s, W, H, 3, pixels);
    imp_scene_float(s, "rotation", rotation);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "sphere", "ball", NULL);
    imp_scene_begin(s, "bsdf", "roughconductor", NULL, NULL);
    imp_scene_string(s, "distribution", "ggx");
    imp_scene_float(s, "alpha", 0.15);
    imp_scene_end(s);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "rectangle", "ground", NULL);
    imp_scene_transform(s, "to_world", ground);
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_rgb(s, "reflectance", rho);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    return s;
}

static float truth[N], start[N];
static imp_film *photograph(imp_context *ctx, int side, double rotation, int spp)
{
    imp_scene *s = make(ctx, truth, rotation, side);
    imp_film *film;
    struct imp_run run = IMP_RUN_INIT;
    run.spp = spp;
    run.seed = 100;
    test_must(ctx, imp_render(s, &run, &film));
    imp_scene_destroy(s);
    return film;
}

static imp_problem *problem(imp_context *ctx, imp_scene *s, const char *what,
                            imp_film *film, int side)
{
    struct imp_target t = IMP_TARGET_INIT;
    imp_problem *p = test_problem(ctx, s, what);
    t.width = t.height = side;
    t.channels = 3;
    t.pixels = imp_film_mean(film);
    t.noise_se = imp_film_se(film);
    test_must(ctx, imp_problem_add_target(p, &t));
    return p;
}

static void texels(imp_context *ctx, int side)
{
    imp_film *film = photograph(ctx, side, 0, 1024);
    imp_scene *s = make(ctx, start, 0, side);
    imp_problem *p = problem(ctx, s, "sky.data", film, side);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r;
    struct imp_estimate end;
    run.spp = 4;
    run.seed = 7;
    o.max_iterations = 1000;
    o.tolerance = 1e-9;
    test_must(ctx, imp_fit(p, &o, &run, &r));

    /* Least mean of a window of iterations, with the errors of its losses. */
    double least = INFINITY, least_se = 0, last = 0, last_se = 0;
    for (size_t k = 0; k + WINDOW <= r->n_history; k += WINDOW) {
        double mean = 0, variance = 0;
        for (size_t i = k; i < k + WINDOW; i++) {
            mean += r->history[i] / WINDOW;
            variance += r->history_se[i] * r->history_se[i] / (WINDOW * WINDOW);
        }
        printf("# iterations %zu to %zu: loss %.5g +- %.2g\n", k, k + WINDOW, mean,
               sqrt(variance));
        if (mean < least) least = mean, least_se = sqrt(variance);
        last = mean, last_se = sqrt(variance);
    }
    run.spp = 512;
    run.seed = 8;
    test_must(ctx, imp_problem_objective(p, NULL, &run, &end, NULL, NULL));
    tap_ok(r->iterations == 1000 && end.value < least + 3 * hypot(end.se, least_se) &&
               last < least + 3 * hypot(last_se, least_se),
           "%d texels: the loss ends at its least # %.5g +- %.2g, least %.5g +- %.2g", N,
           end.value, end.se, least, least_se);
    tap_ok(end.value + 3 * end.se < 0.01 * r->history[0],
           "and went down # from %.4g to %.4g +- %.2g", r->history[0], end.value, end.se);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_film_destroy(film);
}

static void rotation(imp_context *ctx, int side)
{
    imp_film *film = photograph(ctx, side, 20, 2048);
    imp_scene *s = make(ctx, truth, 8, side);
    imp_problem *p = problem(ctx, s, "sky.rotation", film, side);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r;
    run.spp = 256;
    run.seed = 9;
    o.optimizer = IMP_LM;
    o.intervals = 1;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    const struct imp_fit_variable *v = &r->variables[0];
    tap_ok(fabs(v->value - 20) < 4.5 * v->se && v->se < 0.5,
           "the sky is turned back # %.3f +- %.3f degrees, from 8 to 20: %s; %s",
           v->value, v->se, r->reason, r->warning ? r->warning : "");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_film_destroy(film);
}

int main(int argc, char **argv)
{
    const bool is_long = argc > 1 && strcmp(argv[1], "long") == 0;
    imp_context *ctx = test_context(0);
    for (int k = 0; k < N; k++) {
        const int j = k / 3 % W, i = k / 3 / W, c = k % 3;
        const double blue = 0.3 + 0.2 * c, up = 1 - 2.0 * i / (H - 1);
        truth[k] = (float)(up > 0 ? blue * (1.2 - up) + 0.2 * cos(0.4 * j) * (1 - up)
                                  : 0.15 - 0.03 * c);
        if (i == 4 && j == 12) truth[k] = (float)(8 - c); /* a sun */
        start[k] = 0.5F;
    }
    texels(ctx, is_long ? 40 : 20);
    rotation(ctx, 24);
    imp_context_destroy(ctx);
    return tap_done();
}
