/* SPDX-License-Identifier: Apache-2.0
 *
 * Samples of tiles: what they are for given variances and costs, and fits whose samples are
 * allocated: the same bits on any number of threads, and after a break. */
#include "inverse/gradient/allocation.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <math.h>
#include <stdbool.h>
#include <unistd.h>

enum { TILES = 400, EVEN = 16 };

/* ---- Samples ------------------------------------------------------------------------ */

static struct imp__allocation a;
static int even[2 * TILES];
static double state[2 * TILES + 1];

static double cost(const int *samples)
{
    double sum = 0;
    for (int k = 0; k < TILES; k++) sum += state[TILES + k] * samples[k];
    return sum;
}

/* Are samples in their range, at no more than the cost of equal ones, and at no less than
 * `used` of it? Is sum v/n within `most` of what the formula with that range says? */
static void place(const char *name, int spp, double spread, double used, double most)
{
    double v = 0, best = 0, lo = 0, hi = 1e9;
    bool inside = true;
    a = (struct imp__allocation){
        .n = TILES, .parts = 1, .even = even, .spp = even + TILES, .state = state};
    for (int k = 0; k < TILES; k++) {
        even[k] = spp;
        state[k] = pow(spread, (imp__mix64((uint64_t)k) >> 11) * 0x1p-53);
        state[TILES + k] = 100 + (double)(imp__mix64((uint64_t)k + 1000) % 400);
    }
    imp__allocation_place(&a);
    const int floor = spp <= 16 ? 4 : spp / 4;
    for (int k = 0; k < TILES; k++) {
        inside &= a.spp[k] >= floor && a.spp[k] <= 16 * spp;
        v += state[k] / a.spp[k];
    }
    for (int i = 0; i < 100; i++) { /* the factor that uses the whole cost */
        const double middle = (lo + hi) / 2;
        double c = 0;
        best = 0;
        for (int k = 0; k < TILES; k++) {
            const double n =
                fmin(fmax(floor, middle * sqrt(state[k] / state[TILES + k])), 16 * spp);
            c += state[TILES + k] * n;
            best += state[k] / n;
        }
        if (c <= cost(even)) lo = middle;
        else hi = middle;
    }
    const double part = cost(a.spp) / cost(even);
    tap_ok(inside && part <= 1 + 1e-12 && part >= used && v <= most * best,
           "%s # cost %.4f, sum v/n over the formula's %.4f", name, part, v / best);
}

static void alike(void)
{
    bool same = true, none = true;
    for (int k = 0; k < TILES; k++) {
        even[k] = 24;
        state[k] = 3;
        state[TILES + k] = 7;
    }
    imp__allocation_place(&a);
    for (int k = 0; k < TILES; k++) same &= a.spp[k] == 24;
    for (int k = 0; k < TILES; k++) state[k] = 0;
    imp__allocation_place(&a);
    for (int k = 0; k < TILES; k++) none &= a.spp[k] == 24;
    tap_ok(same && none, "tiles that are alike, or show nothing, have the same samples");
}

/* ---- Fits --------------------------------------------------------------------------- */

enum { SIDE = 20, NUMBERS = 9 };

struct end {
    double x[NUMBERS], loss;
};

static const char *const active[] = {"white.reflectance.value", "red.reflectance.value",
                                     "light.radiance.value"};

static struct end fit(int threads, enum imp_allocation allocation, int iterations,
                      const char *checkpoint)
{
    imp_context *ctx = test_context(threads);
    imp_scene *scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=20");
    struct imp_run run = IMP_RUN_INIT;
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    const struct imp_fit_result *r;
    struct end end = {{0}, 0};
    imp_film *film;
    imp_problem *p;
    run.spp = 64;
    run.seed = 5;
    test_must(ctx, imp_render(scene, &run, &film));
    test_must(ctx, imp_problem_create(scene, &p));
    for (size_t k = 0; k < sizeof active / sizeof *active; k++)
        test_must(ctx, imp_problem_activate(p, active[k]));
    target.pixels = imp_film_mean(film);
    target.width = target.height = SIDE;
    target.channels = 3;
    test_must(ctx, imp_problem_add_target(p, &target));
    imp_problem_get_x(p, end.x);
    for (int k = 0; k < NUMBERS; k++) end.x[k] *= 0.8;
    test_must(ctx, imp_problem_set_x(p, end.x));
    run.spp = 8;
    run.seed = 1;
    o.max_iterations = iterations;
    o.allocation = allocation;
    o.checkpoint = checkpoint;
    o.resume = checkpoint != NULL;
    test_must(ctx, imp_fit(p, &o, &run, &r));
    imp_problem_get_x(p, end.x);
    end.loss = r->history[r->n_history - 1];
    imp_problem_destroy(p);
    imp_film_destroy(film);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return end;
}

static bool equal(struct end e, struct end f) { return memcmp(&e, &f, sizeof e) == 0; }

static void fits(void)
{
    char path[] = "/tmp/importon_allocation_XXXXXX";
    const struct end whole = fit(1, IMP_ALLOCATION_VARIANCE, 26, NULL);
    const struct end same = fit(1, IMP_ALLOCATION_EVEN, 26, NULL);
    tap_ok(equal(whole, fit(3, IMP_ALLOCATION_DEFAULT, 26, NULL)),
           "by variance is the default; three threads have the bits of one");
    tap_ok(!equal(whole, same), "equal samples are other samples");
    const int file = mkstemp(path);
    if (file >= 0) close(file);
    unlink(path);
    (void)fit(2, IMP_ALLOCATION_VARIANCE, 13, path);
    tap_ok(equal(whole, fit(1, IMP_ALLOCATION_VARIANCE, 26, path)),
           "a fit that was stopped and gone on with has the bits of one that was not");
    unlink(path);
}

static void refused(void)
{
    imp_context *ctx = test_context(1);
    imp_scene *scene = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    const float pixel[8 * 8 * 3] = {0};
    struct imp_fit_options o = IMP_FIT_OPTIONS_INIT;
    struct imp_target target = IMP_TARGET_INIT;
    const struct imp_fit_result *r;
    imp_problem *p;
    test_must(ctx, imp_problem_create(scene, &p));
    test_must(ctx, imp_problem_activate(p, active[0]));
    target.pixels = pixel;
    target.width = target.height = 8;
    target.channels = 3;
    test_must(ctx, imp_problem_add_target(p, &target));
    o.allocation = (enum imp_allocation)3;
    tap_ok(imp_fit(p, &o, NULL, &r) == IMP_E_ARG &&
               strstr(imp_last_error(ctx), "allocation 3"),
           "an allocation that does not exist is refused");
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
}

int main(void)
{
    place("variances over four decades", EVEN, 1e4, 0.99, 1.02);
    place("over one", EVEN, 10, 0.99, 1.02);
    place("many samples", 256, 1e4, 0.99, 1.02);
    place("six samples", 6, 1e3, 0.97, 1.05);
    alike();
    fits();
    refused();
    return tap_done();
}
