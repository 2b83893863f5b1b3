/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids of illuminances against closed forms, from both ends: planar, turned, cylindrical and
 * semicylindrical receivers below a point lamp and under skies; a rectangular lamp over a plane;
 * planes that are not there for light; and the coverage of intervals of averages, extremes and
 * uniformities, of numbers drawn by hand and of walks. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/stat.h"
#include <importon/rooms.h>
#include <math.h>

static imp_context *ctx;
enum { NX = 6, NY = 4, N = NX * NY };

#define HEAD                                                                             \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='%d'/></integrator>"
/* A grid of 6 x 4 points on [-3, 3] x [-2, 2] at z = 0. */
#define GRID                                                                             \
    "<shape type='rectangle' id='plane'><transform name='to_world'><scale x='3' y='2'/>" \
    "</transform><sensor type='irradiancemeter' id='grid'><boolean name='virtual' "      \
    "value='true'/><string name='at' value='%s'/>%s<string name='units' "                \
    "value='photometric'/><film type='hdrfilm'><integer name='width' value='6'/>"        \
    "<integer name='height' value='4'/></film></sensor></shape>"

static imp_scene *scene_of(int depth, const char *at, const char *receiver,
                           const char *rest)
{
    char xml[4096];
    snprintf(xml, sizeof xml, HEAD GRID "%s</scene>", depth, at, receiver, rest);
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* ---- Receivers ------------------------------------------------------------------------ */

static const double lamp_at[3] = {0.7, -0.4, 2.5};
#define LAMP                                                                             \
    "<emitter type='point'><point name='position' x='.7' y='-.4' z='2.5'/><rgb "         \
    "name='intensity' value='100'/></emitter>"
#define FACING "<vector name='facing' x='3' y='4' z='0'/>" /* (.6, .8, 0) */

enum receiver { PLANAR, TURNED, CYLINDRICAL, SEMI };
static const char *const receiver_xml[] = {
    "", FACING, "<string name='receiver' value='cylindrical'/>",
    "<string name='receiver' value='semicylindrical'/>" FACING};
static const char *const receiver_name[] = {"planar", "planar, turned", "cylindrical",
                                            "semicylindrical"};

/* Weight of direction w of the receiver: dE = weight L dw. */
static double weight(enum receiver r, const double w[3])
{
    const double across = hypot(w[0], w[1]), towards = .6 * w[0] + .8 * w[1];
    switch (r) {
    case PLANAR: return fmax(w[2], 0);
    case TURNED: return fmax(towards, 0);
    case CYLINDRICAL: return across / M_PI;
    case SEMI: return (across + towards) / M_PI;
    }
    return 0;
}

static void point_lamp(void)
{
    static const enum imp_from ends[2] = {IMP_FROM_SENSOR, IMP_FROM_LIGHTS};
    for (int r = 0; r < 4; r++) {
        imp_scene *s = scene_of(2, "points", receiver_xml[r], LAMP);
        double p[3 * N], normal[3 * N];
        test_must(ctx, imp_grid_points(s, 0, p, normal));
        for (int e = 0; e < 2; e++) {
            struct imp_run run = IMP_RUN_INIT;
            struct imp_estimate mean;
            double value[N], se[N], worst = 0, widest = 0, truth_mean = 0;
            int64_t sets;
            run.from = ends[e];
            run.spp = e ? 40000 : 16;
            test_must(ctx, imp_grid_read(s, &run, value, se, &mean, &sets));
            for (int i = 0; i < N; i++) {
                double d[3], r2 = 0;
                for (int k = 0; k < 3; k++)
                    d[k] = lamp_at[k] - p[3 * i + k], r2 += d[k] * d[k];
                for (int k = 0; k < 3; k++) d[k] /= sqrt(r2);
                const double truth = 100 * weight((enum receiver)r, d) / r2;
                truth_mean += truth / N;
                /* Floats of a picture: 6e-8. */
                worst =
                    fmax(worst, fabs(value[i] - truth) / (se[i] + 2e-7 * truth + 1e-12));
                widest = fmax(widest, se[i] / (truth + 1));
            }
            tap_ok(worst < 4.5 && widest < (e ? .02 : 1e-6) && sets > 1,
                   "point lamp, %s, from the %s: worst %.2f, relative error %.1e",
                   receiver_name[r], e ? "lights" : "sensor", worst, widest);
            const double z = (mean.value - truth_mean) / (mean.se + 2e-7 * truth_mean);
            tap_ok(fabs(z) < 4.5 && mean.se < .01 * truth_mean, "and the average: z %.2f",
                   z);
        }
        tap_ok(normal[2] == 1 && p[0] == -2.5 && p[1] == -1.5 && p[3 * N - 1] == 0,
               "places are the middles of cells");
        imp_scene_destroy(s);
    }
}

/* Under L = 2 from everywhere: pi L of all receivers but the turned one, too. */
static void constant_sky(void)
{
    for (int r = 0; r < 4; r++) {
        imp_scene *s = scene_of(2, r % 2 ? "cells" : "points", receiver_xml[r],
                                "<emitter type='constant'><rgb name='radiance' "
                                "value='2'/></emitter>");
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate mean;
        double value[N], se[N];
        run.spp = 4096;
        test_must(ctx, imp_grid_read(s, &run, value, se, &mean, NULL));
        const double z = (mean.value - 2 * M_PI) / fmax(mean.se, 1e-6);
        tap_ok(fabs(z) < 4.5 && mean.se < .01, "sky, %s: %.5f +- %.1e, z %.2f",
               receiver_name[r], mean.value, mean.se, z);
        imp_scene_destroy(s);
    }
}

/* ---- A rectangular lamp over the plane ------------------------------------------------ */

/* Configuration factor of a rectangle a x b at distance c, seen from below its corner
 * (Howell, Catalog of radiation configuration factors, B-3). */
static double corner_factor(double a, double b, double c)
{
    const double sign = (a < 0) == (b < 0) ? 1 : -1;
    const double x = fabs(a) / c, y = fabs(b) / c;
    const double p = sqrt(1 + x * x), q = sqrt(1 + y * y);
    return sign / (2 * M_PI) * (x / p * atan(y / p) + y / q * atan(x / q));
}
/* Of [x0, x1] x [y0, y1] at height h, from (x, y) on the plane. */
static double lamp_factor(double x, double y, double h)
{
    const double x0 = -1 - x, x1 = 1 - x, y0 = -.5 - y, y1 = .5 - y;
    return corner_factor(x1, y1, h) - corner_factor(x0, y1, h) -
           corner_factor(x1, y0, h) + corner_factor(x0, y0, h);
}
#define PANEL                                                                            \
    "<shape type='rectangle'><transform name='to_world'><scale x='1' y='.5'/><rotate "   \
    "x='1' angle='180'/><translate z='2'/></transform><emitter type='area'><rgb "        \
    "name='radiance' value='50'/></emitter></shape>"

static void truth_of_panel(const double *p, double truth[N])
{
    for (int i = 0; i < N; i++)
        truth[i] = 50 * M_PI * lamp_factor(p[3 * i], p[3 * i + 1], 2);
}

static void panel(void)
{
    /* A black plate close below the virtual plane, and another plane above it that is virtual:
     * neither takes light from the grid. */
    imp_scene *s = scene_of(
        2, "points", "",
        PANEL "<shape type='rectangle'><transform name='to_world'><scale x='9' y='9'/>"
              "<translate z='1'/></transform><sensor type='irradiancemeter'><boolean "
              "name='virtual' value='true'/><string name='units' value='photometric'/>"
              "<film type='hdrfilm'><integer name='width' value='1'/><integer "
              "name='height' value='1'/></film></sensor></shape>");
    double p[3 * N], truth[N], value[N], se[N];
    test_must(ctx, imp_grid_points(s, 0, p, NULL));
    truth_of_panel(p, truth);
    for (int e = 0; e < 2; e++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate mean;
        double worst = 0, widest = 0;
        run.from = e ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR;
        run.spp = e ? 40000 : 16384;
        test_must(ctx, imp_grid_read(s, &run, value, se, &mean, NULL));
        for (int i = 0; i < N; i++) {
            worst = fmax(worst, fabs(value[i] - truth[i]) / se[i]);
            widest = fmax(widest, se[i] / truth[i]);
        }
        tap_ok(worst < 4.5 && widest < .02,
               "a panel, from the %s: worst z %.2f of %d points, "
               "relative error at most %.1e",
               e ? "lights" : "sensor", worst, N, widest);
    }
    imp_scene_destroy(s);
}

/* ---- Intervals ------------------------------------------------------------------------ */

enum { AVERAGE, MINIMUM, MAXIMUM, UNIFORMITY, DIVERSITY, NUMBERS };
static const char *const number_name[] = {"average", "minimum", "maximum", "uniformity",
                                          "diversity"};

static void covered_add(const struct imp_grid_summary *s, const double *truth, int n,
                        int covered[NUMBERS])
{
    double t[NUMBERS] = {0, INFINITY, -INFINITY, 0, 0};
    for (int i = 0; i < n; i++) {
        t[AVERAGE] += truth[i] / n;
        t[MINIMUM] = fmin(t[MINIMUM], truth[i]);
        t[MAXIMUM] = fmax(t[MAXIMUM], truth[i]);
    }
    t[UNIFORMITY] = t[MINIMUM] / t[AVERAGE];
    t[DIVERSITY] = t[MINIMUM] / t[MAXIMUM];
    const struct imp_interval_estimate *e[NUMBERS] = {
        &s->average, &s->minimum, &s->maximum, &s->uniformity, &s->diversity};
    for (int k = 0; k < NUMBERS; k++) covered[k] += e[k]->lo <= t[k] && t[k] <= e[k]->hi;
}

/* Of `runs` intervals of 95 %, 93 % or more, less what chance takes of them; the average, which
 * is not conservative, 97 % at most, and so the minimum where one point is the least for sure. */
static void covered_judge(const char *what, bool sure, const int covered[NUMBERS],
                          int runs)
{
    const double chance = 2.6 * sqrt(.95 * .05 / runs);
    for (int k = 0; k < NUMBERS; k++) {
        const double share = (double)covered[k] / runs;
        tap_ok(share >= fmin(.93, .95 - chance) &&
                   ((k != AVERAGE && !(sure && k == MINIMUM)) ||
                    share <= fmax(.97, .95 + chance)),
               "%s, %s: %.1f %% of %d intervals hold", what, number_name[k], 100 * share,
               runs);
    }
}

/* Normal numbers about: one value everywhere; a ramp; one low point among equals; half of them
 * low; a low point that is not sure to be; two low points. */
static double truth_of(int kind, int i)
{
    switch (kind) {
    case 0: return 500;
    case 1: return 400 + 2. * i;
    case 2: return i == 17 ? 300 : 500;
    case 3: return i % 2 ? 500 : 485;
    case 4: return i == 17 ? 490 : 500;
    default: return i == 17 || i == 19 ? 300 : 500;
    }
}
static void drawn(void)
{
    enum { POINTS = 100, RUNS = 1000 };
    static const char *const shape[] = {"equal values",   "a ramp",
                                        "one low point",  "half of them low",
                                        "one hardly low", "two low points"};
    for (int kind = 0; kind < 6; kind++) {
        int covered[NUMBERS] = {0};
        double truth[POINTS], se[POINTS], low = 0;
        for (int i = 0; i < POINTS; i++) {
            truth[i] = truth_of(kind, i);
            se[i] = 5 + .1 * i;
        }
        for (unsigned r = 0; r < RUNS; r++) {
            struct imp_grid_summary s = IMP_GRID_SUMMARY_INIT;
            double value[POINTS];
            s.size = sizeof s;
            for (unsigned i = 0; i < POINTS; i++)
                value[i] = truth[i] + se[i] * imp__normal_quantile(imp__u01(
                                                  imp__key(5, r, i), (uint32_t)kind));
            test_must(ctx, imp_grid_summarise(ctx, POINTS, value, se, NULL, 0, 0, &s));
            covered_add(&s, truth, POINTS, covered);
            low += s.minimum.value / RUNS;
        }
        covered_judge(shape[kind], kind == 2, covered, RUNS);
        if (kind == 0)
            tap_ok(low < 490, "and the least of noisy values is biased low: %.1f of 500",
                   low);
    }
}

static void walked(void)
{
    enum { RUNS = 200 };
    imp_scene *s = scene_of(2, "points", "", PANEL);
    double p[3 * N], truth[N];
    test_must(ctx, imp_grid_points(s, 0, p, NULL));
    truth_of_panel(p, truth);
    for (int e = 0; e < 2; e++) {
        int covered[NUMBERS] = {0};
        for (int r = 0; r < RUNS; r++) {
            struct imp_run run = IMP_RUN_INIT;
            struct imp_grid_summary g = IMP_GRID_SUMMARY_INIT;
            struct imp_estimate mean;
            double value[N], se[N];
            int64_t sets;
            run.from = e ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR;
            run.seed = (uint64_t)r + 1;
            run.spp = e ? 1024 : 64;
            g.size = sizeof g;
            test_must(ctx, imp_grid_read(s, &run, value, se, &mean, &sets));
            test_must(ctx, imp_grid_summarise(ctx, N, value, se, &mean, sets, 0, &g));
            covered_add(&g, truth, N, covered);
        }
        covered_judge(e ? "light walks" : "walks from the sensor", false, covered, RUNS);
    }
    imp_scene_destroy(s);
}

/* ---- The norm's spacing, and what is refused ------------------------------------------ */

static void spacing(void)
{
    /* 12 m x 8 m less a band of .5 m: 11 x 7, d = 11: p = .2 x 5^log10(11) = 1.069; 10 x 7. */
    static const struct {
        const char *scale, *more;
        int width, height;
    } rows[] = {{"<scale x='6' y='4'/>", "<float name='margin' value='.5'/>", 10, 7},
                {"<scale x='6' y='4'/>", "<float name='spacing' value='2'/>", 6, 4},
                /* ratio 3: d is the shorter side, 4 m: p = .527; 23 x 8 */
                {"<scale x='6' y='2'/>", "", 23, 8},
                /* the same in millimetres */
                {"<scale x='6000' y='2000'/>",
                 "<float name='metres_per_unit' value='.001'/>", 23, 8},
                /* 400 m: 10 m at most */
                {"<scale x='200' y='200'/>", "", 40, 40}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char xml[2048];
        struct imp_sensor_info info = {.size = sizeof info};
        snprintf(xml, sizeof xml,
                 HEAD
                 "<emitter type='constant'/><shape type='rectangle'><transform "
                 "name='to_world'>%s</transform><sensor type='irradiancemeter'><string "
                 "name='at' value='points'/>%s</sensor></shape></scene>",
                 2, rows[k].scale, rows[k].more);
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        test_must(ctx, imp_scene_get_sensor(s, 0, &info));
        tap_ok(info.width == rows[k].width && info.height == rows[k].height,
               "grid of %s: %d x %d", rows[k].scale, info.width, info.height);
        imp_scene_destroy(s);
    }
}

static void refused(void)
{
    static const struct {
        const char *meter, *says;
    } rows[] = {
        {"<string name='receiver' value='cylindrical'/>", "its shape is virtual"},
        {"<boolean name='virtual' value='true'/><string name='receiver' "
         "value='semicylindrical'/>",
         "'facing' is missing"},
        {"<boolean name='virtual' value='true'/><string name='receiver' "
         "value='semicylindrical'/><vector name='facing' x='0' y='0' z='1'/>",
         "no part across"},
        {"<boolean name='virtual' value='true'/><string name='receiver' "
         "value='cylindrical'/>" FACING,
         "all sides alike"},
        {"<string name='at' value='points'/><float name='margin' value='1'/>",
         "leaves nothing of a side"},
        {"<float name='margin' value='.1'/>", "margin"},
        {"<string name='at' value='points'/><vector name='facing' x='1' y='0' z='0'/>",
         "faces otherwise"},
        {"<string name='at' value='points'/><film type='hdrfilm'><rfilter "
         "type='tent'/></film>",
         "mixes neighbouring points"},
        {"<string name='at' value='points'/><float name='spacing' value='1'/><film "
         "type='hdrfilm'><integer name='width' value='4'/></film>",
         "how many points"}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        char xml[2048];
        imp_scene *s = NULL;
        snprintf(xml, sizeof xml,
                 HEAD "<emitter type='constant'/><shape type='rectangle'><sensor "
                      "type='irradiancemeter'>%s</sensor></shape></scene>",
                 2, rows[k].meter);
        const enum imp_status st =
            imp_scene_load_string(ctx, xml, strlen(xml), "test", NULL, &s);
        tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(ctx), rows[k].says) &&
                   strncmp(imp_last_error(ctx), "test:1:", 7) == 0,
               "%s", imp_last_error(ctx));
        imp_scene_destroy(s);
    }
    struct imp_grid_summary g = IMP_GRID_SUMMARY_INIT;
    const double one = 1, bad = -1;
    g.size = sizeof g;
    tap_ok(imp_grid_summarise(ctx, 0, &one, &one, NULL, 0, 0, &g) == IMP_E_ARG &&
               imp_grid_summarise(ctx, 1, &one, &bad, NULL, 0, 0, &g) == IMP_E_ARG &&
               imp_grid_summarise(ctx, 1, &one, &one, NULL, 0, 1, &g) == IMP_E_ARG,
           "no points, negative errors, certainty");
    imp_scene *s = scene_of(2, "points", "", LAMP);
    double p[3 * N];
    tap_ok(imp_grid_points(s, 1, p, NULL) == IMP_E_ARG, "no such sensor");
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    point_lamp();
    constant_sky();
    panel();
    drawn();
    walked();
    spacing();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}
