/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes from photographs. In scenes drawn at random (paints, a lamp, a sky, two cameras whose lenses
 * distort, with unknown exposures and vignetting) two photographs are made with noise, a gamma, 8 bits and clipping, and measured from guesses
 * that are off, cameras included:
 *
 *   - 95 % intervals hold the truth, counted over all numbers;
 *   - standard errors are bounded, so that they cannot hold it by their width;
 *   - a block of other pixels in one photograph is masked, and few others are;
 *   - with the lamp held at half its radiance the lamp is named, or it is not explained.
 *
 * Argument long, or a number: 100 cases in place of 2, cameras in all of them, and lenses in every other one. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <importon/measure.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 24, HEIGHT = 18, PIXELS = WIDTH * HEIGHT };
#define GAMMA 2.2
#define NOISE 0.01

static imp_context *ctx;

static double normal(struct imp_key key, uint32_t k)
{
    const double u = 1 - imp__u01(key, 2 * k), v = imp__u01(key, 2 * k + 1);
    return sqrt(-2 * log(u)) * cos(6.283185307179586 * v);
}

/* The numbers of a case. */
struct truth {
    double floor, block, lamp, sky, exposure, x[2], turn, dark[2], k1[2];
};

static struct truth truth_of(struct imp_key key)
{
    return (struct truth){
        .floor = 0.3 + 0.4 * imp__u01(key, 1),
        .block = 0.3 + 0.4 * imp__u01(key, 2),
        .lamp = 3 + 3 * imp__u01(key, 3),
        .sky = 0.2 + 0.3 * imp__u01(key, 4),
        .exposure = 0.8 + 0.6 * imp__u01(key, 5),
        .x = {-1.4 + 0.4 * imp__u01(key, 6), 1.2 + 0.4 * imp__u01(key, 7)},
        .turn = 90 * imp__u01(key, 8),
        .dark = {-0.3 * imp__u01(key, 9), -0.3 * imp__u01(key, 10)},
        .k1 = {0.3 * imp__u01(key, 11) - 0.2, 0.3 * imp__u01(key, 12) - 0.2}};
}

static int sensor_put(char *to, size_t room, const char *id, double x, double exposure,
                      double dark, double k1)
{
    return snprintf(
        to, room,
        "<sensor type='perspective' id='%s'><float name='fov' value='40'/><float "
        "name='opencv_k1' value='%g'/><transform "
        "name='to_world'><lookat origin='%g,1.2,2.3' target='0,.2,0' up='0,1,0'/>"
        "</transform><film type='hdrfilm'><integer name='width' value='%d'/><integer "
        "name='height' value='%d'/><rfilter type='box'/><float name='exposure' "
        "value='%g'/><float name='vignetting_2' value='%g'/><float name='gamma' "
        "value='2.2'/></film></sensor>",
        id, k1, x, WIDTH, HEIGHT, exposure, dark);
}

static imp_scene *scene_make(const struct truth *t)
{
    static char xml[4096];
    int n = snprintf(xml, sizeof xml,
                     "<scene version='3.0.0'><integrator type='path'><integer "
                     "name='max_depth' value='3'/></integrator>");
    n += sensor_put(xml + n, sizeof xml - (size_t)n, "left", t->x[0], 1, t->dark[0],
                    t->k1[0]);
    n += sensor_put(xml + n, sizeof xml - (size_t)n, "right", t->x[1], t->exposure,
                    t->dark[1], t->k1[1]);
    snprintf(xml + n, sizeof xml - (size_t)n,
             "<shape type='rectangle'><transform name='to_world'><scale value='2'/>"
             "<rotate x='1' angle='-90'/></transform><bsdf type='diffuse' id='floor'>"
             "<spectrum name='reflectance' value='%g'/></bsdf></shape><shape type='cube'>"
             "<transform name='to_world'><scale value='.35'/><rotate y='1' angle='%g'/>"
             "<translate y='.35'/></transform><bsdf type='diffuse' id='block'><spectrum "
             "name='reflectance' value='%g'/></bsdf></shape><shape type='rectangle'>"
             "<transform name='to_world'><scale value='.5'/><rotate x='1' angle='90'/>"
             "<translate x='-.6' y='2.4' z='.5'/></transform><emitter type='area' "
             "id='lamp'><spectrum name='radiance' value='%g'/></emitter></shape>"
             "<emitter type='constant' id='sky'><spectrum name='radiance' value='%g'/>"
             "</emitter></scene>",
             t->floor, t->turn, t->block, t->lamp, t->sky);
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* A block of 6 x 5 pixels of something else, where `foreign`. */
static void photo_make(imp_scene *s, int sensor, uint64_t seed, bool foreign, float *out)
{
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    run.sensor = sensor;
    run.spp = 1024;
    run.seed = seed;
    test_must(ctx, imp_render(s, &run, &film));
    for (int i = 0; i < PIXELS; i++) {
        const struct imp_key key = imp__key(seed, 7, (uint64_t)sensor);
        const int x = i % WIDTH, y = i / WIDTH;
        double v = pow(fmax((double)imp_film_mean(film)[i], 0), 1 / GAMMA) +
                   NOISE * normal(key, (uint32_t)i);
        if (foreign && x >= 8 && x < 14 && y >= 8 && y < 13)
            v = imp__u01(key, 4 * PIXELS + (uint32_t)i);
        out[i] = (float)(round(255 * fmin(1, fmax(0, v))) / 255);
    }
    imp_film_destroy(film);
}

struct measured {
    imp_problem *problem;
    const struct imp_measure_result *result;
};

static struct measured measure(imp_scene *s, float (*pixels)[PIXELS], int n,
                               const char *const *hold, size_t n_hold, const char *stages,
                               uint64_t seed)
{
    struct imp_photo photo[2];
    struct imp_measure_options o = IMP_MEASURE_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct measured m = {NULL, NULL};
    for (int i = 0; i < n; i++) {
        photo[i] = (struct imp_photo)IMP_PHOTO_INIT;
        photo[i].sensor = i;
        photo[i].width = WIDTH;
        photo[i].height = HEIGHT;
        photo[i].channels = 1;
        photo[i].pixels = pixels[i];
        photo[i].clipped = true;
        photo[i].low = 0.5 / 255;
        photo[i].high = 254.5 / 255;
        photo[i].step = 1. / 255;
        photo[i].noise = hypot(NOISE, 1 / (255 * sqrt(12)));
    }
    o.hold = hold;
    o.n_hold = n_hold;
    o.stages = stages;
    run.spp = 8;
    run.seed = seed;
    test_must(ctx, imp_measure(s, photo, (size_t)n, &o, &run, &m.problem, &m.result));
    return m;
}

struct record {
    int numbers, inside, wide, explained, cases;
    int foreign_masked, others_masked;
};

static double truth_by_name(const char *name, const struct truth *t)
{
    const struct {
        const char *name;
        double value;
    } all[] = {{"floor.reflectance.value", t->floor},
               {"block.reflectance.value", t->block},
               {"lamp.radiance.value", t->lamp},
               {"left.vignetting_2.value", t->dark[0]},
               {"right.vignetting_2.value", t->dark[1]},
               {"right.exposure.value", t->exposure},
               {"left.opencv_k1", t->k1[0]},
               {"right.opencv_k1", t->k1[1]},
               {"left.x_fov", 40},
               {"right.x_fov", 40}};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        if (!strcmp(all[k].name, name)) return all[k].value;
    return 0; /* poses: the file has the cameras where they were */
}

static void intervals_count(imp_scene *s, const struct measured *m, const struct truth *t,
                            struct record *r)
{
    for (size_t i = 0; i < imp_problem_n_variables(m->problem); i++) {
        struct imp_variable_info v = IMP_VARIABLE_INFO_INIT;
        struct imp_param_info info = {.size = sizeof info};
        struct imp_fit_variable f = IMP_FIT_VARIABLE_INIT;
        test_must(ctx, imp_problem_get_variable(m->problem, i, &v));
        test_must(ctx, imp_scene_get_param(s, v.param, &info));
        test_must(ctx, imp_problem_get_fit_variable(m->problem, i, &f));
        const double truth = truth_by_name(info.name, t);
        r->numbers++;
        r->inside += f.lo95 <= truth && truth <= f.hi95;
        r->wide += !(f.se < (strstr(info.name, "_k1") ? 0.4
                             : truth > 0              ? 0.2 * truth
                                                      : 0.15));
    }
}

static void geometry_guess(imp_scene *s, const char *name, const double *v, size_t n)
{
    size_t k;
    test_must(ctx, imp_scene_add_geometry(s, name));
    test_must(ctx, imp_scene_find_param(s, name, &k));
    test_must(ctx, imp_scene_set_values(s, k, n, v));
}

/* Guesses that are off by up to 30 %, cameras by up to 4 cm and a degree, fields of view by up to 2 of 40
 * degrees, and no distortion. */
static void guesses_set(imp_scene *s, struct imp_key key, bool cameras, bool lenses)
{
    for (size_t k = 0; k < imp_scene_n_params(s); k++) {
        struct imp_param_info info = {.size = sizeof info};
        double v[6];
        test_must(ctx, imp_scene_get_param(s, k, &info));
        if (strstr(info.name, "gamma") || strstr(info.name, "sky") || info.count != 1)
            continue;
        test_must(ctx, imp_scene_get_values(s, k, v));
        if (strstr(info.name, "vignetting")) {
            test_must(ctx, imp_scene_set_values(s, k, 1, &(double){0}));
            continue;
        }
        v[0] *= exp(0.3 * (2 * imp__u01(key, 100 + (uint32_t)k) - 1));
        if (!strstr(info.name, "left")) test_must(ctx, imp_scene_set_values(s, k, 1, v));
    }
    for (int c = 0; c < 2 && cameras; c++) {
        double v[6];
        for (uint32_t e = 0; e < 6; e++)
            v[e] = (e < 3 ? 0.04 : 0.017) *
                   (2 * imp__u01(key, 200 + 6 * (uint32_t)c + e) - 1);
        geometry_guess(s, c ? "right.pose" : "left.pose", v, 6);
        if (!lenses) continue;
        v[0] = 38 + 4 * imp__u01(key, 300 + (uint32_t)c);
        geometry_guess(s, c ? "right.x_fov" : "left.x_fov", v, 1);
        geometry_guess(s, c ? "right.opencv_k1" : "left.opencv_k1", &(double){0}, 1);
    }
}

static void one_case(uint64_t seed, bool cameras, struct record *r)
{
    const bool lenses = cameras && seed % 2 == 1;
    static float pixels[2][PIXELS];
    static const char *const hold[] = {"*.gamma.*", "sky.*", "left.exposure"};
    const struct imp_key key = imp__key(seed, 3, 0);
    const struct truth t = truth_of(key);
    imp_scene *s = scene_make(&t);
    photo_make(s, 0, 1000 + seed, true, pixels[0]);
    photo_make(s, 1, 2000 + seed, false, pixels[1]);
    guesses_set(s, key, cameras, lenses);
    const struct measured m = measure(s, pixels, 2, hold, 3,
                                      lenses    ? "cameras,lens,exposure,lights,materials"
                                      : cameras ? "cameras,exposure,lights,materials"
                                                : "exposure,lights,materials",
                                      seed);
    intervals_count(s, &m, &t, r);
    r->cases++;
    r->explained += m.result->explained;
    const struct imp_measure_photo *left =
                                       IMP_ROW(imp_measure_photo, m.result->photos, 0),
                                   *right =
                                       IMP_ROW(imp_measure_photo, m.result->photos, 1);
    for (int i = 0; i < PIXELS; i++) {
        const int x = i % WIDTH, y = i / WIDTH;
        const bool foreign = x >= 8 && x < 14 && y >= 8 && y < 12;
        const bool near = x >= 6 && x < 16 && y >= 6 && y < 15;
        r->foreign_masked += foreign && left->weights[i] == 0;
        r->others_masked += !near && left->weights[i] == 0;
        r->others_masked += right->weights[i] == 0;
    }
    if (!m.result->explained)
        for (size_t i = 0; i < m.result->n_lines; i++)
            printf("# case %d: %s\n", (int)seed, m.result->lines[i]);
    imp_problem_destroy(m.problem);
    imp_scene_destroy(s);
}

/* The lamp is held at half its radiance: 1 if it is named, 0 if it is not explained, -1: neither. */
static int wrong_lamp(uint64_t seed)
{
    static float pixels[2][PIXELS];
    static const char *const hold[] = {"*.gamma.*", "sky.*", "*.exposure.*", "lamp.*",
                                       "*.vignetting*"};
    const struct truth t = truth_of(imp__key(seed, 3, 0));
    imp_scene *s = scene_make(&t);
    size_t lamp;
    bool named = false;
    photo_make(s, 0, 3000 + seed, false, pixels[0]);
    photo_make(s, 1, 4000 + seed, false, pixels[1]);
    test_must(ctx, imp_scene_find_param(s, "lamp.radiance.value", &lamp));
    test_must(ctx, imp_scene_set_values(s, lamp, 1, &(double){0.5 * t.lamp}));
    const struct measured m = measure(s, pixels, 2, hold, 5, "materials", seed);
    for (size_t k = 0; k < m.result->n_missing; k++) {
        const struct imp_missing *row = IMP_ROW(imp_missing, m.result->missing, k);
        named |= row->param == lamp && row->chance < 0.05;
    }
    const int verdict = m.result->explained ? -1 : named;
    imp_problem_destroy(m.problem);
    imp_scene_destroy(s);
    return verdict;
}

int main(int argc, char **argv)
{
    const int cases = argc > 1 ? (strcmp(argv[1], "long") ? atoi(argv[1]) : 100) : 2;
    const bool cameras = argc > 1;
    const int lamps = argc > 1 ? cases / 2 + 1 : 1;
    struct record r = {0};
    int named = 0, unsaid = 0;
    test_must(NULL, imp_context_create(NULL, &ctx));
    for (int k = 0; k < cases; k++) one_case((uint64_t)k, cameras, &r);
    for (int k = 0; k < lamps; k++) {
        const int verdict = wrong_lamp((uint64_t)k);
        named += verdict == 1;
        unsaid += verdict < 0;
    }
    /* Numbers of a case are correlated: as if there were a third of them. */
    const double part = (double)r.inside / r.numbers,
                 se = sqrt(0.95 * 0.05 / (r.numbers / 3.));
    tap_ok(part > 0.95 - 3.5 * se, "95 %% intervals hold the truth # %d of %d", r.inside,
           r.numbers);
    tap_ok(r.wide <= r.numbers / 20 + 1, "their errors are bounded # %d of %d are wide",
           r.wide, r.numbers);
    tap_ok(r.explained >= r.cases - r.cases / 10, "photographs are explained # %d of %d",
           r.explained, r.cases);
    tap_ok(r.foreign_masked > 0.75 * 24 * r.cases &&
               r.others_masked < 0.02 * 2 * PIXELS * r.cases,
           "what is foreign is masked # %.0f %%, of the rest %.2f %%",
           100. * r.foreign_masked / (24 * r.cases),
           100. * r.others_masked / (2 * PIXELS * r.cases));
    tap_ok(unsaid <= lamps / 10 && named >= lamps - lamps / 10 - (lamps > 9),
           "a lamp that is wrong is named # %d of %d, %d explained", named, lamps,
           unsaid);
    imp_context_destroy(ctx);
    return tap_done();
}
