/* SPDX-License-Identifier: Apache-2.0
 *
 * Errors of a year of daylight: of runs with other seeds, how many intervals hold, and whether
 * errors are as large as they are said to be. */
#include "imp_tap.h"
#include "imp_year.h"

static imp_context *ctx;

/* Runs with other seeds against the mean of some of more walks: how often do 95 % intervals of Student's
 * distribution with 15 degrees of freedom hold, and are errors as large as they are said to be? */
static void coverage(bool is_long)
{
    enum { RUNS = 400, NUMBERS = 4, TRUTHS = 32 };
    static const char *const name[NUMBERS] = {"autonomy", "continuous", "mean",
                                              "exposure"};
    const double t = 2.131;
    const int runs = is_long ? RUNS : RUNS / 4;
    int held[NUMBERS] = {0}, at_points = 0;
    struct imp_annual_point point[POINTS];
    imp_scene *s = scene_of(ctx, "path", SKY ROOM DESK);
    struct imp_annual_options o = IMP_ANNUAL_OPTIONS_INIT;
    double truth[NUMBERS] = {0}, point_truth[POINTS] = {0}, said[NUMBERS] = {0},
           seen[NUMBERS] = {0}, bias[NUMBERS] = {0};
    o.size = sizeof o;
    o.closes = 24;
    o.wanted = 4000;
    for (int r = -TRUTHS; r < runs; r++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_annual_summary y = IMP_ANNUAL_SUMMARY_INIT;
        y.size = sizeof y;
        run.spp = r < 0 ? 1 << 13 : 1024;
        run.seed = (uint64_t)(1000 + r);
        test_must(ctx, imp_annual_read(s, &run, HOURS, hours, &o, point, &y, NULL, NULL));
        for (int i = 0; i < POINTS; i++) {
            const struct imp_estimate a = point[i].autonomy;
            if (r < 0) point_truth[i] += a.value / TRUTHS;
            else at_points += fabs(a.value - point_truth[i]) <= t * a.se + 1e-12;
        }
        const struct imp_estimate e[NUMBERS] = {y.average.autonomy, y.average.continuous,
                                                y.average.mean, y.average.exposure};
        for (int k = 0; k < NUMBERS; k++) {
            const double off = r < 0 ? 0 : e[k].value - truth[k];
            if (r < 0) truth[k] += e[k].value / TRUTHS;
            else held[k] += fabs(off) <= t * e[k].se + 1e-12;
            if (r >= 0)
                said[k] += e[k].se * e[k].se, seen[k] += off * off, bias[k] += off;
        }
    }
    const double at_point = (double)at_points / (runs * POINTS);
    tap_ok(at_point > .93, "autonomy of single points: %.1f %% of %d intervals hold",
           100 * at_point, runs * POINTS);
    for (int k = 0; k < NUMBERS; k++) {
        const double part = (double)held[k] / runs, ratio = sqrt(said[k] / seen[k]);
        tap_ok(part > (is_long ? .92 : .87) && (part < .985 || !is_long),
               "coverage of the %s: %.3f of %d runs", name[k], part, runs);
        tap_ok(ratio > .85 && ratio < 1.2,
               "its errors as stated and as seen: %.2f, the bias %.2f of them", ratio,
               bias[k] / sqrt(seen[k] * runs));
    }
    imp_scene_destroy(s);
}

int main(int argc, char **argv)
{
    const bool is_long = tap_is_long(argc, argv);
    ctx = test_context(0);
    weather_make();
    coverage(is_long);
    imp_context_destroy(ctx);
    return tap_done();
}
