/* SPDX-License-Identifier: Apache-2.0
 *
 * Fits by light walks, and from both ends, with Gauss-Newton matrices: J^T J and
 * the gradient are those of walks from the sensor, and intervals hold the truth as often as
 * they say. */
#include "imp_light_room.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/gauss/gauss_newton.h"
#include "inverse/problem/problem.h"

static imp_context *ctx;

static const char room[] =
    "<scene version='3.0.0'><integrator type='bdpt'><integer "
    "name='max_depth' "
    "value='4'/></integrator><shape type='cube'>" AT(
        "<scale value='2'/>") "<boolean name='flip_normals' value='true'/><bsdf "
                              "type='diffuse' id='wall'><float "
                              "name='reflectance' "
                              "value='.6'/></bsdf></shape><shape "
                              "type='rectangle'>" AT(
                                  "<scale x='.6' y='.6'/><rotate "
                                  "x='1' angle='90'/><translate "
                                  "y='1.95'/>") "<bsdf type='diffuse' "
                                                "id='frame'><float "
                                                "name='reflectance' "
                                                "value='.2'/></bsdf>"
                                                "<emitter type='area' "
                                                "id='lamp'><float "
                                                "name='radiance' "
                                                "value='4'/></"
                                                "emitter></"
                                                "shape>" BALL(
                                                    "0,-1,0",
                                                    "<bsdf "
                                                    "type='diffuse' "
                                                    "id='ball'><float "
                                                    "name='"
                                                    "reflectance' "
                                                    "value='.4'/>"
                                                    "</bsdf>") "<senso"
                                                               "r "
                                                               "type='"
                                                               "perspe"
                                                               "ctive'"
                                                               "><"
                                                               "float "
                                                               "name='"
                                                               "fov' "
                                                               "value="
                                                               "'70'/"
                                                               ">" AT("<lookat "
                                                                      "origin='0,0,"
                                                                      "1.9' "
                                                                      "target='0,0,"
                                                                      "0' "
                                                                      "up='0,1,0'/"
                                                                      ">") "<film "
                                                                           "type='"
                                                                           "hdrfilm"
                                                                           "'><"
                                                                           "integer"
                                                                           " name='"
                                                                           "width' "
                                                                           "value='"
                                                                           "6'/"
                                                                           "><"
                                                                           "integer"
                                                                           " name='"
                                                                           "height'"
                                                                           " "
                                                                           "value='"
                                                                           "5'/"
                                                                           "><"
                                                                           "rfilter"
                                                                           " type='"
                                                                           "%s'/></"
                                                                           "film></"
                                                                           "sensor>"
                                                                           "</"
                                                                           "scene>";

static const char *const fitted[] = {"wall.reflectance.value", "ball.reflectance.value"};
static const double truth[] = {.6, .4};

static imp_problem *problem_of(imp_scene *scene)
{
    imp_problem *p = test_problem(ctx, scene, fitted[0]);
    test_must(ctx, imp_problem_activate(p, fitted[1]));
    return p;
}

/* A target: by walks from the sensor, whose noise is independent from pixel to pixel, as
 * intervals take it. */
static imp_film *picture(imp_scene *scene, uint64_t seed, int spp)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.seed = seed;
    run.spp = spp;
    run.from = IMP_FROM_SENSOR;
    test_must(ctx, imp_render(scene, &run, &film));
    return film;
}

static void target_set(imp_problem *p, const float *pixels, const float *se,
                       enum imp_loss loss)
{
    struct imp_target t = IMP_TARGET_INIT;
    t.pixels = pixels;
    t.noise_se = se;
    t.width = 6;
    t.height = 5;
    t.channels = 1;
    t.loss = loss;
    t.epsilon = .05;
    test_must(ctx, imp_problem_add_target(p, &t));
}

/* J^T J, the gradient and the objective against those of walks from the sensor, as means
 * over seeds. */
static void matrices(const char *filter, enum imp_from by, const char *name, int spp)
{
    enum { SEEDS = 16, NUMBERS = 6 };
    char xml[4096];
    float target[30];
    snprintf(xml, sizeof xml, room, filter);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    for (int k = 0; k < 30; k++) target[k] = .2f + .01f * (float)(k % 7);
    imp_problem *p = problem_of(scene);
    target_set(p, target, NULL, IMP_LOSS_L2);
    struct tap_stat s[2][NUMBERS] = {{{0, 0, 0}}};
    double ratio = 0;
    for (int from = 0; from < 2; from++)
        for (int k = 0; k < SEEDS; k++) {
            double H[4], g[2], g_se[2];
            struct imp_run run = IMP_RUN_INIT;
            struct imp__gauss_newton out = {.H = H, .g = g, .g_se = g_se};
            run.from = from ? by : IMP_FROM_SENSOR;
            run.spp = from ? spp : 64;
            run.seed = 100 + (uint64_t)k;
            test_must(ctx, imp__gauss_newton(p, NULL, &run, &out));
            const double x[NUMBERS] = {H[0], H[1], H[3], g[0], g[1], out.objective.value};
            for (int i = 0; i < NUMBERS; i++) tap_add(&s[from][i], x[i]);
            ratio += from ? g_se[0] * g_se[0] / SEEDS : 0;
        }
    static const char *const names[NUMBERS] = {"J1.J1", "J1.J2", "J2.J2",
                                               "g1",    "g2",    "the loss"};
    for (int i = 0; i < NUMBERS; i++) {
        const double a = tap_se(&s[0][i]), b = tap_se(&s[1][i]);
        const double z = (s[0][i].mean - s[1][i].mean) / hypot(a, b);
        tap_ok(fabs(z) < 4 && hypot(a, b) < .1 * fabs(s[0][i].mean),
               "%s filter: %s from the sensor and from %s # %.5g and %.5g, z %.2f",
               filter, names[i], name, s[0][i].mean, s[1][i].mean, z);
    }
    ratio /= s[1][3].m2 / (SEEDS - 1);
    tap_ok(ratio > .5 && ratio < 2.2,
           "%s filter, %s: variance of g1 told over seen # %.2f", filter, name, ratio);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

/* What intervals of both numbers did over fits. */
struct covered {
    double held[2], square[2]; /* that hold the truth; the sum of z^2 */
    double widest;
    int none; /* numbers without an interval */
};

/* told: is the noise of the targets? */
static struct covered cover(int fits, enum imp_from from, int spp, bool told)
{
    char xml[4096];
    struct covered c = {0};
    snprintf(xml, sizeof xml, room, "box");
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    for (int k = 0; k < fits; k++) {
        for (size_t i = 0; i < 2; i++) {
            size_t index;
            test_must(ctx, imp_scene_find_param(scene, fitted[i], &index));
            test_must(ctx, imp_scene_set_values(scene, index, 1, &truth[i]));
        }
        imp_film *film = picture(scene, 5000 + (uint64_t)k, 100);
        imp_problem *p = problem_of(scene);
        target_set(p, imp_film_mean(film), told ? imp_film_se(film) : NULL, IMP_LOSS_L2);
        struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        const struct imp_fit_result *r;
        double x[2] = {.5, .5};
        test_must(ctx, imp_problem_set_x(p, x));
        o.optimizer = IMP_LM;
        o.intervals = 1;
        o.max_iterations = 8;
        run.from = from;
        run.spp = spp;
        run.seed = 9000 + (uint64_t)k;
        test_must(ctx, imp_fit(p, &o, &run, &r));
        for (size_t i = 0; i < 2; i++) {
            const struct imp_fit_variable v = r->variables[i];
            if (!(v.se > 0)) {
                c.none++;
                continue;
            }
            c.square[i] += imp__sqr((v.value - truth[i]) / v.se);
            c.held[i] += v.lo95 <= truth[i] && truth[i] <= v.hi95;
            c.widest = fmax(c.widest, v.se);
        }
        imp_problem_destroy(p);
        imp_film_destroy(film);
    }
    imp_scene_destroy(scene);
    return c;
}

/* The target's noise is told: few of the 30 pixels say what the ball reflects, and with squared
 * residuals of so few in its place intervals of fits from the sensor are too short (`unknown`). */
static void coverage(int fits, enum imp_from from, const char *name, int spp)
{
    const struct covered c = cover(fits, from, spp, true);
    /* 95 % of n, within 3.5 standard deviations of the binomial; both numbers of a fit
     * count, though they are not quite independent. */
    const double n = 2. * fits, expected = .95 * n, sd = sqrt(.95 * .05 * n);
    const double held = c.held[0] + c.held[1], square = (c.square[0] + c.square[1]) / n;
    tap_ok(c.none == 0 && held >= expected - 3.5 * sd && square > .6 && square < 1.5,
           "%d fits from %s: %g of %g intervals hold the truth, mean z^2 %.2f # "
           "errors up to %.3f",
           fits, name, held, n, square, c.widest);
}

/* Expects nothing: what docs/fitting.md says of targets whose noise is not known. */
static void unknown(int fits, enum imp_from from, const char *name, int spp)
{
    for (int told = 0; told < 2; told++) {
        const struct covered c = cover(fits, from, spp, told);
        for (int i = 0; i < 2; i++)
            printf("# %d fits from %s, %s noise_se, %s: %.1f %% of the intervals hold "
                   "the truth, mean z^2 %.2f\n",
                   fits, name, told ? "with" : "without", fitted[i],
                   100 * c.held[i] / fits, c.square[i] / fits);
        fflush(stdout);
    }
}

/* Of a loss that is not quadratic, few walks a pixel are a bias, which is refused. */
static void refused(enum imp_from from, const char *name)
{
    char xml[4096];
    float target[30];
    snprintf(xml, sizeof xml, room, "box");
    imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
    for (int k = 0; k < 30; k++) target[k] = .2f;
    imp_problem *p = problem_of(scene);
    target_set(p, target, NULL, IMP_LOSS_LOG);
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    o.optimizer = IMP_LM;
    run.from = from;
    const enum imp_status st = imp_fit(p, &o, &run, &r);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "quadratic"),
           "the log loss is refused from %s # %s", name, imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    const bool slow = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(2);
    static const char lights[] = "the lights", both[] = "both ends";
    if (argc > 1 && strcmp(argv[1], "unknown") == 0) {
        unknown(400, IMP_FROM_SENSOR, "the sensor", 100);
        unknown(400, IMP_FROM_LIGHTS, lights, 300);
        unknown(400, IMP_FROM_SCENE, both, 100);
        imp_context_destroy(ctx);
        return tap_done();
    }
    matrices("box", IMP_FROM_LIGHTS, lights, 256);
    if (slow) matrices("gaussian", IMP_FROM_LIGHTS, lights, 256);
    if (slow) matrices("box", IMP_FROM_SCENE, both, 64);
    matrices("gaussian", IMP_FROM_SCENE, both, 64);
    coverage(slow ? 400 : 24, IMP_FROM_LIGHTS, lights, 300);
    coverage(slow ? 400 : 12, IMP_FROM_SCENE, both, 100);
    refused(IMP_FROM_LIGHTS, lights);
    refused(IMP_FROM_SCENE, both);
    imp_context_destroy(ctx);
    return tap_done();
}
