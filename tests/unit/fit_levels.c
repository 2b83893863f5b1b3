/* SPDX-License-Identifier: Apache-2.0
 *
 * Volumes in fits: cells taken together, and the transpose of that; smoothness along all
 * three axes; .vol files written and read back; a density found in three pictures, from
 * coarse to fine. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/problem/cells.h"
#include "vol_write.h"

static imp_context *ctx;

/* ---- Cells --------------------------------------------------------------------------- */

static double draw(uint64_t *s)
{
    *s = *s * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*s >> 11) * 0x1p-53;
}

static void transpose(void)
{
    enum { MOST = 7 * 5 * 12 * 3 };
    static double x[MOST], px[MOST], c[MOST], pc[MOST];
    uint64_t seed = 3;
    const struct imp__cells fine = {{7, 5, 12}, 3};
    for (int level = 0; level < 4; level++) {
        const struct imp__cells coarse = imp__cells_coarse(&fine, level);
        const size_t n = imp__cells_count(&fine), m = imp__cells_count(&coarse);
        double one = 0, other = 0, worst = 0, lo = 1, hi = 0;
        for (size_t i = 0; i < n; i++) x[i] = draw(&seed);
        for (size_t i = 0; i < m; i++) c[i] = draw(&seed);
        imp__cells_prolong(&fine, level, c, pc);
        imp__cells_restrict(&fine, level, x, px);
        for (size_t i = 0; i < n; i++) one += x[i] * pc[i];
        for (size_t i = 0; i < m; i++) other += c[i] * px[i];
        tap_near(other, one, 1e-13, 0, "<P^T x, c> = <x, P c>");
        for (size_t i = 0; i < n; i++) lo = fmin(lo, pc[i]), hi = fmax(hi, pc[i]);
        tap_ok(lo >= 0 && hi <= 1, "... and P c stays within the bounds of c");
        for (size_t i = 0; i < n; i++) x[i] = 2.5;
        imp__cells_average(&fine, level, x, c);
        imp__cells_prolong(&fine, level, c, pc);
        for (size_t i = 0; i < n; i++) worst = fmax(worst, fabs(pc[i] - 2.5));
        tap_ok(worst < 1e-14, "... and what is uniform stays so # %.1e", worst);
    }
}

/* ---- A volume that absorbs ------------------------------------------------------------ */

enum { N = 8, CELLS = N * N * N };

/* Seen along the three axes before lamps of radiance 1. */
static imp_scene *scene_of(const char *grid, int channels)
{
    char text[4096];
    snprintf(text, sizeof text,
             "<scene version='3.0.0'><integrator type='volpath'/>"
             "<medium type='heterogeneous' id='fog'><float name='albedo' value='0'/>"
             "<volume name='sigma_t' type='gridvolume' id='grid'>"
             "<string name='filename' value='%s'/></volume></medium>"
             "<shape type='cube'><bsdf type='null'/><ref id='fog' name='interior'/>"
             "<transform name='to_world'><scale value='0.5'/>"
             "<translate x='0.5' y='0.5' z='0.5'/></transform></shape>"
             "<emitter type='constant'><float name='radiance' value='1'/></emitter>"
#define VIEW(from, up)                                                                   \
    "<sensor type='orthographic'><transform name='to_world'><scale value='0.5'/>"        \
    "<lookat origin='" from "' target='0.5,0.5,0.5' up='" up "'/></transform>"           \
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "      \
    "value='8'/><rfilter type='box'/></film></sensor>"
             VIEW("-2,0.5,0.5", "0,1,0") VIEW("0.5,-2,0.5", "0,0,1")
                 VIEW("0.5,0.5,-2", "0,1,0") "</scene>",
             grid);
    (void)channels;
    return test_scene_text(ctx, text, channels == 3 ? IMP_RGB : IMP_MONO);
}

static double bump(int i, int j, int k)
{
    const double x = (i + .5) / N - .4, y = (j + .5) / N - .5, z = (k + .5) / N - .6;
    return 3 * exp(-(x * x + y * y + z * z) / .05);
}

static void truth(float *value)
{
    for (int k = 0; k < N; k++)
        for (int j = 0; j < N; j++)
            for (int i = 0; i < N; i++) *value++ = (float)bump(i, j, k);
}

/* w/2 sum of squared differences of neighbours, each pair once: of a ramp along one axis
 * that is the same whichever axis it is. */
static void smoothness(int channels)
{
    static float value[3 * CELLS];
    static double g[3 * CELLS];
    char path[64];
    for (int axis = 0; axis < 3; axis++) {
        for (int at = 0; at < CELLS; at++) {
            const int c[3] = {at % N, at / N % N, at / N / N};
            for (int k = 0; k < channels; k++)
                value[at * channels + k] = (float)(.25 * c[axis]);
        }
        vol_write(path, N, N, N, channels, value);
        imp_scene *s = scene_of(path, channels);
        imp_problem *p;
        struct imp_target t = IMP_TARGET_INIT;
        struct imp_run run = IMP_RUN_INIT;
        struct imp_estimate with, without;
        static float black[3 * 64];
        test_must(ctx, imp_problem_create(s, &p));
        test_must(ctx, imp_problem_activate(p, "grid.data"));
        t.pixels = black;
        t.width = t.height = 8;
        t.channels = channels == 3 ? 3 : 1;
        test_must(ctx, imp_problem_add_target(p, &t));
        run.spp = 2;
        test_must(ctx, imp_problem_objective(p, NULL, &run, &without, g, NULL));
        test_must(ctx, imp_problem_add_smoothness(p, "grid.data", 2));
        test_must(ctx, imp_problem_objective(p, NULL, &run, &with, g, NULL));
        const double expected = channels * .25 * .25 * (N - 1) * N * N;
        tap_near(with.value - without.value, expected, 1e-9, 0,
                 "smoothness along an axis");
        imp_problem_destroy(p);
        imp_scene_destroy(s);
        remove(path);
    }
}

static void written(int channels)
{
    static float value[3 * 24];
    static double back[3 * 24];
    char path[64], copy[80];
    struct imp_param_info info = {.size = sizeof info};
    size_t param;
    bool same = true;
    for (int k = 0; k < 24 * channels; k++) value[k] = (float)(k * .5);
    vol_write(path, 2, 3, 4, channels, value);
    snprintf(copy, sizeof copy, "%s.copy", path);
    imp_scene *s = scene_of(path, channels), *again;
    test_must(ctx, imp_scene_find_param(s, "grid.data", &param));
    test_must(ctx, imp_scene_get_param(s, param, &info));
    tap_ok(info.layers == 4 && info.flags & IMP_PARAM_VOLUME, "a volume has layers");
    test_must(ctx, imp_scene_write_volume(s, param, NULL, copy));
    again = scene_of(copy, channels);
    test_must(ctx, imp_scene_get_values(again, param, back));
    for (int k = 0; k < 24 * channels; k++) same &= back[k] == (double)value[k];
    tap_ok(same, "what is written is what is read, %d channels", channels);
    test_must(ctx, imp_scene_get_values(s, param, back));
    back[5] = NAN;
    tap_ok(imp_scene_write_volume(s, param, back, copy) == IMP_E_ARG, "but no NaN");
    for (param = 0; param < imp_scene_n_params(s); param++) {
        test_must(ctx, imp_scene_get_param(s, param, &info));
        if (!(info.flags & IMP_PARAM_VOLUME)) break;
    }
    tap_ok(imp_scene_write_volume(s, param, NULL, copy) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "is no volume"),
           "and no other parameter # %s", imp_last_error(ctx));
    imp_film *f;
    struct imp_film_info film = {.size = sizeof film};
    test_must(ctx, imp_film_read(ctx, copy, &f));
    test_must(ctx, imp_film_get_info(f, &film));
    same = film.width == 2 && film.height == 12 && film.channels == channels;
    for (int k = 0; k < 24 * channels && same; k++)
        same &= imp_film_mean(f)[k] == value[k];
    tap_ok(same, "as a picture its layers lie below each other");
    imp_film_destroy(f);
    imp_scene_destroy(s);
    imp_scene_destroy(again);
    remove(path);
    remove(copy);
}

/* ---- Fits ------------------------------------------------------------------------------ */

static double rms_error(const double *x)
{
    static float wanted[CELLS];
    double sum = 0;
    truth(wanted);
    for (int k = 0; k < CELLS; k++) sum += (x[k] - wanted[k]) * (x[k] - wanted[k]);
    return sqrt(sum / CELLS);
}

static void add_pictures(imp_scene *from, imp_problem *p)
{
    for (int v = 0; v < 3; v++) {
        struct imp_target t = IMP_TARGET_INIT;
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f;
        run.sensor = v;
        run.spp = 4096;
        run.seed = 7;
        test_must(ctx, imp_render(from, &run, &f));
        t.pixels = imp_film_mean(f);
        t.width = t.height = 8;
        t.channels = 1;
        t.sensor = v;
        test_must(ctx, imp_problem_add_target(p, &t));
        imp_film_destroy(f);
    }
}

static void fits(void)
{
    static float value[CELLS];
    static double x[CELLS], flat[CELLS];
    char path[64];
    double error[2];
    truth(value);
    vol_write(path, N, N, N, 1, value);
    imp_scene *seen = scene_of(path, 1), *s = scene_of(path, 1);
    imp_problem *p;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "grid.data"));
    add_pictures(seen, p);
    test_must(ctx, imp_problem_add_smoothness(p, "grid.data", 1e-3));
    for (int k = 0; k < CELLS; k++) flat[k] = .5;
    run.spp = 8;
    o.max_iterations = 60;
    o.learning_rate = .2;
    for (int levels = 1; levels <= 3; levels += 2) {
        o.levels = levels;
        test_must(ctx, imp_problem_set_x(p, flat));
        test_must(ctx, imp_fit(p, &o, &run, &r));
        imp_problem_get_x(p, x);
        error[levels > 1] = rms_error(x);
        tap_ok(r->iterations == 60 && r->n_history == 60,
               "%d level(s): all iterations are in the history", levels);
    }
    tap_ok(fmax(error[0], error[1]) < .4 * rms_error(flat),
           "the density is found # rms %.3f, from coarse to fine %.3f, at the start %.3f",
           error[0], error[1], rms_error(flat));
    double least = INFINITY;
    for (int k = 0; k < CELLS; k++) least = fmin(least, x[k]);
    tap_ok(least >= 0, "and is nowhere negative");
    struct imp_fit_variable v = IMP_FIT_VARIABLE_INIT;
    test_must(ctx, imp_problem_get_fit_variable(p, 3, &v));
    tap_near(v.start, .5, 1e-6, 0, "its start is that of the fit, not of a level");

    o.levels = 2;
    o.learning_rate = 0;
    o.optimizer = IMP_LBFGS;
    tap_ok(imp_fit(p, &o, &run, &r) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "are Adam's"),
           "levels of another optimiser # %s", imp_last_error(ctx));
    o.optimizer = IMP_ADAM;
    o.levels = -1;
    tap_ok(imp_fit(p, &o, &run, &r) == IMP_E_ARG, "levels below 0");
    imp_problem_destroy(p);
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_problem_activate(p, "fog.albedo.value"));
    add_pictures(seen, p);
    o.levels = 2;
    tap_ok(imp_fit(p, &o, &run, &r) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "has cells"),
           "levels of what has no cells # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_scene_destroy(seen);
    remove(path);
}

static int stop_early(const struct imp_fit_step *step, void *payload)
{
    (void)payload;
    return step->iteration >= 3;
}

/* Of few numbers it is told where the objective was: in those of the problem, also while
 * cells are taken together. */
static void trail(void)
{
    enum { SIDE = 4, FEW = SIDE * SIDE * SIDE, ITERATIONS = 12 };
    static float value[FEW];
    static double flat[FEW];
    char path[64];
    for (int k = 0; k < FEW; k++) value[k] = (float)(.5 + k % SIDE);
    vol_write(path, SIDE, SIDE, SIDE, 1, value);
    imp_scene *seen = scene_of(path, 1), *s = scene_of(path, 1);
    imp_problem *p = test_problem(ctx, s, "grid.data");
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    const struct imp_fit_result *r;
    int pairs = 0, inside = 1;
    add_pictures(seen, p);
    for (int k = 0; k < FEW; k++) flat[k] = .5;
    test_must(ctx, imp_problem_set_x(p, flat));
    run.spp = 4;
    o.max_iterations = ITERATIONS;
    o.learning_rate = .2;
    o.levels = 2;
    o.intervals = 0;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    const double *x = r->history_x;
    for (size_t i = 0; i < r->n_history; i++)
        for (int k = 0; k < FEW; k++) inside &= x[i * FEW + (size_t)k] > 0;
    tap_ok(r->n_history == ITERATIONS && inside && !memcmp(x, flat, sizeof flat),
           "the trail begins at the start, and is inside the bounds");
    /* Half of the iterations, which hardly move at first, have one number for two cells: between the middles of two the
     * grid is linear, and at its ends flat: cells 0 of an axis is a coarse number c0, and 1
     * and 2 lie a quarter from c0 and c1: x1 - x0 = x3 - x2 = (x2 - x1)/2. */
    for (size_t i = 0; i < r->n_history; i++) {
        const double *row = x + i * FEW;
        double off = 0, size = 0;
        for (int k = 0; k < FEW; k += SIDE) {
            const double d = row[k + 1] - row[k];
            off = fmax(off, fabs(row[k + 3] - row[k + 2] - d));
            off = fmax(off, fabs(row[k + 2] - row[k + 1] - 2 * d));
            size = fmax(size, fabs(d));
        }
        pairs += i > 1 && i < ITERATIONS / 2 && size > 1e-3 && off < 1e-12;
    }
    tap_ok(pairs == ITERATIONS / 2 - 2,
           "and on the coarse level it is the fine grid # %d", pairs);
    /* One that is stopped there has its trail, too. */
    o.step = stop_early;
    test_must(ctx, imp_problem_set_x(p, flat));
    const enum imp_status st = imp_fit(p, &o, &run, &r);
    tap_ok(st == IMP_CANCELLED && r && r->n_history == 3 &&
               !memcmp(r->history_x, flat, sizeof flat),
           "one that is stopped there has its own # %s, %zu iterations",
           imp_status_text(st), r ? r->n_history : 0);
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    imp_scene_destroy(seen);
    remove(path);
}

int main(void)
{
    ctx = test_context(1);
    transpose();
    smoothness(1);
    smoothness(3);
    written(1);
    written(3);
    fits();
    trail();
    imp_context_destroy(ctx);
    return tap_done();
}
