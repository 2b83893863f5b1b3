/* SPDX-License-Identifier: Apache-2.0
 *
 * Adam of many variables: 40 bytes each, gradient included; the steps and the answer of
 * the search that keeps doubles; the bits of an uninterrupted search after a checkpoint;
 * and steps with other momenta against the formula. */
#include "imp_fail_alloc.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "search/checkpoint.h"
#include <math.h>
#include <unistd.h>

enum { N = 3000 };

/* 1/2 sum a (x - t)^2 with noise in its gradient; t of the second half is beyond a bound
 * for some. */
struct bowl {
    size_t n;
    double gain; /* of value and gradient */
    int stop_at; /* iteration */
    bool quiet;  /* imp__opt_options */
    struct imp__goal goal;
    struct imp__span spans[2];
    double lo[N], hi[N], scale[N];
};

static double curvature(size_t k) { return 1 + 9 * imp__u01(imp__key(1, k, 0), 0); }
static double target(size_t k) { return 1.2 * imp__u01(imp__key(2, k, 0), 0) - 0.1; }

static enum imp_status eval(const double *x, uint64_t seed, struct imp_estimate *f,
                            double *g, double *g_se, void *payload)
{
    const struct bowl *b = payload;
    double value = 0;
    (void)g_se;
    for (size_t k = 0; k < b->n; k++) {
        const double noise = imp__u01(imp__key(seed, k, 3), 0) - 0.5;
        const double d = x[k] - target(k);
        value += 0.5 * curvature(k) * d * d;
        g[k] = b->gain * curvature(k) * (d + 0.5 * noise);
    }
    *f = (struct imp_estimate){.value = b->gain * value,
                               .se = b->gain * 0.01 * (double)b->n};
    return IMP_OK;
}

static enum imp_status iterated(const struct imp__search *s, void *payload)
{
    const struct bowl *b = payload;
    return s->iteration == b->stop_at ? IMP_CANCELLED : IMP_OK;
}

static void bowl_make(struct bowl *b, imp_context *ctx, size_t n, bool many, double gain)
{
    *b = (struct bowl){.n = n, .gain = gain};
    b->spans[0] = (struct imp__span){n / 2, 0, 1, 1, false, true, false};
    b->spans[1] = (struct imp__span){n, 0, INFINITY, 0.3, true, false, false};
    b->goal = (struct imp__goal){
        .ctx = ctx, .n = n, .seed = 7, .eval = eval, .iterated = iterated, .payload = b};
    for (size_t k = 0; !many && k < n; k++) {
        b->lo[k] = 0;
        b->hi[k] = k < n / 2 ? 1 : INFINITY;
        b->scale[k] = k < n / 2 ? 1 : 0.5; /* the start */
    }
    if (many) b->goal.spans = b->spans, b->goal.n_spans = 2;
    else b->goal.lo = b->lo, b->goal.hi = b->hi, b->goal.scale = b->scale;
}

static struct imp__search *begin(struct bowl *b, double *x0, int iterations)
{
    struct imp__search *s;
    const struct imp__opt_options o = {iterations, 0.05, 1e-6, 0, false};
    for (size_t k = 0; k < b->n; k++) x0[k] = 0.5;
    test_must(b->goal.ctx, imp__search_create(&b->goal, IMP_ADAM, &o, x0, &s));
    return s;
}

static void run(struct bowl *b, struct imp__search *s, int iterations)
{
    const struct imp__opt_options o = {iterations, 0.05, 1e-6, 0, b->quiet};
    const enum imp_status st = imp__optimize(&b->goal, &o, s);
    if (st != IMP_CANCELLED) test_must(b->goal.ctx, st);
}

static double off(const struct bowl *b, const struct imp__search *s)
{
    double square = 0;
    for (size_t k = 0; k < b->n; k++) {
        const double best = imp__into_bounds(&b->goal, k, target(k));
        square += pow(imp__search_answer(s, k) - best, 2);
    }
    return sqrt(square / (double)b->n);
}

static void compared(double gain)
{
    imp_context *ctx = test_context(1);
    static struct bowl few, many;
    static double x0[N];
    double worst = 0;
    bowl_make(&few, ctx, N, false, gain);
    bowl_make(&many, ctx, N, true, gain);
    struct imp__search *a = begin(&few, x0, 400), *b = begin(&many, x0, 400);
    run(&few, a, 15);
    run(&many, b, 15);
    for (size_t k = 0; k < N; k++)
        worst = fmax(worst, fabs(imp__search_answer(a, k) - imp__search_answer(b, k)));
    /* Moments are floats: 1e-7 a step, relative to steps of 0.05. */
    tap_ok(worst < 1e-6, "gain %g: 15 steps as in doubles # off by %.2g", gain, worst);
    run(&few, a, 400);
    run(&many, b, 400);
    const double off_a = off(&few, a), off_b = off(&many, b);
    tap_ok(off_b < 1.1 * off_a && off_b < 0.03,
           "gain %g: the answer is as good # %.4f, in doubles %.4f", gain, off_b, off_a);
    imp__search_destroy(a);
    imp__search_destroy(b);
    imp_context_destroy(ctx);
}

/* A search that follows another of 30 iterations, whose history it has. */
static struct imp__search *follow(struct bowl *b, double *x0, int iterations)
{
    struct imp__search *first = begin(b, x0, 30), *s = begin(b, x0, iterations);
    run(b, first, 30);
    imp__search_take_history(s, first);
    imp__search_destroy(first);
    return s;
}

static void resumed(void)
{
    imp_context *ctx = test_context(1);
    static struct bowl b;
    static double x0[N];
    const struct imp__fingerprint of = {1, 2, 3, 4};
    char path[64];
    bool found = false;
    snprintf(path, sizeof path, "/tmp/imp_adam_many_%ld.ck", (long)getpid());
    bowl_make(&b, ctx, N, true, 1);
    b.quiet = true;
    struct imp__search *whole = follow(&b, x0, 137), *part = follow(&b, x0, 137);
    run(&b, whole, 137);
    b.stop_at = 61;
    run(&b, part, 137);
    test_must(ctx, imp__checkpoint_write(ctx, path, &of, part));
    imp__search_destroy(part);
    b.stop_at = 0;
    part = begin(&b, x0, 137);
    test_must(ctx, imp__checkpoint_read(ctx, path, &of, &b.goal, part, &found));
    run(&b, part, 137);
    size_t same = 0;
    for (size_t k = 0; k < N; k++)
        same += imp__search_answer(whole, k) == imp__search_answer(part, k) &&
                whole->x[k] == part->x[k];
    tap_ok(found && same == N && imp__search_start(part, 5) == 0.5,
           "resumed: the same bits # %zu of %d", same, N);
    unlink(path);
    imp__search_destroy(whole);
    imp__search_destroy(part);
    imp_context_destroy(ctx);
}

/* Its gradient is 1, then -1. */
static enum imp_status eval_turned(const double *x, uint64_t seed, struct imp_estimate *f,
                                   double *g, double *g_se, void *payload)
{
    int *calls = payload;
    (void)x, (void)seed, (void)g_se;
    for (size_t k = 0; k < 2; k++) g[k] = *calls % 2 ? -1 : 1;
    ++*calls;
    *f = (struct imp_estimate){0};
    return IMP_OK;
}

/* Two steps: the first is the rate a, and of the second, with v = 1 either way,
 *
 *     m / (1 - b^2) = (b (1 - b) - (1 - b)) / (1 - b^2) = -(1 - b) / (1 + b)
 *
 * Where gradients are quiet and variables settle, whatever bounds they have (a logarithm's are far
 * away), iteration i has the rate a / sqrt(1 + i/10), and i goes on from another search's. */
static void momenta(bool many)
{
    static const struct {
        double asked, hi, b;
        bool falls, quiet, settles;
        int before; /* iterations of another search */
    } row[] = {
        {0, 1, .9, false, false, true, 0},
        {.9, 1, .9, false, false, true, 0},
        {.5, 1, .5, false, false, true, 0},
        {.25, 1, .25, false, false, true, 0},
        {0, 1, .5, true, true, true, 0},
        {.9, 1, .9, true, true, true, 0},
        {0, INFINITY, .9, false, true, false, 0},
        {.25, INFINITY, .25, false, true, false, 0},
        {0, 710, .9, false, true, false, 0},
        {0, 1, .5, true, true, true, 40},
        {0, 1, .9, false, false, true, 40},
    };
    static const double lo[2] = {-1, -1}, scale[2] = {1, 1};
    imp_context *ctx = test_context(1);
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        const double b = row[i].b, hi[2] = {row[i].hi, row[i].hi}, x0[2] = {0, 0};
        const double before = row[i].falls ? row[i].before / 10. : 0,
                     next = row[i].falls ? before + .1 : 0;
        const double expected =
            -.05 / sqrt(1 + before) + .05 / sqrt(1 + next) * (1 - b) / (1 + b);
        const bool settles[2] = {row[i].settles, row[i].settles};
        const struct imp__opt_options o = {row[i].before + 2, 0.05, 1e-6, row[i].asked,
                                           row[i].quiet};
        const struct imp__span span = {2, -1, row[i].hi, 1, false, row[i].settles, false};
        int calls = 0;
        struct imp__goal goal = {
            .ctx = ctx, .n = 2, .eval = eval_turned, .payload = &calls};
        struct imp__search *s, *last;
        if (many) goal.spans = &span, goal.n_spans = 1;
        else goal.lo = lo, goal.hi = hi, goal.scale = scale, goal.settles = settles;
        test_must(ctx, imp__search_create(&goal, IMP_ADAM, &o, x0, &last));
        test_must(ctx, imp__search_create(&goal, IMP_ADAM, &o, x0, &s));
        last->iteration = row[i].before;
        imp__search_take_history(s, last);
        imp__search_destroy(last);
        test_must(ctx, imp__optimize(&goal, &o, s));
        const double off = fabs(imp__search_answer(s, 0) - expected);
        tap_ok(off < 1e-7,
               "%s: momentum %g%s, bound %g, %ssettles, after %d # %.9f, off by %.1g",
               many ? "in floats" : "in doubles", row[i].asked,
               row[i].quiet ? " of quiet gradients" : "", row[i].hi,
               row[i].settles ? "" : "never ", row[i].before, expected, off);
        imp__search_destroy(s);
    }
    imp_context_destroy(ctx);
}

static void memory(void)
{
    enum { LARGE = 500000 };
    static struct bowl b;
    struct fail_alloc heap = {0};
    imp_context *ctx = fail_alloc_context(&heap);
    double *x0 = malloc(LARGE * sizeof *x0);
    if (!x0) exit(99);
    const size_t before = heap.bytes;
    bowl_make(&b, ctx, LARGE, true, 1);
    struct imp__search *s = begin(&b, x0, 45);
    run(&b, s, 45);
    const double bytes = (double)(heap.peak - before) / LARGE;
    tap_ok(bytes <= 40.1, "%.2f bytes a variable, gradient included", bytes);
    imp__search_destroy(s);
    imp_context_destroy(ctx);
    free(x0);
}

int main(void)
{
    compared(1);
    compared(1e-60); /* squares of such derivatives are no floats */
    compared(1e60);
    resumed();
    momenta(false);
    momenta(true);
    memory();
    return tap_done();
}
