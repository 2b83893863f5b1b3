/* SPDX-License-Identifier: Apache-2.0
 *
 * Tied numbers: gradients, Jacobians and tangents against the chain rule applied to those
 * of the numbers by themselves, from the same walks; standard errors against the spread of
 * seeds; fits of tied numbers; what cannot be tied. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdbool.h>
#include <string.h>

static imp_context *ctx;

static struct imp_run run_of(int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = spp;
    run.seed = seed;
    return run;
}

static imp_scene *box(void) { return test_scene(ctx, "cornell.xml", IMP_RGB, "res=12"); }

/* A flat grey target at twice the box's brightness. */
static void aim(imp_problem *p, float *pixels, int n, float level)
{
    struct imp_target t = IMP_TARGET_INIT;
    for (int i = 0; i < n * n * 3; i++) pixels[i] = level * (1 + (float)(i % 7) / 7);
    t.width = t.height = n;
    t.channels = 3;
    t.pixels = pixels;
    test_must(ctx, imp_problem_add_target(p, &t));
}

/* white = red = green; lamp's colour keeps, its power moves; lamp's reflectance by logs:
 * 3 + 1 + 3 numbers. */
static imp_problem *tied(imp_scene *s)
{
    imp_problem *p = test_problem(ctx, s, "*");
    test_must(ctx, imp_problem_tie(p, "white.*", IMP_TIE_LOG));
    test_must(ctx, imp_problem_tie(p, "light.*", IMP_TIE_FACTOR));
    test_must(ctx, imp_problem_tie(p, "light.*", IMP_TIE_LOG));
    test_must(ctx, imp_problem_tie(p, "red.*,green.*", IMP_TIE_SAME));
    return p;
}

/* g of numbers one by one, into x's of the ties; `each` has the order of the scene: white,
 * red, green, lamp, light. */
static void chain(const double *each, const double *theta, int stride, double *out)
{
    for (int c = 0; c < stride; c++) {
        for (int k = 0; k < 3; k++) {
            out[k * stride + c] = theta[k] * each[k * stride + c];
            out[(3 + k) * stride + c] =
                each[(3 + k) * stride + c] + each[(6 + k) * stride + c];
            out[(6 + k) * stride + c] = each[(9 + k) * stride + c];
        }
        out[9 * stride + c] = 0;
        for (int k = 0; k < 3; k++)
            out[9 * stride + c] += theta[12 + k] * each[(12 + k) * stride + c];
    }
}

static double apart(const double *a, const double *b, size_t n)
{
    double worst = 0, size = 0;
    for (size_t i = 0; i < n; i++) {
        worst = fmax(worst, fabs(a[i] - b[i]));
        size = fmax(size, fabs(b[i]));
    }
    return worst / size;
}

static void chain_rule(void)
{
    imp_scene *s = box();
    float pixels[12 * 12 * 3];
    imp_problem *p = tied(s), *q = test_problem(ctx, s, "*");
    const struct imp_run run = run_of(8, 5);
    double theta[15], x[10], g[10], se[10], each[15], want[10];
    aim(p, pixels, 12, 0.3f);
    aim(q, pixels, 12, 0.3f);
    tap_ok(imp_problem_n_variables(p) == 10, "ties: 15 numbers are 10");
    imp_problem_get_x(q, theta);
    imp_problem_get_x(p, x);
    double wrong = 0;
    for (int k = 0; k < 3; k++) {
        wrong = fmax(wrong, fabs(x[k] - log(theta[k])));
        wrong = fmax(wrong, fabs(x[3 + k] - theta[3 + k]));
        wrong = fmax(wrong, fabs(theta[6 + k] - theta[3 + k]));
    }
    tap_ok(wrong == 0 && x[9] == 0, "x: logarithms, the first's values, factor 1");

    struct imp_estimate a, b;
    test_must(ctx, imp_problem_objective(p, x, &run, &a, g, se));
    test_must(ctx, imp_problem_objective(q, NULL, &run, &b, each, NULL));
    chain(each, theta, 1, want);
    tap_ok(fabs(a.value - b.value) <= 1e-12 * b.value, "loss: that without ties");
    tap_ok(apart(g, want, 10) < 1e-12, "gradient: the chain rule, to %.1e",
           apart(g, want, 10));

    imp_film *films[15], *tied_films[10], *forward;
    test_must(ctx, imp_problem_jacobian(q, &run, NULL, films));
    test_must(ctx, imp_problem_jacobian(p, &run, NULL, tied_films));
    double worst = 0, size = 0, dot[10];
    for (int k = 0; k < 10; k++) dot[k] = 0.3 + 0.1 * k;
    test_must(ctx, imp_problem_forward(p, dot, &run, &forward));
    double along = 0;
    for (size_t i = 0; i < 12 * 12 * 3; i++) {
        double sum = 0;
        for (int k = 0; k < 15; k++) each[k] = (double)imp_film_mean(films[k])[i];
        chain(each, theta, 1, want);
        for (int k = 0; k < 10; k++) {
            worst = fmax(worst, fabs(want[k] - (double)imp_film_mean(tied_films[k])[i]));
            size = fmax(size, fabs(want[k]));
            sum += dot[k] * want[k];
        }
        along = fmax(along, fabs(sum - (double)imp_film_mean(forward)[i]));
    }
    tap_ok(worst < 1e-6 * size, "derivative pictures: the chain rule, to %.1e",
           worst / size);
    tap_ok(along < 3e-6 * size, "forward: their sum, to %.1e", along / size);
    for (int k = 0; k < 15; k++) imp_film_destroy(films[k]);
    for (int k = 0; k < 10; k++) imp_film_destroy(tied_films[k]);
    imp_film_destroy(forward);

    struct imp_tie_info info = IMP_TIE_INFO_INIT;
    test_must(ctx, imp_problem_get_tie(p, 9, &info));
    tap_ok(info.factor && info.log && info.count == 1 && info.n_members == 1 &&
               !strcmp(info.name, "factor(light.*)"),
           "number 9 is the logarithm of a factor, %s", info.name);
    test_must(ctx, imp_problem_get_tie(p, 4, &info));
    tap_ok(!info.factor && !info.log && info.n_members == 2 &&
               !strcmp(info.members[0], "red.reflectance.value") &&
               !strcmp(info.members[1], "green.reflectance.value"),
           "number 4 moves red and green");

    x[9] = log(2), x[0] = log(0.5), x[3] = 0.25;
    test_must(ctx, imp_problem_set_x(p, x));
    double moved[15], again[10];
    imp_problem_get_x(q, moved);
    imp_problem_get_x(p, again);
    tap_ok(apart(again, x, 10) < 1e-15 && fabs(moved[12] - 2 * theta[12]) < 1e-12 &&
               fabs(moved[0] - 0.5) < 1e-15 && moved[3] == 0.25 && moved[6] == 0.25,
           "x goes to all that follow it, and comes back");
    imp_problem_destroy(p);
    imp_problem_destroy(q);
    imp_scene_destroy(s);
}

/* A common factor of three numbers has no error that theirs would give without their
 * covariance: the spread of seeds decides. */
static void errors(void)
{
    enum { SEEDS = 100 };
    imp_scene *s = box();
    float pixels[12 * 12 * 3];
    imp_problem *p = tied(s);
    struct tap_stat of[10] = {{0}};
    double told[10] = {0}, low = 1e9, high = 0;
    aim(p, pixels, 12, 0.3f);
    for (int i = 0; i < SEEDS; i++) {
        const struct imp_run run = run_of(8, 100 + (uint64_t)i);
        struct imp_estimate f;
        double g[10], se[10];
        test_must(ctx, imp_problem_objective(p, NULL, &run, &f, g, se));
        for (int k = 0; k < 10; k++) {
            tap_add(&of[k], g[k]);
            told[k] += se[k] * se[k] / SEEDS;
        }
    }
    for (int k = 0; k < 10; k++) {
        const double ratio = sqrt(told[k] / SEEDS) / tap_se(&of[k]);
        low = fmin(low, ratio), high = fmax(high, ratio);
    }
    tap_ok(low > 0.75 && high < 1.3, "errors told / spread of %d seeds: %.2f to %.2f",
           SEEDS, low, high);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* More numbers than arrays hold: 12,288 texels and their factor, in fixed point. */
static void textures(void)
{
    imp_scene *s = test_scene(ctx, "textured.xml", IMP_RGB, NULL);
    imp_problem *q = test_problem(ctx, s, "floor.*"),
                *p = test_problem(ctx, s, "floor.*"),
                *r = test_problem(ctx, s, "floor.*");
    const size_t n = imp_problem_n_variables(q);
    const struct imp_run run = run_of(2, 5);
    double *theta = malloc(3 * n * sizeof *theta), *each = theta + n, *logs = each + n;
    double one, sum = 0, worst = 0, size = 0;
    test_must(ctx, imp_problem_tie(p, "*", IMP_TIE_FACTOR));
    test_must(ctx, imp_problem_tie(r, "*", IMP_TIE_LOG));
    imp_problem_get_x(q, theta);
    test_must(ctx, imp_problem_functional(q, NULL, &run, NULL, each, NULL));
    test_must(ctx, imp_problem_functional(p, NULL, &run, NULL, &one, NULL));
    test_must(ctx, imp_problem_functional(r, NULL, &run, NULL, logs, NULL));
    for (size_t i = 0; i < n; i++) {
        sum += theta[i] * each[i];
        worst = fmax(worst, fabs(logs[i] - theta[i] * each[i]));
        size = fmax(size, fabs(logs[i]));
    }
    tap_near(one, sum, 1e-9, 0, "factor of 12,288 texels");
    tap_ok(worst < 1e-9 * size, "logarithms of 12,288 texels: to %.1e", worst / size);
    free(theta);
    imp_problem_destroy(p);
    imp_problem_destroy(q);
    imp_problem_destroy(r);
    imp_scene_destroy(s);
}

/* Back from a picture of the answer, with intervals. */
static void fits(void)
{
    imp_scene *s = box();
    imp_problem *p = tied(s);
    const double answer[10] = {log(0.6), log(0.5), log(0.7), 0.3, 0.35,
                               0.15,     0.5,      0.6,      0.7, log(1.4)};
    const double truth[10] = {0.6, 0.5, 0.7, 0.3, 0.35, 0.15, 0.5, 0.6, 0.7, 1.4};
    double x[10];
    imp_problem_get_x(p, x);
    test_must(ctx, imp_problem_set_x(p, answer));
    struct imp_run run = run_of(1024, 77);
    imp_film *film;
    test_must(ctx, imp_render(s, &run, &film));
    struct imp_target t = IMP_TARGET_INIT;
    t.width = t.height = 12;
    t.channels = 3;
    t.pixels = imp_film_mean(film);
    t.noise_se = imp_film_se(film);
    test_must(ctx, imp_problem_add_target(p, &t));
    test_must(ctx, imp_problem_set_x(p, x));
    for (int k = 0; k < 2; k++) {
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        const struct imp_fit_result *r;
        o.optimizer = k ? IMP_LBFGS : IMP_LM;
        o.intervals = 1;
        run = run_of(64, 5);
        test_must(ctx, imp_problem_set_x(p, x));
        test_must(ctx, imp_fit(p, &o, &run, &r));
        int met = 0, positive = 1, ordered = 1;
        double worst = 0;
        for (int i = 0; i < 10; i++) {
            const struct imp_fit_variable *v = &r->variables[i];
            const bool lamp = i >= 6 && i < 9; /* barely seen */
            if (!lamp) worst = fmax(worst, fabs(v->value - truth[i]) / v->se);
            met += lamp || (v->lo95 <= truth[i] && truth[i] <= v->hi95);
            positive &= i >= 3 && i < 9 ? 1 : v->lo95 > 0;
            ordered &= !(v->lo95 > v->value) && !(v->hi95 < v->value);
        }
        tap_ok(worst < 4 && met >= 8 && positive && ordered,
               "%s: %d of 10 in their intervals, worst z %.1f", k ? "L-BFGS" : "LM", met,
               worst);
        double off = 0;
        for (size_t i = 0; r->covariance && i < r->n; i++)
            if (isfinite(r->variables[i].se) && r->covariance[i * r->n + i] > 0)
                off = fmax(
                    off,
                    fabs(sqrt(r->covariance[i * r->n + i]) / r->variables[i].se - 1));
        tap_ok(r->covariance && off < 1e-9, "%s: covariance and errors agree",
               k ? "L-BFGS" : "LM");
    }
    imp_film_destroy(film);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Checks see the numbers one by one, and leave the ties as they were. */
static void checks(void)
{
    imp_scene *s = box();
    imp_problem *p = tied(s);
    struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
    const struct imp_run run = run_of(4, 5);
    const struct imp_check_row *rows;
    size_t n_rows, ok = 0;
    o.draws_s = 0.02;
    o.paths = 100;
    o.fresh_spp = 16;
    test_must(ctx, imp_check(p, &o, &run, &rows, &n_rows));
    for (size_t i = 0; i < n_rows; i++) ok += rows[i].ok != 0;
    tap_ok(n_rows > 15 && ok == n_rows && imp_problem_n_variables(p) == 10,
           "check: %zu of %zu rows, and still 10 numbers", ok, n_rows);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void refuses(imp_problem *p, const char *glob, enum imp_tie kind,
                    enum imp_status want, const char *words)
{
    const size_t n = imp_problem_n_variables(p);
    const enum imp_status st = imp_problem_tie(p, glob, kind);
    tap_ok(st == want && strstr(imp_last_error(ctx), words) &&
               imp_problem_n_variables(p) == n,
           "refused: %s", imp_last_error(ctx));
}

static void refusals(void)
{
    imp_scene *s = box();
    imp_problem *p = test_problem(ctx, s, "*");
    refuses(p, "none*", IMP_TIE_SAME, IMP_E_ARG, "no active parameter");
    refuses(p, "red.*", IMP_TIE_SAME, IMP_E_ARG, "alone");
    refuses(p, "*", (enum imp_tie)7, IMP_E_ARG, "does not exist");
    test_must(ctx, imp_problem_tie(p, "red.*,green.*", IMP_TIE_SAME));
    refuses(p, "red.*", IMP_TIE_FACTOR, IMP_E_ARG, "tied already");
    refuses(p, "red.*", IMP_TIE_LOG, IMP_E_ARG, "both have logarithms");
    const double none[3] = {0, 0, 0};
    size_t white;
    test_must(ctx, imp_scene_find_param(s, "white.reflectance.value", &white));
    test_must(ctx, imp_scene_set_values(s, white, 3, none));
    refuses(p, "white.*", IMP_TIE_LOG, IMP_E_ARG, "has no logarithm");
    refuses(p, "white.*", IMP_TIE_FACTOR, IMP_E_ARG, "is zero");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    s = test_scene(ctx, "textured.xml", IMP_RGB, NULL);
    p = test_problem(ctx, s, "*");
    refuses(p, "*.reflectance.*", IMP_TIE_SAME, IMP_E_ARG, "12288 and 3 numbers");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(2);
    chain_rule();
    errors();
    textures();
    fits();
    checks();
    refusals();
    imp_context_destroy(ctx);
    return tap_done();
}
