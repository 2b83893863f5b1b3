/* SPDX-License-Identifier: Apache-2.0
 *
 * Problems: what can be made active, what a target must be, and the regularisers' values
 * and gradients. */
#include "inverse/problem/problem.h"
#include "imp_tap.h"
#include "inverse/problem/match.h"
#include "inverse_scenes.h"
#include <math.h>

static imp_context *ctx;

static void globs(void)
{
    static const struct {
        const char *glob, *text;
        int yes;
    } at[] = {{"*", "a.b", 1},
              {"*", "", 1},
              {"a.b", "a.b", 1},
              {"a.b", "a.c", 0},
              {"a?b", "a.b", 1},
              {"*.value", "x.y.value", 1},
              {"*.value", "x.value.y", 0},
              {"a*b*c", "a-b-b-c", 1},
              {"a*b*c", "a-c-b", 0},
              {"**", "z", 1},
              {"?", "", 0},
              {"x*", "x", 1},
              {"*a*a*a*a*a*b", "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa", 0}};
    int wrong = 0;
    for (size_t i = 0; i < sizeof at / sizeof at[0]; i++)
        wrong += imp__glob(at[i].glob, at[i].text) != at[i].yes;
    tap_ok(wrong == 0, "globs # %d wrong", wrong);
}

static void activation(imp_scene *s)
{
    imp_problem *p = NULL;
    struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
    double x[16];
    tap_ok(imp_problem_create(s, &p) == IMP_OK && imp_problem_n_variables(p) == 0,
           "nothing is active");
    tap_ok(imp_problem_activate(p, "sky.radiance.value") == IMP_OK &&
               imp_problem_n_variables(p) == 3,
           "by name");
    tap_ok(imp_problem_activate(p, "ball.*") == IMP_OK && imp_problem_n_variables(p) == 6,
           "by glob");
    tap_ok(imp_problem_activate(p, "sky.radiance.value") == IMP_OK &&
               imp_problem_n_variables(p) == 6,
           "twice is once");
    imp_problem_get_x(p, x);
    struct imp_param_info info = {.size = sizeof info}, before = {.size = sizeof before};
    int ordered = 1;
    for (size_t i = 0; i < 6; i++) {
        if (imp_problem_get_variable(p, i, &v) != IMP_OK ||
            imp_scene_get_param(s, v.param, &info) != IMP_OK)
            return;
        ordered &= i == 0 || info.offset + v.element > before.offset;
        before = info;
        before.offset += v.element;
    }
    tap_ok(ordered, "the scene's order, whatever the order of calls");
    tap_ok(imp_problem_get_variable(p, 6, &v) == IMP_E_ARG, "no number 6 # %s",
           imp_last_error(ctx));
    size_t ball;
    if (imp_scene_find_param(s, "ball.reflectance", &ball) != IMP_OK) return;
    for (size_t i = 0; i < 6; i++) {
        if (imp_problem_get_variable(p, i, &v) != IMP_OK) return;
        if (v.param == ball)
            tap_ok(fabs(x[i] - (0.3 + 0.2 * (double)v.element)) < 1e-7 && v.lo == 0 &&
                       v.hi == 1,
                   "value and bounds of number %zu # %g in [%g, %g]", i, x[i], v.lo,
                   v.hi);
    }

    tap_ok(imp_problem_activate(p, "bal.reflectance.value") == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "ball.reflectance.value"),
           "a misspelling # %s", imp_last_error(ctx));
    tap_ok(imp_problem_activate(p, "nothing*") == IMP_E_ARG, "no match # %s",
           imp_last_error(ctx));
    tap_ok(imp_problem_activate(p, "") == IMP_E_ARG, "no name");
    tap_ok(imp_problem_activate(p, "glass.*") == IMP_E_BIAS &&
               strstr(imp_last_error(ctx), "glass.eta") &&
               strstr(imp_last_error(ctx), "paths"),
           "a pattern that meets only what has none: the reason # %s",
           imp_last_error(ctx));
    for (size_t k = 0; k < imp_scene_n_params(s); k++) {
        if (imp_scene_get_param(s, k, &info) != IMP_OK) return;
        if (info.flags & IMP_PARAM_DIFFERENTIABLE) continue;
        tap_ok(imp_problem_activate(p, info.name) == IMP_E_BIAS, "biased by name # %s",
               imp_last_error(ctx));
    }
    tap_ok(imp_problem_n_variables(p) == 6, "failures change nothing");
    tap_ok(imp_problem_activate(p, "*") == IMP_OK, "* takes what has a gradient");

    double y[16];
    const size_t n = imp_problem_n_variables(p);
    imp_problem_get_x(p, x);
    memcpy(y, x, sizeof y);
    for (size_t i = 0; i < n; i++) y[i] *= 0.5;
    tap_ok(imp_problem_set_x(p, y) == IMP_OK, "set");
    double z[16];
    imp_problem_get_x(p, z);
    tap_ok(!memcmp(y, z, n * sizeof *y), "what is set is what is there");
    y[0] = 0.1;
    y[n - 1] = -1;
    tap_ok(imp_problem_set_x(p, y) == IMP_E_ARG, "below a bound # %s",
           imp_last_error(ctx));
    y[n - 1] = NAN;
    tap_ok(imp_problem_set_x(p, y) == IMP_E_ARG, "NaN # %s", imp_last_error(ctx));
    double after[16];
    imp_problem_get_x(p, after);
    tap_ok(!memcmp(z, after, n * sizeof *z), "all or nothing");
    if (imp_problem_set_x(p, x) != IMP_OK) return;
    imp_problem_destroy(p);
    imp_problem_destroy(NULL);
}

static void targets(imp_scene *s)
{
    imp_problem *p = NULL;
    float pixels[12 * 10 * 3], weights[12 * 10], se[12 * 10 * 3];
    if (imp_problem_create(s, &p) != IMP_OK) return;
    for (int i = 0; i < 360; i++) pixels[i] = 0.5f, se[i] = 0.1f, weights[i / 3] = 1;
    struct imp_target t = IMP_TARGET_INIT;
    t.width = 12, t.height = 10, t.channels = 3, t.pixels = pixels;
    struct imp_target bad = t;
    tap_ok(imp_problem_add_target(p, NULL) == IMP_E_ARG, "no target");
    bad.width = 13;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "size # %s",
           imp_last_error(ctx));
    bad = t, bad.sensor = 4;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "sensor # %s",
           imp_last_error(ctx));
    bad = t, bad.channels = 2;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "channels # %s",
           imp_last_error(ctx));
    bad = t, bad.pixels = NULL;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "pixels # %s",
           imp_last_error(ctx));
    bad = t, bad.loss = 9;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "loss # %s",
           imp_last_error(ctx));
    bad = t, bad.epsilon = -1;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "epsilon # %s",
           imp_last_error(ctx));
    bad = t, bad.weights = weights, weights[7] = -1;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "weight # %s",
           imp_last_error(ctx));
    weights[7] = 0, pixels[22] = NAN;
    tap_ok(imp_problem_add_target(p, &t) == IMP_E_ARG, "NaN # %s", imp_last_error(ctx));
    tap_ok(imp_problem_add_target(p, &bad) == IMP_OK,
           "NaN where the weight is 0 is left out");
    pixels[22] = 0;
    bad = t, bad.noise_se = se, se[3] = INFINITY;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "noise # %s",
           imp_last_error(ctx));
    memset(weights, 0, sizeof weights);
    bad = t, bad.weights = weights;
    tap_ok(imp_problem_add_target(p, &bad) == IMP_E_ARG, "no weight # %s",
           imp_last_error(ctx));
    tap_ok(p->n_targets == 1 && p->targets[0].desc.scale == 1 &&
               p->targets[0].desc.epsilon == 1e-2,
           "failures add nothing; 0 is the default");
    imp_problem_destroy(p);
}

/* A parameter that looks like a texture stands in for one: [h][w][c] of a row of numbers.
 */
static void regularisers(imp_scene *s)
{
    imp_problem *p = NULL;
    if (imp_problem_create(s, &p) != IMP_OK || imp_problem_activate(p, "*") != IMP_OK)
        return;
    const size_t n = imp_problem_n_variables(p);
    tap_ok(imp_problem_add_tikhonov(p, "nothing*", 1, 0) == IMP_E_ARG, "no match # %s",
           imp_last_error(ctx));
    tap_ok(imp_problem_add_tikhonov(p, "*", NAN, 0) == IMP_E_ARG, "NaN # %s",
           imp_last_error(ctx));
    tap_ok(imp_problem_add_smoothness(p, "*", 1) == IMP_E_ARG,
           "smoothness of numbers # %s", imp_last_error(ctx));
    tap_ok(imp_problem_add_tikhonov(p, "ball.*", 3, 0) == IMP_OK &&
               imp_problem_add_tikhonov(p, "sky.*", 2, 1) == IMP_OK,
           "added");
    double x[16], g[16] = {0}, expect = 0;
    imp_problem_get_x(p, x);
    size_t ball;
    if (imp_scene_find_param(s, "ball.reflectance", &ball) != IMP_OK) return;
    for (size_t i = 0; i < n; i++) x[i] += 0.01 * (double)(i + 1);
    double error = 0;
    const double value = imp__regularise(p, x, g);
    for (size_t i = 0; i < n; i++) {
        struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
        if (imp_problem_get_variable(p, i, &v) != IMP_OK) return;
        const size_t k = v.param;
        const double d = k == ball ? x[i] : 0.01 * (double)(i + 1), w = k == ball ? 3 : 2;
        const char *name = s->params[k].info.name;
        if (k != ball && strncmp(name, "sky", 3) != 0) continue;
        expect += 0.5 * w * d * d;
        error = fmax(error, fabs(g[i] - w * d));
    }
    tap_near(value, expect, 1e-13, 0, "Tikhonov");
    tap_ok(error < 1e-13, "its gradient # %.1e", error);
    imp_problem_destroy(p);

    /* Smoothness of [2][3][1] over six numbers, by hand. */
    struct imp_param two[1] = {{.info = {.count = 6, .dims = {2, 3, 1}, .n_dims = 3}}};
    struct imp_scene fake = {.n_params = 1, .params = two};
    uint8_t on[1] = {1};
    struct imp__block block = {.count = 6, .tie = -1};
    struct imp__regulariser r = {.kind = IMP_SMOOTHNESS, .weight = 2, .on = on};
    struct imp_problem q = {.scene = &fake,
                            .n = 6,
                            .n_regularisers = 1,
                            .regularisers = &r,
                            .n_blocks = 1,
                            .blocks = &block};
    const double t[6] = {1, 2, 4, 3, 3, 0};
    double gt[6] = {0};
    /* rows: 1, 2 | 0, -3; columns: 2, 1, -4: squares 1+4+0+9+4+1+16 = 35 */
    tap_near(imp__regularise(&q, t, gt), 35, 1e-15, 0, "smoothness");
    double worst = 0;
    for (int i = 0; i < 6; i++) {
        double a[6], b[6];
        memcpy(a, t, sizeof a);
        memcpy(b, t, sizeof b);
        a[i] += 0.5, b[i] -= 0.5; /* quadratic: central differences are exact */
        worst = fmax(worst, fabs(imp__regularise(&q, a, NULL) -
                                 imp__regularise(&q, b, NULL) - gt[i]));
    }
    tap_ok(worst < 1e-13, "its gradient # %.1e", worst);
}

/* With nothing active, the picture that derivatives would be of. */
static void primal_alone(imp_scene *s)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_problem *p = NULL;
    imp_film *picture = NULL, *primal = NULL, *films[8] = {0};
    run.spp = 3;
    int ok = imp_problem_create(s, &p) == IMP_OK;
    tap_ok(ok && imp_problem_jacobian(p, &run, NULL, NULL) == IMP_E_ARG &&
               imp_problem_jacobian(p, &run, &primal, films) == IMP_E_ARG && !primal,
           "a Jacobian of nothing has no films # %s", imp_last_error(ctx));
    ok = ok && imp_problem_jacobian(p, &run, &primal, NULL) == IMP_OK &&
         imp_render(s, &run, &picture) == IMP_OK;
    struct imp_film_info info = {.size = sizeof info};
    if (ok) imp_film_get_info(picture, &info);
    const size_t n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
    tap_ok(ok &&
               !memcmp(imp_film_mean(picture), imp_film_mean(primal), n * sizeof(float)),
           "its primal is the picture, to the bit");
    imp_film_destroy(primal);
    primal = NULL;
    tap_ok(ok && imp_problem_activate(p, "*") == IMP_OK &&
               imp_problem_jacobian(p, &run, &primal, NULL) == IMP_E_ARG && !primal,
           "where something is active, films are needed");
    imp_film_destroy(picture);
    imp_problem_destroy(p);
}

int main(void)
{
    if (imp_context_create(NULL, &ctx) != IMP_OK) return 1;
    imp_scene *s = scene_open(ctx, ball_xml, IMP_RGB);
    globs();
    activation(s);
    targets(s);
    regularisers(s);
    primal_alone(s);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    return tap_done();
}
