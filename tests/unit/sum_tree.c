/* SPDX-License-Identifier: Apache-2.0
 *
 * Sums in a fixed binary tree: the bits of a recursive sum for any number of threads,
 * from ranges of items that were computed apart, and with few results kept. */
#include "base/pool.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <stdatomic.h>

enum { WIDTH = 3, N_MAX = 1000, THREADS_MAX = 7 };

struct result {
    double v[WIDTH];
};

/* Numbers of very different size: any other order gives other bits. */
static struct result item_value(size_t i)
{
    struct result r;
    for (int c = 0; c < WIDTH; c++) {
        const struct imp_key key = imp__key(5, i, (uint64_t)c);
        r.v[c] = (imp__u01(key, 0) - 0.5) * exp2(40 * imp__u01(key, 1));
    }
    return r;
}

static void add(void *into, const void *from, void *payload)
{
    struct result *a = into;
    const struct result *b = from;
    (void)payload;
    for (int c = 0; c < WIDTH; c++) a->v[c] += b->v[c];
}

/* Items [first, first + n) of a group that begins at `first`, by the definition. */
static struct result tree_sum(size_t first, size_t n)
{
    size_t half = 1;
    if (n == 1) return item_value(first);
    while (2 * half < n) half *= 2;
    struct result a = tree_sum(first, half), b = tree_sum(first + half, n - half);
    add(&a, &b, NULL);
    return a;
}

struct job {
    imp_context *ctx;
    struct result sums[N_MAX];
    atomic_int taken;
    bool patient;
    atomic_size_t begun;
};

static enum imp_status work(size_t i, int worker, void *result, void *payload)
{
    struct job *j = payload;
    (void)worker;
    const struct result r = item_value(i);
    memcpy(result, &r, sizeof r);
    atomic_fetch_add(&j->begun, 1);
    if (j->patient && i == 0) { /* the others go as far as they may */
        const double start = imp__now();
        while (imp__now() - start < 0.2) {}
    }
    return IMP_OK;
}

static enum imp_status take(size_t group, void *sum, void *payload)
{
    struct job *j = payload;
    memcpy(&j->sums[group], sum, sizeof j->sums[group]);
    atomic_fetch_add(&j->taken, 1);
    return IMP_OK;
}

static struct job job;

static struct imp_sum_desc desc_of(size_t n, size_t group)
{
    return (struct imp_sum_desc){n, group, sizeof(struct result), add, take, &job};
}

static void whole(int threads, size_t n, size_t group)
{
    struct imp_sum_tree tree;
    const struct imp_sum_desc desc = desc_of(n, group);
    imp_context *ctx = test_context(threads);
    memset(&job, 0, sizeof job);
    test_must(ctx, imp__sum_tree_create(ctx, &desc, &tree));
    const struct imp_loop loop = {.n_items = n, .payload = &job};
    test_must(ctx, imp__parallel_sum(ctx, &loop, &tree, 0, work, NULL));
    const size_t groups = (n + group - 1) / group;
    size_t right = 0;
    for (size_t g = 0; g < groups; g++) {
        const struct result r = tree_sum(g * group, imp_min(group, n - g * group));
        right += memcmp(&r, &job.sums[g], sizeof r) == 0;
    }
    tap_ok(right == groups && (size_t)job.taken == groups && tree.n_nodes == 0,
           "%d threads, %zu items by %zu: every sum to the bit # %zu of %zu", threads, n,
           group, right, groups);
    imp__sum_tree_destroy(&tree);
    imp_context_destroy(ctx);
}

/* Ranges of items, each in a tree of its own, and their nodes put together. */
static void parts(size_t n, size_t group, const size_t *cuts, int n_cuts)
{
    struct imp_sum_tree all;
    const struct imp_sum_desc desc = desc_of(n, group);
    struct imp_sum_desc silent = desc;
    imp_context *ctx = test_context(2);
    memset(&job, 0, sizeof job);
    silent.take = NULL;
    test_must(ctx, imp__sum_tree_create(ctx, &desc, &all));
    size_t nodes = 0;
    for (int k = n_cuts; k >= 0; k--) { /* the last range first */
        const size_t a = k ? cuts[k - 1] : 0, b = k < n_cuts ? cuts[k] : n;
        struct imp_sum_tree part;
        test_must(ctx, imp__sum_tree_create(ctx, &silent, &part));
        const struct imp_loop loop = {.n_items = b - a, .payload = &job};
        test_must(ctx, imp__parallel_sum(ctx, &loop, &part, a, work, NULL));
        nodes = imp_max(nodes, part.n_nodes);
        for (size_t i = 0; i < part.n_nodes; i++)
            test_must(ctx, imp__sum_tree_put_node(&all, &part.nodes[i]));
        if (k == n_cuts && group == n)
            tap_ok(imp__sum_tree_put_node(&all, &part.nodes[0]) == IMP_E_ARG,
                   "a part twice is refused");
        imp__sum_tree_destroy(&part);
    }
    const size_t groups = (n + group - 1) / group;
    size_t right = 0;
    for (size_t g = 0; g < groups; g++) {
        const struct result r = tree_sum(g * group, imp_min(group, n - g * group));
        right += memcmp(&r, &job.sums[g], sizeof r) == 0;
    }
    tap_ok(right == groups, "%zu items by %zu in %d ranges, most nodes of one %zu", n,
           group, n_cuts + 1, nodes);
    const struct imp_sum_node wrong = {.group = groups, .sum = &job.sums[0]};
    tap_ok(imp__sum_tree_put_node(&all, &wrong) == IMP_E_ARG, "a node of no group");
    imp__sum_tree_destroy(&all);
    imp_context_destroy(ctx);
}

/* One slow item: the others wait, so that few results are kept. */
static void memory(int threads)
{
    struct imp_sum_tree tree;
    const struct imp_sum_desc desc = desc_of(N_MAX, N_MAX);
    imp_context *ctx = test_context(threads);
    memset(&job, 0, sizeof job);
    job.patient = true;
    test_must(ctx, imp__sum_tree_create(ctx, &desc, &tree));
    const struct imp_loop loop = {.n_items = N_MAX, .payload = &job};
    test_must(ctx, imp__parallel_sum(ctx, &loop, &tree, 0, work, NULL));
    const size_t bound = 10 + 9 * (size_t)threads; /* log2(N_MAX), the window, in work */
    tap_ok(tree.most <= bound, "%d threads keep %zu results of %d, at most %zu", threads,
           tree.most, N_MAX, bound);
    imp__sum_tree_destroy(&tree);
    imp_context_destroy(ctx);
}

int main(void)
{
    static const size_t sizes[] = {1, 2, 3, 7, 8, 9, 64, 100, 999, 1000};
    for (int threads = 1; threads <= THREADS_MAX; threads += threads < 2 ? 1 : 5)
        for (size_t k = 0; k < imp_count(sizes); k++) {
            whole(threads, sizes[k], sizes[k]);
            whole(threads, sizes[k], 5);
        }
    static const size_t halves[] = {500}, powers[] = {256, 512},
                        odd[] = {1, 3, 77, 78, 640};
    parts(1000, 1000, halves, 1);
    parts(1000, 1000, powers, 2);
    parts(1000, 1000, odd, 5);
    parts(1000, 64, odd, 5);
    for (int threads = 1; threads <= 4; threads *= 2) memory(threads);
    return tap_done();
}
