/* SPDX-License-Identifier: Apache-2.0
 *
 * Designs (importon/design.h): point lamps over a plane, where the answer is arithmetic; area lamps,
 * whose illuminances are integrals, for the coverage of what is said to hold; glare limits against
 * the rating of the scene that the answer makes; what cannot be had; the same bits on
 * any number of threads. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/design.h>
#include <importon/rooms.h>
#include <math.h>
#include <string.h>

static imp_context *ctx;
enum { NX = 6, NY = 4, N = NX * NY, LAMPS = 3 };

/* A grid of 6 x 4 points on [-3, 3] x [-2, 2] at z = 0. */
#define GRID                                                                             \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='2'/></integrator><shape type='rectangle' id='plane'><transform "             \
    "name='to_world'><scale x='3' y='2'/></transform><sensor type='irradiancemeter' "    \
    "id='grid'><boolean name='virtual' value='true'/><string name='at' "                 \
    "value='points'/><sampler type='independent'><integer name='sample_count' "          \
    "value='16'/></sampler><film type='hdrfilm'><integer name='width' value='6'/>"       \
    "<integer name='height' value='4'/></film></sensor></shape>"

static const double place[LAMPS][3] = {{-2, 0.5, 2}, {0.4, -0.7, 2.2}, {2.1, 0.3, 2}};
static const double strength[LAMPS] = {40, 60, 50};

static double px(int i) { return -3 + (i % NX + 0.5) * 6 / NX; }
static double py(int i) { return 2 - (i / NX + 0.5) * 4 / NY; }

static imp_scene *points_scene(imp_context *context)
{
    char xml[4096] = GRID;
    for (int j = 0; j < LAMPS; j++)
        snprintf(
            xml + strlen(xml), sizeof xml - strlen(xml),
            "<emitter type='point' id='lamp_%d'><point name='position' x='%g' y='%g' "
            "z='%g'/><rgb name='intensity' value='%g'/></emitter>",
            j, place[j][0], place[j][1], place[j][2], strength[j]);
    strcat(xml, "</scene>");
    return test_scene_text(context, xml, IMP_MONO);
}

/* E = I cos / r^2 = I h / r^3. */
static void points_truth(double e[LAMPS][N])
{
    for (int j = 0; j < LAMPS; j++)
        for (int i = 0; i < N; i++) {
            const double x = px(i) - place[j][0], y = py(i) - place[j][1],
                         h = place[j][2];
            e[j][i] = strength[j] * h / pow(x * x + y * y + h * h, 1.5);
        }
}

static struct imp_design_lamp lamp_of(const char *name, double watts)
{
    struct imp_design_lamp l = IMP_DESIGN_LAMP_INIT;
    l.lamp = name;
    l.watts = watts;
    return l;
}
static struct imp_design_want want_of(enum imp_design_want_of of, double value)
{
    struct imp_design_want w = IMP_DESIGN_WANT_INIT;
    w.of = of;
    w.value = value;
    return w;
}
static const struct imp_design_finding *finding(const imp_design *d, size_t k)
{
    return IMP_ROW(imp_design_finding, imp_design_result(d)->wants, k);
}

/* ---- Points: the answer is arithmetic ------------------------------------------------------- */

static double least_of(double e[LAMPS][N], const double *x)
{
    double least = INFINITY;
    for (int i = 0; i < N; i++) {
        double sum = 0;
        for (int j = 0; j < LAMPS; j++) sum += e[j][i] * x[j];
        least = fmin(least, sum);
    }
    return least;
}

/* Fewest watts by a grid of levels of two lamps, the third by what is missing. */
static double watts_by_trial(double e[LAMPS][N], const double *watts, double wanted)
{
    enum { STEPS = 400 };
    double best = INFINITY;
    for (int a = -1; a <= STEPS; a++)
        for (int b = -1; b <= STEPS; b++) {
            const double x = a < 0 ? 0 : 0.1 + 0.9 * a / STEPS,
                         y = b < 0 ? 0 : 0.1 + 0.9 * b / STEPS;
            double z = 0;
            for (int i = 0; i < N; i++)
                z = fmax(z, (wanted - e[0][i] * x - e[1][i] * y) / e[2][i]);
            if (z > 1) continue;
            if (z > 0) z = fmax(z, 0.1);
            best = fmin(best, watts[0] * x + watts[1] * y + watts[2] * z);
        }
    return best;
}

static void test_points(void)
{
    double e[LAMPS][N];
    const double watts[LAMPS] = {10, 25, 11};
    imp_scene *s = points_scene(ctx);
    points_truth(e);
    struct imp_design_lamp lamps[LAMPS] = {lamp_of("lamp_0", watts[0]),
                                           lamp_of("lamp_1", watts[1]),
                                           lamp_of("lamp_2", watts[2])};
    for (int t = 0; t < 3; t++) {
        const double wanted = (double[]){2, 3.2, 4.2}[t];
        const struct imp_design_want w = want_of(IMP_WANT_MINIMUM, wanted);
        imp_design *d = NULL;
        test_must(ctx, imp_design_find(s, lamps, LAMPS, &w, 1, NULL, NULL, &d));
        const struct imp_design_answer *a = imp_design_result(d);
        const double trial = watts_by_trial(e, watts, wanted);
        const double least = least_of(e, a->level);
        tap_ok(a->found && a->holds && a->watts <= trial + 1e-6 &&
                   a->watts > trial - 0.05 && least > wanted * (1 - 1e-6) &&
                   fabs(finding(d, 0)->value - least) < 1e-5 * least && a->margin < 1e-6,
               "points, at least %g # %.4f W, by trial %.4f W; least %.6f, said %.6f",
               wanted, a->watts, trial, least, finding(d, 0)->value);
        imp_design_destroy(d);
    }
    /* One lamp: level = wanted / least, and its price is watts / least. */
    const double one[LAMPS] = {0, 1, 0}, least = least_of(e, one);
    const struct imp_design_want w = want_of(IMP_WANT_MINIMUM, 0.6 * least);
    imp_design *d = NULL;
    test_must(ctx, imp_design_find(s, &lamps[1], 1, &w, 1, NULL, NULL, &d));
    /* The others shine as they are. */
    const double rest[LAMPS] = {1, 0, 1};
    tap_ok(imp_design_result(d)->level[0] == 0 && least_of(e, rest) > 0.6 * least,
           "no lamp where the others are enough");
    imp_design_destroy(d);
    imp_scene_destroy(s);
}

static void test_places(void)
{
    double e[LAMPS][N];
    imp_scene *s = points_scene(ctx);
    points_truth(e);
    struct imp_design_lamp lamps[LAMPS] = {lamp_of("lamp_0", 10), lamp_of("lamp_1", 25),
                                           lamp_of("lamp_2", 11)};
    double least = INFINITY;
    for (int j = 0; j < LAMPS; j++) {
        double one[LAMPS] = {0};
        one[j] = 1;
        least = fmin(least, least_of(e, one));
        lamps[j].place = "here";
        lamps[j].needed = true;
    }
    struct imp_design_want w = want_of(IMP_WANT_MINIMUM, 0.9 * least);
    struct imp_design_options o = IMP_DESIGN_OPTIONS_INIT;
    imp_design *d = NULL;
    o.others = 3;
    o.within = 100;
    test_must(ctx, imp_design_find(s, lamps, LAMPS, &w, 1, &o, NULL, &d));
    const struct imp_design_answer *a = imp_design_result(d);
    /* Each lamp alone, where it is enough. */
    double best = INFINITY;
    size_t enough = 0;
    for (int j = 0; j < LAMPS; j++) {
        double x[LAMPS] = {0};
        x[j] = 1;
        const double level = w.value / least_of(e, x);
        if (level > 1) continue;
        enough++;
        best = fmin(best, fmax(level, 0.1) * lamps[j].watts);
    }
    tap_ok(a->found && fabs(a->watts - best) < 1e-5 * best && a->n_others == enough - 1 &&
               enough == LAMPS,
           "one lamp of a place # %.5f W, by hand %.5f; %zu others of %zu", a->watts,
           best, a->n_others, enough - 1);
    const double price = finding(d, 0)->price;
    tap_ok(fabs(price - a->watts / w.value) < 1e-5 * price,
           "price of the minimum # %.6g W per unit, by hand %.6g", price,
           a->watts / w.value);
    imp_design_destroy(d);
    /* By cost, the cheapest that is enough. */
    o.least = IMP_LEAST_COST;
    o.others = 0;
    for (int j = 0; j < LAMPS; j++) lamps[j].cost = 100 - 10 * j, lamps[j].place = NULL;
    for (int j = 0; j < LAMPS; j++) lamps[j].needed = false;
    test_must(ctx, imp_design_find(s, lamps, LAMPS, &w, 1, &o, NULL, &d));
    double cheapest = INFINITY;
    for (int set = 1; set < 8; set++) {
        double x[LAMPS], cost = 0;
        for (int j = 0; j < LAMPS; j++) {
            x[j] = set >> j & 1;
            cost += x[j] * lamps[j].cost;
        }
        if (least_of(e, x) >= w.value) cheapest = fmin(cheapest, cost);
    }
    tap_ok(imp_design_result(d)->cost == cheapest, "fewest costs # %g, of all sets %g",
           imp_design_result(d)->cost, cheapest);
    imp_design_destroy(d);
    imp_scene_destroy(s);
}

static void test_none(void)
{
    double e[LAMPS][N], full = 0;
    imp_scene *s = points_scene(ctx);
    points_truth(e);
    const struct imp_design_lamp lamps[LAMPS] = {
        lamp_of("lamp_0", 10), lamp_of("lamp_1", 25), lamp_of("lamp_2", 11)};
    for (int j = 0; j < LAMPS; j++)
        for (int i = 0; i < N; i++) full += e[j][i] / N;
    const struct imp_design_want w[2] = {want_of(IMP_WANT_AVERAGE, 1.3 * full),
                                         want_of(IMP_WANT_MAXIMUM, 1.4 * full)};
    imp_design *d = NULL;
    test_must(ctx, imp_design_find(s, lamps, LAMPS, w, 2, NULL, NULL, &d));
    const struct imp_design_answer *a = imp_design_result(d);
    const double alone = finding(d, 0)->alone, with = finding(d, 0)->attainable;
    tap_ok(!a->found && a->proven && fabs(alone - full) < 1e-3 * full && with < alone &&
               with > 0,
           "what cannot be had # average %.5g of at most %.5g; below the maximum %.5g",
           alone, full, with);
    imp_design_destroy(d);
    tap_ok(imp_design_enough(IMP_WANT_UNIFORMITY, 0.81 * (1 - 1e-8), 0.81) &&
               !imp_design_enough(IMP_WANT_UNIFORMITY, 0.8099, 0.81) &&
               imp_design_enough(IMP_WANT_UGR, 19 * (1 + 1e-8), 19) &&
               !imp_design_enough(IMP_WANT_UGR, 19.001, 19) &&
               !imp_design_enough(IMP_WANT_AVERAGE, NAN, 1),
           "a bound that is met exactly holds");
    /* The best that can be had does not depend on what was asked for. */
    double worst = 0;
    for (int k = 0; k < 4; k++) {
        const double most[LAMPS] = {1, 1, 1}, least = least_of(e, most);
        const double factor = (double[]){1.001, 3, 100, 1e5}[k];
        const struct imp_design_want v[2] = {
            want_of(IMP_WANT_AVERAGE, k < 2 ? 0.9 * full : factor * full),
            want_of(IMP_WANT_MINIMUM, factor * least)};
        test_must(ctx, imp_design_find(s, lamps, LAMPS, v, 2, NULL, NULL, &d));
        worst = fmax(worst, fabs(finding(d, 0)->alone / full - 1));
        worst = fmax(worst, fabs(finding(d, 1)->alone / least - 1));
        imp_design_destroy(d);
    }
    tap_ok(worst < 3e-6, "the best that can be had, whatever is wanted # error %.2g",
           worst);
    imp_scene_destroy(s);
}

/* Uniformity alone: some lamps are lit, since without light it is not defined. */
static void test_lit(void)
{
    enum { STEPS = 60 };
    double e[LAMPS][N], best = 0;
    imp_scene *s = points_scene(ctx);
    points_truth(e);
    const struct imp_design_lamp lamps[LAMPS] = {
        lamp_of("lamp_0", 10), lamp_of("lamp_1", 25), lamp_of("lamp_2", 11)};
    for (int k = 1; k < (STEPS + 1) * (STEPS + 1) * (STEPS + 1); k++) {
        const double x[LAMPS] = {k % (STEPS + 1), k / (STEPS + 1) % (STEPS + 1),
                                 k / (STEPS + 1) / (STEPS + 1)};
        double average = 0;
        bool is_level = true; /* 0, or a tenth or more */
        for (int j = 0; j < LAMPS; j++) is_level &= x[j] == 0 || x[j] >= 0.1 * STEPS;
        for (int j = 0; j < LAMPS; j++)
            for (int i = 0; i < N; i++) average += e[j][i] * x[j] / N;
        if (!is_level) continue;
        best = fmax(best, least_of(e, x) / average);
    }
    for (int t = 0; t < 2; t++) {
        const double wanted = t ? 0.95 * best : fmin(1.1 * best, 0.99);
        const struct imp_design_want w = want_of(IMP_WANT_UNIFORMITY, wanted);
        imp_design *d = NULL;
        test_must(ctx, imp_design_find(s, lamps, LAMPS, &w, 1, NULL, NULL, &d));
        const struct imp_design_answer *a = imp_design_result(d);
        const double value = finding(d, 0)->value;
        if (t)
            tap_ok(a->found && a->holds && a->watts > 1 && value >= wanted * (1 - 1e-6),
                   "a uniformity needs light # %.4g W, %.4f of at least %.4f", a->watts,
                   value, wanted);
        else
            tap_ok(!a->found && a->proven && value > best - 1e-6 && value < 1.01 * best,
                   "the best uniformity # %.5f, by trial %.5f", value, best);
        imp_design_destroy(d);
    }
    imp_scene_destroy(s);
}

/* ---- Area lamps: coverage -------------------------------------------------------------------- */

static imp_scene *areas_scene(imp_context *context)
{
    char xml[4096] = GRID;
    for (int j = 0; j < LAMPS; j++)
        snprintf(
            xml + strlen(xml), sizeof xml - strlen(xml),
            "<shape type='rectangle' id='lamp_%d'><transform name='to_world'><scale "
            "value='.5'/><rotate x='1' angle='180'/><translate x='%g' y='%g' z='%g'/>"
            "</transform><emitter type='area' id='area_%d'><rgb name='radiance' "
            "value='%g'/></emitter><bsdf type='diffuse'><rgb name='reflectance' "
            "value='0'/></bsdf></shape>",
            j, place[j][0], place[j][1], place[j][2], j, strength[j]);
    strcat(xml, "</scene>");
    return test_scene_text(context, xml, IMP_MONO);
}

/* E = L int h^2 / r^4 dA over a square of side 1. */
static void areas_truth(double e[LAMPS][N])
{
    enum { Q = 60 };
    for (int j = 0; j < LAMPS; j++)
        for (int i = 0; i < N; i++) {
            double sum = 0;
            for (int a = 0; a < Q; a++)
                for (int b = 0; b < Q; b++) {
                    const double x = px(i) - place[j][0] + (a + 0.5) / Q - 0.5,
                                 y = py(i) - place[j][1] + (b + 0.5) / Q - 0.5,
                                 h = place[j][2], r2 = x * x + y * y + h * h;
                    sum += h * h / (r2 * r2);
                }
            e[j][i] = strength[j] * sum / (Q * Q);
        }
}

static void test_coverage(bool all)
{
    const int runs = all ? 400 : 120;
    double e[LAMPS][N];
    int found = 0, shown = 0, wrong = 0, average_covered = 0, minimum_covered = 0;
    imp_scene *s = areas_scene(ctx);
    areas_truth(e);
    const struct imp_design_lamp lamps[LAMPS] = {
        lamp_of("area_0", 10), lamp_of("area_1", 25), lamp_of("area_2", 11)};
    double full = 0;
    for (int j = 0; j < LAMPS; j++)
        for (int i = 0; i < N; i++) full += e[j][i] / N;
    for (int k = 0; k < runs; k++) {
        const struct imp_design_want w[2] = {want_of(IMP_WANT_AVERAGE, 0.6 * full),
                                             want_of(IMP_WANT_UNIFORMITY, 0.35)};
        struct imp_design_options o = IMP_DESIGN_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        imp_design *d = NULL;
        run.seed = 1000 + (uint64_t)k;
        run.points = IMP_POINTS_INDEPENDENT;
        o.confidence = 0.8;
        o.rounds = 1;
        test_must(ctx, imp_design_find(s, lamps, LAMPS, w, 2, &o, &run, &d));
        const struct imp_design_answer *a = imp_design_result(d);
        if (a->found) {
            double average = 0;
            for (int j = 0; j < LAMPS; j++)
                for (int i = 0; i < N; i++) average += e[j][i] * a->level[j] / N;
            const double uniformity = least_of(e, a->level) / average;
            found++;
            average_covered += finding(d, 0)->sure <= average;
            minimum_covered += finding(d, 1)->sure <= uniformity;
            shown += a->holds;
            wrong += a->holds && (average < w[0].value || uniformity < w[1].value);
        }
        imp_design_destroy(d);
    }
    const double sd = sqrt(0.8 * 0.2 / found), covered = (double)average_covered / found;
    tap_ok(
        found > 0.95 * runs && shown > 0.5 * runs && wrong <= 0.2 * shown,
        "what is said to hold with 80 %% holds # of %d: %d found, %d shown, %d of these "
        "wrong",
        runs, found, shown, wrong);
    tap_ok(fabs(covered - 0.8) < 4.5 * sd, "bound of an average # covers %.3f, sd %.3f",
           covered, sd);
    tap_ok((double)minimum_covered / found > 0.8 - 4.5 * sd,
           "bound of a uniformity # covers %.3f", (double)minimum_covered / found);
    imp_scene_destroy(s);
}

/* All rounds: more walks until it is shown. */
static void test_rounds(void)
{
    double e[LAMPS][N];
    int shown = 0, wrong = 0;
    enum { RUNS = 40 };
    imp_scene *s = areas_scene(ctx);
    areas_truth(e);
    const struct imp_design_lamp lamps[LAMPS] = {
        lamp_of("area_0", 10), lamp_of("area_1", 25), lamp_of("area_2", 11)};
    for (int k = 0; k < RUNS; k++) {
        const struct imp_design_want w = want_of(IMP_WANT_MINIMUM, 1.2);
        struct imp_run run = IMP_RUN_INIT;
        imp_design *d = NULL;
        run.seed = (uint64_t)k;
        test_must(ctx, imp_design_find(s, lamps, LAMPS, &w, 1, NULL, &run, &d));
        const struct imp_design_answer *a = imp_design_result(d);
        shown += a->found && a->holds;
        wrong += a->found && a->holds && least_of(e, a->level) < 1.2;
        imp_design_destroy(d);
    }
    tap_ok(shown >= RUNS - 2 && wrong <= 4, "rounds # of %d %d shown, %d of these wrong",
           RUNS, shown, wrong);
    imp_scene_destroy(s);
}

/* ---- Glare ------------------------------------------------------------------------------------ */

static void test_glare(void)
{
    imp_scene *s = test_scene(ctx, "office.xml", IMP_MONO, NULL);
    struct imp_design_lamp lamps[6];
    static char name[6][16];
    for (int k = 0; k < 6; k++) {
        snprintf(name[k], sizeof name[k], "lamp_%d%d", 1 + k / 3, 1 + k % 3);
        lamps[k] = lamp_of(name[k], 0);
        lamps[k].least = 0.05;
    }
    struct imp_design_want w[2] = {want_of(IMP_WANT_AVERAGE, 450),
                                   want_of(IMP_WANT_UGR, 19)};
    w[1].sensor = 3;
    struct imp_run run = IMP_RUN_INIT;
    imp_design *d = NULL;
    run.spp = 64;
    test_must(ctx, imp_design_find(s, lamps, 6, w, 2, NULL, &run, &d));
    const struct imp_design_answer *a = imp_design_result(d);
    double worst = -INFINITY, worst_se = 0, ugr[64], se[64];
    for (int k = 0; k < 6 && a->found; k++) {
        char param[64];
        size_t at;
        snprintf(param, sizeof param, "%s.scale.value", name[k]);
        test_must(ctx, imp_scene_find_param(s, param, &at));
        test_must(ctx, imp_scene_set_values(s, at, 1, &a->level[k]));
    }
    struct imp_sensor_info info = {.size = sizeof info};
    test_must(ctx, imp_scene_get_sensor(s, 3, &info));
    run.sensor = 3;
    run.spp = 1024;
    run.seed = 77;
    test_must(ctx, imp_grid_glare(s, &run, ugr, se));
    for (int i = 0; i < info.width * info.height; i++)
        if (ugr[i] > worst) worst = ugr[i], worst_se = se[i];
    const struct imp_design_finding *f = finding(d, 1);
    tap_ok(
        a->found && a->holds && worst < 19 + 3 * worst_se && f->binding && f->price < 0 &&
            fabs(worst - f->value) < 0.5,
        "a glare limit # %.1f W; wanted 19, said %.3f (at most %.3f), rated %.3f +- %.3f",
        a->watts, f->value, f->sure, worst, worst_se);
    imp_design_destroy(d);
    imp_scene_destroy(s);
}

/* ---- Bits ---------------------------------------------------------------------------------------- */

static void test_bits(void)
{
    double level[2][LAMPS], sure[2];
    for (int k = 0; k < 2; k++) {
        imp_context *own = test_context(k ? 3 : 1);
        imp_scene *s = areas_scene(own);
        const struct imp_design_lamp lamps[LAMPS] = {
            lamp_of("area_0", 10), lamp_of("area_1", 25), lamp_of("area_2", 11)};
        const struct imp_design_want w = want_of(IMP_WANT_MINIMUM, 1.2);
        imp_design *d = NULL;
        test_must(own, imp_design_find(s, lamps, LAMPS, &w, 1, NULL, NULL, &d));
        memcpy(level[k], imp_design_result(d)->level, sizeof level[k]);
        sure[k] = finding(d, 0)->sure;
        imp_design_destroy(d);
        imp_scene_destroy(s);
        imp_context_destroy(own);
    }
    tap_ok(!memcmp(level[0], level[1], sizeof level[0]) && sure[0] == sure[1],
           "the same bits on one and on three threads");
}

int main(int argc, char **argv)
{
    ctx = test_context(0);
    test_points();
    test_places();
    test_none();
    test_lit();
    test_coverage(tap_is_long(argc, argv));
    test_rounds();
    test_glare();
    test_bits();
    imp_context_destroy(ctx);
    return tap_done();
}
