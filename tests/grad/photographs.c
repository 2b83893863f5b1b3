/* SPDX-License-Identifier: Apache-2.0
 *
 * Photographs as targets: exposure, white balance, vignetting and gamma of a camera that
 * nobody has measured. The picture against its definition, the loss against the same made
 * of a quiet picture, its gradient against differences with the same walks, and a room back
 * from two photographs, as far as they determine it. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdbool.h>
#include <string.h>

#define WIDTH  20
#define HEIGHT 16
#define PIXELS (WIDTH * HEIGHT)

static imp_context *ctx;

#define CAMERA(id, x, film)                                                              \
    "<sensor type='perspective' id='" id "'><float name='fov' value='75'/>"              \
    "<transform name='to_world'><lookat origin='" x ",0,1.9' target='0,-.3,0' "          \
    "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='20'/>"    \
    "<integer name='height' value='16'/><rfilter type='box'/>" film "</film></sensor>"
#define ROOM                                                                             \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='5'/></integrator><shape type='cube'><transform name='to_world'><scale "      \
    "value='2'/></transform><boolean name='flip_normals' value='true'/><bsdf "           \
    "type='diffuse' id='wall'><rgb name='reflectance' value='.6,.5,.4'/></bsdf></shape>" \
    "<shape type='sphere'><point name='center' x='.6' y='-1.2' z='0'/><float "           \
    "name='radius' value='.7'/><bsdf type='diffuse' id='paint'><rgb name='reflectance' " \
    "value='.2,.5,.3'/></bsdf></shape><shape type='rectangle'><transform "               \
    "name='to_world'><scale x='.5' y='.5'/><rotate x='1' angle='90'/><translate "        \
    "y='1.9'/></transform><bsdf type='diffuse' id='shade'><rgb name='reflectance' "      \
    "value='.1'/></bsdf><emitter type='area' id='lamp'><rgb name='radiance' "            \
    "value='9,8,7'/></emitter></shape>"
#define NUMBER(name, value) "<float name='" name "' value='" value "'/>"
#define ALL                                                                              \
    NUMBER("exposure", ".3")                                                             \
    NUMBER("white_balance_red", "1.2")                                                   \
    NUMBER("white_balance_blue", ".8")                                                   \
    NUMBER("vignetting_2", "-.3") NUMBER("vignetting_4", ".05")

static struct imp_run run_of(int spp, uint64_t seed, int sensor)
{
    struct imp_run run = IMP_RUN_INIT;
    run.spp = spp;
    run.seed = seed;
    run.sensor = sensor;
    return run;
}

static imp_film *render(imp_scene *s, int spp, uint64_t seed, int sensor)
{
    const struct imp_run run = run_of(spp, seed, sensor);
    imp_film *film;
    test_must(ctx, imp_render(s, &run, &film));
    return film;
}

static double lens_at(int i)
{
    const double x = i % WIDTH + 0.5 - 0.5 * WIDTH, y = i / WIDTH + 0.5 - 0.5 * HEIGHT;
    const double r2 = 4 * (x * x + y * y) / (WIDTH * WIDTH + HEIGHT * HEIGHT);
    return 1 - 0.3 * r2 + 0.05 * r2 * r2;
}

/* Vignetting and radiance vary within a pixel: their covariance there is what a pixel is
 * off, to both sides, by less than the product of their slopes over 12. */
static void picture(enum imp_color_mode mode)
{
    imp_scene *plain = test_scene_text(ctx, ROOM CAMERA("cam", "0", "") "</scene>", mode);
    imp_scene *s = test_scene_text(ctx, ROOM CAMERA("cam", "0", ALL) "</scene>", mode);
    imp_film *a = render(plain, 64, 1, 0), *b = render(s, 64, 1, 0);
    const double balance[3] = {1.2, 1, 0.8};
    double worst = 0, mean = 0;
    for (int i = 0; i < 3 * PIXELS; i++) {
        const double expect =
            0.3 * balance[i % 3] * lens_at(i / 3) * (double)imp_film_mean(a)[i];
        const double off = expect > 1e-4 ? (double)imp_film_mean(b)[i] / expect - 1 : 0;
        worst = fmax(worst, fabs(off));
        mean += off / (3 * PIXELS);
    }
    tap_ok(worst < 1e-2 && fabs(mean) < 5e-4,
           "%s: exposure x balance x vignetting x radiance, to %.1e, on average %.1e",
           mode == IMP_RGB ? "rgb" : "spectral", worst, mean);
    imp_film_destroy(a);
    imp_film_destroy(b);
    imp_scene_destroy(plain);
    imp_scene_destroy(s);
}

/* 1 - r^2 - r^4 is below 0 in the corners: no light arrives there, and its derivative is
 * that of the rest. The mean is linear in both numbers but where a sample is dark on one
 * side of a difference only: one sample in 10,000 or so, whose value is then below h. */
static void dark_corners(void)
{
    imp_scene *s =
        test_scene_text(ctx,
                        ROOM CAMERA("cam", "0",
                                    NUMBER("vignetting_2", "-.99")
                                        NUMBER("vignetting_4", "-.98")) "</scene>",
                        IMP_RGB);
    imp_film *film = render(s, 16, 1, 0);
    const float *mean = imp_film_mean(film);
    const int corner[4] = {0, WIDTH - 1, PIXELS - WIDTH, PIXELS - 1};
    double least = INFINITY, most = 0;
    for (int i = 0; i < 3 * PIXELS; i++) least = fmin(least, (double)mean[i]);
    for (int k = 0; k < 4; k++) most = fmax(most, (double)mean[3 * corner[k]]);
    tap_ok(least == 0 && most == 0 && mean[3 * (PIXELS / 2 + WIDTH / 2)] > 0,
           "vignetting is dark in the corners, and nowhere negative # %g", least);
    imp_film_destroy(film);

    imp_problem *p = test_problem(ctx, s, "cam.vignetting*");
    struct imp_run run = run_of(16, 1, 0);
    double x[2], g[2], worst = 0;
    const double h = 1e-4;
    run.points = IMP_POINTS_INDEPENDENT; /* values and gradients of the same walks */
    test_must(ctx, imp_problem_functional(p, NULL, &run, NULL, g, NULL));
    imp_problem_get_x(p, x);
    for (int k = 0; k < 2; k++) {
        struct imp_estimate up, down;
        const double at = x[k];
        x[k] = at + h;
        test_must(ctx, imp_problem_set_x(p, x));
        test_must(ctx, imp_problem_functional(p, NULL, &run, &up, NULL, NULL));
        x[k] = at - h;
        test_must(ctx, imp_problem_set_x(p, x));
        test_must(ctx, imp_problem_functional(p, NULL, &run, &down, NULL, NULL));
        x[k] = at;
        worst = fmax(worst, fabs((up.value - down.value) / (2 * h) / g[k] - 1));
    }
    tap_ok(g[0] > 0 && g[1] > 0 && worst < 1e-4, "and so are its derivatives # %.1e",
           worst);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* T = (g L)^(1/gamma) of a quiet picture. */
static void photograph(imp_scene *s, int sensor, double gamma, float *out)
{
    imp_film *film = render(s, 4096, 91 + (uint64_t)sensor, sensor);
    for (int i = 0; i < 3 * PIXELS; i++)
        out[i] = powf(imp_film_mean(film)[i], (float)(1 / gamma));
    imp_film_destroy(film);
}

static void loss(void)
{
    imp_scene *s = test_scene_text(
        ctx, ROOM CAMERA("cam", "0", ALL NUMBER("gamma", "1.8")) "</scene>", IMP_RGB);
    imp_problem *p = test_problem(ctx, s, "cam.*");
    const size_t n = imp_problem_n_variables(p);
    float T[3 * PIXELS];
    double x[6], g[6], seen = 0;
    struct tap_stat of = {0};
    for (int i = 0; i < 3 * PIXELS; i++) T[i] = 0.1f + 0.8f * (float)(i * 37 % 101) / 101;
    test_target(ctx, p, 0, WIDTH, HEIGHT, T);
    tap_ok(n == 6, "a camera has six numbers");
    for (uint64_t k = 0; k < 64; k++) {
        const struct imp_run run = run_of(16, 1000 + k, 0);
        struct imp_estimate e;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &e, NULL, NULL));
        tap_add(&of, e.value);
    }
    /* The same of a picture with 64 x 64 samples: its noise adds half its variance. */
    imp_film *film = render(s, 4096, 7, 0);
    for (int i = 0; i < 3 * PIXELS; i++) {
        const double gain = pow((double)T[i], 1 - 1.8), se = (double)imp_film_se(film)[i];
        const double left = gain * (double)imp_film_mean(film)[i] - (double)T[i];
        seen += 0.5 * (left * left - gain * gain * se * se);
    }
    imp_film_destroy(film);
    tap_z(&of, seen, 0.01 * seen, "loss: sum of 1/2 (T^(1 - gamma) M - T)^2");

    const struct imp_run run = run_of(8, 3, 0);
    struct imp_estimate up, down, mid;
    imp_problem_get_x(p, x);
    test_must(ctx, imp_problem_objective(p, x, &run, &mid, g, NULL));
    for (size_t k = 0; k < n; k++) {
        const double h = 1e-4, at = x[k];
        x[k] = at + h;
        test_must(ctx, imp_problem_objective(p, x, &run, &up, NULL, NULL));
        x[k] = at - h;
        test_must(ctx, imp_problem_objective(p, x, &run, &down, NULL, NULL));
        x[k] = at;
        tap_near(g[k], (up.value - down.value) / (2 * h), 1e-6, 0,
                 "gradient against differences of the same walks");
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

/* Two views of unknown exposure and one unknown gamma each: walls and paint come back,
 * since light that has met a wall twice knows its reflectance, and light seen directly
 * knows the exposure. With the lamp unknown too, lamp and exposure are one number. */
static void room(void)
{
    imp_scene *s = test_scene_text(
        ctx,
        ROOM CAMERA("left", "-1", NUMBER("exposure", ".1") NUMBER("gamma", "1.8")) CAMERA(
            "right", "1", NUMBER("exposure", ".15") NUMBER("gamma", "2.4")) "</scene>",
        IMP_RGB);
    static const char *const names[] = {"wall.*", "paint.*", "left.*", "right.*"};
    const double truth[10] = {.6, .5, .4, .2, .5, .3, .1, 1.8, .15, 2.4};
    const double start[10] = {.4, .4, .4, .4, .4, .4, .2, 2.2, .2, 2.2};
    float T[2][3 * PIXELS];
    imp_problem *p;
    photograph(s, 0, 1.8, T[0]);
    photograph(s, 1, 2.4, T[1]);
    test_must(ctx, imp_problem_create(s, &p));
    for (int i = 0; i < 4; i++) test_must(ctx, imp_problem_activate(p, names[i]));
    for (int i = 0; i < 2; i++) test_target(ctx, p, i, WIDTH, HEIGHT, T[i]);
    tap_ok(imp_problem_n_variables(p) == 10,
           "six reflectances, two cameras of two numbers");
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    const struct imp_fit_result *r;
    const struct imp_run run = run_of(256, 5, 0);
    o.optimizer = IMP_LM;
    o.intervals = 1;
    test_must(ctx, imp_problem_set_x(p, start));
    test_must(ctx, imp_fit(p, &o, &run, &r));
    double worst = 0, off = 0, loose = 0;
    for (size_t i = 0; i < r->n; i++) {
        const struct imp_fit_variable *v = &r->variables[i];
        worst = fmax(worst, fabs(v->value - truth[i]) / v->se);
        off = fmax(off, fabs(v->value / truth[i] - 1));
        loose = fmax(loose, v->se / truth[i]);
    }
    tap_ok(worst < 4 && loose < 0.1,
           "a room from two photographs: z %.1f, off by %.1f %%, told %.1f %%", worst,
           100 * off, 100 * loose);

    test_must(ctx, imp_problem_activate(p, "lamp.*"));
    test_must(ctx,
              imp_problem_tie(p, "lamp.*,left.exposure.*,right.exposure.*", IMP_TIE_LOG));
    test_must(ctx, imp_fit(p, &o, &run, &r));
    bool told = r->warning && strstr(r->warning, "do not determine");
    for (int k = 0; k < 2 && told; k++)
        told = strstr(r->warning, k ? "lamp.radiance" : "exposure") != NULL;
    tap_ok(told, "with the lamp unknown: %.120s",
           r->warning ? r->warning : "(no warning)");
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static void refused(const char *xml, enum imp_color_mode mode, const char *words)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *s = NULL;
    imp_film *film;
    const struct imp_run run = run_of(1, 1, 0);
    o.mode = mode;
    enum imp_status st = imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &s);
    if (st == IMP_OK) st = imp_render(s, &run, &film);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), words), "refused: %s",
           imp_last_error(ctx));
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(2);
    picture(IMP_RGB);
    dark_corners();
    picture(IMP_SPECTRAL);
    loss();
    room();
    refused(ROOM CAMERA("cam", "0", NUMBER("white_balance_red", "1.1")) "</scene>",
            IMP_MONO, "red, green and blue");
    refused("<scene version='3.0.0'><integrator type='path'/><sensor "
            "type='perspective'><film type='hdrfilm'><float name='gamma' "
            "value='2.2'/></film></sensor></scene>",
            IMP_RGB, "box filter");
    refused(
        "<scene version='3.0.0'><integrator type='ptracer'/><emitter type='point'/>"
        "<shape type='sphere'/>" CAMERA("cam", "0", NUMBER("exposure", ".5")) "</scene>",
        IMP_RGB, "has an exposure");
    imp_context_destroy(ctx);
    return tap_done();
}
