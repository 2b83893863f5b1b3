/* SPDX-License-Identifier: Apache-2.0
 *
 * Grids whose points get the samples that each of them needs: two lamps over a plane in closed form,
 * chosen by their weights, so that points below the weak one are noisy. Promises, errors and expectation
 * over many seeds; bits on threads; a picture of some pixels; what is refused. */
#include "base/film.h"
#include "film/film_render.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>
#include <string.h>

enum { NX = 6, NY = 4, N = NX * NY };
static const double WANTED = .04;

/* Lamps: half sides, centre, height, radiance; the second one is chosen seldom. */
struct lamp {
    double a, b, x, y, h, L, weight;
};
static const struct lamp lamps[2] = {{1, .5, 1.5, 0, 3, 60, 1},
                                     {.1, .1, -2.5, -1.5, .7, 60, .2}};

static imp_scene *scene_of(imp_context *ctx, bool lit, const char *more)
{
    char xml[4096];
    int n = snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='2'/><string name='light_choice' value='weights'/></integrator><shape "
        "type='rectangle'><transform name='to_world'><scale x='3' y='2'/></transform>"
        "<sensor type='irradiancemeter' id='grid'><boolean name='virtual' value='true'/>"
        "<string name='at' value='points'/><film type='hdrfilm'><integer name='width' "
        "value='6'/><integer name='height' value='4'/></film></sensor></shape>%s",
        more);
    for (int k = 0; k < 2 && lit; k++) {
        const struct lamp *l = &lamps[k];
        n += snprintf(xml + n, sizeof xml - (size_t)n,
                      "<shape type='rectangle'><transform name='to_world'><scale x='%g' "
                      "y='%g'/><rotate x='1' angle='180'/><translate x='%g' y='%g' "
                      "z='%g'/></transform><emitter type='area'><rgb name='radiance' "
                      "value='%g'/><float name='sampling_weight' "
                      "value='%g'/></emitter></shape>",
                      l->a, l->b, l->x, l->y, l->h, l->L, l->weight);
    }
    snprintf(xml + n, sizeof xml - (size_t)n, "</scene>");
    return test_scene_text(ctx, xml, IMP_MONO);
}

/* Configuration factor of a rectangle x times y at distance c, seen from below its corner
 * (Howell, Catalog of radiation configuration factors, B-3). */
static double corner(double a, double b, double c)
{
    const double x = fabs(a) / c, y = fabs(b) / c, p = hypot(1, x), q = hypot(1, y);
    return ((a < 0) == (b < 0) ? 1 : -1) / (2 * M_PI) *
           (x / p * atan(y / p) + y / q * atan(x / q));
}
static double brings(const struct lamp *l, const double *p)
{
    const double x0 = l->x - l->a - p[0], x1 = l->x + l->a - p[0];
    const double y0 = l->y - l->b - p[1], y1 = l->y + l->b - p[1];
    return l->L * M_PI *
           (corner(x1, y1, l->h) - corner(x0, y1, l->h) - corner(x1, y0, l->h) +
            corner(x0, y0, l->h));
}

struct reading {
    double value[N], se[N];
    struct imp_estimate mean;
    int64_t sets;
    struct imp_until_end end;
};
static enum imp_points points = IMP_POINTS_SCENE;
static enum imp_status read_until(imp_scene *s, uint64_t seed, double relative, int most,
                                  enum imp_from from, struct reading *out)
{
    struct imp_run run = IMP_RUN_INIT;
    struct imp_until_options o = IMP_UNTIL_OPTIONS_INIT;
    run.size = sizeof run;
    o.size = sizeof o;
    run.seed = seed;
    run.from = from;
    run.points = points;
    o.relative = relative;
    o.most_spp = most;
    out->end = (struct imp_until_end)IMP_UNTIL_END_INIT;
    out->end.size = sizeof out->end;
    return imp_grid_read_until(s, &run, &o, out->value, out->se, &out->mean, &out->sets,
                               &out->end);
}

/* ---- The promise ---------------------------------------------------------------------- */

/* Independent points: variances fall as 1/n, and what is promised holds hardly more often. Of sets of
 * points pilots ask for too many, since larger sets have less variance. */
static void promise(imp_context *ctx, enum imp_points kind, int runs)
{
    const bool alone = kind == IMP_POINTS_INDEPENDENT;
    const char *name = alone ? "independent points" : "sets of points";
    points = kind;
    imp_scene *s = scene_of(ctx, true, "");
    double p[3 * N], truth[N], off[N] = {0}, off2[N] = {0}, said2[N] = {0}, all = 0;
    int held = 0, reached = 0, mean_held = 0;
    test_must(ctx, imp_grid_points(s, 0, p, NULL));
    for (int i = 0; i < N; i++) {
        truth[i] = brings(&lamps[0], p + 3 * i) + brings(&lamps[1], p + 3 * i);
        all += truth[i] / N;
    }
    for (int r = 0; r < runs; r++) {
        struct reading g;
        test_must(ctx, read_until(s, (uint64_t)r + 1, WANTED, 0, IMP_FROM_SENSOR, &g));
        reached += g.end.reached && g.end.relative <= WANTED;
        mean_held += fabs(g.mean.value - all) <= 2.1 * g.mean.se;
        for (int i = 0; i < N; i++) {
            const double d = g.value[i] / truth[i] - 1;
            held += fabs(d) <= WANTED;
            off[i] += d / runs;
            off2[i] += d * d / runs;
            said2[i] += g.se[i] * g.se[i] / (truth[i] * truth[i]) / runs;
        }
    }
    double bias2 = 0, seen = 0, said = 0, least = INFINITY, most = 0;
    for (int i = 0; i < N; i++) {
        bias2 += off[i] * off[i] / (off2[i] / runs) / N;
        seen += off2[i];
        said += said2[i];
        least = fmin(least, off2[i]);
        most = fmax(most, off2[i]);
    }
    const double share = (double)held / (runs * N), chance = sqrt(.05 * .95 / (runs * N));
    tap_ok(reached == runs, "%s: the wanted error is reached in %d of %d runs", name,
           reached, runs);
    tap_ok(share >= .95 - 3.5 * chance && (!alone || share <= .98),
           "%.2f %% of the readings are within %g %%", 100 * share, 100 * WANTED);
    tap_ok(mean_held >= (.95 - 3.5 * sqrt(.05 * .95 / runs)) * runs,
           "%d of %d intervals of the average hold", mean_held, runs);
    /* Mean of N squares of nearly normal numbers: 1 +- sqrt(2/N). */
    tap_ok(fabs(bias2 - 1) < 3.5 * sqrt(2. / N), "no bias: mean z^2 of %d points %.2f", N,
           bias2);
    tap_ok(fabs(seen / said - 1) < 3.5 * sqrt(2. / (runs * N)) + .05,
           "squared errors are %.3f of what is stated", seen / said);
    if (alone) {
        tap_ok(most < 2.5 * least, "variances of points: %.1f between largest and least",
               most / least);
        struct imp_run run = IMP_RUN_INIT;
        struct reading g;
        double low = INFINITY, high = 0;
        run.spp = 4096;
        run.points = kind;
        test_must(ctx, imp_grid_read(s, &run, g.value, g.se, &g.mean, &g.sets));
        for (int i = 0; i < N; i++) {
            low = fmin(low, g.se[i] / truth[i]);
            high = fmax(high, g.se[i] / truth[i]);
        }
        tap_ok(high * high > 8 * low * low, "with equal samples %.0f",
               high * high / (low * low));
    }
    points = IMP_POINTS_SCENE;
    imp_scene_destroy(s);
}

/* ---- Bits ------------------------------------------------------------------------------ */

static void bits(void)
{
    struct reading g[2];
    for (int k = 0; k < 2; k++) {
        imp_context *ctx = test_context(k ? 3 : 1);
        imp_scene *s = scene_of(ctx, true, "");
        memset(&g[k], 0, sizeof g[k]);
        test_must(ctx, read_until(s, 5, .03, 0, IMP_FROM_SENSOR, &g[k]));
        imp_scene_destroy(s);
        imp_context_destroy(ctx);
    }
    tap_ok(memcmp(&g[0], &g[1], sizeof g[0]) == 0, "the same bits on 3 threads");
}

static void some_pixels(imp_context *ctx)
{
    imp_scene *s = scene_of(ctx, true, "");
    struct imp_run run = IMP_RUN_INIT;
    imp_film *all, *some;
    bool only[N];
    int wrong = 0;
    run.spp = 96;
    for (int i = 0; i < N; i++) only[i] = i % 5 == 1 || i > 18;
    test_must(ctx, imp_render(s, &run, &all));
    test_must(ctx, imp__render_pixels(s, &run, only, &some));
    const int n = all->channels;
    for (int i = 0; i < N * n; i++) {
        const float mean = only[i / n] ? imp_film_mean(all)[i] : 0;
        const float se = only[i / n] ? imp_film_se(all)[i] : 0;
        wrong += imp_film_mean(some)[i] != mean || imp_film_se(some)[i] != se;
    }
    tap_ok(wrong == 0, "some pixels have the bits that they have among all");
    imp_film_destroy(all);
    imp_film_destroy(some);
    imp_scene_destroy(s);
}

/* ---- Ends without the promise, and refusals ------------------------------------------- */

static void ends(imp_context *ctx)
{
    imp_scene *s = scene_of(ctx, true, ""),
              *dark = scene_of(ctx, false,
                               "<emitter type='point'><point name='position' x='0' y='0' "
                               "z='-1'/></emitter><shape type='rectangle'><transform "
                               "name='to_world'><scale value='9'/><translate z='-.1'/>"
                               "</transform></shape>");
    struct reading g;
    test_must(ctx, read_until(s, 1, .001, 128, IMP_FROM_SENSOR, &g));
    tap_ok(!g.end.reached && g.end.relative > .001 && isfinite(g.end.relative),
           "128 samples at most: %.4f", g.end.relative);
    test_must(ctx, read_until(dark, 1, 0, 0, IMP_FROM_SENSOR, &g));
    tap_ok(!g.end.reached && isinf(g.end.relative) && g.mean.value == 0,
           "darkness is never near enough");
    enum imp_status st = read_until(s, 1, 0, 0, IMP_FROM_LIGHTS, &g);
    tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "lights"), "%s",
           imp_last_error(ctx));
    st = read_until(s, 1, -1, 0, IMP_FROM_SENSOR, &g);
    tap_ok(st == IMP_E_ARG, "%s", imp_last_error(ctx));
    struct imp_run run = IMP_RUN_INIT;
    run.time_limit_s = 1;
    st = imp_grid_read_until(s, &run, NULL, g.value, g.se, &g.mean, NULL, NULL);
    tap_ok(st == IMP_E_UNSUPPORTED, "%s", imp_last_error(ctx));
    imp_scene_destroy(s);
    imp_scene_destroy(dark);
}

int main(int argc, char **argv)
{
    imp_context *ctx = test_context(0);
    const int runs = argc > 1 && !strcmp(argv[1], "long") ? 1000 : 100;
    promise(ctx, IMP_POINTS_INDEPENDENT, runs);
    promise(ctx, IMP_POINTS_SOBOL, runs);
    some_pixels(ctx);
    ends(ctx);
    imp_context_destroy(ctx);
    bits();
    return tap_done();
}
