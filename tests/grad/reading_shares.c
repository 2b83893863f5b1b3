/* SPDX-License-Identifier: Apache-2.0
 *
 * Shares of lamps and materials in a reading: of lamps they add up to it, to rounding, from either
 * end and in colours; of a closed sphere that glows, E = pi L/(1 - rho), the wall's share is
 * E rho/(1 - rho); errors are the spread over seeds; materials against differences. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <importon/rooms.h>
#include <math.h>

static imp_context *ctx;
enum { ROWS = 16 };

static size_t shares_of(imp_scene *s, const struct imp_run *run,
                        struct imp_share row[ROWS], struct imp_estimate *reading)
{
    size_t n;
    test_must(ctx, imp_reading_shares(s, run, row, ROWS, &n, reading));
    return n;
}

static const struct imp_share *named(const struct imp_share *row, size_t n,
                                     const char *name)
{
    for (size_t k = 0; k < n; k++)
        if (strcmp(row[k].name, name) == 0) return &row[k];
    printf("Bail out! no row %s\n", name);
    exit(99);
}

static void lamps(void)
{
    for (int k = 0; k < 4; k++) {
        const bool rgb = k & 1, lights = k & 2;
        imp_scene *s = test_scene(ctx, "desk.xml", rgb ? IMP_RGB : IMP_MONO, "spp=64");
        struct imp_run run = IMP_RUN_INIT;
        struct imp_share row[ROWS];
        struct imp_estimate reading;
        double sum = 0;
        size_t n_lights = 0;
        run.spp = 4096;
        run.from = lights ? IMP_FROM_LIGHTS : IMP_FROM_SENSOR;
        const size_t n = shares_of(s, &run, row, &reading);
        for (size_t r = 0; r < n; r++)
            if (row[r].of == IMP_SHARE_LIGHT) sum += row[r].value, n_lights++;
        tap_ok(n == 5 && n_lights == 2 && fabs(sum / reading.value - 1) < 1e-6 &&
                   row[0].se > 0 && row[0].se < .1 * row[0].value,
               "%s, from the %s: lamps %.6f of %.6f lx", rgb ? "rgb" : "mono",
               lights ? "lights" : "sensor", sum, reading.value);
        imp_scene_destroy(s);
    }
}

#define SPHERE                                                                           \
    "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "          \
    "value='64'/></integrator><shape type='sphere'><boolean name='flip_normals' "        \
    "value='true'/><bsdf type='diffuse' id='wall'><rgb name='reflectance' value='%g'/>"  \
    "</bsdf><emitter type='area' id='glow'><rgb name='radiance' value='2'/></emitter>"   \
    "</shape><shape type='rectangle'><transform name='to_world'><scale value='.2'/>"     \
    "</transform><sensor type='irradiancemeter'><boolean name='virtual' value='true'/>"  \
    "<film type='hdrfilm'><integer name='width' value='1'/><integer name='height' "      \
    "value='1'/></film></sensor></shape></scene>"

static void sphere(void)
{
    static const double rho[] = {.3, .6};
    for (int k = 0; k < 2; k++) {
        char xml[2048];
        snprintf(xml, sizeof xml, SPHERE, rho[k]);
        imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
        struct imp_run run = IMP_RUN_INIT;
        struct imp_share row[ROWS];
        struct imp_estimate e;
        run.spp = 20000;
        const size_t n = shares_of(s, &run, row, &e);
        const double E = 2 * M_PI / (1 - rho[k]), share = E * rho[k] / (1 - rho[k]);
        const struct imp_share *wall = named(row, n, "wall"),
                               *glow = named(row, n, "glow");
        const double z = (e.value - E) / e.se, zw = (wall->value - share) / wall->se;
        tap_ok(fabs(z) < 4.5 && e.se < .01 * E && fabs(zw) < 4.5 &&
                   wall->se < .03 * share && fabs(glow->value / e.value - 1) < 2e-4,
               "sphere of %.1f: E %.4f of %.4f, z %.2f; wall %.4f of %.4f, z %.2f; "
               "glow %.9f",
               rho[k], e.value, E, z, wall->value, share, zw, glow->value / e.value);
        imp_scene_destroy(s);
    }
}

/* E(1.5 rho) - E(.5 rho) is rho dE/drho to the third order of what wood gives. */
static void differences(void)
{
    imp_scene *s = test_scene(ctx, "desk.xml", IMP_MONO, "spp=64");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_share row[ROWS];
    struct imp_estimate e, side[2];
    size_t param;
    double rho;
    run.spp = 65536;
    const size_t n = shares_of(s, &run, row, &e);
    const struct imp_share wood = *named(row, n, "wood");
    test_must(ctx, imp_scene_find_param(s, "wood.reflectance.value", &param));
    test_must(ctx, imp_scene_get_values(s, param, &rho));
    for (int k = 0; k < 2; k++) {
        const double changed = rho * (k ? 1.5 : .5);
        struct imp_share again[ROWS];
        test_must(ctx, imp_scene_set_values(s, param, 1, &changed));
        run.seed = 7; /* the same numbers on both sides, others than those of the share */
        shares_of(s, &run, again, &side[k]);
    }
    const double d = side[1].value - side[0].value;
    const double se = hypot(wood.se, wood.se * 1.5);
    tap_ok(fabs(wood.value - d) < 4.5 * se && se < .3 * wood.value,
           "wood: %.3f +- %.3f, by differences %.3f", wood.value, wood.se, d);
    imp_scene_destroy(s);
}

static void errors(void)
{
    enum { SEEDS = 60 };
    imp_scene *s = test_scene(ctx, "desk.xml", IMP_RGB, "spp=64");
    struct tap_stat spread[3] = {{0}};
    double told[3] = {0};
    for (int k = 0; k < SEEDS; k++) {
        struct imp_run run = IMP_RUN_INIT;
        struct imp_share row[ROWS];
        struct imp_estimate e;
        run.seed = (uint64_t)k + 1;
        run.spp = 512;
        shares_of(s, &run, row, &e);
        for (int r = 0; r < 3; r++) {
            tap_add(&spread[r], row[r].value);
            told[r] += row[r].se * row[r].se / SEEDS;
        }
    }
    for (int r = 0; r < 3; r++) {
        const double seen = tap_se(&spread[r]) * sqrt(SEEDS),
                     ratio = sqrt(told[r]) / seen;
        tap_ok(ratio > .7 && ratio < 1.4, "row %d: error told / seen %.2f", r, ratio);
    }
    imp_scene_destroy(s);
}

static void refused(void)
{
    imp_scene *s = test_scene(ctx, "desk.xml", IMP_MONO, "spp=64");
    struct imp_share row;
    struct imp_estimate e;
    size_t n = 0;
    const enum imp_status st = imp_reading_shares(s, NULL, &row, 1, &n, &e);
    tap_ok(st == IMP_OK && n == 5, "one row of room: %zu are wanted", n);
    struct imp_run run = IMP_RUN_INIT;
    run.sensor = 9;
    struct imp_share all[ROWS];
    tap_ok(imp_reading_shares(s, &run, all, ROWS, &n, &e) == IMP_E_ARG, "no such sensor");
    imp_scene_destroy(s);
}

int main(void)
{
    ctx = test_context(0);
    lamps();
    sphere();
    differences();
    errors();
    refused();
    imp_context_destroy(ctx);
    return tap_done();
}
