/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples until an error is reached: over many seeds the answer is as near to the truth as
 * was asked for, in at least as many cases as were promised, though the sequence ends where
 * its own errors say so; and what it is when samples, time or patience end before. */
#include "imp_cornell.h"
#include "imp_tap.h"
#include <importon/until.h>
#include <stdbool.h>

enum { SIDE = 12 };

/* As "long", smaller errors and more seeds. */
static struct {
    int seeds, truth_spp;
    double picture, gradient; /* the wanted errors */
} size = {60, 4096, 0.4, 0.16};

static const char *const active[] = {"white.reflectance.value", "light.radiance.value"};

/* May so many of n be missed where each is with probability `risk`? 3.5 standard deviations. */
static bool may_miss(int missed, int n, double risk)
{
    return missed <= risk * n + 3.5 * sqrt(risk * (1 - risk) * n);
}

static void pictures(imp_context *ctx, const char *filter, enum imp_points points,
                     double risk)
{
    const int seeds = size.seeds;
    char element[40];
    snprintf(element, sizeof element, "<rfilter type='%s'/>", filter);
    imp_scene *scene = test_cornell_through(ctx, element, SIDE);
    struct imp_until_options o = IMP_UNTIL_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct tap_stat looks = {0}, part = {0};
    imp_film *truth;
    int missed = 0;
    o.relative = size.picture;
    o.risk = risk;
    run.spp = size.truth_spp;
    run.seed = 1;
    test_must(ctx, imp_render(scene, &run, &truth));
    run.spp = 4;
    run.points = points;
    for (int k = 0; k < seeds; k++) {
        struct imp_until_end end = IMP_UNTIL_END_INIT;
        imp_film *film;
        double error = 0, length = 0;
        run.seed = 100 + (uint64_t)k;
        test_must(ctx, imp_render_until(scene, &run, &o, &film, &end));
        for (int i = 0; i < SIDE * SIDE * 3; i++) {
            const double I = (double)imp_film_mean(film)[i];
            error += pow(I - (double)imp_film_mean(truth)[i], 2);
            length += I * I;
        }
        missed += sqrt(error / length) > o.relative || !end.reached;
        tap_add(&looks, end.looks);
        tap_add(&part, sqrt(error / length) / o.relative);
        imp_film_destroy(film);
    }
    /* Not in vain: the widest bound is z <= 3.5 standard errors, those of Sobol points are up
     * to 1.2 of the true ones, and a look may come when half of the samples would have been
     * too few. */
    tap_ok(may_miss(missed, seeds, risk) && looks.mean > 2 &&
               part.mean > 0.5 / (3.5 * 1.2),
           "pictures, %s, %s, risk %g # %d of %d missed, %.1f looks, %.2f of the wanted "
           "error",
           filter, points == IMP_POINTS_SOBOL ? "sobol" : "independent", risk, missed,
           seeds, looks.mean, part.mean);
    imp_film_destroy(truth);
    imp_scene_destroy(scene);
}

/* Of few numbers the error is bounded as one normal number is, by +-z_k; of many by less. */
static void bounds(imp_context *ctx)
{
    static const double z[] = {2.2414, 2.6383, 2.8653};
    for (int side = 1; side <= 64; side += 63) {
        imp_scene *scene = test_cornell_through(ctx, "<rfilter type='box'/>", side);
        struct imp_until_options o = IMP_UNTIL_OPTIONS_INIT;
        struct imp_run run = IMP_RUN_INIT;
        double part[3];
        o.relative = 1e-9;
        for (int k = 0; k < 3; k++) {
            struct imp_until_end end = IMP_UNTIL_END_INIT;
            imp_film *film;
            double S = 0, M = 0;
            run.spp = 64 >> k;
            run.points = IMP_POINTS_INDEPENDENT; /* few sets have wider bounds */
            o.most_spp = 65; /* one sample that is left has no error: no look of it */
            test_must(ctx, imp_render_until(scene, &run, &o, &film, &end));
            for (int i = 0; i < side * side * 3; i++) {
                S += pow((double)imp_film_se(film)[i], 2);
                M += pow((double)imp_film_mean(film)[i], 2);
            }
            part[k] = end.relative / (z[k] * sqrt(S / (M - S)));
            if (end.looks != k + 1 || end.spp != 64) part[k] = NAN;
            imp_film_destroy(film);
        }
        const bool right = side == 1
                               ? fabs(part[0] - 1) < 1e-4 && fabs(part[1] - 1) < 1e-4 &&
                                     fabs(part[2] - 1) < 1e-4
                               : part[0] < 1 && part[1] < 1 && part[2] < 1;
        tap_ok(right, "%d x %d pixels: bounds over z standard errors # %.5f %.5f %.5f",
               side, side, part[0], part[1], part[2]);
        imp_scene_destroy(scene);
    }
}

/* Where nothing has been found, nothing is known. */
static void darkness(imp_context *ctx)
{
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'>"
        "<film type='hdrfilm'><integer name='width' value='2'/><integer name='height' "
        "value='2'/></film></sensor><shape type='sphere'><point name='center' x='0' "
        "y='0' z='4'/></shape>"
        "<emitter type='point'><rgb name='intensity' value='0'/></emitter></scene>",
        IMP_RGB);
    struct imp_until_options o = IMP_UNTIL_OPTIONS_INIT;
    struct imp_until_end end = IMP_UNTIL_END_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    o.most_spp = 64;
    test_must(ctx, imp_render_until(scene, &run, &o, &film, &end));
    tap_ok(!end.reached && end.spp == 64, "darkness is no answer # %d samples",
           (int)end.spp);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
}

static void gradients(imp_context *ctx, double risk)
{
    enum { n = 6 };
    const int seeds = size.seeds;
    imp_scene *scene = test_cornell_through(ctx, "<rfilter type='box'/>", SIDE);
    struct imp_until_options o = IMP_UNTIL_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_estimate f;
    struct tap_stat looks = {0};
    float adjoint[SIDE * SIDE * 3];
    double truth[n], se[n];
    imp_problem *p;
    int missed[2] = {0, 0};
    for (int i = 0; i < SIDE * SIDE * 3; i++) adjoint[i] = 1;
    test_must(ctx, imp_problem_create(scene, &p));
    for (int k = 0; k < 2; k++) test_must(ctx, imp_problem_activate(p, active[k]));
    run.spp = size.truth_spp;
    run.points = IMP_POINTS_INDEPENDENT; /* the bounds' factor is that of normal errors */
    test_must(ctx, imp_problem_functional(p, adjoint, &run, &f, truth, se));
    o.relative = size.gradient;
    o.risk = risk;
    run.spp = 8;
    for (int k = 0; k < seeds; k++) {
        struct imp_until_end end = IMP_UNTIL_END_INIT;
        double g[n], g_se[n];
        run.seed = 1000 + (uint64_t)k;
        test_must(ctx, imp_problem_until(p, adjoint, &run, &o, &f, g, g_se, &end));
        for (int b = 0; b < 2; b++) {
            double error = 0, length = 0;
            for (int i = 3 * b; i < 3 * b + 3; i++) {
                error += pow(g[i] - truth[i], 2);
                length += g[i] * g[i];
            }
            missed[b] += sqrt(error / length) > o.relative || !end.reached;
        }
        tap_add(&looks, end.looks);
    }
    tap_ok(may_miss(missed[0], seeds, risk) && may_miss(missed[1], seeds, risk) &&
               looks.mean > 2,
           "gradients, risk %g # %d and %d of %d missed, %.1f looks", risk, missed[0],
           missed[1], seeds, looks.mean);
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static int calls;
static int stop_third(const struct imp_progress *p, void *payload)
{
    (void)payload;
    calls += p->fraction >= 1;
    return calls >= 2;
}

static void ends(imp_context *ctx)
{
    imp_scene *scene = test_cornell_through(ctx, "<rfilter type='box'/>", SIDE);
    struct imp_until_options o = IMP_UNTIL_OPTIONS_INIT;
    struct imp_until_end end = IMP_UNTIL_END_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film, *same;
    run.spp = 16;
    o.relative = 10;
    test_must(ctx, imp_render_until(scene, &run, &o, &film, &end));
    test_must(ctx, imp_render(scene, &run, &same));
    bool equal = end.looks == 1 && end.spp == 16 && end.reached;
    for (int i = 0; i < SIDE * SIDE * 3; i++)
        equal &= imp_film_mean(film)[i] == imp_film_mean(same)[i] &&
                 imp_film_se(film)[i] == imp_film_se(same)[i];
    tap_ok(equal, "one look is imp_render's picture, to the bit");
    imp_film_destroy(film);
    imp_film_destroy(same);
    o.relative = 1e-6;
    o.most_spp = 100;
    test_must(ctx, imp_render_until(scene, &run, &o, &film, &end));
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(film, &info);
    tap_ok(!end.reached && end.spp == 100 && info.spp == 100 && end.looks == 4,
           "at most 100 samples: 16, 32, 64, 100 # %d in %d looks", (int)end.spp,
           end.looks);
    imp_film_destroy(film);
    run.time_limit_s = 1e-9;
    test_must(ctx, imp_render_until(scene, &run, &o, &film, &end));
    tap_ok(!end.reached && end.looks == 1, "no time: one look");
    imp_film_destroy(film);
    run.time_limit_s = 0;
    run.progress = stop_third;
    film = NULL;
    const enum imp_status st = imp_render_until(scene, &run, &o, &film, &end);
    tap_ok(st == IMP_CANCELLED && film && !end.reached,
           "cancelled: the looks before are there # %d, %d samples", end.looks,
           (int)end.spp);
    imp_film_destroy(film);
    o.risk = 1;
    run.progress = NULL;
    film = NULL;
    tap_ok(imp_render_until(scene, &run, &o, &film, &end) == IMP_E_ARG && !film,
           "risk 1 is refused # %s", imp_last_error(ctx));
    imp_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "long") == 0) {
        size.seeds = 500;
        size.truth_spp = 32768;
        size.picture = 0.2;
        size.gradient = 0.08;
    }
    imp_context *ctx = test_context(2);
    ends(ctx);
    bounds(ctx);
    darkness(ctx);
    pictures(ctx, "box", IMP_POINTS_INDEPENDENT, .05);
    pictures(ctx, "gaussian", IMP_POINTS_INDEPENDENT, .05);
    pictures(ctx, "box", IMP_POINTS_SOBOL, .05);
    gradients(ctx, .05);
    imp_context_destroy(ctx);
    return tap_done();
}
