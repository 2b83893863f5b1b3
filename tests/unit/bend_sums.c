/* SPDX-License-Identifier: Apache-2.0
 *
 * Adding up slices of a gradient: whichever thread adds which slice to which part, and
 * in whatever order slices come, the sum has the bits of a sum in order. */
#include "../bend_kit.h"
#include "bend/bend_adjoint.h"
#include <pthread.h>
#include <string.h>

#define BLOCK   ((size_t)1 << IMP_BLOCK_SHIFT)
#define SLICES  24
#define THREADS 4

static struct imp__partials sums;
static struct imp__partial *slice[SLICES];
static int order[SLICES];

static void *adder(void *arg)
{
    const size_t t = (size_t)(uintptr_t)arg;
    for (size_t i = t; i < SLICES; i += THREADS)
        imp__partial_add(&sums, (size_t)order[i], slice[order[i]]);
    return NULL;
}

/* A number of any size, so that another order has other bits. */
static double number(size_t s, size_t i)
{
    return kit_pm(s + 1, i) * exp(12 * kit_pm(s + 100, i));
}
static bool reached(size_t s, size_t block) { return kit_u(s + 200, block) < 0.6; }

static void fill(size_t n)
{
    imp__partials_init(&sums, kit_ctx, n);
    for (size_t s = 0; s < SLICES; s++) {
        KIT_CHECK(imp__partial_take(&sums, &slice[s]));
        struct imp__bar bar = {slice[s]->theta, 0, slice[s]->touched};
        for (size_t b = 0; b < sums.n_blocks; b++) {
            if (!reached(s, b)) continue;
            imp__bar_touch(&bar, b, b);
            for (size_t i = b * BLOCK; i < imp_min((b + 1) * BLOCK, n); i += 7)
                bar.theta[i] += number(s, i);
        }
    }
}

static double *in_order(size_t n)
{
    double *sum = calloc(n, sizeof *sum);
    for (size_t s = 0; s < SLICES; s++)
        for (size_t b = 0; b * BLOCK < n; b++)
            for (size_t i = b * BLOCK; reached(s, b) && i < imp_min((b + 1) * BLOCK, n);
                 i += 7)
                sum[i] += number(s, i);
    return sum;
}

static void shuffle(uint64_t seed)
{
    for (int i = 0; i < SLICES; i++) order[i] = i;
    for (int i = SLICES - 1; i > 0; i--) {
        const int k = (int)(kit_u(seed, (uint64_t)i) * (i + 1)), old = order[i];
        order[i] = order[k];
        order[k] = old;
    }
}

static void parts(size_t n, int rounds)
{
    double *want = in_order(n), *got = calloc(n, sizeof *got);
    int wrong = 0, lost = 0;
    for (int r = 0; r < rounds; r++) {
        pthread_t thread[THREADS];
        int idle = 0;
        fill(n);
        shuffle(1000 + (uint64_t)r);
        for (size_t t = 0; t < THREADS; t++)
            if (pthread_create(&thread[t], NULL, adder, (void *)(uintptr_t)t)) exit(1);
        for (int t = 0; t < THREADS; t++) pthread_join(thread[t], NULL);
        for (const struct imp__partial *p = sums.idle; p; p = p->next) idle++;
        lost += idle != SLICES || sums.ready;
        KIT_CHECK(imp__partials_sum(&sums, got));
        wrong += memcmp(got, want, n * sizeof *got) != 0;
        imp__partials_free(&sums);
    }
    tap_ok(!wrong && !lost,
           "%zu numbers in %d parts, %d orders of %d slices on %d threads # %d wrong, %d "
           "not all added",
           n, (int)imp_min((n + BLOCK - 1) / BLOCK, (size_t)IMP_PARTIALS_PARTS), rounds,
           SLICES, THREADS, wrong, lost);
    free(want), free(got);
}

/* Slices that never came: what waits is released (the address sanitizer sees). */
static void given_up(void)
{
    fill(3 * BLOCK);
    imp__partial_add(&sums, 1, slice[1]);
    imp__partial_add(&sums, 2, slice[2]);
    for (int s = 3; s < SLICES; s++) imp__partial_drop(&sums, slice[s]);
    tap_ok(sums.part[0].slice == 0 && sums.ready, "slices wait for the first");
    imp__partial_drop(&sums, slice[0]);
    imp__partials_free(&sums);
}

int main(void)
{
    kit_begin(2);
    parts(5, 3);
    parts(5 * BLOCK + 17, 20);
    parts(40 * BLOCK, 10);
    given_up();
    imp_context_destroy(kit_ctx);
    return tap_done();
}
