/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples from both ends (integrator bdpt) against walks from the sensor or the lights,
 * pixel by pixel, in scenes of all kinds that they accept; against closed forms; their
 * standard errors against the spread of seeds; and what they refuse. */
#include "base/film.h"
#include "imp_light_room.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/stat.h"

static imp_context *ctx;
static int times = 1; /* as many samples */

/* clang-format off: literals are broken where the markup is */
#define FILM(w, h, filter)                                                               \
    "<film type='hdrfilm'><integer name='width' value='" #w "'/><integer name='height' " \
    "value='" #h "'/><rfilter type='" filter "'/></film>"
#define METER   "<sensor type='irradiancemeter'>" FILM(1, 1, "box") "</sensor>"
#define LOOK(z) AT("<lookat origin='0,0," #z "' target='0,0,0' up='0,1,0'/>")
#define CAMERA(z, filter)                                                                \
    "<sensor type='perspective'><float name='fov' value='50'/>" LOOK(z)                  \
        FILM(6, 4, filter) "</sensor>"
#define RGB(name, c) "<rgb name='" name "' value='" c "'/>"
#define LAMP(e)      "<emitter type='area'>" RGB("radiance", e) "</emitter>"
#define DIFFUSE(r)   "<bsdf type='diffuse'>" RGB("reflectance", r) "</bsdf>"
#define GLASS                                                                            \
    "<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float "                 \
    "name='ext_ior' value='1'/></bsdf>"
#define ROUGH(kind, alpha)                                                               \
    "<bsdf type='" kind "'><float name='alpha' value='" alpha "'/></bsdf>"
#define FLOOR(inside)                                                                    \
    "<shape type='rectangle'>" AT("<scale x='.5' y='.5'/><rotate x='1' angle='-90'/>"    \
                                  "<translate y='-1.6'/>") DIFFUSE(".3") inside          \
        "</shape>"
#define WALLS                                                                            \
    "<shape type='cube'>" AT("<scale value='2'/>") "<boolean name='flip_normals' "       \
                                                   "value='true'/>" DIFFUSE(             \
                                                       ".6,.5,.4") "</shape>"
#define ROOM                                                                             \
    WALLS "<shape type='rectangle'>" AT("<scale x='.6' y='.6'/><rotate x='1' "           \
                                        "angle='90'/><translate y='1.95'/>")             \
        LAMP("5,4,3") "</shape>"
#define SIDE(inside)                                                                     \
    "<shape type='rectangle'>" AT("<rotate y='1' angle='90'/><translate x='-1.5'/>")     \
        inside "</shape>"
/* clang-format on */

#define BEAM                                                                             \
    "<shape type='disk'>" AT("<rotate x='1' angle='170'/><translate z='4'/>") DIFFUSE(   \
        "0") "<emitter type='directionalarea'><float name='radiance' value='3'/>"        \
             "</emitter></shape>"

static imp_film *picture(imp_scene *scene, enum imp_from from, int spp, uint64_t seed)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.from = from;
    run.spp = spp;
    run.seed = seed;
    run.points = IMP_POINTS_INDEPENDENT;
    test_must(ctx, imp_render(scene, &run, &film));
    return film;
}

static imp_scene *scene_of(int max_depth, const char *body, enum imp_color_mode mode)
{
    char xml[16384];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><integrator type='bdpt'><integer name='max_depth' "
             "value='%d'/></integrator>%s</scene>",
             max_depth, body);
    return test_scene_text(ctx, xml, mode);
}

/* Bounds that were set before any run: chance alone exceeds each in one of 10^5 tests. */
#define CHANCE 1e-5
/* Of sum x^2 of n independent standard normal numbers. */
static double square_sum_limit(double n, double chance)
{
    double lo = 0, hi = 10 * n + 100;
    for (int i = 0; i < 60; i++) {
        const double middle = (lo + hi) / 2;
        *(imp__chi2_tail(middle, n) > chance ? &lo : &hi) = middle;
    }
    return lo;
}

/* All pixels of two pictures of one mean, and what is told of the mean of all. Channels of
 * a pixel share their walks: the bound of mean z^2 is for one number a pixel. */
static void films_same(const char *what, const imp_film *a, const imp_film *b,
                       double relative)
{
    const size_t n = (size_t)a->width * (size_t)a->height * (size_t)a->channels;
    double worst = 0, square = 0, sum[2] = {0}, se = 0;
    int counted = 0;
    for (size_t i = 0; i < n; i++) {
        const double both = hypot((double)a->se[i], (double)b->se[i]);
        const double d = (double)a->mean[i] - (double)b->mean[i];
        sum[0] += (double)a->mean[i] / (double)n;
        sum[1] += (double)b->mean[i] / (double)n;
        se += both * both;
        if (!(both > 0)) continue;
        worst = fmax(worst, fabs(d / both));
        square += d * d / (both * both);
        counted++;
    }
    /* Channels of a pixel depend on each other: as if they were the same. */
    se = sqrt(se * a->channels) / (double)n;
    const double z = (sum[0] - sum[1]) / se;
    const double pixels = fmax(counted / (double)a->channels, 1);
    const double limit = square_sum_limit(pixels, CHANCE) / pixels;
    tap_ok(fabs(z) < sqrt(square_sum_limit(1, CHANCE)) &&
               worst < sqrt(square_sum_limit(1, CHANCE / fmax(counted, 1))) &&
               square < limit * counted && counted > 0 && se < relative * sum[0],
           "%s: %.6g and %.6g +- %.1g, %d values # z %.2f, worst %.2f, mean z^2 %.2f "
           "(limit %.1f)",
           what, sum[0], sum[1], se, counted, z, worst, square / counted, limit);
}

/* Of both ends and of one. `relative` is the standard error that the row has at most, a
 * quarter of the least that a defect of its kind changes: Fresnel's .04 of one face of clear
 * glass, and with dispersion one lane of four. The samples are as many as that takes. */
static void same(const char *what, int max_depth, const char *body,
                 enum imp_color_mode mode, enum imp_from from, int spp_from, int spp,
                 double relative)
{
    imp_scene *scene = scene_of(max_depth, body, mode);
    imp_film *a = picture(scene, from, spp_from * times, 3);
    imp_film *b = picture(scene, IMP_FROM_SCENE, spp * times, 4);
    films_same(what, a, b, relative);
    imp_film_destroy(a);
    imp_film_destroy(b);
    imp_scene_destroy(scene);
}

#define EYE    IMP_FROM_SENSOR
#define LIGHTS IMP_FROM_LIGHTS

static void rooms(void)
{
    same("diffuse room", 5, ROOM CAMERA(1.9, "box"), IMP_RGB, EYE, 3000, 1000, .02);
    same("one reflection", 2, ROOM CAMERA(1.9, "box"), IMP_RGB, EYE, 2000, 1000, .02);
    same("light alone", 1,
         "<shape type='disk'>" LAMP("1,2,3") "</shape>" CAMERA(3, "box"), IMP_RGB, EYE,
         2000, 1000, .02);
    same("a wide filter", 3, ROOM CAMERA(1.9, "gaussian"), IMP_RGB, LIGHTS, 2000, 1000,
         .02);
    same("no end but roulette", -1, ROOM CAMERA(1.9, "box"), IMP_MONO, EYE, 2000, 1000,
         .03);
    same("rough glass and metal", 5,
         ROOM BALL("-.8,-.9,-.5", ROUGH("roughdielectric", ".4"))
             BALL("1,-1,.3", ROUGH("roughconductor", ".3")) CAMERA(1.9, "box"),
         IMP_RGB, EYE, 3000, 1000, .03);
    same("plastics, phong, a mirror", 5,
         ROOM BALL("-.8,-.9,-.5", ROUGH("roughplastic", ".2"))
             BALL("1,-1,.3", "<bsdf type='phong'/>")
                 BALL("0,-.3,-1", "<bsdf type='plastic'/>")
                     BALL("-.6,.7,-.8", "<bsdf type='conductor'/>") CAMERA(1.9, "box"),
         IMP_RGB, EYE, 4000, 1000, .03);
    same("clear glass, whose caustic the eye hardly finds", 7,
         ROOM BALL("0,-.6,0", GLASS) CAMERA(1.9, "box"), IMP_MONO, EYE, 12000, 1000, .03);
    same("a glowing ball, and a small one", 4,
         WALLS BALL("-.5,.4,-.4", LAMP("1,2,3")) "<shape type='sphere'><float "
                                                 "name='radius' value='.05'/><point "
                                                 "name='center' value='.8,.3,.2'/>" LAMP(
                                                     "90,80,70") "</shape>" CAMERA(1.9,
                                                                                   "box"),
         IMP_RGB, EYE, 2000, 1000, .03);
    same("inside of a glowing ball", 3,
         "<shape type='sphere'><float name='radius' value='5'/><boolean "
         "name='flip_normals' value='true'/>" LAMP("1,1,1") "</shape>" BALL(
             "0,0,0", DIFFUSE(".5,.6,.7")) CAMERA(3, "box"),
         IMP_RGB, EYE, 2000, 1000, .03);
    same("fog in a room", 6, ROOM FOG CAMERA(1.9, "box"), IMP_RGB, EYE, 3000, 1500, .03);
}

static void sensors(void)
{
    same("thin lens", 4,
         ROOM "<sensor type='thinlens'><float name='fov' value='50'/><float "
              "name='aperture_radius' value='.2'/><float name='focus_distance' "
              "value='3'/>" LOOK(1.7) FILM(6, 4, "box") "</sensor>",
         IMP_RGB, EYE, 2000, 1000, .03);
    same("orthographic", 4,
         ROOM "<sensor type='orthographic'>" AT(
             "<scale x='.7' y='.7'/><lookat origin='0,0,1.7' target='0,0,0' "
             "up='0,1,0'/>") FILM(4, 4, "box") "</sensor>",
         IMP_RGB, EYE, 2000, 1000, .03);
    same(
        "a crop", 4,
        ROOM "<sensor type='perspective'><float name='fov' value='60'/>" LOOK(
            1.9) "<film type='hdrfilm'><integer name='width' value='9'/><integer "
                 "name='height' value='7'/><integer name='crop_offset_x' value='3'/>"
                 "<integer name='crop_offset_y' value='2'/><integer name='crop_width' "
                 "value='4'/><integer name='crop_height' value='3'/><rfilter type='box'/>"
                 "</film></sensor>",
        IMP_RGB, EYE, 2000, 1000, .03);
    same("meter behind clear glass", 8, ROOM BALL("0,-.4,0", GLASS) FLOOR(METER), IMP_RGB,
         LIGHTS, 800000, 200000, .01);
    same("wall of lux, a film over a rectangle", 4,
         ROOM FLOOR("<sensor type='irradiancemeter'>" FILM(4, 2, "box") "</sensor>"),
         IMP_RGB, EYE, 10000, 4000, .02);
    same("distant sensor", 4,
         BALL("0,0,0", DIFFUSE(".5")) "<shape type='rectangle'>" AT(
             "<rotate x='1' angle='90'/><translate y='1.5'/>")
             LAMP("5,4,3") "</shape><sensor type='distant'><vector name='direction' "
                           "value='.9,.1,.2'/>" FILM(3, 3, "box") "</sensor>",
         IMP_RGB, EYE, 10000, 4000, .03);
}

static void lights(void)
{
    same("a point light and a meter", 3,
         "<emitter type='point'><point name='position' value='.3,0,1'/></emitter>"
         "<shape type='disk'>" DIFFUSE(".5") METER "</shape>" SIDE(DIFFUSE(".7")),
         IMP_MONO, EYE, 40000, 20000, .01);
    same("a spot, seen by a camera", 4,
         "<emitter type='spot'>" AT(
             "<lookat origin='.3,0,1.2' target='0,0,0' "
             "up='0,1,0'/>") "<float "
                             "name='cutoff_angle' "
                             "value='40'/></emitter><shape "
                             "type='disk'>" DIFFUSE(".5") "</shape>" SIDE(DIFFUSE("."
                                                                                  "7"))
                                 CAMERA(3, "box"),
         IMP_MONO, EYE, 2000, 1000, .02);
    same("a projector", 3,
         "<emitter type='projector'>" AT(
             "<lookat origin='.5,0,2' target='0,0,0' "
             "up='0,1,0'/>") "<float name='fov' "
                             "value='50'/><texture "
                             "type='checkerboard' "
                             "name='irradiance'/></emitter>"
                             "<shape "
                             "type='rectangle'>" DIFFUSE(".5") "</shape>" BALL(
                                 "0,0,."
                                 "2",
                                 DIFFUSE("."
                                         "7")) CAMERA(3, "box"),
         IMP_RGB, EYE, 4000, 2000, .02);
    same("parallel light, a wall and a meter", 4,
         "<emitter type='directional'><vector name='direction' value='.3,.1,-1'/>"
         "</emitter><shape type='disk'>" DIFFUSE(".5") METER
         "</shape>" SIDE(DIFFUSE(".7")),
         IMP_MONO, EYE, 40000, 20000, .01);
    same("parallel light, seen by a camera", 4,
         "<emitter type='directional'><vector name='direction' value='.3,.1,-1'/>"
         "</emitter><shape type='rectangle'>" DIFFUSE(".5") "</shape>" BALL(
             "0,0,.2", DIFFUSE(".7")) CAMERA(3, "box"),
         IMP_RGB, EYE, 2000, 2000, .02);
    same("a beam, a wall and a meter", 4,
         BEAM "<shape type='disk'>" DIFFUSE(".5") METER "</shape>" SIDE(DIFFUSE(".7")),
         IMP_MONO, EYE, 20000, 20000, .01);
    same("a beam, seen by a camera", 4,
         BEAM
         "<shape type='rectangle'>" DIFFUSE(".5") "</shape>" BALL("0,0,.2", DIFFUSE(".7"))
             CAMERA(3, "box"),
         IMP_RGB, EYE, 2000, 2000, .02);
    same("sky over a ball and a floor", 4,
         "<emitter type='constant'>" RGB("radiance", ".5,.6,.7") "</emitter>" BALL(
             "0,0,0",
             DIFFUSE(
                 ".5")) "<shape type='rectangle'>" AT("<scale value='2'/><rotate x='1' "
                                                      "angle='-90'/><translate y='-.7'/>")
             DIFFUSE(".4,.5,.6") "</shape>" CAMERA(3, "box"),
         IMP_RGB, EYE, 2000, 2000, .02);
    same("sky, and a meter that sees it", 3,
         "<emitter type='constant'/><shape type='disk'>" DIFFUSE(".5") METER
         "</shape>" SIDE(DIFFUSE(".7")),
         IMP_MONO, EYE, 20000, 20000, .02);
    same(
        "light that varies in time", 3,
        WALLS "<shape type='rectangle'>" AT(
            "<scale x='.6' y='.6'/><rotate x='1' "
            "angle='90'/><translate y='1.95'/>") "<emitter "
                                                 "type='area'"
                                                 ">" RGB(
                                                     "radiance",
                                                     "5,4,3") "<string name='times' "
                                                              "value='0:1, .5:3, "
                                                              "1:0'/></emitter></"
                                                              "shape><sensor "
                                                              "type='perspective'><float "
                                                              "name='fov' "
                                                              "value='50'/><float "
                                                              "name='shutter_open' "
                                                              "value='0'/><float "
                                                              "name='shutter_close' "
                                                              "value='1'/>" LOOK(1.9)
                                                                  FILM(6, 4,
                                                                       "box") "</sensor>",
        IMP_RGB, EYE, 3000, 1500, .03);
}

static void spectra(void)
{
    same("spectral room", 4, ROOM CAMERA(1.9, "box"), IMP_SPECTRAL, EYE, 2000, 1000, .03);
    same("one wavelength", 4, ROOM CAMERA(1.9, "box"), IMP_SINGLE, EYE, 4000, 2000, .05);
    same("fog in many wavelengths", 5, ROOM FOG CAMERA(1.9, "box"), IMP_SPECTRAL, EYE,
         3000, 1500, .04);
    same("rough dispersion", 6,
         ROOM BALL("0,-.4,0",
                   "<bsdf type='roughdielectric'><float name='alpha' value='.2'/><string "
                   "name='int_ior' value='N-BK7'/></bsdf>") CAMERA(1.9, "box"),
         IMP_SPECTRAL, EYE, 4000, 2000, .04);
    same("dispersion", 6,
         ROOM BALL("0,-.4,0", "<bsdf type='dielectric'><string name='int_ior' "
                              "value='N-BK7'/></bsdf>") FLOOR(METER),
         IMP_SPECTRAL, LIGHTS, 150000, 60000, .06);
}

/* ---- Closed forms ----------------------------------------------------------------- */

static void truth(const char *what, int max_depth, const char *body, double value,
                  int spp, double relative)
{
    imp_scene *scene = scene_of(max_depth, body, IMP_MONO);
    imp_film *film = picture(scene, IMP_FROM_SCENE, spp * times, 5);
    const double mean = (double)film->mean[0], se = (double)film->se[0];
    const double z = (mean - value) / se;
    tap_ok(fabs(z) < 4 && se < relative * value, "%s: %.6g +- %.1g, truth %.6g # z %.2f",
           what, mean, se, value, z);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

/* Two coaxial discs (F12 = .4688711), and a sphere that glows with 1 and reflects rho: what
 * has at most n segments makes the radiance (1 - rho^n)/(1 - rho) everywhere in it. */
static void closed_forms(void)
{
    const double pi = acos(-1), R = 1.1568931;
    /* clang-format off */
#define DISCS(z0, a, z1, b)                                                              \
    "<shape type='disk'>" AT("<scale value='.5'/><translate z='" z0 "'/>") DIFFUSE("0") a \
    "</shape><shape type='disk'>" AT("<rotate y='1' angle='180'/><translate z='" z1      \
    "'/>") DIFFUSE("0") b "</shape>"
    /* clang-format on */
    truth("discs, the smaller one a lamp", -1, DISCS("0", LAMP("1"), "1", METER), R / pi,
          40000, 3e-3);
    truth("discs, roles exchanged", -1, DISCS("0", METER, "1", LAMP("1")), R / (pi / 4),
          40000, 3e-3);
    truth("integrating sphere, reflectance .9, 8 segments", 8,
          "<shape type='sphere'><boolean name='flip_normals' value='true'/>" DIFFUSE(".9")
              LAMP("1") "</shape><shape type='disk'>" AT("<scale value='.01'/>")
                  DIFFUSE("0") METER "</shape>",
          pi * (1 - pow(.9, 8)) / .1, 20000, 1e-2);
}

/* ---- Errors ----------------------------------------------------------------------- */

/* The spread of seeds over the error that is told, of all pixels together. `alone`: pixels
 * that the filter leaves independent of each other, of all; a sum of variances v has
 * (sum v)^2/sum v^2 of their degrees of freedom (Satterthwaite 1946). */
static void errors(const char *what, int max_depth, const char *body,
                   enum imp_color_mode mode, int spp, int seeds, double alone)
{
    imp_scene *scene = scene_of(max_depth, body, mode);
    enum { MOST = 128 };
    struct tap_stat value[MOST] = {{0}};
    double told = 0, spread = 0, of_pixel[MOST] = {0}, squares = 0;
    size_t n = 0;
    for (int i = 0; i < seeds; i++) {
        imp_film *f = picture(scene, IMP_FROM_SCENE, spp, 100 + (uint64_t)i);
        n = (size_t)f->width * (size_t)f->height * (size_t)f->channels;
        for (size_t k = 0; k < n && k < MOST; k++) {
            tap_add(&value[k], (double)f->mean[k]);
            of_pixel[k] += (double)f->se[k] * (double)f->se[k] / seeds;
        }
        imp_film_destroy(f);
    }
    for (size_t k = 0; k < n && k < MOST; k++) {
        spread += value[k].m2 / (seeds - 1);
        told += of_pixel[k];
        squares += of_pixel[k] * of_pixel[k];
    }
    const double freedom = (seeds - 1) * fmax(alone * told * told / squares, 1);
    const double hi = sqrt(square_sum_limit(freedom, CHANCE / 2) / freedom);
    const double lo = sqrt(square_sum_limit(freedom, 1 - CHANCE / 2) / freedom);
    const double ratio = sqrt(spread / told);
    tap_ok(ratio > lo && ratio < hi,
           "%s: spread of %d seeds over error # %.3f (limits %.2f, %.2f)", what, seeds,
           ratio, lo, hi);
    imp_scene_destroy(scene);
}

/* ---- Threads ---------------------------------------------------------------------- */

/* The same bits with 1, 2 and 3, of pictures and of a gradient. */
static void threads(void)
{
    imp_context *const own = ctx;
    float mean[3][72], se[3][72];
    double grad[3][64];
    size_t n = 0, m = 0;
    for (int k = 0; k < 3; k++) {
        ctx = test_context(k + 1);
        imp_scene *scene =
            scene_of(6, ROOM FOG BALL("0,-.4,0", GLASS) CAMERA(1.9, "gaussian"), IMP_RGB);
        imp_film *film = picture(scene, IMP_FROM_SCENE, 128, 9);
        n = (size_t)film->width * (size_t)film->height * (size_t)film->channels;
        if (n > imp_count(mean[0])) n = imp_count(mean[0]);
        memcpy(mean[k], film->mean, n * sizeof *mean[k]);
        memcpy(se[k], film->se, n * sizeof *se[k]);
        imp_problem *p = test_problem(ctx, scene, "*");
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate value;
        run.spp = 64;
        m = imp_problem_n_variables(p);
        if (m < imp_count(grad[0]))
            test_must(ctx, imp_problem_functional(p, NULL, &run, &value, grad[k], NULL));
        imp_problem_destroy(p);
        imp_film_destroy(film);
        imp_scene_destroy(scene);
        imp_context_destroy(ctx);
    }
    ctx = own;
    bool equal = n == imp_count(mean[0]) && m > 0 && m < imp_count(grad[0]);
    for (int k = 1; k < 3; k++)
        equal = equal && memcmp(mean[0], mean[k], n * sizeof *mean[k]) == 0 &&
                memcmp(se[0], se[k], n * sizeof *se[k]) == 0 &&
                memcmp(grad[0], grad[k], m * sizeof *grad[k]) == 0;
    tap_ok(equal, "1, 2 and 3 threads: the same bits of %zu values and %zu derivatives",
           n, m);
}

/* ---- What is refused ------------------------------------------------------------- */

static void refused(const char *what, const char *body, const char *words)
{
    imp_scene *scene = scene_of(4, body, IMP_RGB);
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film = NULL;
    run.spp = 4;
    const enum imp_status st = imp_render(scene, &run, &film);
    const char *error = imp_last_error(ctx);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(error, words), "%s is refused # %s", what,
           error);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

static void refusals(void)
{
    refused("a sensor of one ray",
            ROOM "<sensor type='radiancemeter'>" FILM(1, 1, "box") "</sensor>",
            "measures one ray");
    refused("sample_border",
            ROOM "<sensor type='perspective'>" LOOK(
                1.9) "<film type='hdrfilm'><boolean name='sample_border' value='true'/>"
                     "<rfilter type='gaussian'/></film></sensor>",
            "sample_border");
    refused("a mask in fog",
            ROOM FOG BALL("0,0,0", "<bsdf type='mask'><float name='opacity' value='.5'/>"
                                   "<bsdf type='diffuse'/></bsdf>") CAMERA(1.9, "box"),
            "straight on");
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "long") == 0) times = 16;
    ctx = test_context(2);
    rooms();
    sensors();
    lights();
    spectra();
    closed_forms();
    errors("room", 4, ROOM CAMERA(1.9, "box"), IMP_MONO, 64, 64, 1);
    /* A Gaussian of standard deviation s covers 4 pi s^2 pixels, s = .5. */
    errors("room through a wide filter", 4, ROOM CAMERA(1.9, "gaussian"), IMP_MONO, 64,
           64, 1 / acos(-1));
    errors("meter", 4, ROOM FLOOR(METER), IMP_MONO, 400, 320, 1);
    threads();
    refusals();
    imp_context_destroy(ctx);
    return tap_done();
}
