/* SPDX-License-Identifier: Apache-2.0
 *
 * A sweep with two adjoints (imp__walk_sweep_both) beside two sweeps: the first sums have the same
 * bits, the second agree to rounding, also where an adjoint is 0. And the sums of gradients, which take both
 * at once, beside the two sinks that they are, of few numbers and of many. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "inverse/estimate/tally.h"
#include "walk/core/walk.h"
#include "walk/core/walk_integrator.h"

enum { SIDE = 5, SAMPLES = 16, PARAMS = 64 };

static imp_context *ctx;

/* Sums over all elements of a parameter, and of squares of what is added. */
struct sums {
    struct imp_sink sink; /* first */
    double sum[PARAMS], square[PARAMS];
};
static void add(struct imp_sink *sink, int param, size_t element, int channels,
                const imp_spec *bar)
{
    struct sums *s = (struct sums *)sink;
    const double by = 1 + (double)(element % 7);
    if (param >= PARAMS) return;
    for (int c = 0; c < (channels == 3 ? 3 : 4); c++) {
        s->sum[param] += by * (*bar)[c];
        s->square[param] += (*bar)[c] * (*bar)[c];
    }
}

static void compare(const char *file, const char *more, enum imp_color_mode mode)
{
    imp_scene *scene = test_scene(ctx, file, mode, NULL);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_tracer tracer = {.scene = scene,
                                .integrator = imp__walk_integrator(scene),
                                .sensor = scene->sensors[0],
                                .seed = 3,
                                .collisions_fixed = true};
    static uint8_t chosen[PARAMS];
    struct imp_active active;
    struct imp_arena arena;
    struct sums one = {.sink.add = add}, two = one, both = one, second = one;
    int touched = 0, differ = 0;
    double worst = 0;
    imp__tracer_numbers(&tracer, &run, SAMPLES);
    for (size_t k = 0; k < scene->n_params && k < PARAMS; k++)
        chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    test_must(ctx, imp__active_create(scene, chosen, &active));
    tracer.active = &active;
    imp__arena_init(&arena, ctx);
    for (int x = 0; x < SIDE * SIDE; x++)
        for (int k = 0; k < SAMPLES; k++) {
            struct imp_walk walk;
            /* Now and then one lane of the first is 0. */
            const imp_spec P = {.3 - .01 * k, k % 5 ? -.2 : 0, .1 + .02 * x, 0},
                           E = {.02 * x, .3, -.7 + .1 * k, 0};
            imp__walk_trace(&tracer, &arena, 7 * (x % SIDE), 7 * (x / SIDE), k, &walk);
            imp__walk_sweep(&tracer, &walk, P, &one.sink);
            imp__walk_sweep(&tracer, &walk, E, &two.sink);
            imp__walk_sweep_both(&tracer, &walk, P, E,
                                 &(struct imp_sink_pair){&both.sink, &second.sink, NULL});
            imp__arena_rewind(&arena, (struct imp_arena_mark){0});
        }
    for (int k = 0; k < PARAMS; k++) {
        if (one.square[k] == 0) continue;
        touched++;
        differ += one.sum[k] != both.sum[k] || one.square[k] != both.square[k];
        worst = fmax(worst, fabs(two.sum[k] - second.sum[k]) / sqrt(two.square[k]));
        worst = fmax(worst, fabs(two.square[k] - second.square[k]) / two.square[k]);
    }
    tap_ok(touched > 2 && differ == 0 && worst < 1e-10,
           "%s%s: %d parameters, first sums differ in %d, second by %.2g", file, more,
           touched, differ, worst);
    imp__arena_free(&arena);
    imp__active_destroy(ctx, &active);
    imp_scene_destroy(scene);
}

/* Of the present pixel, of two sums of which one has met them in the same order. */
static size_t numbers_differ(const struct imp_tally *a, const struct imp_tally *b,
                             size_t *met)
{
    size_t differ = a->n_triples != b->n_triples || a->n_singles != b->n_singles;
    for (size_t k = 0; a->dense && k < a->active->n; k++) {
        *met += a->batch[k] != 0 && a->error[k] != 0;
        differ += a->batch[k] != b->batch[k] || a->error[k] != b->error[k];
    }
    for (size_t k = 0; !differ && k < a->n_triples; k++) {
        const struct imp__tally_triple *x = &a->triples[k], *y = &b->triples[k];
        *met += 3;
        differ += x->key != y->key || memcmp(x->batch, y->batch, sizeof x->batch) != 0 ||
                  memcmp(x->error, y->error, sizeof x->error) != 0;
    }
    for (size_t k = 0; !differ && k < a->n_singles; k++) {
        const struct imp__tally_single *x = &a->singles[k], *y = &b->singles[k];
        (*met)++;
        differ += x->key != y->key || x->batch != y->batch || x->error != y->error;
    }
    return differ;
}

static void tallies(const char *file, bool many)
{
    imp_scene *scene = test_scene(ctx, file, IMP_RGB, NULL);
    struct imp_run run = IMP_RUN_INIT;
    struct imp_tracer tracer = {.scene = scene,
                                .integrator = imp__walk_integrator(scene),
                                .sensor = scene->sensors[0],
                                .seed = 3};
    static uint8_t chosen[PARAMS];
    struct imp_active active;
    struct imp_arena arena;
    struct imp_tally at_once, apart;
    size_t met = 0;
    imp__tracer_numbers(&tracer, &run, SAMPLES);
    for (size_t k = 0; k < scene->n_params && k < PARAMS; k++)
        chosen[k] = (scene->params[k].info.flags & IMP_PARAM_DIFFERENTIABLE) != 0;
    test_must(ctx, imp__active_create(scene, chosen, &active));
    tracer.active = &active;
    test_must(ctx, imp__tally_create(ctx, &active, 3, 0, &at_once));
    test_must(ctx, imp__tally_create(ctx, &active, 3, 0, &apart));
    imp__arena_init(&arena, ctx);
    for (int x = 0; x < SIDE * SIDE; x++)
        for (int k = 0; k < SAMPLES; k++) {
            struct imp_walk walk;
            const imp_spec P = {.3 - .01 * k, k % 5 ? -.2 : 0, .1 + .02 * x, 0},
                           E = {.02 * x, .3, -.7 + .1 * k, 0};
            imp__walk_trace(&tracer, &arena, 7 * (x % SIDE), 7 * (x / SIDE), k, &walk);
            imp__walk_sweep_both(&tracer, &walk, P, E, &at_once.both);
            imp__walk_sweep_both(
                &tracer, &walk, P, E,
                &(struct imp_sink_pair){&apart.sink, &apart.errors.sink, NULL});
            imp__arena_rewind(&arena, (struct imp_arena_mark){0});
        }
    const size_t differ = numbers_differ(&at_once, &apart, &met);
    tap_ok(at_once.both.add && at_once.dense == !many && met > 10 && differ == 0,
           "%s: sums of both at once, of %zu numbers # %zu met, %zu differ", file,
           active.n, met, differ);
    imp__arena_free(&arena);
    imp__tally_destroy(&at_once);
    imp__tally_destroy(&apart);
    imp__active_destroy(ctx, &active);
    imp_scene_destroy(scene);
}

int main(void)
{
    ctx = test_context(1);
    compare("cornell.xml", "", IMP_RGB);
    compare("cornell.xml", " in spectra", IMP_SPECTRAL);
    compare("cornell.xml", " in grey", IMP_MONO);
    compare("textured.xml", "", IMP_RGB);
    compare("fog.xml", "", IMP_RGB);
    compare("sky.xml", "", IMP_RGB);
    tallies("cornell.xml", false);
    tallies("textured.xml", true);
    imp_context_destroy(ctx);
    return tap_done();
}
