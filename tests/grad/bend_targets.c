/* SPDX-License-Identifier: Apache-2.0
 *
 * Every target, at exits, beyond a plane and at taps, with holds and smoothness: gradient
 * of the objective against central differences. Energy of pictures. Fits that find what
 * made their data. */
#include "bend/bend_problem.h"
#include "bend_kit.h"

#define N 200

static imp_field *sdf;

static imp_bend *bend_make(bool grid)
{
    imp_bend *b;
    imp_field *f = grid ? kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 7, 1, 0.04) : NULL;
    KIT_CHECK(imp_bend_create(kit_ctx, f, &b));
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    struct imp_bend_surface s[2] = {IMP_BEND_SURFACE_INIT, IMP_BEND_SURFACE_INIT};
    static const struct imp_bend_tap tap[1] = {
        {.size = sizeof *tap, .normal = {0, 0.1, 1}, .group = -1}};
    s[0].offset = 0.7, s[0].normal[0] = 0.1;
    s[1].type = IMP_BEND_BOX, s[1].event = IMP_BEND_STOP;
    for (int k = 0; k < 3; k++) s[1].lo[k] = -1, s[1].hi[k] = 1;
    o.surfaces = s, o.n_surfaces = 2, o.taps = tap, o.n_taps = 1, o.step = 0.06;
    KIT_CHECK(imp_bend_set_options(b, &o));
    for (int k = 0; k < 2; k++) {
        double power[N];
        struct imp_bend_rays r = kit_beam(N, -0.8 + 0.1 * k, 0.5, 0.2);
        for (int i = 0; i < N; i++) power[i] = 0.5 + kit_u(400 + k, i);
        KIT_CHECK(imp_bend_add_rays(b, N, r.x, r.d, power, NULL));
        kit_rays_free(&r);
    }
    return b;
}

static void target_test(enum imp_bend_target_type type, int where)
{
    static const char *const names[] = {"focus",      "spot",       "points", "direction",
                                        "directions", "deflection", "path",   "wavefront",
                                        "image",      "far field",  "shape"};
    static const char *const places[] = {"exit", "plane beyond", "tap",
                                         "plane from a tap"};
    imp_bend *b = bend_make(true);
    struct imp_bend_target t = IMP_BEND_TARGET_INIT;
    static double data[3 * N];
    static float pixels[12 * 10];
    t.type = type;
    t.bundle = where % 2;
    t.tap = where >= 2 ? 0 : -1;
    t.at_plane = where % 2;
    t.normal[0] = -0.1, t.normal[1] = 0.3, t.offset = 1.6, t.outside = 1.2;
    t.weight = 1.7;
    t.point[0] = 0.1, t.point[1] = -0.2, t.point[2] = 1;
    for (int i = 0; i < 3 * N; i++) data[i] = kit_pm(410, i);
    for (int i = 0; i < 120; i++) pixels[i] = (float)kit_u(411, i);
    t.data = data, t.pixels = pixels, t.width = 12, t.height = 10, t.sdf = sdf;
    t.origin[0] = t.origin[1] = -0.9, t.u[0] = 1.8, t.v[1] = 1.8;
    KIT_CHECK(imp_bend_add_target(b, &t));
    KIT_CHECK(imp_bend_add_smoothness(b, 1e-3, 2, 0));
    KIT_CHECK(imp_bend_add_smoothness(b, 1e-3, 1, 0.05));
    KIT_CHECK(imp_bend_hold_rim(b, 1, NAN));
    KIT_CHECK(imp_bend_hold_number(b, 400, NAN));

    imp_field *f = imp_bend_field(b);
    const size_t n = imp_field_n_theta(f);
    double *g = calloc(n, sizeof *g), *theta = calloc(n, sizeof *theta),
           *dot = calloc(n, sizeof *dot), *moved = calloc(n, sizeof *moved), value,
           want = 0, scale = 0, c[4];
    imp_field_get_theta(f, theta);
    KIT_CHECK(imp_bend_objective(b, &value, g, NULL, NULL));
    bool held = g[400] == 0 && g[0] == 0 && g[n - 1] == 0;
    for (size_t i = 0; i < n; i++) {
        dot[i] = g[i] == 0 ? 0 : kit_pm(412, i);
        want += g[i] * dot[i], scale += imp__sqr(g[i] * dot[i]);
    }
    const double eps = 2e-5;
    for (int q = 0; q < 4; q++) {
        for (size_t i = 0; i < n; i++)
            moved[i] = theta[i] + (q % 2 ? -eps : eps) * (1 + q / 2) * dot[i];
        KIT_CHECK(imp_field_set_theta(f, moved));
        KIT_CHECK(imp_bend_objective(b, &c[q], NULL, NULL, NULL));
    }
    const double fd = (8 * (c[0] - c[1]) - (c[2] - c[3])) / (12 * eps);
    tap_ok(fabs(fd - want) < 1e-6 * sqrt(scale) && held,
           "%s, %s # value %.4g, error %.1e", names[type], places[where], value,
           fabs(fd - want) / sqrt(scale));
    free(g), free(theta), free(dot), free(moved);
    imp_bend_destroy(b);
}

static void image_energy(void)
{
    imp_bend *b = bend_make(true);
    struct imp_bend_target t = IMP_BEND_TARGET_INIT;
    static float pixels[40 * 40], e[40 * 40];
    for (int i = 0; i < 1600; i++) pixels[i] = 1;
    t.type = IMP_BEND_IMAGE, t.pixels = pixels, t.width = t.height = 40;
    t.origin[0] = t.origin[1] = -1.5, t.u[0] = 3, t.v[1] = 3;
    KIT_CHECK(imp_bend_add_target(b, &t));
    KIT_CHECK(imp_bend_image(b, 0, e));
    double mean = 0;
    for (int i = 0; i < 1600; i++) mean += e[i] / 1600.0;
    tap_near(mean, 1, 1e-6, 0, "image: all power arrives, the mean is 1");
    imp_bend_destroy(b);
}

/* Numbers of a plume from the directions it makes; a grid from optical paths. */
static void fits(void)
{
    const double truth[6] = {1, 0.03, 0.35, 0.1, -0.05, 0.02},
                 guess[6] = {1, 0.02, 0.45, 0, 0, 0};
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    s.offset = 1, o.surfaces = &s, o.n_surfaces = 1, o.step = 0.05;
    imp_field *f = kit_profile("plume", truth, NULL);
    static struct imp_bend_exit e[N];
    static double data[3 * N], paths[N];
    struct imp_bend_rays r = kit_beam(N, -1, 0.8, 0.3);
    KIT_CHECK(imp_bend_trace(f, &o, &r, e, NULL, NULL));
    for (int i = 0; i < N; i++) {
        paths[i] = e[i].path;
        for (int k = 0; k < 3; k++) data[3 * i + k] = e[i].v[k];
    }
    imp_field_destroy(f);
    for (int method = 0; method < 2; method++) {
        imp_bend *b;
        KIT_CHECK(imp_bend_create(kit_ctx, kit_profile("plume", guess, NULL), &b));
        KIT_CHECK(imp_bend_set_options(b, &o));
        KIT_CHECK(imp_bend_add_rays(b, N, r.x, r.d, NULL, NULL));
        struct imp_bend_target t = IMP_BEND_TARGET_INIT;
        t.type = method ? IMP_BEND_PATH : IMP_BEND_DIRECTIONS;
        t.data = method ? paths : data;
        t.weight = 1e4;
        KIT_CHECK(imp_bend_add_target(b, &t));
        KIT_CHECK(imp_bend_hold_number(b, 0, NAN));
        struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
        struct imp_bend_fit_result res = {.size = sizeof res};
        fo.iterations[0] = 200;
        fo.tolerance = 1e-9;
        KIT_CHECK(imp_bend_fit(b, &fo, &res));
        double theta[6], worst = 0;
        imp_field_get_theta(imp_bend_field(b), theta);
        for (int k = 0; k < 6; k++) worst = fmax(worst, fabs(theta[k] - truth[k]));
        tap_ok(worst < 1e-5 && res.value < 1e-6 * res.start,
               "plume found again from its %s # worst %.1e, %.2e -> %.2e in %d: %s",
               method ? "paths" : "directions", worst, res.start, res.value,
               res.iterations, res.reason);
        imp_bend_destroy(b);
    }
    /* Levels: a grid that makes the paths, 4 -> 8 cells; resume gives the same bits. */
    double theta[2][11 * 11 * 11];
    for (int run = 0; run < 2; run++) {
        imp_bend *b;
        struct imp_field_grid g = IMP_FIELD_GRID_INIT;
        for (int k = 0; k < 3; k++) g.cells[k] = 4, g.lo[k] = -1.1, g.hi[k] = 1.1;
        KIT_CHECK(imp_field_grid_create(kit_ctx, &g, 1, &f));
        KIT_CHECK(imp_bend_create(kit_ctx, f, &b));
        KIT_CHECK(imp_bend_set_options(b, &o));
        KIT_CHECK(imp_bend_add_rays(b, N, r.x, r.d, NULL, NULL));
        struct imp_bend_target t = IMP_BEND_TARGET_INIT;
        t.type = IMP_BEND_PATH, t.data = paths, t.weight = 1e4;
        KIT_CHECK(imp_bend_add_target(b, &t));
        KIT_CHECK(imp_bend_add_smoothness(b, 1e-7, 2, 0));
        struct imp_bend_fit_options fo = IMP_BEND_FIT_OPTIONS_INIT;
        struct imp_bend_fit_result res = {.size = sizeof res};
        fo.levels = 2;
        fo.iterations[0] = 20;
        fo.checkpoint = "bend_targets.checkpoint";
        remove(fo.checkpoint);
        if (run == 1) { /* stop after the first level, go on from the file */
            fo.levels = 1;
            KIT_CHECK(imp_bend_fit(b, &fo, &res));
            imp_bend_destroy(b);
            KIT_CHECK(imp_field_grid_create(kit_ctx, &g, 1, &f));
            KIT_CHECK(imp_bend_create(kit_ctx, f, &b));
            KIT_CHECK(imp_bend_set_options(b, &o));
            KIT_CHECK(imp_bend_add_rays(b, N, r.x, r.d, NULL, NULL));
            KIT_CHECK(imp_bend_add_target(b, &t));
            KIT_CHECK(imp_bend_add_smoothness(b, 1e-7, 2, 0));
            fo.levels = 2;
            fo.resume = 1;
        }
        KIT_CHECK(imp_bend_fit(b, &fo, &res));
        imp_field_get_theta(imp_bend_field(b), theta[run]);
        if (run == 0)
            tap_ok(imp_field_n_theta(imp_bend_field(b)) == 1331 && res.levels == 2 &&
                       res.value < 1e-2 * res.start,
                   "two levels # %.2e -> %.2e in %d", res.start, res.value,
                   res.iterations);
        double lowest = INFINITY;
        for (int i = 0; i < 1331; i++) lowest = fmin(lowest, theta[run][i]);
        if (run == 0) tap_ok(lowest >= 1, "index stays at or above 1 # %.6f", lowest);
        remove(fo.checkpoint);
        imp_bend_destroy(b);
    }
    tap_ok(!memcmp(theta[0], theta[1], sizeof theta[0]),
           "continued from a checkpoint: same bits");
    kit_rays_free(&r);
}

int main(void)
{
    kit_begin(2);
    const double p[5] = {1.2, -0.3, 0, 0, 0};
    sdf = kit_profile("linear", p, NULL);
    for (int type = 0; type < IMP_BEND_N_TARGETS; type++)
        for (int where = 0; where < 4; where++) target_test(type, where);
    image_energy();
    fits();
    imp_field_destroy(sdf);
    imp_context_destroy(kit_ctx);
    return tap_done();
}
