/* SPDX-License-Identifier: Apache-2.0
 *
 * Lights and cameras inside media: transmittance to lights of each kind and single
 * scattering of their light, against closed forms and quadrature; through null, smooth and
 * rough boundaries; a walk that nothing ends. */
#include "media_kit.h"
#include "vol_write.h"

static imp_context *ctx;

#define FILM                                                                             \
    "<film type='hdrfilm'><integer name='width' value='4'/>"                             \
    "<integer name='height' value='4'/><rfilter type='box'/></film>"
/* From the origin along z, through a window of .002. */
#define EYE(more)                                                                        \
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.001'/>"      \
    "<lookat origin='0,0,0' target='0,0,1' up='0,1,0'/></transform>" FILM more           \
    "</sensor>"
#define FOG                                                                              \
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.4'/>"            \
    "<float name='albedo' value='0.7'/><phase type='hg'><float name='g' value='0.5'/>"   \
    "</phase></medium>"
#define IN_FOG "<ref id='fog'/>"
#define SCENE(depth, ...)                                                                \
    "<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' "       \
    "value='" #depth "'/></integrator>" __VA_ARGS__ "</scene>"

enum { SIGMA, ALBEDO, G, NUMBERS };
static const double fog[NUMBERS] = {.4, .7, .5};

/* The picture, and its derivatives by extinction, albedo and g against differences of the
 * truth. */
static void compare(const char *text, double (*truth)(const double fog[NUMBERS]), int spp,
                    const char *numbers, const char *what)
{
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    double mean[3], se[3], g[16], g_se[16];
    struct imp_estimate v;
    struct imp_run run = IMP_RUN_INIT;
    const double exact = truth(fog);
    static const char *const of[] = {"extinction", "albedo", "g"};
    media_mean(ctx, s, spp, mean, se);
    media_near(mean[0], se[0] + 1e-7 * exact, exact, .01 * exact, what);
    imp_problem *p = test_problem(ctx, s, numbers);
    run.spp = spp;
    run.seed = 11;
    test_must(ctx, imp_problem_functional(p, NULL, &run, &v, g, g_se));
    for (size_t i = 0; i < imp_problem_n_variables(p); i++) {
        struct imp_param_info info = {.size = sizeof info};
        const size_t param = test_param_of(ctx, p, i);
        test_must(ctx, imp_scene_get_param(s, param, &info));
        const int k = strstr(info.name, "sigma")    ? SIGMA
                      : strstr(info.name, "albedo") ? ALBEDO
                      : strstr(info.name, ".g")     ? G
                                                    : NUMBERS;
        if (k == NUMBERS) continue;
        double up[NUMBERS], down[NUMBERS];
        const double h = 1e-4;
        memcpy(up, fog, sizeof up);
        memcpy(down, fog, sizeof down);
        up[k] += h;
        down[k] -= h;
        const double d = (truth(up) - truth(down)) / (2 * h);
        media_near(g[i], g_se[i] + 1e-7 * exact, d, .05 * exact + .02 * fabs(d), of[k]);
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
}

static double hg(double g, double c)
{
    const double d = 1 + g * g - 2 * g * c;
    return (1 - g * g) / (4 * M_PI * d * sqrt(d));
}

/* ---- A wall in the fog, at z = 2 --------------------------------------------------- */

#define WALL                                                                             \
    "<shape type='rectangle'><bsdf type='diffuse'><float name='reflectance' "            \
    "value='0.5'/></bsdf><transform name='to_world'><scale value='9'/>"                  \
    "<rotate x='1' angle='180'/><translate z='2'/></transform></shape>"
#define POINT                                                                            \
    "<emitter type='point'><point name='position' x='1' y='0' z='0'/>"                   \
    "<float name='intensity' value='3'/>" IN_FOG "</emitter>"
/* Light that no collision has turned: of a single bounce. */
#define ABSORBING                                                                        \
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.4'/>"            \
    "<float name='albedo' value='0'/></medium>"
#define D2 5. /* squared distance from the light to the wall */

static double lit_by_point(const double f[NUMBERS])
{
    return .5 / M_PI * 3 * (2 / sqrt(D2)) / D2 * exp(-f[SIGMA] * (2 + sqrt(D2)));
}
/* A sphere of radius 1/2 about the same point: its radiance fills a cone. */
static double lit_by_sphere(const double f[NUMBERS])
{
    const double c0 = sqrt(1 - .25 / D2), tilt = 2 / sqrt(D2);
    double sum = 0;
    enum { N = 400 };
    for (int i = 0; i < N; i++) { /* about the axis cosines at the wall average out */
        const double c = c0 + (1 - c0) * (i + .5) / N;
        const double d = sqrt(D2) * c - sqrt(.25 - D2 * (1 - c * c));
        sum += c * exp(-f[SIGMA] * d);
    }
    return .5 / M_PI * 3 * 2 * M_PI * tilt * sum * (1 - c0) / N * exp(-f[SIGMA] * 2);
}
/* The square of side 1 about (0, 1.5, 1), which faces the wall. */
static double lit_by_square(const double f[NUMBERS])
{
    double sum = 0;
    enum { N = 200 };
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double x = (i + .5) / N - .5, y = (j + .5) / N + 1,
                         d2 = x * x + y * y + 1;
            sum += exp(-f[SIGMA] * (2 + sqrt(d2))) / (d2 * d2);
        }
    return .5 / M_PI * 3 * sum / N / N;
}

static void walls(void)
{
    compare(SCENE(2, ABSORBING WALL POINT EYE(IN_FOG)), lit_by_point, 4096,
            "fog.sigma_t.value", "a point lights a wall through fog");
    compare(SCENE(2, ABSORBING WALL
                  "<emitter type='spot'><transform name='to_world'><lookat "
                  "origin='1,0,0' target='0,0,2' up='0,1,0'/></transform>"
                  "<float name='intensity' value='3'/>" IN_FOG "</emitter>" EYE(IN_FOG)),
            lit_by_point, 4096, "fog.sigma_t.value", "a spot");
    compare(SCENE(2, ABSORBING WALL
                  "<shape type='sphere'><point name='center' x='1' y='0' z='0'/>"
                  "<float name='radius' value='0.5'/><emitter type='area'><float "
                  "name='radiance' value='3'/></emitter><ref id='fog' name='exterior'/>"
                  "</shape>" EYE(IN_FOG)),
            lit_by_sphere, 4096, "fog.sigma_t.value", "a sphere");
    compare(
        SCENE(
            2, ABSORBING WALL
            "<shape type='rectangle'><transform name='to_world'><scale "
            "value='0.5'/><translate y='1.5' z='1'/></transform><emitter "
            "type='area'><float name='radiance' value='3'/></emitter>"
            "<ref id='fog' name='exterior'/><ref id='fog' name='interior'/></shape>" EYE(
                IN_FOG)),
        lit_by_square, 8192, "fog.sigma_t.value", "a square");
}

/* ---- Light that is scattered once, along z from 0 to 2 ------------------------------ */

#define BLACK                                                                            \
    "<shape type='rectangle'><bsdf type='diffuse'><float name='reflectance' "            \
    "value='0'/></bsdf><transform name='to_world'><scale value='9'/>"                    \
    "<rotate x='1' angle='180'/><translate z='2'/></transform></shape>"

/* Of the point at (1, 0, 0): in a ball of radius `inner` about it the extinction is
 * SIGMA_IN, with nothing else; 0: no ball. */
#define SIGMA_IN 1.5
static double point_at(double z, const double *f, double inner)
{
    const double d = sqrt(1 + z * z);
    /* turned from (-1, 0, z)/d to (0, 0, -1) */
    return f[SIGMA] * f[ALBEDO] * hg(f[G], -z / d) * 3 / (d * d) *
           exp(-f[SIGMA] * (z + d - inner) - SIGMA_IN * inner);
}
static double by_point(double z, const void *with) { return point_at(z, with, 0); }
static double by_point_in_ball(double z, const void *with)
{
    return point_at(z, with, .5);
}
static double scattered_point(const double f[NUMBERS])
{
    return media_integral(by_point, f, 0, 2, 400);
}
static double scattered_nested(const double f[NUMBERS])
{
    return media_integral(by_point_in_ball, f, 0, 2, 400);
}
/* Of the spot at (1, 0, 0) that looks along -x with a cone of 60 degrees: the beam's edge
 * is at z = sqrt(3). */
static double scattered_spot(const double f[NUMBERS])
{
    return media_integral(by_point, f, 0, sqrt(3.), 400);
}
/* Of the square x in [-.5, .5], y in [1, 2] at z = 1, which shines to larger z. */
static double by_square(double z, const void *with)
{
    const double *f = with;
    double sum = 0;
    enum { N = 40 };
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const double x = (i + .5) / N - .5, y = (j + .5) / N + 1, h = z - 1,
                         d2 = x * x + y * y + h * h, d = sqrt(d2);
            sum += (h / d) / d2 * hg(f[G], -h / d) * exp(-f[SIGMA] * (z + d));
        }
    return f[SIGMA] * f[ALBEDO] * 3 * sum / N / N;
}
static double scattered_square(const double f[NUMBERS])
{
    return media_integral(by_square, f, 1, 2, 100);
}

static void scattering(void)
{
    compare(SCENE(2, FOG BLACK POINT EYE(IN_FOG)), scattered_point, 8192, "fog.*",
            "light of a point, scattered once");
    compare(SCENE(2, FOG BLACK
                  "<emitter type='spot'><transform name='to_world'><lookat "
                  "origin='1,0,0' target='0,0,0' up='0,1,0'/></transform>"
                  "<float name='intensity' value='3'/><float name='cutoff_angle' "
                  "value='60'/><float name='beam_width' value='60'/>" IN_FOG
                  "</emitter>" EYE(IN_FOG)),
            scattered_spot, 8192, "fog.*", "of a spot");
    compare(
        SCENE(
            2, FOG BLACK
            "<shape type='rectangle'><transform name='to_world'><scale "
            "value='0.5'/><translate y='1.5' z='1'/></transform><emitter "
            "type='area'><float name='radiance' value='3'/></emitter>"
            "<ref id='fog' name='exterior'/><ref id='fog' name='interior'/></shape>" EYE(
                IN_FOG)),
        scattered_square, 16384, "fog.*", "of a square");
    compare(SCENE(2, FOG BLACK POINT
                  "<shape type='sphere'><point name='center' x='1' y='0' z='0'/>"
                  "<float name='radius' value='0.5'/><bsdf type='null'/>"
                  "<medium type='homogeneous' name='interior'><float name='sigma_t' "
                  "value='1.5'/><float name='albedo' value='0'/></medium>"
                  "<ref id='fog' name='exterior'/></shape>" EYE(IN_FOG)),
            scattered_nested, 8192, "fog.*", "of a point in a ball of other fog");
    compare(SCENE(2, FOG BLACK POINT
                  "<shape type='sphere'><integer name='priority' value='1'/><point "
                  "name='center' x='1' y='0' z='0'/><float name='radius' value='0.5'/>"
                  "<bsdf type='null'/><medium type='homogeneous' name='interior'><float "
                  "name='sigma_t' value='1.5'/><float name='albedo' value='0'/></medium>"
                  "</shape>" EYE(IN_FOG)),
            scattered_nested, 8192, "fog.*", "... that has a priority");
}

/* ---- Boundaries of another index --------------------------------------------------- */

#define R0 (1 / 25.) /* of index 1.5, straight on */
#define BALL(bsdf, more)                                                                 \
    "<shape type='sphere'><float name='radius' value='2'/><bsdf type='" bsdf             \
    "'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>" more        \
    "</bsdf><ref id='fog' name='interior'/></shape>"
#define SKY "<emitter type='constant'><float name='radiance' value='1'/></emitter>"

/* From its middle, light that went to and fro. */
static double in_middle(const double f[NUMBERS])
{
    const double T = exp(-2 * f[SIGMA]);
    return 2.25 * (1 - R0) * T / (1 - R0 * T * T);
}
/* A black ball of radius 1 that glows inside, seen from outside along a radius. */
static double glowing(const double f[NUMBERS])
{
    return 3 * (1 - R0) / 2.25 * exp(-f[SIGMA]);
}

static void boundaries(void)
{
    compare(SCENE(-1, ABSORBING BALL("dielectric", "") SKY EYE(IN_FOG)), in_middle, 2048,
            "fog.sigma_t.value", "the sky from the middle of a ball of glass");
    compare(
        SCENE(-1, ABSORBING BALL("roughdielectric", "<float name='alpha' "
                                                    "value='0.002'/>") SKY EYE(IN_FOG)),
        in_middle, 2048, "fog.sigma_t.value", "... whose boundary is a little rough");
#define GLOWS                                                                            \
    "<shape type='sphere'><emitter type='area'><float name='radiance' value='3'/>"       \
    "</emitter><ref id='fog' name='exterior'/></shape>"                                  \
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.001'/>"      \
    "<lookat origin='0,0,-5' target='0,0,1' up='0,1,0'/></transform>" FILM "</sensor>"
    compare(SCENE(-1, ABSORBING BALL("dielectric", "") GLOWS), glowing, 2048,
            "fog.sigma_t.value", "a light in a ball of glass");
}

/* A rough boundary around what scatters, by walks from the camera and from the sky. */
static void both_ends(void)
{
    const char *text =
        SCENE(12, FOG BALL("roughdielectric", "<float name='alpha' value='0.4'/>") SKY
              "<sensor type='perspective'><float name='fov' value='20'/><transform "
              "name='to_world'><lookat origin='0,0,-8' target='0,0,1' up='0,1,0'/>"
              "</transform>" FILM "</sensor>");
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    double mean[2][3], se[2][3];
    for (int k = 0; k < 2; k++) {
        struct imp_run run = IMP_RUN_INIT;
        run.spp = k ? 160000 : 20000;
        run.seed = 3;
        run.from = k ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR;
        media_mean_run(ctx, s, &run, mean[k], se[k], IMP_DROP_NONE);
    }
    media_near(mean[0][0], hypot(se[0][0], se[1][0]), mean[1][0], .02 * mean[1][0],
               "a rough ball of fog, from both ends");
    imp_scene_destroy(s);
}

/* One cell of an extinction without measure beside empty ones, under the same bound. */
static void endless(void)
{
    enum { N = 128 };
    float value[N] = {0};
    char path[64], text[2048];
    double mean[3], se[3];
    struct imp_run run = IMP_RUN_INIT;
    value[1] = 1e12f;
    vol_write(path, N, 1, 1, 1, value);
    snprintf(text, sizeof text,
             SCENE(4, "<medium type='heterogeneous' id='fog'><volume name='sigma_t' "
                      "type='gridvolume'><string name='filename' value='%s'/><string "
                      "name='filter_type' value='nearest'/></volume></medium>"
                      "<shape type='cube'><bsdf type='null'/><ref id='fog' "
                      "name='interior'/><transform name='to_world'><scale value='0.5'/>"
                      "<translate x='0.5' y='0.5' z='0.5'/></transform></shape>" SKY
                      "<sensor type='orthographic'><transform name='to_world'>"
                      "<scale value='0.001'/><lookat origin='0.004,0.5,-1' "
                      "target='0.004,0.5,1' up='0,1,0'/></transform><film "
                      "type='hdrfilm'><integer name='width' value='1'/><integer "
                      "name='height' value='1'/><rfilter type='box'/></film></sensor>"),
             path);
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    run.spp = 4;
    run.drop_budget = 1;
    const uint64_t dropped = media_mean_run(ctx, s, &run, mean, se, IMP_DROP_EVENTS);
    tap_ok(dropped == 4, "walks of a million tentative collisions are dropped: %d",
           (int)dropped);
    imp_scene_destroy(s);
    remove(path);
}

int main(void)
{
    ctx = test_context(0);
    walls();
    scattering();
    boundaries();
    both_ends();
    endless();
    imp_context_destroy(ctx);
    return tap_done();
}
