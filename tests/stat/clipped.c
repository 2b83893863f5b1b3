/* SPDX-License-Identifier: Apache-2.0
 *
 * Clipped targets as censored data. Decisions are those of the rule, losses those of the
 * weights decided. Two photographs of 8 bits of a yard, and of a room, with burnt lights and
 * lenses that distort, of unknown exposure, white balance, vignetting and gamma: the truth is
 * in the intervals; without levels it is not. What they do not determine is said. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <importon/clip.h>
#include <math.h>
#include <stdbool.h>

#define WIDTH  16
#define HEIGHT 12
#define N      (3 * WIDTH * HEIGHT)

static imp_context *ctx;

#define NUMBER(name, value) "<float name='" name "' value='" value "'/>"
#define CAMERA(id, fov, place, film)                                                     \
    "<sensor type='perspective' id='" id                                                 \
    "'>" NUMBER("fov", fov) NUMBER("opencv_k1", "-.1")                                   \
        NUMBER("opencv_k2",                                                              \
               ".02") "<transform name='to_world'><lookat " place                        \
                      " up='0,1,0'/></transform>"                                        \
                      "<film type='hdrfilm'><integer name='width' value='16'/><integer " \
                      "name='height' value='12'/><rfilter type='box'/>" film             \
                      "</film></sensor>"
/* A yard: a ball before two walls, on a floor, under a grey sky. */
#define YARD                                                                             \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='5'/></integrator><emitter type='constant' id='light'><rgb name='radiance' "  \
    "value='.5,.55,.6'/></emitter><shape type='rectangle'><transform name='to_world'>"   \
    "<scale value='2'/><rotate x='1' angle='-90'/></transform><bsdf type='diffuse' "     \
    "id='wall'><rgb name='reflectance' value='.6,.5,.4'/></bsdf></shape>"                \
    "<shape type='rectangle'><transform name='to_world'><scale value='2'/><translate "   \
    "y='1' z='-2'/></transform><ref id='wall'/></shape><shape type='rectangle'>"         \
    "<transform name='to_world'><scale value='2'/><rotate y='1' angle='90'/><translate " \
    "x='-2'/></transform><ref id='wall'/></shape><shape type='sphere'><point "           \
    "name='center' x='.3' y='.7' z='0'/><float name='radius' value='.7'/><bsdf "         \
    "type='diffuse' id='paint'><rgb name='reflectance' "                                 \
    "value='.2,.5,.3'/></bsdf></shape>"
/* A closed room, of which the lamp is seen. */
#define ROOM                                                                             \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='5'/></integrator><shape type='cube'><transform name='to_world'><scale "      \
    "value='2'/></transform><boolean name='flip_normals' value='true'/><bsdf "           \
    "type='diffuse' id='wall'><rgb name='reflectance' value='.6,.5,.4'/></bsdf></shape>" \
    "<shape type='sphere'><point name='center' x='.6' y='-1.2' z='0'/><float "           \
    "name='radius' value='.7'/><bsdf type='diffuse' id='paint'><rgb name='reflectance' " \
    "value='.2,.5,.3'/></bsdf></shape><shape type='rectangle'><transform "               \
    "name='to_world'><scale value='.8'/><rotate x='1' angle='90'/><translate y='1.9'/>"  \
    "</transform><bsdf type='diffuse' id='shade'><rgb name='reflectance' value='.1'/>"   \
    "</bsdf><emitter type='area' id='light'><rgb name='radiance' value='4,3.5,3'/>"      \
    "</emitter></shape>"
#define FILM(exposure, red, blue, falls, gamma)                                          \
    NUMBER("exposure", exposure)                                                         \
    NUMBER("white_balance_red", red)                                                     \
    NUMBER("white_balance_blue", blue)                                                   \
    NUMBER("vignetting_2", falls) NUMBER("gamma", gamma)

enum { NUMBERS = 16 };
/* Walls, paint, and of each camera exposure, red, blue, vignetting, gamma. */
static const struct setting {
    const char *name, *xml;
    double truth[NUMBERS], start[NUMBERS], light[3];
    int spp;
} yard = {"a yard",
          YARD CAMERA("left", "60", "origin='-1,1,4' target='0,.3,0'",
                      FILM("1.6", "1.1", ".9", "-.6", "1.8"))
              CAMERA("right", "60", "origin='1,1,4' target='0,.3,0'",
                     FILM("3", ".95", "1.2", "-.4", "2.4")) "</scene>",
          {.6, .5, .4, .2, .5, .3, 1.6, 1.1, .9, -.6, 1.8, 3, .95, 1.2, -.4, 2.4},
          {.4, .4, .4, .4, .4, .4, 2, 1, 1, 0, 2.2, 2, 1, 1, 0, 2.2},
          {.5, .55, .6},
          64},
  room = {"a closed room",
          ROOM CAMERA("left", "100", "origin='-1,0,1.9' target='0,.3,0'",
                      FILM(".3", "1.1", ".9", "-.6", "1.8"))
              CAMERA("right", "100", "origin='1,0,1.9' target='0,.3,0'",
                     FILM(".5", ".95", "1.2", "-.4", "2.4")) "</scene>",
          {.6, .5, .4, .2, .5, .3, .3, 1.1, .9, -.6, 1.8, .5, .95, 1.2, -.4, 2.4},
          {.4, .4, .4, .4, .4, .4, .4, 1, 1, 0, 2.2, .4, 1, 1, 0, 2.2},
          {4, 3.5, 3},
          256};

static double normal(struct imp_key key, uint32_t i)
{
    const double u = 1 - imp__u01(key, 2 * i), v = imp__u01(key, 2 * i + 1);
    return sqrt(-2 * log(u)) * cos(6.283185307179586 * v);
}

/* A photograph of 8 bits, with a camera's noise. */
static void photograph(imp_scene *s, int sensor, uint64_t seed, double gamma,
                       double noise, float *out)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.spp = 1024;
    run.seed = imp__mix64(91 + 2 * seed + (uint64_t)sensor);
    run.sensor = sensor;
    test_must(ctx, imp_render(s, &run, &film));
    for (uint32_t i = 0; i < N; i++) {
        const double v = pow((double)imp_film_mean(film)[i], 1 / gamma) +
                         noise * normal(imp__key(seed, (uint64_t)sensor, 5), i);
        out[i] = (float)(fmax(0, fmin(255, round(255 * v))) / 255);
    }
    imp_film_destroy(film);
}

enum how { AS_IT_IS, CENSORED, UNLIT };
struct found {
    double worst;  /* z */
    double inside; /* part of the truth that is in its interval */
    struct imp_clipped clipped;
    bool told; /* with the light unknown too: which numbers are one */
};

/* The light times each exposure is all that the photographs know. */
static bool undetermined(imp_problem *p, const struct imp_fit_options *o,
                         const struct imp_run *run)
{
    const struct imp_fit_result *r;
    test_must(ctx, imp_problem_activate(p, "light.*"));
    test_must(
        ctx, imp_problem_tie(p, "light.*,left.exposure.*,right.exposure.*", IMP_TIE_LOG));
    test_must(ctx, imp_fit(p, o, run, &r));
    printf("# %s\n", r->warning ? r->warning : "(no warning)");
    return r->warning && strstr(r->warning, "do not determine") &&
           strstr(r->warning, "light.radiance") && strstr(r->warning, "left.exposure") &&
           strstr(r->warning, "right.exposure");
}

static imp_problem *problem_make(imp_scene *s)
{
    static const char *const names[] = {"wall.*", "paint.*", "left.*", "right.*"};
    imp_problem *p;
    test_must(ctx, imp_problem_create(s, &p));
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        test_must(ctx, imp_problem_activate(p, names[i]));
    return p;
}

static struct found fit(const struct setting *of, imp_scene *s, float T[2][N],
                        enum how how, uint64_t seed)
{
    struct found f = {.clipped = IMP_CLIPPED_INIT};
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    imp_problem *p;
    run.spp = of->spp;
    run.seed = seed;
    o.optimizer = IMP_LM;
    o.intervals = 1;
    p = problem_make(s);
    for (int i = 0; i < 2; i++) {
        test_target(ctx, p, i, WIDTH, HEIGHT, T[i]);
        if (how != AS_IT_IS)
            test_must(ctx, imp_problem_clip(p, i, .5 / 255, 254.5 / 255));
    }
    test_must(ctx, imp_problem_set_x(p, of->start));
    test_must(ctx, imp_fit(p, &o, &run, &r));
    for (size_t i = 0; i < NUMBERS; i++) {
        const struct imp_fit_variable *v = &r->variables[i];
        const double z = (v->value - of->truth[i]) / v->se;
        f.inside +=
            (v->lo95 <= of->truth[i] && of->truth[i] <= v->hi95) / (double)NUMBERS;
        if (!(fabs(z) <= f.worst)) f.worst = fabs(z);
    }
    test_must(ctx, imp_problem_get_clipped(p, &f.clipped));
    if (how == UNLIT) {
        size_t k;
        f.told = undetermined(p, &o, &run);
        test_must(ctx, imp_scene_find_param(s, "light.radiance.value", &k));
        test_must(ctx, imp_scene_set_values(s, k, 3, of->light));
    }
    imp_problem_destroy(p);
    p = problem_make(s); /* the truth again, for the next photograph */
    test_must(ctx, imp_problem_set_x(p, of->truth));
    imp_problem_destroy(p);
    return f;
}

static void photographs(const struct setting *of, int seeds, bool all)
{
    imp_scene *s = test_scene_text(ctx, of->xml, IMP_RGB);
    static float T[2][N];
    struct tap_stat inside = {0};
    for (int seed = 1; seed <= seeds; seed++) {
        for (int i = 0; i < 2; i++)
            photograph(s, i, (uint64_t)seed, i ? 2.4 : 1.8, .01, T[i]);
        const struct found f =
            fit(of, s, T, seed == 1 && all ? UNLIT : CENSORED, (uint64_t)seed);
        tap_add(&inside, f.inside);
        if (seed > 1) continue;
        tap_ok(f.worst < 4 && f.clipped.clipped > 20 && f.clipped.against == 0,
               "%s from photographs of 8 bits: the truth is in the intervals # worst z "
               "%.1f; %zu of %zu clipped, %zu without weight",
               of->name, f.worst, f.clipped.clipped, f.clipped.numbers, f.clipped.silent);
        if (all)
            tap_ok(f.told, "with the light unknown, it and the exposures are one number");
        const struct found plain = fit(of, s, T, AS_IT_IS, (uint64_t)seed);
        tap_ok(plain.worst > 6, "white taken at its word: it is not # worst z %.1f",
               plain.worst);
    }
    if (seeds > 1)
        tap_ok(fabs(inside.mean - 0.95) < 3 * tap_se(&inside) && tap_se(&inside) < 0.015,
               "intervals hold %.1f +- %.1f %% of the truths", 100 * inside.mean,
               100 * tap_se(&inside));
    imp_scene_destroy(s);
}

/* ---- Decisions ------------------------------------------------------------------ */

/* A sky alone: each sample of a pixel is its radiance. */
#define SKY(film)                                                                        \
    "<scene version='3.0.0'><integrator type='path'/><emitter type='constant' "          \
    "id='light'><rgb name='radiance' value='.8,.5,.2'/></emitter><sensor "               \
    "type='perspective' id='cam'><film type='hdrfilm'><integer name='width' value='3'/>" \
    "<integer name='height' value='1'/><rfilter type='box'/>" film                       \
    "</film></sensor></scene>"

static void decisions(void)
{
    imp_scene *s = test_scene_text(ctx, SKY(""), IMP_RGB);
    imp_problem *p = test_problem(ctx, s, "light.*");
    /* Levels .3 and .7: red is above, green between, blue below. */
    const float T[9] = {.7f, .7f, .3f, .6f, .45f, 1, .55f, .3f, .1f};
    /* What counts, as its level if it was clipped; 0: no weight. */
    const double as[9] = {0, .7, 0, .6, .45, .7, .55, .3, 0};
    const double L[3] = {.8, .5, .2};
    struct imp_target t = IMP_TARGET_INIT;
    struct imp_clipped c = IMP_CLIPPED_INIT;
    struct imp_estimate e;
    struct imp_run run = IMP_RUN_INIT;
    double g[3], loss[2] = {0}, slope[3] = {0};
    t.width = 3;
    t.height = 1;
    t.channels = 3;
    t.pixels = T;
    run.spp = 4;
    test_must(ctx, imp_problem_add_target(p, &t));
    test_must(ctx, imp_problem_clip(p, 0, .3, .7));
    for (int i = 0; i < 9; i++) {
        const double v = (double)T[i], r = L[i % 3] - v;
        if (v > (double).3f && v < (double).7f) loss[0] += 0.5 * r * r;
        if (as[i] == 0) continue;
        loss[1] += 0.5 * (L[i % 3] - as[i]) * (L[i % 3] - as[i]);
        slope[i % 3] += L[i % 3] - as[i];
    }
    test_must(ctx, imp_problem_objective(p, NULL, &run, &e, NULL, NULL));
    tap_near(e.value, loss[0], 1e-6, 0, "before a decision clipped numbers say nothing");
    test_must(ctx, imp_problem_censor(p, &run));
    test_must(ctx, imp_problem_objective(p, NULL, &run, &e, g, NULL));
    tap_near(e.value, loss[1], 1e-6, 0, "then they count where the scene disagrees");
    for (int i = 0; i < 3; i++)
        tap_near(g[i], slope[i], 1e-5, 1e-7, "and so does the slope");
    test_must(ctx, imp_problem_get_clipped(p, &c));
    tap_ok(c.numbers == 9 && c.clipped == 6 && c.silent == 3 && c.against == 3,
           "numbers %zu, clipped %zu, silent %zu, against %zu", c.numbers, c.clipped,
           c.silent, c.against);
    tap_ok(imp_problem_clip(p, 1, 0, 1) == IMP_E_ARG &&
               imp_problem_clip(p, 0, 0, 1) == IMP_E_ARG,
           "refused: %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* The weights stand, so differences of losses with the same walks are the gradient. */
static void gradients(void)
{
    imp_scene *s = test_scene_text(ctx, yard.xml, IMP_RGB);
    imp_problem *p = test_problem(ctx, s, "*wall*");
    static float T[N];
    struct imp_run run = IMP_RUN_INIT;
    double x[8], g[8];
    test_must(ctx, imp_problem_activate(p, "left.*"));
    const size_t n = imp_problem_n_variables(p);
    photograph(s, 0, 1, 1.8, .01, T);
    test_target(ctx, p, 0, WIDTH, HEIGHT, T);
    test_must(ctx, imp_problem_clip(p, 0, .5 / 255, 254.5 / 255));
    run.spp = 8;
    test_must(ctx, imp_problem_censor(p, &run));
    test_must(ctx, imp_problem_objective(p, NULL, &run, NULL, g, NULL));
    imp_problem_get_x(p, x);
    tap_ok(n == 8, "walls and a camera");
    for (size_t k = 0; k < n; k++) {
        struct imp_estimate up, down;
        const double h = 3e-6, at = x[k];
        x[k] = at + h;
        test_must(ctx, imp_problem_objective(p, x, &run, &up, NULL, NULL));
        x[k] = at - h;
        test_must(ctx, imp_problem_objective(p, x, &run, &down, NULL, NULL));
        x[k] = at;
        tap_near(g[k], (up.value - down.value) / (2 * h), 1e-6, 0,
                 "gradient of the weights decided, against differences");
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* A grey wall tells nothing of gamma, as the exposure follows it: one gamma is as good as
 * another, also than that of the noisy picture that decided. What is left of the loss is of
 * second order in that picture's variance, .0005; terms of first order would be .008 at 1.9. The curtain lets four of five
 * walks through. */
#define GREY                                                                             \
    "<scene version='3.0.0'><integrator type='path'/><emitter type='constant' "          \
    "id='light'><rgb name='radiance' value='.5'/></emitter><shape type='rectangle'>"     \
    "<transform name='to_world'><scale value='9'/><translate z='-1'/></transform><bsdf " \
    "type='mask'><float name='opacity' value='.2'/><bsdf type='diffuse'><rgb "           \
    "name='reflectance' value='0'/></bsdf></bsdf></shape><sensor type='perspective' "    \
    "id='cam'><transform name='to_world'><lookat origin='0,0,1' target='0,0,0' "         \
    "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='16'/>"    \
    "<integer name='height' value='12'/><rfilter type='box'/>" NUMBER("exposure", "1")   \
        NUMBER("gamma", "2.2") "</film></sensor></scene>"

/* Of one channel, luminance is what is seen. */
static void grey_wall(int channels)
{
    imp_scene *s = test_scene_text(ctx, GREY, IMP_RGB);
    imp_problem *p = test_problem(ctx, s, "cam.*");
    const double V = 0.6, mean = 0.8 * 0.5;
    static float T[N];
    struct imp_run run = IMP_RUN_INIT;
    for (size_t i = 0; i < N; i++) T[i] = (float)V;
    struct imp_target t = IMP_TARGET_INIT;
    t.width = WIDTH;
    t.height = HEIGHT;
    t.channels = channels;
    t.pixels = T;
    test_must(ctx, imp_problem_add_target(p, &t));
    test_must(ctx, imp_problem_clip(p, 0, .5 / 255, 254.5 / 255));
    tap_ok(imp_problem_n_variables(p) == 2, "exposure and gamma");
    test_must(ctx, imp_problem_set_x(p, (double[]){pow(V, 2.2) / mean, 2.2}));
    run.spp = 16;
    test_must(ctx, imp_problem_censor(p, &run));
    run.spp = 4096;
    for (int k = 0; k < 3; k++) {
        const double gamma = 2.2 - 0.3 * k;
        struct imp_estimate e;
        test_must(ctx, imp_problem_objective(p, (double[]){pow(V, gamma) / mean, gamma},
                                             &run, &e, NULL, NULL));
        tap_ok(fabs(e.value) < 0.001 && e.se < 0.0002,
               "a grey wall of %d channels, decided at 2.2, loss at gamma %.1f # %.5f +- "
               "%.5f",
               channels, gamma, e.value, e.se);
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    const bool all = argc > 1 && strcmp(argv[1], "long") == 0;
    ctx = test_context(2);
    decisions();
    gradients();
    grey_wall(3);
    grey_wall(1);
    photographs(&yard, all ? 140 : 1, all);
    if (all) photographs(&room, 1, all);
    imp_context_destroy(ctx);
    return tap_done();
}
